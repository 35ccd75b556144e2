#include "hw/sim/body/outcome_node.h"

#include "common/runtime/log.h"

namespace mimesis::hw::sim {
namespace {

constexpr double kPlanTooOld_s = 0.05;

Eigen::Vector2d ground(const v1::Vector3& p) { return {p.x_m(), p.y_m()}; }

}  // namespace

OutcomeJudge::OutcomeJudge(const Settings& settings, runtime::Bus& bus)
    : settings_(settings),
      walk_(bus, "walk"),
      balance_(bus, "balance"),
      motion_(bus, "motion"),
      outcome_(bus, "outcome") {}

void OutcomeJudge::watch_steps() {
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
    if (wished_length_m_ > 0.0) step.wished_length_m = wished_length_m_;
    judge_.step(step);
  }
  while (const auto status = motion_.pop()) {
    reached_ = status->reached();
    wished_length_m_ = status->step_length_m_size() > 0 ? status->step_length_m(0) : 0.0;
  }
}

void OutcomeJudge::step(runtime::Time now, const BodyTruth& truth) {
  const v1::WalkBalance* balance = balance_.fresh(now, runtime::from_seconds(kPlanTooOld_s));
  std::optional<Eigen::Vector2d> zmp;
  if (balance != nullptr) zmp = ground(balance->zmp_planned_in_world_m());
  watch_steps();
  // Before there is a plan the robot settles on its feet: that is no walk.
  const bool walks = planned_.state() > v1::WALK_STATE_WAITING;
  if (walks || truth.fell) judge_.tick(truth, zmp);

  const bool stands = reached_ && planned_.state() == v1::WALK_STATE_STANDING;
  if (!stands) standing_since_s_ = std::nullopt;
  if (stands && !standing_since_s_) standing_since_s_ = truth.time_s;
  if (truth.fell) return end(now, false, "fell: " + truth.how);
  if (stands && truth.time_s - *standing_since_s_ >= settings_.settle_s) return end(now, true, "");
  if (settings_.time_limit_s > 0.0 && truth.time_s >= settings_.time_limit_s) {
    end(now, false, reached_ ? "does not stand at the goal in time" : "goal not reached in time");
  }
}

void OutcomeJudge::end(runtime::Time now, bool success, const std::string& reason) {
  if (std::exchange(ended_, true)) return;
  const WalkFigures& f = judge_.figures();
  v1::WalkOutcome out;
  out.set_success(success);
  out.set_reason(reason);
  out.set_fell(f.fell);
  out.set_steps(static_cast<std::uint32_t>(f.steps));
  out.set_step_error_max_m(f.step_error_max_m);
  out.set_step_error_rms_m(f.step_error_rms_m);
  out.set_step_length_error_max_m(f.step_length_error_max_m);
  out.set_ankle_pitch_peak_n_m(f.ankle_pitch_peak_n_m);
  out.set_normal_peak_n(f.normal_peak_n);
  out.set_zmp_error_rms_m(f.zmp_error_rms_m.norm());
  outcome_.send(out, now);
  runtime::info("outcome: {}, {} steps", success ? "stands at the goal" : reason, f.steps);
}

}  // namespace mimesis::hw::sim
