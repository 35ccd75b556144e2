#pragma once
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "hw/sim/body/drawer.h"
#include "hw/sim/body/walk_judge.h"
#include "proto/motion.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::hw::sim {

/// Says once how a walk ended: the robot fell, it stands at the motion's goal, or time is up.
class OutcomeJudge {
 public:
  struct Settings {
    double settle_s;      ///< time of standing at the goal
    double time_limit_s;  ///< 0: none
  };
  OutcomeJudge(const Settings& settings, runtime::Bus& bus)
      : settings_(settings),
        walk_(bus, "walk"),
        balance_(bus, "balance"),
        motion_(bus, "motion"),
        wish_(bus, "wish"),
        outcome_(bus, "outcome") {}

  /// After every step of the world. `drawer`: null if there is none; else the object is the goal.
  void step(runtime::Time now, const BodyTruth& truth, const Drawer* drawer) {
    const v1::WalkBalance* balance = balance_.fresh(now, runtime::from_seconds(kPlanTooOld_s));
    watch_steps();
    std::optional<PlannedGround> plan;
    if (balance != nullptr && planned_.feet_size() == 2) {
      plan = {.zmp_W_m = ground(balance->zmp_planned_in_world_m())};
      for (int i = 0; i < 2; ++i) {
        const v1::Footprint& foot = planned_.feet(i);
        const auto side = static_cast<std::size_t>(i);
        plan->foot_W_m[side] = ground(foot.position_in_world_m());
        plan->foot_yaw_rad[side] = foot.yaw_rad();
      }
    }
    // Before there is a plan the robot settles on its feet: that is no walk.
    const bool walks = planned_.state() > v1::WALK_STATE_WAITING;
    if (walks || truth.fell) judge_.tick(truth, plan);
    if (!ended_) decide(now, truth, drawer);
  }

 private:
  static constexpr double kPlanTooOld_s = 0.05;
  static Eigen::Vector2d ground(const v1::Vector3& p) { return {p.x_m(), p.y_m()}; }

  /// Wished landing of the next foot, as last received before it landed.
  void watch_wishes() {
    while (const auto motion = wish_.pop()) {
      if (motion->landings().empty()) continue;
      const v1::Footprint& next = motion->landings(0);
      if (next.foot() == v1::FOOT_UNSPECIFIED) continue;
      wished_W_m_[next.foot() == v1::FOOT_LEFT ? 0 : 1] = ground(next.position_in_world_m());
    }
  }
  void watch_steps() {
    watch_wishes();
    while (const auto now = walk_.pop()) {
      const v1::WalkFeedback before = std::exchange(planned_, *now);
      const bool landed = now->steps() == before.steps() + 1 && now->feet_size() == 2 &&
                          before.swing() != v1::FOOT_UNSPECIFIED && before.has_landing();
      if (!landed) continue;
      const bool left = before.swing() == v1::FOOT_LEFT;
      const v1::Footprint& other = now->feet(left ? 1 : 0);
      JudgedStep step{.side = left ? robot::kLeft : robot::kRight,
                      .planned_W_m = ground(before.landing().position_in_world_m()),
                      .planned_other_W_m = ground(other.position_in_world_m()),
                      .planned_other_yaw_rad = other.yaw_rad()};
      if (auto& wished = wished_W_m_[step.side]) {
        const Eigen::Vector2d way(std::cos(other.yaw_rad()), std::sin(other.yaw_rad()));
        step.wished_length_m = way.dot(*wished - step.planned_other_W_m);
        wished.reset();
      }
      judge_.step(step);
    }
    while (const auto status = motion_.pop()) {
      reached_ = status->reached();
      refused_ = status->reason();
    }
  }
  void decide(runtime::Time now, const BodyTruth& truth, const Drawer* drawer) {
    const bool stands = reached_ && planned_.state() == v1::WALK_STATE_STANDING;
    if (!stands) standing_since_s_ = std::nullopt;
    if (stands && !standing_since_s_) standing_since_s_ = truth.time_s;
    if (truth.fell) return end(now, "fell: " + truth.how, drawer);
    if (stands && truth.time_s - *standing_since_s_ >= settings_.settle_s) {
      const bool taken = drawer == nullptr || drawer->now().taken;
      return end(now, taken ? "" : "the object was not taken", drawer);
    }
    if (settings_.time_limit_s > 0.0 && truth.time_s >= settings_.time_limit_s) {
      const std::string why = refused_.empty() ? "" : ": " + refused_;
      end(now, reached_ ? "does not stand at the goal in time" : "goal not reached in time" + why,
          drawer);
    }
  }
  void end(runtime::Time now, const std::string& failure, const Drawer* drawer) {
    ended_ = true;
    const WalkFigures& f = judge_.figures();
    v1::WalkOutcome out;
    out.set_success(failure.empty());
    out.set_reason(failure);
    out.set_fell(f.fell);
    out.set_steps(static_cast<std::uint32_t>(f.steps));
    out.set_step_error_max_m(f.step_error_max_m);
    out.set_step_error_rms_m(f.step_error_rms_m);
    out.set_step_length_error_max_m(f.step_length_error_max_m);
    out.set_ankle_pitch_peak_n_m(f.ankle_pitch_peak_n_m);
    out.set_normal_peak_n(f.normal_peak_n);
    out.set_zmp_error_rms_m(f.zmp_error_rms_m.norm());
    if (drawer != nullptr) out.set_reach_error_m(drawer->reach_error_m().value_or(0.0));
    outcome_.send(out, now);
    runtime::info("outcome: {}, {} steps", failure.empty() ? "stands at the goal" : failure,
                  f.steps);
  }

  Settings settings_;
  WalkJudge judge_;
  v1::WalkFeedback planned_;  // newest
  bool reached_ = false, ended_ = false;
  std::string refused_;  // why the motion's goal cannot be reached
  std::optional<double> standing_since_s_;
  std::array<std::optional<Eigen::Vector2d>, 2> wished_W_m_;  // next landings: left, right

  runtime::Queue<v1::WalkFeedback, 16> walk_;
  runtime::Latest<v1::WalkBalance> balance_;
  runtime::Queue<v1::MotionStatus, 16> motion_;
  runtime::Queue<v1::Motion, 16> wish_;
  runtime::Out<v1::WalkOutcome> outcome_;
};

}  // namespace mimesis::hw::sim
