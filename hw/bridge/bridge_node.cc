#include "hw/bridge/bridge_node.h"

#include <google/protobuf/empty.pb.h>

#include <algorithm>
#include <cmath>

namespace mimesis::hw::bridge {
namespace {

using std::chrono::milliseconds;

constexpr double kHandRateHz = 100.0, kJointsRateHz = 50.0;
constexpr milliseconds kStatusPeriod(1000);
constexpr int kHoldCycles = 3;
// Each time the arm brakes on its path it falls behind, and comes to rest later when it has to. A
// machine that lets the planner wait for 20 ms now and then shall not add that up.
constexpr milliseconds kBrakeAfter(40);
// In lock-step graph time stands still meanwhile, and the machine's speed must not decide. A node
// that is asked to stop has 3 s.
constexpr milliseconds kHandTimeoutLockstep(2000);

static_assert(static_cast<int>(DriveState::switch_on_disabled) ==
              v1::DRIVE_STATE_SWITCH_ON_DISABLED);
static_assert(static_cast<int>(DriveState::fault) == v1::DRIVE_STATE_FAULT);

bool holds(const BridgeParams& p, const Joints& joints) {
  return p.on_silence == "auto" ? joints.walks : p.on_silence == "hold";
}

GateLimits gate_limits(const BridgeParams& p, const Joints& joints) {
  return {.hold_after = runtime::from_seconds((kHoldCycles + 0.5) / joints.rate_hz),
          .brake_after = kBrakeAfter,
          .silence = runtime::from_seconds(p.silence_s),
          .start_tolerance_rad = p.start_tolerance_rad,
          .jump_rad = p.jump_rad,
          .v_max_rad_s = {joints.limits.v_max.begin(), joints.limits.v_max.end()},
          .a_max_rad_s2 = {joints.limits.a_max.begin(), joints.limits.a_max.end()},
          .names = joints.names,
          .hold_on_silence = holds(p, joints),
          .cycle = runtime::from_seconds(1.0 / joints.rate_hz),
          .extrapolated_cycles = joints.extrapolated_cycles,
          .enables_itself = p.enable == "auto"};
}

/// Every how many steps something slower is due.
std::uint64_t every(double rate_hz, double slower_hz) {
  return static_cast<std::uint64_t>(std::max(1.0, std::round(rate_hz / slower_hz)));
}

}  // namespace

std::pair<BridgeParams, Joints> BridgeNode::with_machine(BridgeParams params) {
  Joints joints = take_machine(params);
  return {std::move(params), std::move(joints)};
}

BridgeNode::BridgeNode(const Params& params, runtime::Bus& bus)
    : BridgeNode(bus, with_machine(params)) {}

BridgeNode::BridgeNode(runtime::Bus& bus, const std::pair<Params, Joints>& machine)
    : params_(machine.first),
      names_(machine.second.names),
      gate_(gate_limits(params_, machine.second)),
      driver_(make_actuators({.params = params_,
                              .joints = machine.second,
                              .stays_powered = holds(params_, machine.second),
                              .graph = bus,
                              .frames = params_.log_frames ? &frames_ : nullptr})),
      stop_inputs_(params_.stop_input, params_.stop_input_unit, params_.stop_input_address, bus),
      command_(bus, "command", {.author = runtime::Author::named, .optional = params_.readonly}),
      hand_command_(
          bus, "hand_command",
          {.author = runtime::Author::named, .optional = params_.readonly || params_.hand.empty()}),
      emergency_stop_(bus, "emergency_stop", {.optional = true}),
      joint_states_(bus, "joint_states"),
      hand_(bus, "hand"),
      joints_(bus, "joints"),
      status_(bus, "status", {.latched = true}),
      can_(bus, "can") {
  params_.rate_hz = machine.second.rate_hz;
  serve(bus);
  if (params_.hand.empty() || params_.readonly) return;
  hand_reading_.fault = "not connected yet";
  hand_driver_ = std::make_unique<outside::RecordedHand>(
      params_.hand, modbus::load_hand_profile(params_.hand_profile),
      modbus::HandDriver::Options{
          .threaded = !bus.lockstep(),
          .timeout = bus.lockstep() ? kHandTimeoutLockstep : milliseconds(0)},
      bus);
}

void BridgeNode::serve(runtime::Bus& bus) {
  const auto offer = [&](const char* name, auto act) {
    bus.serve(name, google::protobuf::Empty::default_instance(),
              v1::BridgeStatus::default_instance(),
              [this, act](const std::string&) -> tl::expected<std::string, Status> {
                if (const std::string why = act(); !why.empty()) return tl::unexpected(Status{why});
                v1::BridgeStatus answer = status_message_;
                answer.set_enabled(gate_.enabled());
                answer.set_reason(gate_.reason());
                return answer.SerializeAsString();
              });
  };
  const auto readonly = [this] { return params_.readonly ? "read-only: sends nothing" : ""; };
  offer("enable", [this, readonly]() -> std::string {
    if (reading_ == nullptr) return "no step yet";
    return params_.readonly ? readonly() : gate_.enable(*reading_);
  });
  offer("disable", [this]() -> std::string {
    gate_.disable("service bridge/disable");
    return {};
  });
  // Ends an emergency stop, and takes drives out of their faults.
  offer("reset", [this, readonly]() -> std::string {
    if (params_.readonly) return readonly();
    if (!stop_demanded_.empty()) return "the emergency stop is still demanded: " + stop_demanded_;
    const bool failed = reading_ != nullptr && reading_->phase == Phase::fault;
    if (failed || !gate_.stopped()) {
      if (std::string why = driver_->reset_faults(); !why.empty()) return why;
      if (failed) runtime::info("joints: the drives' faults are being reset");
    }
    if (gate_.stopped()) gate_.release();
    return {};
  });
}

/// Emergency stops: by drives' inputs and a circuit as long as they are open, by signal and topic
/// once.
void BridgeNode::take_stops(const Reading& arm) {
  stop_demanded_ = stop_inputs_.demanded();
  if (stop_demanded_.empty()) stop_demanded_ = arm.emergency;
  if (!stop_demanded_.empty()) gate_.emergency_stop(stop_demanded_);
  if (const v1::EmergencyStop* stop = emergency_stop_.take())
    gate_.emergency_stop(stop->reason().empty() ? "topic emergency_stop" : stop->reason());
}

void BridgeNode::publish_frames(runtime::Time now) {
  frames_.take([&](const std::string& bus, const can::Frame& frame) {
    const bool fd = frame.length > 8 || (frame.flags & can::kFd) != 0;
    const bool remote = (frame.id & can::kRemoteFlag) != 0;
    const bool extended = (frame.id & can::kExtendedFlag) != 0;
    const bool error = (frame.id & can::kErrorFlag) != 0;
    v1::CanFrame message;
    message.set_bus(bus);
    message.set_id(frame.id & (extended || error ? 0x1FFFFFFF : 0x7FF));
    message.set_extended(extended);
    message.set_remote(remote);
    message.set_error(error);
    message.set_fd(fd);
    message.set_fd_flags(fd ? frame.flags & 3u : 0u);
    message.set_remote_length(remote ? frame.length : 0u);
    if (!remote) message.set_data(frame.data.data(), frame.length);
    can_.send(message, now);
  });
}

void BridgeNode::take_command(runtime::Time now, const Reading& arm) {
  const v1::JointCommand* command = command_.take();
  if (command == nullptr) return;
  const auto& q = command->position_rad();
  ahead_.assign(command->ahead_rad().begin(), command->ahead_rad().end());
  const std::string refusal = gate_.offer(
      now, command_.stamp(), std::span(q.data(), static_cast<std::size_t>(q.size())), arm, ahead_);
  if (!refusal.empty() && refusals_.pass()) runtime::warn("command refused: {}", refusal);
}

void BridgeNode::step_hand(runtime::Time now) {
  if (const v1::HandCommand* c = hand_command_.take()) {
    hand_setpoint_.move = true;
    if (c->grip() == v1::GRIP_PRECISION) hand_setpoint_.mode = modbus::HandMode::pinch;
    if (c->grip() == v1::GRIP_FULL) hand_setpoint_.mode = modbus::HandMode::basic;
    hand_setpoint_.closure = c->closure();
    hand_setpoint_.force = c->force();
  }
  if (gate_.stopped()) hand_setpoint_.move = false;  // it stands still and keeps its object
  if (!hand_driver_ || steps_ % every(params_.rate_hz, kHandRateHz) != 0) return;
  const std::string before = hand_reading_.fault;
  const bool was_active = hand_reading_.active;
  hand_reading_ = hand_driver_->exchange(now, hand_setpoint_);
  if (hand_reading_.fault != before && !hand_reading_.fault.empty())
    runtime::warn("hand: {}", hand_reading_.fault);
  if (hand_reading_.active && !was_active) runtime::info("hand: well");
  if (params_.on_hand_fault == "stop" && was_active && !hand_reading_.fault.empty())
    gate_.emergency_stop("hand: " + hand_reading_.fault);
  v1::HandState state;
  state.set_grip(hand_reading_.mode == modbus::HandMode::pinch   ? v1::GRIP_PRECISION
                 : hand_reading_.mode == modbus::HandMode::basic ? v1::GRIP_FULL
                                                                 : v1::GRIP_UNSPECIFIED);
  state.set_closure(hand_reading_.closure);
  state.set_moving(hand_reading_.moving);
  state.set_object_detected(hand_reading_.object_detected);
  state.set_active(hand_reading_.active);
  state.set_fault(hand_reading_.fault);
  hand_.send(state, now);
}

void BridgeNode::publish_joint_states(runtime::Time now, const Reading& arm) {
  if (!arm.posture_known) return;  // zeros would be a posture
  joint_states_message_.Clear();
  for (const JointReading& joint : arm.joints) {
    joint_states_message_.add_position_rad(joint.position_rad);
    joint_states_message_.add_velocity_rad_s(joint.velocity_rad_s);
    joint_states_message_.add_torque_n_m(joint.torque_n_m);
    joint_states_message_.add_drives(static_cast<v1::DriveState>(joint.drive));
  }
  joint_states_message_.set_operational(arm.phase == Phase::following);
  joint_states_message_.set_fault(arm.phase == Phase::fault ? arm.reason : "");
  joint_states_.send(joint_states_message_, now);

  if (steps_ % every(params_.rate_hz, kJointsRateHz) != 0) return;
  foxglove::JointStates states;
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    auto* state = states.add_joints();
    state->set_name(names_[i]);
    state->set_position(arm.joints[i].position_rad);
    state->set_velocity(arm.joints[i].velocity_rad_s);
    state->set_effort(arm.joints[i].torque_n_m);
  }
  joints_.send(states, now);
}

void BridgeNode::publish_status(runtime::Time now, const Reading& arm) {
  const std::string& reason = arm.reason.empty() ? gate_.reason() : arm.reason;
  const bool changed = status_message_.state() != name(arm.phase) ||
                       status_message_.reason() != reason ||
                       status_message_.enabled() != gate_.enabled();
  if (!changed && now < status_due_) return;
  if (changed) {
    const std::string line =
        "joints: " + std::string(name(arm.phase)) + (reason.empty() ? "" : ": " + reason);
    runtime::log(arm.phase == Phase::fault ? runtime::Level::warn : runtime::Level::info, line);
  }
  status_due_ = now + kStatusPeriod;
  const Traffic can = driver_->traffic();
  status_message_.set_state(name(arm.phase));
  status_message_.set_reason(reason);
  status_message_.set_can_frames_sent(can.sent);
  status_message_.set_can_frames_received(can.received);
  status_message_.set_can_errors(can.errors);
  status_message_.set_modbus_transactions(hand_reading_.transactions);
  status_message_.set_modbus_errors(hand_reading_.errors);
  status_message_.set_commands_limited(arm.limited);
  status_message_.set_enabled(gate_.enabled());
  status_.send(status_message_, now);
}

void BridgeNode::step(runtime::Time now) {
  const Reading& arm = driver_->read(now);
  reading_ = &arm;
  take_stops(arm);
  take_command(now, arm);
  driver_->write(now, gate_.decide(now, arm));
  step_hand(now);
  publish_joint_states(now, arm);
  publish_status(now, arm);
  publish_frames(now);
  ++steps_;
}

void BridgeNode::stop(runtime::Time) noexcept {
  driver_->stop();
  if (hand_driver_) hand_driver_->stop();
}

}  // namespace mimesis::hw::bridge
