#include "hw/cia402/setup.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "common/error.h"

namespace mimesis::hw::cia402 {
namespace {

using Kind = SetupStep::Kind;
constexpr std::uint32_t kPdoInvalid = 0x80000000;
constexpr std::uint32_t kPdoBits = 0xBFFFFFFF;  // without that for remote requests
constexpr std::uint32_t kSynchronous = 1;       // transmission type: with every SYNC
constexpr const char* kUnimportant = "";

/// Object that the set-points of a mode go to; homing has none.
std::vector<Mapped> target_of(OperationMode mode) {
  switch (mode) {
    case OperationMode::homing:
      return {};
    case OperationMode::cyclic_velocity:
    case OperationMode::profile_velocity:
      return {{object::kTargetVelocity, 4}};
    case OperationMode::cyclic_torque:
      return {{object::kTargetTorque, 2}};
    default:
      return {{object::kTarget, 4}};
  }
}

const char* text(OperationMode mode) {
  switch (mode) {
    case OperationMode::profile_position:
      return "profile position";
    case OperationMode::profile_velocity:
      return "profile velocity";
    case OperationMode::homing:
      return "homing";
    case OperationMode::cyclic_velocity:
      return "cyclic synchronous velocity";
    case OperationMode::cyclic_torque:
      return "cyclic synchronous torque";
    default:
      return "cyclic synchronous position";
  }
}

std::uint32_t bits(std::int32_t value) { return static_cast<std::uint32_t>(value); }

/// Remaps a PDO: invalidate, clear, map, count, validate [CiA 301, 7.5.2.36].
void remap(std::vector<SetupStep>& steps, int pdo, std::uint32_t cob,
           const std::vector<Mapped>& objects) {
  const std::uint16_t communication = kPdoObjects.at(static_cast<std::size_t>(pdo));
  const auto mapping = static_cast<std::uint16_t>(communication + 0x200);
  const auto map = [&](Kind kind, std::uint8_t sub, std::uint32_t value, int bytes) {
    steps.push_back({.kind = kind,
                     .object = {mapping, sub},
                     .value = value,
                     .bytes = bytes,
                     .meaning = "PDO mapping",
                     .pdo = pdo});
  };
  // A drive that does not let it be switched off says with the mapping what follows.
  steps.push_back(
      {Kind::write, {communication, 1}, cob | kPdoInvalid, 4, "PDO off", kPdoBits, kUnimportant});
  map(Kind::write, 0, 0, 1);
  std::uint8_t i = 0;
  for (const Mapped& m : objects) map(Kind::write, ++i, mapping_entry(m), 4);
  map(Kind::write_checked, 0, i, 1);
  steps.push_back({Kind::write, {communication, 2}, kSynchronous, 1, "PDO on SYNC"});
  steps.push_back({Kind::write, {communication, 1}, cob, 4, "PDO on", kPdoBits});
}

}  // namespace

OperationMode stream_mode(const Axis& axis) {
  return axis.mode == "csv"  ? OperationMode::cyclic_velocity
         : axis.mode == "pv" ? OperationMode::profile_velocity
                             : OperationMode::cyclic_position;
}

std::string lack_of(Object object) { return "no_" + text(object).substr(0, 4); }

Mapped mapped(std::uint32_t entry) {
  return {{static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8)},
          static_cast<int>(entry & 0xFF) / 8};
}

std::uint32_t mapping_entry(const Mapped& m) {
  return std::uint32_t{m.object.index} << 16 | std::uint32_t{m.object.sub} << 8 |
         static_cast<std::uint32_t>(8 * m.bytes);
}

PdoMaps maps_of(const std::vector<SetupStep>& steps) {
  PdoMaps maps;
  for (const SetupStep& step : steps) {
    const bool entry = step.pdo >= 0 && step.object.sub > 0;
    if (entry) maps.at(static_cast<std::size_t>(step.pdo)).push_back(mapped(step.value));
  }
  return maps;
}

int bytes_of(const std::vector<Mapped>& map) {
  int bytes = 0;
  for (const Mapped& m : map) bytes += m.bytes;
  return bytes;
}

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

std::vector<SetupStep> setup_steps(const Axis& axis, const JointSetup& joint, Period period,
                                   QuickStop quick_stop) {
  const auto node = static_cast<std::uint32_t>(axis.node_id);
  const auto [low, high] =
      std::minmax({axis.to_increments(joint.q_min), axis.to_increments(joint.q_max)});
  const auto magnitude = [&](double rad) { return bits(std::abs(axis.rate_to_increments(rad))); };
  const std::uint32_t master = std::uint32_t{kMasterNode} << 16 | kMasterHeartbeatTimeoutMs;
  const bool guarded = axis.guarding;
  constexpr const char* kOursAlone = "the bridge alone keeps the position limits";
  constexpr std::uint32_t kAll = 0xFFFFFFFF;
  const std::uint32_t mode_number = static_cast<std::uint8_t>(joint.mode);
  const std::uint32_t mode_bit = 1u << (mode_number - 1);
  const char* const mode = text(joint.mode);
  std::vector<SetupStep> steps = {
      {Kind::expect, object::kDeviceType, 402, 4, "a drive of profile 402", 0xFFFF},
      {Kind::expect, object::kSupportedModes, mode_bit, 4, mode, mode_bit, kUnimportant},
      {Kind::expect_least, object::kMaxVelocity, magnitude(joint.v_max), 4,
       "the robot's velocity limit", kAll, "how fast it can turn is not known"},
      {Kind::write_checked, object::kPositionMin, bits(low), 4, "position limit", kAll, kOursAlone},
      {Kind::write_checked, object::kPositionMax, bits(high), 4, "position limit", kAll,
       kOursAlone},
      {Kind::write_checked, object::kQuickStopDeceleration, magnitude(joint.a_max), 4,
       "deceleration", kAll, "its quick stop has a deceleration of its own"},
      {Kind::write_checked, object::kQuickStopOption, static_cast<std::uint32_t>(quick_stop), 2,
       quick_stop == QuickStop::disables ? "quick stop by ramp, then disable"
                                         : "quick stop by ramp, then stay powered"},
      {.kind = Kind::write_checked,
       .object = object::kAbortOption,
       .value = 3,
       .bytes = 2,
       .meaning = "quick stop when the connection is lost",
       .lost = "what it does when the connection is lost is its maker's choice"},
      {.kind = Kind::write_checked,
       .object = guarded ? object::kGuardTime : object::kMasterHeartbeat,
       .value = guarded ? kGuardMs : master,
       .bytes = guarded ? 2 : 4,
       .meaning = guarded ? "time between our guard requests" : "watch over our heartbeat",
       .lost = guarded
                   ? nullptr
                   : "it does not notice the end of our heartbeat, only that of the set-points"},
      {Kind::write_checked, object::kHeartbeatLost, 1, 1, "stays operational without our heartbeat",
       kAll, kUnimportant},
      {.kind = Kind::write_checked,
       .object = guarded ? object::kLifeTimeFactor : object::kHeartbeatTime,
       .value = guarded ? kLifeTimeFactor : std::uint32_t{kDriveHeartbeatMs},
       .bytes = guarded ? 1 : 2,
       .meaning = guarded ? "watch over our guard requests" : "the drive's heartbeat",
       .lost = guarded ? nullptr : "its loss shows by missing answers to SYNC alone"},
      {.kind = Kind::write_checked,
       .object = object::kPeriodValue,
       .value = period.value,
       .bytes = 1,
       .meaning = "interpolation period",
       .lost = "it interpolates over a time of its own, or not at all"},
      {.kind = Kind::write_checked,
       .object = object::kPeriodExponent,
       .value = static_cast<std::uint8_t>(period.exponent),
       .bytes = 1,
       .meaning = "interpolation period",
       .lost = "it interpolates over a time of its own, or not at all"},
      {Kind::write, object::kMode, mode_number, 1, mode},
      {Kind::expect, object::kModeDisplay, mode_number, 1, mode, 0xFF},
  };
  if (guarded) {  // one that sends heartbeats is not guarded
    steps.push_back({Kind::write_checked, object::kHeartbeatTime, 0, 2,
                     "no heartbeat beside node guarding", kAll, kUnimportant});
  }
  const auto checked = [&](Object object, double rad, const char* meaning) {
    steps.push_back({Kind::write_checked, object, magnitude(rad), 4, meaning});
  };
  const bool profile = joint.mode == OperationMode::profile_position;
  if (profile) checked(object::kProfileVelocity, joint.profile_v, "velocity of the profile");
  if (profile || joint.mode == OperationMode::profile_velocity) {
    checked(object::kProfileAcceleration, joint.a_max, "acceleration of the profile");
    checked(object::kProfileDeceleration, joint.a_max, "deceleration of the profile");
  } else if (joint.mode == OperationMode::homing) {
    constexpr double kSlower = 0.1;  // from the switch to zero
    steps.push_back({Kind::write_checked, object::kHomingMethod,
                     static_cast<std::uint32_t>(joint.homing_method), 1, "homing method"});
    checked(object::kHomingSearchSpeed, joint.profile_v, "homing speed");
    checked(object::kHomingZeroSpeed, kSlower * joint.profile_v, "homing speed");
    checked(object::kHomingAcceleration, joint.a_max, "homing acceleration");
  }
  if (joint.following_window_rad > 0.0) {
    steps.push_back({Kind::write_checked, object::kFollowingWindow,
                     magnitude(joint.following_window_rad), 4, "largest following error"});
  }
  if (joint.following_time_s > 0.0) {
    steps.push_back({Kind::write_checked, object::kFollowingTime,
                     static_cast<std::uint32_t>(std::lround(1e3 * joint.following_time_s)), 2,
                     "time of a following error"});
  }
  std::vector<Mapped> command{{object::kControlword, 2}};
  for (const Mapped& target : target_of(joint.mode)) command.push_back(target);
  remap(steps, 0, 0x200 + node, command);
  steps.push_back(
      {Kind::write_checked, object::kRpdo1Deadline, kRpdoDeadlineMs, 2, "watch over our set-points",
       kAll,
       guarded ? "it stops 200 ms after our last guard request, not 100 ms after the last set-point"
               : "it stops 250 ms after our last heartbeat, not 100 ms after the last set-point"});
  remap(steps, 1, 0x180 + node,
        {{object::kStatusword, 2}, {object::kPosition, 4}, {object::kTorque, 2}});
  std::vector<Mapped> slower = {{object::kVelocity, 4}};
  if (quick_stop == QuickStop::stays_powered) slower.push_back({object::kDemand, 4});
  remap(steps, 2, 0x280 + node, slower);
  for (SetupStep& step : steps) {
    const bool holds = quick_stop == QuickStop::stays_powered;
    if (step.object == object::kQuickStopOption && !holds)
      step.lost = "how its quick stop ends is its maker's choice";
    if (step.lost != nullptr && axis.accepts(lack_of(step.object))) step.without = step.lost;
  }
  if (axis.stop_bit >= 0) remap(steps, 3, 0x380 + node, {{object::kDigitalInputs, 4}});
  return steps;
}

}  // namespace mimesis::hw::cia402
