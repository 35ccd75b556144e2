#include "common/motion/retarget/smoothing.h"

#include <algorithm>

#include "common/error.h"

namespace mimesis::retarget {
namespace {

using Eigen::Index, Eigen::VectorXd;

constexpr double kTooFar = 1e-10;  // of an end effector from its place [m, rad]

/// aₜ = 2qₜ − qₜ₋₁ − qₜ₊₁
VectorXd bend(std::span<const Posture> p, std::size_t t) {
  return -difference(p[t], p[t - 1]) - difference(p[t], p[t + 1]);
}

class Smoother {
 public:
  Smoother(robot::Kinematics& kinematics, const std::vector<std::vector<Goal>>& exact,
           std::vector<Posture>& postures, const SmoothingOptions& options)
      : kinematics_(kinematics),
        exact_(exact),
        postures_(postures),
        options_(options),
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
    double sum = options_.barrier_weight * barrier_.value(postures_[t].q);
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
    gradient.tail(joints) += options_.barrier_weight * first;
    VectorXd scale = VectorXd::Constant(gradient.size(), curvature);
    scale.tail(joints) += options_.barrier_weight * second;
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
  SmoothingOptions options_;
  LimitBarrier barrier_;
  VectorXd lower_, upper_;
};

}  // namespace

double roughness(std::span<const Posture> postures) {
  double sum = 0.0;
  for (std::size_t t = 1; t + 1 < postures.size(); ++t) sum += bend(postures, t).squaredNorm();
  return sum;
}

void smooth(robot::Kinematics& kinematics, const std::vector<std::vector<Goal>>& exact,
            std::vector<Posture>& postures, const SmoothingOptions& options) {
  MIMESIS_ASSERT(exact.size() == postures.size());
  Smoother smoother(kinematics, exact, postures, options);
  for (int sweep = 0; sweep < options.sweeps; ++sweep) {
    for (std::size_t t = 1; t + 1 < postures.size(); ++t) smoother.improve(t);
  }
}

}  // namespace mimesis::retarget
