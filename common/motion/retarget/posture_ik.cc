#include "common/motion/retarget/posture_ik.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "common/error.h"

namespace mimesis::retarget {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kLargestStep = 0.25;  // [m], [rad]: linearisation holds

/// One step towards the goals without the locked components.
VectorXd step_towards(const GoalErrors& exact, const GoalErrors& wishes, const VectorXd& slope,
                      const VectorXd& curvature, const std::vector<bool>& locked) {
  const NullSpace null_space(exact.jacobian, locked);
  // Damped by the error itself (Sugihara 2011): sure far away, exact at the goal
  const VectorXd main = null_space.reach(exact.error, 1e-3 * exact.error.squaredNorm() + 1e-13);
  const MatrixXd& Z = null_space.basis();
  if (Z.cols() == 0) return main;
  const MatrixXd JZ = wishes.jacobian * Z;
  const MatrixXd H = JZ.transpose() * JZ + Z.transpose() * curvature.asDiagonal() * Z;
  const VectorXd downhill = JZ.transpose() * (wishes.error - wishes.jacobian * main) -
                            Z.transpose() * (slope + curvature.cwiseProduct(main));
  return main + Z * H.ldlt().solve(downhill);
}

}  // namespace

IkResult solve(robot::Kinematics& kinematics, const Posture& start, const std::vector<Goal>& exact,
               const std::vector<Goal>& wishes, const IkOptions& options) {
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
    if (out.iterations == options.max_iterations) return out;
    barrier.derivatives(out.posture.q, first, second);
    slope << VectorXd::Zero(6), options.barrier_weight * first;
    curvature << VectorXd::Zero(6), options.barrier_weight * second;
    slope += options.stay_weight * difference(start, out.posture);
    curvature.array() += options.stay_weight;
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
    const bool fulfilled = out.exact_error < options.exact_tolerance;
    const double still = fulfilled ? options.still : 1e-3 * options.still;
    if (step.cwiseAbs().maxCoeff() < still) {
      kinematics.update(out.posture.X_WB, out.posture.q);
      out.exact_error = errors(kinematics, exact).error.norm();
      return out;
    }
  }
}

}  // namespace mimesis::retarget
