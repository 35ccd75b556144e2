#include "hw/sim/powercube/module.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/time.h"

namespace mimesis::hw::sim {
namespace {

// State bits, identifiers and parameters as the protocol numbers them.
constexpr std::uint32_t kErrorBit = 0x1, kHomedBit = 0x2, kHaltedBit = 0x4, kTowBit = 0x10,
                        kCommBit = 0x20, kMotionBit = 0x800;
constexpr double kLargestLag = 0.05;  // [rad]

std::uint32_t as_bits(double value) {
  return std::bit_cast<std::uint32_t>(static_cast<float>(value));
}
double as_float(std::uint32_t bits) { return static_cast<double>(std::bit_cast<float>(bits)); }

std::uint32_t word(const can::Frame& f, std::size_t at) {
  return std::uint32_t{f.data[at]} | std::uint32_t{f.data[at + 1]} << 8 |
         std::uint32_t{f.data[at + 2]} << 16 | std::uint32_t{f.data[at + 3]} << 24;
}

}  // namespace

Module::Module(const ModuleConfig& config)
    : config_(config),
      parameters_{{0x39, 0},
                  {0x40, as_bits(kLargestLag)},
                  {0x45, as_bits(-3.0)},
                  {0x46, as_bits(3.0)},
                  {0x48, as_bits(config.v_max_rad_s)},
                  {0x4A, as_bits(config.deceleration_rad_s2)}},
      position_(config.position_rad),
      target_(config.position_rad),
      flags_(kHaltedBit),
      homed_(config.homed) {}

std::uint32_t Module::state() const {
  return flags_ | (homed_ ? kHomedBit : 0) | (velocity_ != 0.0 ? kMotionBit : 0);
}

void Module::halt(std::uint32_t because) {
  flags_ |= kHaltedBit | because;
  left_s_ = 0.0;
}

void Module::advance(Time now) {
  const double dt = now_ ? to_seconds(std::max(now - *now_, Time(0))) : 0.0;
  now_ = now;
  const bool watched = (parameters_[0x39] >> 24 & 1u) != 0;
  if (watched && refreshed_ && now - *refreshed_ > config_.watchdog && (flags_ & kHaltedBit) == 0)
    halt(kErrorBit | kCommBit);
  if (jammed_ && left_s_ > 0.0) {
    target_ += rate_ * dt;
    if (std::abs(target_ - position_) > as_float(parameters_[0x40])) halt(kErrorBit | kTowBit);
    velocity_ = 0.0;
    return;
  }
  if ((flags_ & kHaltedBit) != 0) {  // brakes on its ramp
    const double slowing = std::min(std::abs(velocity_), config_.deceleration_rad_s2 * dt);
    const double before = velocity_;
    velocity_ -= std::copysign(slowing, velocity_);
    position_ += 0.5 * (before + velocity_) * dt;
    target_ = position_;
    return;
  }
  const double moving_s = std::min(dt, left_s_);
  position_ += rate_ * moving_s;
  left_s_ -= moving_s;
  velocity_ = left_s_ > 1e-9 || moving_s > 0.0 ? rate_ : 0.0;
}

void Module::handle(const can::Frame& frame, std::vector<can::Frame>& out) {
  if (silent_ || frame.length == 0) return;
  const std::uint32_t id = static_cast<std::uint32_t>(config_.module);
  if (frame.id == 0x100) {  // to all: no answer
    if (frame.data[0] == 0x00) flags_ = 0;
    if (frame.data[0] == 0x02) halt();
    if (frame.data[0] == 0x07) refreshed_ = now_;
    return;
  }
  if (frame.id == 0x0E0 + id) return command(frame, out);
  if (frame.id != 0x0C0 + id || frame.length < 2 || frame.data[0] != 0x0A) return;
  const std::uint8_t parameter = frame.data[1];
  const auto found = parameters_.find(parameter);
  const std::uint32_t value = parameter == 0x27            ? state()
                              : parameter == 0x3C          ? as_bits(position_)
                              : parameter == 0x41          ? as_bits(velocity_)
                              : found != parameters_.end() ? found->second
                                                           : 0;
  can::Frame f{.id = 0x0A0 + id, .length = 6, .data = {0x0A, parameter}};
  for (std::size_t i = 0; i < 4; ++i) f.data[2 + i] = static_cast<std::uint8_t>(value >> 8 * i);
  out.push_back(f);
}

void Module::command(const can::Frame& frame, std::vector<can::Frame>& out) {
  constexpr std::uint8_t kDone = 0x64;
  can::Frame f{.id = 0x0A0u + static_cast<std::uint32_t>(config_.module),
               .length = 2,
               .data = {frame.data[0], kDone}};
  switch (frame.data[0]) {
    case 0x00:
      flags_ = 0;
      break;
    case 0x01:
      homed_ = true;
      break;
    case 0x02:
      halt();
      break;
    case 0x08: {
      if (frame.length < 6) return;
      const auto found = parameters_.find(frame.data[1]);
      if (found == parameters_.end()) return;
      found->second = word(frame, 2);
      f = {.id = f.id, .length = 3, .data = {0x08, frame.data[1], kDone}};
      break;
    }
    case 0x0B: {  // of the motions only steps with an extended answer
      if (frame.length < 8 || frame.data[1] != 0x10) return;
      const double wanted = as_float(word(frame, 2));
      const int time_ms = frame.data[6] | frame.data[7] << 8;
      const bool free = homed_ && (flags_ & (kHaltedBit | kErrorBit)) == 0;
      if (free && std::isfinite(wanted) && time_ms > 0) {
        left_s_ = 1e-3 * time_ms;
        const double most = as_float(parameters_[0x48]);
        const double end =
            std::clamp(wanted, as_float(parameters_[0x45]), as_float(parameters_[0x46]));
        rate_ = std::clamp((end - position_) / left_s_, -most, most);
        if (!jammed_) target_ = end;
      }
      const std::uint32_t position = as_bits(position_);
      f = {.id = f.id, .length = 8, .data = {0x0B, 0x10}};
      for (std::size_t i = 0; i < 4; ++i)
        f.data[2 + i] = static_cast<std::uint8_t>(position >> 8 * i);
      f.data[6] = static_cast<std::uint8_t>((free ? 0 : 1) | (velocity_ != 0.0 ? 0x10 : 0));
      break;
    }
    default:
      return;
  }
  out.push_back(f);
}

}  // namespace mimesis::hw::sim
