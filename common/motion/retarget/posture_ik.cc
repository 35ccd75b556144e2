#include "common/motion/retarget/posture_ik.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/math/so3.h"

namespace mimesis::retarget {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

Posture advance(const Posture& posture, const Eigen::Ref<const VectorXd>& step) {
  Posture out = posture;
  out.X_WB.translation() += step.head<3>();
  // By way of a quaternion: a rotation stays one after thousands of steps
  const Eigen::Matrix3d R = math::exp_so3(step.segment<3>(3)) * posture.X_WB.linear();
  out.X_WB.linear() = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  out.q += step.tail(posture.q.size());
  return out;
}

Goal goal(int link, const Eigen::Matrix3d& R_WE, const Eigen::Vector3d& p_WE,
          double position_weight, double orientation_weight, const Eigen::Vector3d& p_LE) {
  Goal g{
      .link = link, .position_weight = position_weight, .orientation_weight = orientation_weight};
  g.X_LE.translation() = p_LE;
  g.X_WE.linear() = R_WE;
  g.X_WE.translation() = p_WE;
  return g;
}

VectorXd difference(const Posture& from, const Posture& to) {
  VectorXd step(6 + from.q.size());
  step << to.X_WB.translation() - from.X_WB.translation(),
      math::log_so3(to.X_WB.linear() * from.X_WB.linear().transpose()), to.q - from.q;
  return step;
}

GoalErrors errors(const robot::Kinematics& kinematics, const std::vector<Goal>& goals) {
  Index rows = 0;
  for (const Goal& g : goals) {
    rows += (g.position_weight > 0.0 ? 3 : 0) + (g.orientation_weight > 0.0 ? 3 : 0);
  }
  const Index columns = 6 + kinematics.tree().dof();
  GoalErrors out{VectorXd(rows), MatrixXd(rows, columns)};
  robot::Jacobian J(6, columns);
  Index row = 0;
  for (const Goal& g : goals) {
    const Eigen::Isometry3d X_WE = kinematics.X_WL(g.link) * g.X_LE;
    kinematics.jacobian(g.link, X_WE.translation(), J);
    if (g.position_weight > 0.0) {
      out.error.segment<3>(row) = g.position_weight * (g.X_WE.translation() - X_WE.translation());
      out.jacobian.middleRows<3>(row) = g.position_weight * J.topRows<3>();
      row += 3;
    }
    if (g.orientation_weight > 0.0) {
      out.error.segment<3>(row) =
          g.orientation_weight * math::log_so3(g.X_WE.linear() * X_WE.linear().transpose());
      out.jacobian.middleRows<3>(row) = g.orientation_weight * J.bottomRows<3>();
      row += 3;
    }
  }
  return out;
}

NullSpace::NullSpace(const MatrixXd& jacobian, const std::vector<bool>& locked)
    : jacobian_(jacobian) {
  const Index n = jacobian.cols();
  std::vector<Index> free;
  for (Index c = 0; c < n; ++c) {
    if (locked[static_cast<std::size_t>(c)]) {
      jacobian_.col(c).setZero();
    } else {
      free.push_back(c);
    }
  }
  const auto count = static_cast<Index>(free.size());
  MatrixXd transposed(count, jacobian.rows());
  for (Index i = 0; i < count; ++i) {
    transposed.row(i) = jacobian.col(free[static_cast<std::size_t>(i)]).transpose();
  }
  // space perpendicular to all rows of J: the last columns of Q of Jᵀ = Q R
  Eigen::ColPivHouseholderQR<MatrixXd> qr(transposed);
  qr.setThreshold(1e-10);
  const Index rank = qr.rank();
  MatrixXd last = MatrixXd::Zero(count, count - rank);
  last.bottomRows(count - rank).setIdentity();
  last.applyOnTheLeft(qr.householderQ());
  basis_ = MatrixXd::Zero(n, count - rank);
  for (Index i = 0; i < count; ++i) basis_.row(free[static_cast<std::size_t>(i)]) = last.row(i);
}

VectorXd NullSpace::reach(const VectorXd& wanted, double damping) const {
  MatrixXd square = jacobian_ * jacobian_.transpose();
  square.diagonal().array() += damping;
  return jacobian_.transpose() * square.ldlt().solve(wanted);
}

LimitBarrier::LimitBarrier(const robot::RobotTree& tree)
    : lower_(tree.lower()), upper_(tree.upper()), margin_(lower_.size()) {
  for (Index i = 0; i < margin_.size(); ++i) {
    margin_[i] = std::min(0.15, 0.2 * (upper_[i] - lower_[i]));
  }
}

namespace {

constexpr double kNearest = 0.02;  // share of the margin

double barrier(double share) {
  const double d = std::max(share, kNearest);
  return d >= 1.0 ? 0.0 : d - 1.0 - std::log(d) + (1.0 - 1.0 / d) * (share - d);
}

constexpr double kLargestStep = 0.25;     // [m], [rad]: linearisation holds
constexpr double kExactTolerance = 1e-9;  // of the weighted errors of the exact goals
constexpr double kStill = 1e-5;  // the search ends when no component of a step is larger [m, rad]
constexpr double kBarrierWeight = 2e-3;  // of LimitBarrier against the squared errors of wishes
// Against change from the start, per squared radian or metre: decides what goals leave open, such
// as which of two aligned joints turns.
constexpr double kStayWeight = 1e-3;

/// One step towards the goals without the locked components.
VectorXd step_towards(const GoalErrors& exact, const GoalErrors& wishes, const VectorXd& slope,
                      const VectorXd& curvature, const std::vector<bool>& locked) {
  const NullSpace null_space(exact.jacobian, locked);
  // Damped by the error itself (Sugihara 2011): sure far away, exact at the goal
  VectorXd main = null_space.reach(exact.error, 1e-3 * exact.error.squaredNorm() + 1e-13);
  const MatrixXd& Z = null_space.basis();
  if (Z.cols() == 0) return main;
  const MatrixXd JZ = wishes.jacobian * Z;
  const MatrixXd H = JZ.transpose() * JZ + Z.transpose() * curvature.asDiagonal() * Z;
  const VectorXd downhill = JZ.transpose() * (wishes.error - wishes.jacobian * main) -
                            Z.transpose() * (slope + curvature.cwiseProduct(main));
  return main + Z * H.ldlt().solve(downhill);
}

constexpr double kTooFar = 1e-10;           // distance of an end effector from its place [m, rad]
constexpr double kSmoothingBarrier = 1e-5;  // weight of LimitBarrier against E

/// aₜ = 2qₜ − qₜ₋₁ − qₜ₊₁
VectorXd bend(std::span<const Posture> p, std::size_t t) {
  return -difference(p[t], p[t - 1]) - difference(p[t], p[t + 1]);
}

class Smoother {
 public:
  Smoother(robot::Kinematics& kinematics, const std::vector<std::vector<Goal>>& exact,
           std::vector<Posture>& postures)
      : kinematics_(kinematics),
        exact_(exact),
        postures_(postures),
        barrier_(kinematics.tree()),
        lower_(kinematics.tree().lower()),
        upper_(kinematics.tree().upper()) {}

  void improve(std::size_t t) {
    kinematics_.update(postures_[t].X_WB, postures_[t].q);
    std::vector<Goal> here = exact_[t];
    for (Goal& g : here) g.X_WE = kinematics_.X_WL(g.link) * g.X_LE;
    const GoalErrors now = errors(kinematics_, here);
    const VectorXd wanted = downhill(t);
    const Posture before = postures_[t];
    const double cost_before = cost(t);
    for (const double length : {1.6, 0.8, 0.2}) {  // beyond the minimum first: neighbours follow
      if (step(before, here, now.jacobian, length * wanted, t) && cost(t) < cost_before) return;
      postures_[t] = before;
    }
  }

 private:
  bool inner(std::size_t t) const { return t > 0 && t + 1 < postures_.size(); }

  /// The part of E plus barrier that posture t changes.
  double cost(std::size_t t) const {
    double sum = kSmoothingBarrier * barrier_.value(postures_[t].q);
    for (std::size_t s = t - 1; s <= t + 1; ++s) {
      if (inner(s)) sum += bend(postures_, s).squaredNorm();
    }
    return sum;
  }

  /// Minus the gradient, divided by the second derivative: 2(4 + 1 + 1) away from the ends.
  VectorXd downhill(std::size_t t) const {
    VectorXd gradient = 4.0 * bend(postures_, t);
    double curvature = 8.0;
    for (const std::size_t s : {t - 1, t + 1}) {
      if (!inner(s)) continue;
      gradient -= 2.0 * bend(postures_, s);
      curvature += 2.0;
    }
    VectorXd first, second;
    barrier_.derivatives(postures_[t].q, first, second);
    const Index joints = first.size();
    gradient.tail(joints) += kSmoothingBarrier * first;
    VectorXd scale = VectorXd::Constant(gradient.size(), curvature);
    scale.tail(joints) += kSmoothingBarrier * second;
    return -gradient.cwiseQuotient(scale);
  }

  /// Goes along the projected step with joints stopped at their limits, then puts the end effectors
  /// back to where they were to the last digits. False if that fails.
  bool step(const Posture& from, const std::vector<Goal>& here, const Eigen::MatrixXd& jacobian,
            const VectorXd& wanted, std::size_t t) {
    std::vector<bool> locked(static_cast<std::size_t>(wanted.size()), false);
    Posture to;
    for (bool again = true; again;) {
      const NullSpace null_space(jacobian, locked);
      to = advance(from, null_space.project(wanted));
      again = false;
      for (Index i = 0; i < to.q.size(); ++i) {
        if (to.q[i] >= lower_[i] && to.q[i] <= upper_[i]) continue;
        const auto column = static_cast<std::size_t>(6 + i);
        if (locked[column]) return false;
        locked[column] = again = true;
      }
    }
    for (int i = 0; i < 6; ++i) {
      kinematics_.update(to.X_WB, to.q);
      const GoalErrors now = errors(kinematics_, here);
      if (now.error.cwiseAbs().maxCoeff() < kTooFar) {
        postures_[t] = to;
        return true;
      }
      const NullSpace null_space(now.jacobian, locked);
      to = advance(to, null_space.reach(now.error, 1e-14));
      if (((to.q - lower_).array() < 0.0).any() || ((upper_ - to.q).array() < 0.0).any()) {
        return false;
      }
    }
    return false;
  }

  robot::Kinematics& kinematics_;
  const std::vector<std::vector<Goal>>& exact_;
  std::vector<Posture>& postures_;
  LimitBarrier barrier_;
  VectorXd lower_, upper_;
};

}  // namespace

double LimitBarrier::value(const VectorXd& q) const {
  double sum = 0.0;
  for (Index i = 0; i < q.size(); ++i) {
    sum += barrier((q[i] - lower_[i]) / margin_[i]) + barrier((upper_[i] - q[i]) / margin_[i]);
  }
  return sum;
}

void LimitBarrier::derivatives(const VectorXd& q, VectorXd& first, VectorXd& second) const {
  first.setZero(q.size());
  second.setZero(q.size());
  for (Index i = 0; i < q.size(); ++i) {
    for (const double sign : {1.0, -1.0}) {  // towards the lower, the upper limit
      const double distance = sign > 0.0 ? q[i] - lower_[i] : upper_[i] - q[i];
      const double d = std::max(distance / margin_[i], kNearest);
      if (d >= 1.0) continue;
      first[i] += sign * (1.0 - 1.0 / d) / margin_[i];
      second[i] += 1.0 / (d * d * margin_[i] * margin_[i]);
    }
  }
}

IkResult solve(robot::Kinematics& kinematics, const Posture& start, const std::vector<Goal>& exact,
               const std::vector<Goal>& wishes, int max_iterations) {
  const VectorXd lower = kinematics.tree().lower(), upper = kinematics.tree().upper();
  MIMESIS_ASSERT(((start.q - lower).array() >= 0.0).all() &&
                 ((upper - start.q).array() >= 0.0).all());
  const LimitBarrier barrier(kinematics.tree());
  const Index joints = lower.size();
  IkResult out{start, 0.0, 0};
  VectorXd first, second, slope(6 + joints), curvature(6 + joints);
  for (;; ++out.iterations) {
    kinematics.update(out.posture.X_WB, out.posture.q);
    const GoalErrors now = errors(kinematics, exact), wanted = errors(kinematics, wishes);
    out.exact_error = now.error.norm();
    if (out.iterations == max_iterations) return out;
    barrier.derivatives(out.posture.q, first, second);
    slope << VectorXd::Zero(6), kBarrierWeight * first;
    curvature << VectorXd::Zero(6), kBarrierWeight * second;
    slope += kStayWeight * difference(start, out.posture);
    curvature.array() += kStayWeight;
    std::vector<bool> locked(static_cast<std::size_t>(6 + joints), false);
    VectorXd step;
    for (bool more = true; more;) {
      more = false;
      step = step_towards(now, wanted, slope, curvature, locked);
      for (Index i = 0; i < joints; ++i) {
        const double q = out.posture.q[i], d = step[6 + i];
        const bool leaves = (q <= lower[i] && d < 0.0) || (q >= upper[i] && d > 0.0);
        if (!leaves || locked[static_cast<std::size_t>(6 + i)]) continue;
        locked[static_cast<std::size_t>(6 + i)] = more = true;
      }
    }
    step *= std::min(1.0, kLargestStep / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
    out.posture = advance(out.posture, step);
    out.posture.q = out.posture.q.cwiseMax(lower).cwiseMin(upper);
    // An exact goal is fulfilled to its tolerance before the wishes may end the search
    const bool fulfilled = out.exact_error < kExactTolerance;
    if (step.cwiseAbs().maxCoeff() < (fulfilled ? kStill : 1e-3 * kStill)) {
      kinematics.update(out.posture.X_WB, out.posture.q);
      out.exact_error = errors(kinematics, exact).error.norm();
      return out;
    }
  }
}

double roughness(std::span<const Posture> postures) {
  double sum = 0.0;
  for (std::size_t t = 1; t + 1 < postures.size(); ++t) sum += bend(postures, t).squaredNorm();
  return sum;
}

void smooth(robot::Kinematics& kinematics, const std::vector<std::vector<Goal>>& exact,
            std::vector<Posture>& postures, int sweeps) {
  MIMESIS_ASSERT(exact.size() == postures.size());
  Smoother smoother(kinematics, exact, postures);
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (std::size_t t = 1; t + 1 < postures.size(); ++t) smoother.improve(t);
  }
}

}  // namespace mimesis::retarget
