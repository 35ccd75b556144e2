// What the node says at a step.
#include "common/math/so3.h"
#include "common/runtime/bus.h"
#include "nodes/walker/walker_node.h"

namespace mimesis::walker {
namespace {

constexpr std::uint64_t kTransformsEvery = 8;  // steps: 25 Hz

const char* name(v1::WalkState state) {
  switch (state) {
    case v1::WALK_STATE_WAITING:
      return "waiting";
    case v1::WALK_STATE_STANDING:
      return "standing";
    case v1::WALK_STATE_STARTING:
      return "starting";
    case v1::WALK_STATE_WALKING:
      return "walking";
    case v1::WALK_STATE_STOPPING:
      return "stopping";
    case v1::WALK_STATE_SAFE:
      return "safe";
    default:
      return "";
  }
}

}  // namespace

v1::WalkState WalkerNode::state() const {
  switch (conduct_.phase()) {
    case Phase::kBalancing:
      return to_proto(tick_->pattern.gait);
    case Phase::kSafe:
      return v1::WALK_STATE_SAFE;
    default:
      return v1::WALK_STATE_WAITING;
  }
}

void WalkerNode::publish(runtime::Time now) {
  if (conduct_.phase() != Phase::kWaiting) {  // silence stops the drives
    command_message_.mutable_position_rad()->Assign(q_.begin(), q_.end());
    command_message_.mutable_velocity_rad_s()->Assign(dq_.begin(), dq_.end());
    command_.send(command_message_, now);
  }
  publish_feedback(now);
  if (conduct_.phase() == Phase::kBalancing) {
    to_proto(*tick_, balance_message_);
    balance_.send(balance_message_, now);
  }
  if (steps_ % kTransformsEvery == 0) {
    to_proto(kinematics_, now, transforms_message_);
    transforms_.send(transforms_message_, now);
  }
  publish_status(now);
}

/// Where the feet are while there is no plan.
void WalkerNode::stand_in_feedback() {
  feedback_message_.clear_feet();
  for (const Side side : robot::kSides) {
    const Eigen::Isometry3d& X_WS = kinematics_.X_WL(biped_.leg[side].sole);
    to_proto(
        Footprint{.side = side, .p_W_m = X_WS.translation().head<2>(), .yaw_rad = place_.yaw_rad},
        *feedback_message_.add_feet());
  }
  feedback_message_.set_swing(v1::FOOT_RIGHT);
  *feedback_message_.mutable_landing() = feedback_message_.feet(kRight);
}

void WalkerNode::publish_feedback(runtime::Time now) {
  if (tick_ != nullptr) {
    to_proto(*tick_, feedback_message_);
  } else {
    stand_in_feedback();
  }
  feedback_message_.set_state(state());
  const Eigen::Isometry3d& X_WB = kinematics_.X_WL(0);
  to_proto(X_WB.translation(), *feedback_message_.mutable_position_pelvis_in_world_m());
  feedback_message_.set_heading_rad(math::yaw_of(X_WB.linear()));
  feedback_message_.clear_hands_in_world_m();
  for (const int hand : biped_.hand) {
    if (hand < 0) continue;
    to_proto(kinematics_.X_WL(hand).translation(), *feedback_message_.add_hands_in_world_m());
  }
  feedback_.send(feedback_message_, now);
}

/// At every change, and once a second.
void WalkerNode::publish_status(runtime::Time now) {
  const v1::WalkState is = state();
  const std::string& reason =
      conduct_.reason().empty() && motion_heard_ ? refusal_ : conduct_.reason();
  const bool changed = is != told_.state || reason != told_.reason;
  if (!changed && now < told_.due) return;
  if (changed && (is != told_.state || troubles_.pass())) {
    runtime::log(is == v1::WALK_STATE_SAFE ? runtime::Level::warn : runtime::Level::info,
                 fmt::format("{}{}{}", name(is), reason.empty() ? "" : ": ", reason));
  }
  told_ = {is, reason, now + std::chrono::seconds(1)};
  const Took took = runtime::read_outside_value<Took>(bus_, "ticks", [this] { return took_; });
  v1::WalkerStatus status;
  status.set_state(is);
  status.set_reason(reason);
  status.set_failed_solves(failed_);
  status.set_clipped_wishes(clipped_);
  status.set_limited_ticks(limited_);
  status.set_mean_tick_s(took.mean_s);
  status.set_worst_tick_s(took.worst_s);
  status_.send(status, now);
}

}  // namespace mimesis::walker
