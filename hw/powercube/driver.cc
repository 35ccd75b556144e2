#include "hw/powercube/driver.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/error.h"
#include "common/time.h"

namespace mimesis::hw::powercube {
namespace {

constexpr Time kAnswerTimeout = std::chrono::milliseconds(100);
constexpr int kAttempts = 3;
constexpr int kSetupSteps =
    8;  // state, four limits, following error, watchdog on, watchdog read back

const char* step_name(int step) {
  constexpr std::array kNames{"state (27)",
                              "least position (45)",
                              "largest position (46)",
                              "largest velocity (48)",
                              "largest acceleration (4A)",
                              "configuration (39)",
                              "watchdog (39)",
                              "watchdog (39)"};
  return kNames.at(static_cast<std::size_t>(step));
}

}  // namespace

Driver::Driver(DriverOptions options, std::unique_ptr<can::Bus> bus)
    : PhasedActuators(options.limits, options.rate_hz, "searching the modules"),
      options_(std::move(options)),
      bus_(std::move(bus)),
      inbox_(128),
      posture_(options_.axes.size(), 0.0) {
  for (std::size_t i = 0; i < options_.axes.size(); ++i) {
    const cia402::Axis& axis = options_.axes[i];
    if (axis.node_id > kLastModule)
      throw ConfigError(fmt::format("axes[{}].node_id: {} is no module, expected 1 to {}", i,
                                    axis.node_id, kLastModule));
    const std::string name =
        options_.names.empty() ? "A" + std::to_string(i + 1) : options_.names[i];
    modules_.push_back({.name = fmt::format("{} (module {})", name, axis.node_id), .axis = axis});
  }
  outbox_.reserve(modules_.size() + 4);
  std::vector<can::Wanted> wanted;  // answers
  for (const Module& module : modules_)
    wanted.push_back({0x0A0u + static_cast<std::uint32_t>(module.axis.node_id), 0x7FF});
  bus_->want(wanted);
  stop();
}

void Driver::stop() noexcept {
  if (options_.readonly) return;
  try {
    bus_->send(std::array{to_all(Command::halt)});
  } catch (...) {  // the modules' watchdogs are left
  }
  leave_motion();
}

std::string Driver::trouble_of(const Module& module) const {
  const std::pair<std::uint32_t, const char*> words[] = {
      {state::kFollowingError, "following error"},
      {state::kPowerFault, "power fault"},
      {state::kCommunication, "lost its watchdog's refresh"},
      {state::kError, "error"}};
  for (const auto& [bit, text] : words) {
    if ((module.state & bit) != 0)
      return fmt::format("{}: {} (state 0x{:08X})", module.name, text, module.state);
  }
  if ((module.state & state::kHomeOk) == 0)
    return fmt::format("{}: is not homed (state 0x{:08X})", module.name, module.state);
  return {};
}

void Driver::take(Module& module, JointReading& joint, const Answer& answer) {
  module.heard = now_;
  const auto move = [&](float position) {
    if (!std::isfinite(position)) return;
    const double q = module.axis.sign * static_cast<double>(position) + module.axis.offset_rad;
    if (module.known) joint.velocity_rad_s = (q - joint.position_rad) * options_.rate_hz;
    joint.position_rad = q;
    module.known = true;
  };
  if (answer.command == Command::set_motion) {
    module.not_ok = (answer.short_state & kNotOk) != 0;
    return move(answer.position);
  }
  const auto parameter = static_cast<Parameter>(answer.parameter);
  if (answer.command == Command::get_parameter) {
    if (parameter == Parameter::state) module.state = answer.value;
    if (parameter == Parameter::config) module.config = answer.value;
    if (parameter == Parameter::position) move(answer.position);
  }
  if (module.step == kSetupSteps || !module.waits) return;
  const can::Frame asked = request(module, static_cast<std::size_t>(&module - modules_.data()));
  const bool ours = asked.data[0] == static_cast<std::uint8_t>(answer.command) &&
                    asked.data[1] == answer.parameter;
  if (!ours) return;
  module.waits = false;
  module.attempts = 0;
  if (module.step == kSetupSteps - 1 && (module.config & kWatchdogEnabled) == 0)
    return fault(module.name + ": has not kept its watchdog on (39)");
  ++module.step;
}

void Driver::receive() {
  std::size_t count = 0;
  do {
    count = bus_->receive(inbox_);
    for (const can::Frame& frame : std::span(inbox_).first(count)) {
      if (const char* trouble = can::trouble(frame)) {
        fault(std::string("the CAN controller is ") + trouble);
        configured_ = false;
        for (Module& module : modules_) module.step = 0;
      }
      const auto answer = parse_answer(frame);
      if (!answer) continue;
      for (std::size_t i = 0; i < modules_.size(); ++i) {
        if (modules_[i].axis.node_id == answer->module)
          take(modules_[i], reading_.joints[i], *answer);
      }
    }
  } while (count == inbox_.size());
}

can::Frame Driver::request(const Module& module, std::size_t joint) const {
  const auto k = static_cast<Eigen::Index>(joint);
  const JointLimits& l = options_.limits;
  const int id = module.axis.node_id;
  const auto raw = [&](double q) { return module.axis.sign * (q - module.axis.offset_rad); };
  const auto [low, high] = std::minmax({raw(l.q_min[k]), raw(l.q_max[k])});
  switch (module.step) {
    case 0:
      return get(id, Parameter::state);
    case 1:
      return set(id, Parameter::min_position, static_cast<float>(low));
    case 2:
      return set(id, Parameter::max_position, static_cast<float>(high));
    case 3:
      return set(id, Parameter::max_velocity, static_cast<float>(l.v_max[k]));
    case 4:
      return set(id, Parameter::max_acceleration, static_cast<float>(l.a_max[k]));
    case 6:
      return set(id, Parameter::config, module.config | kWatchdogEnabled);
    default:
      return get(id, Parameter::config);
  }
}

void Driver::set_up(std::vector<can::Frame>& out) {
  std::string missing;
  bool all = true;
  for (std::size_t i = 0; i < modules_.size(); ++i) {
    Module& module = modules_[i];
    if (module.step == kSetupSteps) continue;
    all = false;
    if (module.step == 0) missing += (missing.empty() ? "" : ", ") + module.name;
    if (module.waits && now_ - module.asked < kAnswerTimeout) continue;
    if (module.waits && module.step > 0 && ++module.attempts == kAttempts) {
      fault(module.name + ": no answer to " + step_name(module.step));
      module.step = module.attempts = 0;
    }
    module.waits = true;
    module.asked = now_;
    out.push_back(request(module, i));
  }
  if (all) {
    configured_ = true;
    for (Module& module : modules_) module.heard = now_;
    enter(Phase::idle);
  } else if (!missing.empty() && now_ - entered_ > from_seconds(options_.boot_timeout_s)) {
    fault(fmt::format("no answer within {:.3g} s from {}", options_.boot_timeout_s, missing));
  }
}

void Driver::supervise() {
  for (Module& module : modules_) {
    if (now_ - module.heard > from_seconds(options_.feedback_timeout_s)) {
      fault(fmt::format("{}: no answer for {:.3g} s", module.name, options_.feedback_timeout_s));
      module.step = 0;
      module.known = false;
      configured_ = false;
      continue;
    }
    if (!module.known || now_ < forgiven_until_) continue;
    if (const std::string why = trouble_of(module); !why.empty()) fault(why);
  }
  const auto free = [](const Module& m) { return (m.state & state::kHalted) == 0 && !m.not_ok; };
  const bool still = std::ranges::none_of(
      modules_, [](const Module& m) { return (m.state & state::kMotion) != 0; });
  switch (reading_.phase) {
    case Phase::enabling:
      if (std::ranges::all_of(modules_, free)) {
        for (std::size_t i = 0; i < posture_.size(); ++i)
          posture_[i] = reading_.joints[i].position_rad;
        limiter_.reset(posture_);
        enter(Phase::following);
      } else if (now_ - entered_ > std::chrono::seconds(1)) {
        const auto stuck = std::ranges::find_if_not(modules_, free);
        fault(fmt::format("{}: expected free, is halted (state 0x{:08X})", stuck->name,
                          stuck->state));
      }
      return;
    case Phase::following:
      for (const Module& module : modules_) {
        if (!free(module))
          fault(fmt::format("{}: expected free, is halted (state 0x{:08X})", module.name,
                            module.state));
      }
      return;
    case Phase::stopping:
      if (still && now_ - entered_ > kAnswerTimeout) enter(Phase::idle);
      return;
    default:
      return;
  }
}

const Reading& Driver::read(Time now) {
  now_ = now;
  if (!std::exchange(begun_, true)) entered_ = now;
  receive();
  if (configured_) supervise();
  reading_.posture_known = std::ranges::all_of(modules_, &Module::known);
  for (std::size_t i = 0; i < modules_.size(); ++i) {
    const Module& m = modules_[i];
    const bool failed = (m.state & (state::kError | state::kFollowingError)) != 0;
    reading_.joints[i].drive = !m.known                          ? DriveState::unknown
                               : failed                          ? DriveState::fault
                               : (m.state & state::kHalted) != 0 ? DriveState::switch_on_disabled
                                                                 : DriveState::operation_enabled;
  }
  return reading_;
}

/// Position and state in turn: an answer carries one of them.
void Driver::ask_all(bool state) {
  for (const Module& module : modules_)
    outbox_.push_back(get(module.axis.node_id, state ? Parameter::state : Parameter::position));
}

void Driver::write(Time now, const Setpoint& setpoint) {
  now_ = now;
  if (options_.readonly) return;
  outbox_.clear();
  const Phase before = reading_.phase;
  obey(setpoint, configured_ && before == Phase::idle);
  if (reading_.phase == Phase::enabling && before != Phase::enabling) {
    for (Module& module : modules_) module.not_ok = false;
  }
  ++cycles_;
  if (!configured_) {
    outbox_.push_back(to_all(Command::halt));
    set_up(outbox_);
  } else if (reading_.phase == Phase::following) {
    const auto time_ms = static_cast<std::uint16_t>(std::lround(1e3 / options_.rate_hz));
    for (std::size_t i = 0; i < modules_.size(); ++i) {
      const cia402::Axis& axis = modules_[i].axis;
      const double q = limiter_.position()[static_cast<Eigen::Index>(i)];
      outbox_.push_back(
          step(axis.node_id, static_cast<float>(axis.sign * (q - axis.offset_rad)), time_ms));
    }
    if (cycles_ % 4 == 0) ask_all(true);  // what the short state only hints at
  } else {
    outbox_.push_back(to_all(reading_.phase == Phase::enabling ? Command::reset : Command::halt));
    ask_all(cycles_ % 2 == 0);
  }
  outbox_.push_back(to_all(Command::watchdog));
  bus_->send(outbox_);
}

std::string Driver::reset_faults() {
  if (reading_.phase != Phase::fault) return "there is no fault";
  if (!configured_) return "modules are missing: " + reading_.reason;
  bus_->send(std::array{to_all(Command::reset), to_all(Command::halt)});
  forgiven_until_ = now_ + kAnswerTimeout;
  enter(Phase::idle);
  return {};
}

}  // namespace mimesis::hw::powercube
