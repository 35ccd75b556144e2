#include "hw/bridge/command_gate.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "common/time.h"

namespace mimesis::hw::bridge {
namespace {

constexpr const char* kNotEnabled = "not enabled (service bridge/enable)";

}  // namespace

CommandGate::CommandGate(GateLimits limits)
    : limits_(std::move(limits)),
      command_(limits_.v_max_rad_s.size(), 0.0),
      track_(limits_.cycle, limits_.v_max_rad_s, limits_.a_max_rad_s2),
      enabled_(limits_.enables_itself),
      reason_(enabled_ ? "no command yet" : kNotEnabled) {}

std::string CommandGate::enable(const Reading& arm) {
  if (enabled_) return {};
  if (stopped()) return emergency_ + ": bridge/reset ends it, once it is released";
  if (arm.phase == Phase::fault || arm.phase == Phase::starting) return arm.reason;
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    const DriveState state = arm.joints[i].drive;
    const bool ready = arm.posture_known && state != DriveState::unknown &&
                       state != DriveState::fault && state != DriveState::fault_reaction_active;
    if (!ready) {
      return fmt::format("{}: expected a drive without fault whose position is known, is {}",
                         name_of(i), text(arm.joints[i]));
    }
  }
  enabled_ = true;
  reason_ = "enabled: no command yet";
  return {};
}

/// The stream ends here and now; of those that go on none is obeyed.
void CommandGate::close(const std::string& why) {
  needs_silence_ = needs_silence_ || open_;
  open_ = ending_ = false;
  rest_ = Mode::idle;
  reason_ = why;
}

void CommandGate::disable(const std::string& why) {
  enabled_ = false;
  close("disabled: " + why);
}

void CommandGate::emergency_stop(const std::string& why) {
  if (stopped()) return;  // the first cause counts
  emergency_ = "emergency stop: " + why;
  enabled_ = false;
  close(emergency_);
}

void CommandGate::release() {
  emergency_.clear();
  enabled_ = limits_.enables_itself;
  needs_silence_ = true;
  reason_ = "ready after an emergency stop";
}

std::string CommandGate::name_of(std::size_t joint) const {
  return limits_.names.empty() ? "A" + std::to_string(joint + 1) : limits_.names[joint];
}

/// The way ahead has a wrong size, or a step that no joint could make.
bool CommandGate::runs_wild(std::span<const double> position_rad,
                            std::span<const double> ahead) const {
  const std::size_t n = position_rad.size();
  for (std::size_t k = 0; k < ahead.size(); ++k) {
    const double from = k < n ? position_rad[k] : ahead[k - n];
    const double allowed = 2.0 * limits_.v_max_rad_s[k % n] * to_seconds(limits_.cycle);
    if (!(std::abs(ahead[k] - from) <= allowed)) return true;
  }
  return ahead.size() % n != 0;
}

std::string CommandGate::why_not(Time now, Time stamp, std::span<const double> position_rad,
                                 const Reading& arm, std::span<const double> ahead) const {
  if (position_rad.size() != command_.size()) {
    return fmt::format("command for {} joints, the arm has {}", position_rad.size(),
                       command_.size());
  }
  if (stopped()) return emergency_;
  if (!enabled_) return kNotEnabled;
  if (!std::ranges::all_of(position_rad, [](double q) { return std::isfinite(q); })) {
    return "command holds a position that is not a finite number";
  }
  if (runs_wild(position_rad, ahead)) {
    return fmt::format("the way ahead of the command is no motion of {} joints", command_.size());
  }
  if (ending_) return "the stream has ended; the arm comes to rest";
  if (now - stamp > limits_.silence)
    return fmt::format("command is {:.3f} s old", to_seconds(now - stamp));
  if (stamp - now > limits_.hold_after) {
    return fmt::format("command is stamped {:.3f} s ahead of the bridge's clock",
                       to_seconds(stamp - now));
  }
  if (needs_silence_) {
    return fmt::format(
        "after a fault a new stream is needed: one that comes after {:.3g} s of silence",
        to_seconds(limits_.silence));
  }
  if (!arm.posture_known) return "the arm's posture is not known yet";
  for (std::size_t i = 0; i < command_.size(); ++i) {
    const double from = open_ ? command_[i] : arm.joints[i].position_rad;
    const double elapsed =
        open_ ? std::max(0.0, to_seconds(std::min(stamp, now) - accepted_)) : 0.0;
    const double allowed =
        open_ ? limits_.jump_rad + limits_.v_max_rad_s[i] * elapsed : limits_.start_tolerance_rad;
    const double distance = std::abs(position_rad[i] - from);
    if (distance > allowed) {
      return fmt::format("{} {:.3f} rad{}, allowed are {:.3f}; the drive is {}",
                         name_of(i) + (open_ ? " jumps by" : " starts"), distance,
                         open_ ? "" : " from its actual position", allowed, text(arm.joints[i]));
    }
  }
  return {};
}

std::string CommandGate::offer(Time now, Time stamp, std::span<const double> position_rad,
                               const Reading& arm, std::span<const double> ahead) {
  std::string refusal = why_not(now, stamp, position_rad, arm, ahead);
  // Silence counts from a time that has passed, whatever the sender's clock says.
  const Time sent = std::min(stamp, now);
  heard_ = std::max(heard_, sent);
  if (!refusal.empty()) {
    if (!open_) reason_ = refusal;
    return refusal;
  }
  std::ranges::copy(position_rad, command_.begin());
  open_ ? track_.add(sent, position_rad, ahead) : track_.begin(sent, position_rad, ahead);
  accepted_ = sent;
  open_ = true;
  return {};
}

/// Cycles left out since the last one, as far as the drives went on without them.
int CommandGate::missed(Time now) {
  const Time since = now - decided_.value_or(now);
  decided_ = now;
  const auto cycles = (since + limits_.cycle / 2) / limits_.cycle;
  return static_cast<int>(std::clamp<Time::rep>(cycles - 1, 0, limits_.extrapolated_cycles));
}

Setpoint CommandGate::decide(Time now, const Reading& arm) {
  const int missed = this->missed(now);
  if (needs_silence_ && now - heard_ > limits_.silence) {
    needs_silence_ = false;
    reason_ = "ready for a new stream";
  }
  if (arm.phase == Phase::fault) {
    if (open_) close(arm.reason);
    rest_ = Mode::idle;
    enabled_ = limits_.enables_itself && !stopped();
  }
  if (!open_) return {.mode = rest_};
  const Time age = now - accepted_;
  if (age > limits_.silence) {
    ending_ = track_.can_brake() && !track_.at_rest() && age <= limits_.silence + kLongestStop;
    if (ending_) return follow(missed, true);
    open_ = false;
    rest_ = limits_.hold_on_silence ? Mode::hold : Mode::idle;
    reason_ = fmt::format("no command for {:.3g} s{}", to_seconds(limits_.silence),
                          limits_.hold_on_silence ? ": holding" : "");
    return {.mode = rest_};
  }
  const bool late = age > (track_.can_brake() ? std::max(limits_.brake_after, limits_.hold_after)
                                              : limits_.hold_after);
  reason_ = late ? "command is late: holding" : "";
  if (late && !track_.can_brake()) return {.mode = Mode::hold, .missed = missed};
  return follow(missed, late);
}

Setpoint CommandGate::follow(int missed, bool brake) {
  track_.coast(missed);
  return {.mode = Mode::follow,
          .position_rad = track_.advance(brake),
          .missed = missed,
          .brakes = brake};
}

}  // namespace mimesis::hw::bridge
