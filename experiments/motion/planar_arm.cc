#include "experiments/motion/planar_arm.h"

#include <Eigen/Dense>
#include <cmath>

#include "common/error.h"

namespace mimesis::synthesizer {

using Eigen::Index;

Eigen::Matrix2Xd PlanarArm::points(const Eigen::VectorXd& q) const {
  Eigen::Matrix2Xd p = Eigen::Matrix2Xd::Zero(2, length_m.size() + 1);
  double angle = 0.0;
  for (Index i = 0; i < length_m.size(); ++i) {
    angle += q[i];
    p.col(i + 1) = p.col(i) + length_m[i] * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  return p;
}

Eigen::Vector2d PlanarArm::end(const Eigen::VectorXd& q) const {
  return points(q).col(length_m.size());
}

Eigen::Matrix2Xd PlanarArm::jacobian(const Eigen::VectorXd& q) const {
  const Eigen::Matrix2Xd p = points(q);
  Eigen::Matrix2Xd j(2, length_m.size());
  for (Index i = 0; i < length_m.size(); ++i) {
    const Eigen::Vector2d lever = p.col(length_m.size()) - p.col(i);
    j.col(i) << -lever.y(), lever.x();
  }
  return j;
}

namespace {

constexpr double kCorrection_1_s = 20.0;

/// Damped only near singular postures, where it trades accuracy for bounded speeds.
Eigen::MatrixXd pseudo_inverse(const Eigen::Matrix2Xd& j) {
  const Eigen::Matrix2d jj = j * j.transpose();
  const double smallest =
      0.5 *
      (jj.trace() - std::sqrt(std::max(0.0, jj.trace() * jj.trace() - 4.0 * jj.determinant())));
  constexpr double kNear = 1e-4;  // [m²]
  const double damping = smallest < kNear ? 0.1 * (kNear - smallest) : 0.0;
  return j.transpose() * (jj + damping * Eigen::Matrix2d::Identity()).inverse();
}

Eigen::VectorXd velocity(const PlanarArm& arm, const Eigen::VectorXd& q, const Eigen::Vector2d& x,
                         const Eigen::Vector2d& v, const ArmStyle& style) {
  const Eigen::Matrix2Xd j = arm.jacobian(q);
  const Eigen::MatrixXd inverse = pseudo_inverse(j);
  const Eigen::VectorXd wish = style.gain_1_s * style.weight.cwiseProduct(style.preferred_rad - q);
  return inverse * (v + kCorrection_1_s * (x - arm.end(q)) - j * wish) + wish;
}

}  // namespace

Eigen::MatrixXd follow(const PlanarArm& arm, const Eigen::VectorXd& q_start,
                       const Eigen::Matrix2Xd& path, double dt_s, const ArmStyle& style) {
  const Index n = arm.length_m.size();
  if (q_start.size() != n || style.preferred_rad.size() != n || style.weight.size() != n ||
      path.cols() < 2 || !(dt_s > 0.0)) {
    throw ConfigError("planar arm: posture, style and arm are of different sizes");
  }
  if ((arm.end(q_start) - path.col(0)).norm() > 1e-6) {
    throw ConfigError("planar arm: the path does not begin at the hand");
  }
  Eigen::MatrixXd q(n, path.cols());
  q.col(0) = q_start;
  for (Index t = 0; t + 1 < path.cols(); ++t) {
    const Eigen::Vector2d v = (path.col(t + 1) - path.col(t)) / dt_s;
    const auto rate = [&](const Eigen::VectorXd& at, double part) {
      return velocity(arm, at, path.col(t) + part * dt_s * v, v, style);
    };
    const Eigen::VectorXd q0 = q.col(t);
    const Eigen::VectorXd k1 = rate(q0, 0.0), k2 = rate(q0 + 0.5 * dt_s * k1, 0.5),
                          k3 = rate(q0 + 0.5 * dt_s * k2, 0.5), k4 = rate(q0 + dt_s * k3, 1.0);
    q.col(t + 1) = q0 + dt_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  return q;
}

Eigen::Matrix2Xd straight_reach(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m,
                                int samples) {
  Eigen::Matrix2Xd path(2, samples);
  for (int t = 0; t < samples; ++t) {
    const double u = static_cast<double>(t) / (samples - 1);
    path.col(t) = from_m + u * u * u * (10.0 - 15.0 * u + 6.0 * u * u) * (to_m - from_m);
  }
  return path;
}

}  // namespace mimesis::synthesizer
