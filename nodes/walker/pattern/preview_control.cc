#include "nodes/walker/pattern/preview_control.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "common/error.h"

namespace mimesis::walker {
namespace {

void demand(bool fulfilled, const std::string& what) {
  if (!fulfilled) throw ConfigError("preview control: " + what);
}

/// Fᵢ = d⁻¹ bᵀ (Aᵀ − Kᵀbᵀ)ⁱ f, d = R + bᵀPb.
Eigen::VectorXd preview_of(const Eigen::MatrixXd& closed_loop, const Eigen::VectorXd& b, double d,
                           Eigen::VectorXd f, int samples) {
  Eigen::VectorXd F(samples);
  for (int i = 0; i < samples; ++i) {
    F(i) = b.dot(f) / d;
    f = closed_loop.transpose() * f;
  }
  return F;
}

}  // namespace

CartTableAxis::CartTableAxis(double dt_s, double height_m) {
  const double T = dt_s;
  A << 1.0, T, T * T / 2.0, 0.0, 1.0, T, 0.0, 0.0, 1.0;
  b << T * T * T / 6.0, T * T / 2.0, T;
  c << 1.0, 0.0, -height_m / kGravity_m_s2;
}

Eigen::MatrixXd riccati(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                        const Eigen::MatrixXd& Q, double R) {
  const Eigen::Index n = A.rows();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd Ak = A, G = b * b.transpose() / R, P = Q;
  for (int i = 0; i < 60; ++i) {
    const Eigen::PartialPivLU<Eigen::MatrixXd> lu(identity + G * P);
    const Eigen::MatrixXd WA = lu.solve(Ak), WG = lu.solve(G);
    const Eigen::MatrixXd dP = Ak.transpose() * P * WA;
    G += Ak * WG * Ak.transpose();
    P += dP;
    Ak = Ak * WA;
    if (!P.allFinite()) break;
    if (dP.cwiseAbs().maxCoeff() <= 1e-15 * P.cwiseAbs().maxCoeff())
      return (P + P.transpose()) / 2.0;
  }
  throw ConfigError(
      "Riccati equation: no solution found, expected a system that can be stabilized");
}

PreviewGains preview_gains(const PreviewSettings& s) {
  demand(s.height_m > 0.0 && s.height_m < 10.0, "height is not in (0, 10) m");
  demand(s.dt_s > 0.0 && s.dt_s <= 0.1, "dt is not in (0, 0.1] s");
  demand(s.samples > 0 && s.samples <= 100000, "samples are not in [1, 100000]");
  demand(s.zmp_weight > 0.0 && s.jerk_weight > 0.0, "weights are not positive");
  const CartTableAxis axis(s.dt_s, s.height_m);
  PreviewGains gains;
  if (s.form == PreviewForm::kPosition) {
    const Eigen::MatrixXd P =
        riccati(axis.A, axis.b, axis.c.transpose() * s.zmp_weight * axis.c, s.jerk_weight);
    const double d = s.jerk_weight + axis.b.dot(P * axis.b);
    gains.K = axis.b.transpose() * P * axis.A / d;
    gains.F = preview_of(axis.A - axis.b * gains.K, axis.b, d, axis.c.transpose() * s.zmp_weight,
                         s.samples);
    return gains;
  }
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero(), Q = Eigen::Matrix4d::Zero();
  A(0, 0) = 1.0;
  A.block<1, 3>(0, 1) = axis.c * axis.A;
  A.block<3, 3>(1, 1) = axis.A;
  Eigen::Vector4d b;
  b << axis.c.dot(axis.b), axis.b;
  Q(0, 0) = s.zmp_weight;
  const Eigen::MatrixXd P = riccati(A, b, Q, s.jerk_weight);
  const double d = s.jerk_weight + b.dot(P * b);
  const Eigen::RowVector4d K = b.transpose() * P * A / d;
  gains.Ks = K(0);
  gains.K = K.tail<3>();
  gains.F = preview_of(A - b * K, b, d, P.col(0) * s.zmp_weight, s.samples);
  return gains;
}

PreviewControl::PreviewControl(const PreviewSettings& settings)
    : settings_(settings), gains_(preview_gains(settings)) {}

void PreviewControl::reset(const ComState& com) {
  com_ = com;
  error_sum_.setZero();
}

Eigen::Vector2d PreviewControl::jerk(std::span<const Eigen::Vector2d> zmp_ref) const {
  const bool integral = settings_.form == PreviewForm::kIntegral;
  const std::size_t last = zmp_ref.size() - 1,
                    first = std::min<std::size_t>(integral ? 1 : 0, last);
  const std::size_t n = std::min(static_cast<std::size_t>(gains_.F.size()), zmp_ref.size() - first);
  const Eigen::Vector2d hold = zmp_ref[first + n - 1];
  // relative to the last reference, which stays for ever: Σ F = K(0) over an infinite preview
  Eigen::Vector2d u =
      -(gains_.K(0) * (com_.p_W_m - hold) + gains_.K(1) * com_.v_W + gains_.K(2) * com_.a_W);
  for (std::size_t i = 0; i < n; ++i)
    u += gains_.F[static_cast<Eigen::Index>(i)] * (zmp_ref[i + first] - hold);
  if (integral) u += gains_.Ks * (error_sum_ + zmp_ref[0] - zmp_W_m());
  return u;
}

void PreviewControl::step(std::span<const Eigen::Vector2d> zmp_ref) {
  const Eigen::Vector2d u = jerk(zmp_ref);
  error_sum_ += zmp_ref[0] - zmp_W_m();
  com_ = advance(com_, u, settings_.dt_s);
}

}  // namespace mimesis::walker
