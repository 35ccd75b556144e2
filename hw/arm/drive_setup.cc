#include "hw/arm/drive_setup.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mimesis::hw::arm {
namespace {

using Kind = SetupStep::Kind;
constexpr std::uint32_t kPdoInvalid = 0x80000000;
constexpr std::uint32_t kSynchronous = 1;  // transmission type: with every SYNC

std::uint32_t bits(std::int32_t value) { return static_cast<std::uint32_t>(value); }

/// Mapping entry: index, sub-index, length in bits.
std::uint32_t entry(Object object, int bytes) {
  return std::uint32_t{object.index} << 16 | std::uint32_t{object.sub} << 8 |
         static_cast<std::uint32_t>(8 * bytes);
}

/// Remaps a PDO: invalidate, clear, map, count, validate [CiA 301, 7.5.2.36].
void remap(std::vector<SetupStep>& steps, std::uint16_t communication, std::uint32_t cob,
           const std::vector<std::uint32_t>& entries) {
  const auto mapping = static_cast<std::uint16_t>(communication + 0x200);
  steps.push_back({Kind::write, {communication, 1}, cob | kPdoInvalid, 4, "PDO off"});
  steps.push_back({Kind::write, {mapping, 0}, 0, 1, "PDO mapping cleared"});
  std::uint8_t i = 0;
  for (const std::uint32_t e : entries) {
    steps.push_back({Kind::write, {mapping, ++i}, e, 4, "PDO mapping"});
  }
  steps.push_back({Kind::write_checked, {mapping, 0}, i, 1, "PDO mapping"});
  steps.push_back({Kind::write, {communication, 2}, kSynchronous, 1, "PDO on SYNC"});
  steps.push_back({Kind::write, {communication, 1}, cob, 4, "PDO on"});
}

}  // namespace

Period period_of(double rate_hz) {
  for (const int exponent : {-3, -4}) {
    const double value = std::pow(10.0, -exponent) / rate_hz;
    const double whole = std::round(value);
    if (whole >= 1.0 && whole <= 255.0 && std::abs(value - whole) < 1e-6) {
      return {static_cast<std::uint8_t>(whole), static_cast<std::int8_t>(exponent)};
    }
  }
  throw ConfigError(
      "rate_hz: " + std::to_string(rate_hz) +
      " gives no interpolation period in whole 0.1 ms up to 25.5 ms or ms up to 255 ms");
}

std::vector<SetupStep> setup_steps(const Axis& axis, double q_min, double q_max, double v_max,
                                   double a_max, Period period, QuickStop quick_stop) {
  const auto node = static_cast<std::uint32_t>(axis.node_id);
  const auto [low, high] = std::minmax({axis.to_increments(q_min), axis.to_increments(q_max)});
  const auto magnitude = [&](double rad) { return bits(std::abs(axis.to_increments(rad))); };
  const std::uint32_t master = std::uint32_t{kMasterNode} << 16 | kMasterHeartbeatTimeoutMs;
  std::vector<SetupStep> steps = {
      {Kind::expect, object::kDeviceType, 402, 4, "a drive of profile 402", 0xFFFF},
      {Kind::expect, object::kSupportedModes, 1u << (kCyclicSynchronousPosition - 1), 4,
       "cyclic synchronous position", 1u << (kCyclicSynchronousPosition - 1)},
      {Kind::expect_least, object::kMaxVelocity, magnitude(v_max), 4, "the robot's velocity limit"},
      {Kind::write_checked, object::kPositionMin, bits(low), 4, "position limit"},
      {Kind::write_checked, object::kPositionMax, bits(high), 4, "position limit"},
      {Kind::write_checked, object::kQuickStopDeceleration, magnitude(a_max), 4, "deceleration"},
      {Kind::write_checked, object::kQuickStopOption, static_cast<std::uint32_t>(quick_stop), 2,
       quick_stop == QuickStop::disables ? "quick stop by ramp, then disable"
                                         : "quick stop by ramp, then stay powered"},
      {Kind::write_checked, object::kAbortOption, 3, 2, "quick stop when the connection is lost"},
      {Kind::write_checked, object::kMasterHeartbeat, master, 4, "watch over our heartbeat"},
      {Kind::write_checked, object::kHeartbeatTime, kDriveHeartbeatMs, 2, "the drive's heartbeat"},
      {Kind::write_checked, object::kPeriodValue, period.value, 1, "interpolation period"},
      {Kind::write_checked, object::kPeriodExponent, static_cast<std::uint8_t>(period.exponent), 1,
       "interpolation period"},
      {Kind::write, object::kMode, kCyclicSynchronousPosition, 1, "cyclic synchronous position"},
      {Kind::expect, object::kModeDisplay, kCyclicSynchronousPosition, 1,
       "cyclic synchronous position", 0xFF},
  };
  remap(steps, 0x1400, 0x200 + node, {entry(object::kControlword, 2), entry(object::kTarget, 4)});
  steps.push_back({Kind::write_checked, object::kRpdo1Deadline, kRpdoDeadlineMs, 2,
                   "watch over our set-points"});
  remap(steps, 0x1800, 0x180 + node,
        {entry(object::kStatusword, 2), entry(object::kPosition, 4), entry(object::kTorque, 2)});
  std::vector<std::uint32_t> slower = {entry(object::kVelocity, 4)};
  if (quick_stop == QuickStop::stays_powered) slower.push_back(entry(object::kDemand, 4));
  remap(steps, 0x1801, 0x280 + node, slower);
  return steps;
}

}  // namespace mimesis::hw::arm
