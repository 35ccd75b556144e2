#pragma once
#include <cmath>
#include <numbers>

#include "common/model/files.h"
#include "common/shared_data.h"
#include "nodes/walker/tasks/stack.h"

namespace mimesis::walker {

/// Both robots; JVRC-1 only where its file is.
inline std::vector<robot::Biped> robots() {
  std::vector<robot::Biped> robots;
  robots.push_back(model::load_biped("biped.yaml"));
  if (std::filesystem::exists(shared_data("data/robots/jvrc1.urdf"))) {
    robots.push_back(model::load_biped("jvrc1.yaml"));
  }
  return robots;
}

/// Smooth references made of sines and quintics, with exact rates, for what a pattern generator
/// gives: the robot starts in half-sitting and at rest.
class Reference {
 public:
  explicit Reference(const robot::Biped& biped) : biped_(&biped), kinematics_(biped.tree) {
    kinematics_.update(biped.X_WB_half_sitting, biped.half_sitting);
  }

  /// Half-sitting.
  TaskGoals stand() const {
    TaskGoals goals;
    goals.com_W_m = kinematics_.com();
    goals.com_v_W.setZero();
    for (std::size_t side = 0; side < 2; ++side) {
      goals.foot[side] = {};
      goals.foot[side].X_WS = kinematics_.X_WL(biped_->leg[side].sole);
      if (biped_->hand[side] >= 0) {
        goals.hand[side].p_W_m = kinematics_.X_WL(biped_->hand[side]).translation();
      }
    }
    goals.R_W_trunk = kinematics_.X_WL(biped_->trunk).linear();
    goals.upper_body.resize(static_cast<Eigen::Index>(biped_->upper_body.size()));
    for (Eigen::Index i = 0; i < goals.upper_body.size(); ++i) {
      goals.upper_body[i] = biped_->half_sitting[biped_->upper_body[static_cast<std::size_t>(i)]];
    }
    goals.upper_body_rate = Eigen::VectorXd::Zero(goals.upper_body.size());
    return goals;
  }

  /// A walk of `speed` with steps of 0.8 s, a sway of the CoM and turning feet.
  TaskGoals walk(double t, double speed_m_s) const {
    constexpr double kStep = 0.8, kDouble = 0.1, kHeight = 0.05;
    TaskGoals goals = stand();
    const Ramp on = ramp(t, 0.0, 2.0);  // ramp of the walk: smooth start
    const double way = speed_m_s * on.integral, rate = speed_m_s * on.value;
    goals.com_W_m.x() += way;
    goals.com_v_W.x() = rate;
    const double w = std::numbers::pi / kStep, sway = 0.05;
    goals.com_W_m.y() += sway * on.value * std::sin(w * t);
    goals.com_v_W.y() = sway * (on.value * w * std::cos(w * t) + on.rate * std::sin(w * t));
    const int step = static_cast<int>(t / kStep);
    for (int side = 0; side < 2; ++side) {
      // The foot swings in steps of its own parity, to where the CoM will be.
      FootState& foot = goals.foot[static_cast<std::size_t>(side)];
      const bool swings = step % 2 == side;
      const int before = step - 1, after = swings ? step + 1 : step;
      const double from = way_at(before * kStep, speed_m_s), to = way_at(after * kStep, speed_m_s);
      const Ramp s =
          swings ? ramp(t, step * kStep + kDouble, (step + 1) * kStep) : Ramp{.value = 1.0};
      foot.X_WS.translation().x() += from + (to - from) * s.value;
      foot.v_W.x() = (to - from) * s.rate;
      foot.X_WS.translation().z() += 16.0 * kHeight * std::pow(s.value * (1.0 - s.value), 2);
      foot.v_W.z() = 32.0 * kHeight * s.value * (1.0 - s.value) * (1.0 - 2.0 * s.value) * s.rate;
    }
    return goals;
  }

  /// Down by `depth` and up again, cosine of period 2 s.
  TaskGoals squat(double t, double depth_m) const {
    TaskGoals goals = stand();
    const double w = std::numbers::pi;
    goals.com_W_m.z() -= 0.5 * depth_m * (1.0 - std::cos(w * t));
    goals.com_v_W.z() = -0.5 * depth_m * w * std::sin(w * t);
    return goals;
  }

  /// A step in 0..1 with zero rates and accelerations at its ends.
  struct Ramp {
    double value = 0.0, rate = 0.0, integral = 0.0;
  };
  static Ramp ramp(double t, double from, double to) {
    const double T = to - from, s = std::clamp((t - from) / T, 0.0, 1.0);
    return {.value = s * s * s * (10.0 + s * (6.0 * s - 15.0)),
            .rate = s > 0.0 && s < 1.0 ? 30.0 * s * s * (1.0 - s) * (1.0 - s) / T : 0.0,
            .integral = T * s * s * s * s * (2.5 + s * (s - 3.0)) + std::max(0.0, t - to)};
  }

 private:
  static double way_at(double t, double speed) {
    return t <= 0.0 ? 0.0 : speed * ramp(t + 0.4, 0.0, 2.0).integral;
  }
  const robot::Biped* biped_;
  robot::Kinematics kinematics_;
};

}  // namespace mimesis::walker
