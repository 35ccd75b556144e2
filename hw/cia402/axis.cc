#include "hw/cia402/axis.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"

namespace mimesis::hw::cia402 {

std::int32_t Axis::to_increments(double rad) const {
  constexpr double kMin = std::numeric_limits<std::int32_t>::min();
  constexpr double kMax = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(
      std::clamp(std::round(sign * rad * increments_per_rad), kMin, kMax));
}

std::vector<Axis> complete(std::vector<Axis> axes, int joints) {
  if (axes.empty()) {
    for (int i = 1; i <= joints; ++i) axes.push_back({.node_id = i});
  }
  if (static_cast<int>(axes.size()) != joints) {
    throw ConfigError("axes: " + std::to_string(axes.size()) + " given, the robot has " +
                      std::to_string(joints) + " joints");
  }
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const std::string who = "axes[" + std::to_string(i) + "].";
    if (axes[i].sign == 0) throw ConfigError(who + "sign: expected -1 or 1, is 0");
    for (std::size_t j = 0; j < i; ++j) {
      if (axes[i].node_id == axes[j].node_id) {
        throw ConfigError(who + "node_id: " + std::to_string(axes[i].node_id) +
                          " is used by axes[" + std::to_string(j) + "]");
      }
    }
  }
  return axes;
}

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

using std::chrono::milliseconds;

constexpr milliseconds kSdoTimeout(100);
constexpr int kSdoAttempts = 3;

std::string hex(std::uint32_t value) { return fmt::format("0x{:04X}", value); }

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

AxisMaster::AxisMaster(std::string name, const Axis& axis, std::vector<SetupStep> steps)
    : name_(std::move(name)), axis_(axis), steps_(std::move(steps)) {}

void AxisMaster::restart() {
  step_ = 0;
  attempts_ = 0;
  verifying_ = heard_ = rebooted_ = false;
  asked_ = std::nullopt;
  demand_rad_ = std::nullopt;
  failure_.clear();
  reading_.drive = DriveState::unknown;
}

bool AxisMaster::uploading() const {
  const Kind kind = steps_[step_].kind;
  return kind == Kind::expect || kind == Kind::expect_least || verifying_;
}

void AxisMaster::advance(Time now, std::vector<can::Frame>& out) {
  if (configured() || !failure_.empty()) return;
  if (asked_ && now - *asked_ < kSdoTimeout) return;
  const SetupStep& step = steps_[step_];
  if (asked_ && found() && ++attempts_ == kSdoAttempts) {
    fail("no answer to SDO " + text(step.object) + " (" + step.meaning + ")");
    return;
  }
  asked_ = now;
  out.push_back(uploading() ? sdo_upload(axis_.node_id, step.object)
                            : sdo_download(axis_.node_id, step.object, step.value, step.bytes));
}

void AxisMaster::fail(const std::string& why) { failure_ = name_ + ": " + why; }

void AxisMaster::next_step() {
  ++step_;
  attempts_ = 0;
  verifying_ = false;
  asked_ = std::nullopt;
}

void AxisMaster::on_response(const Sdo& response) {
  if (configured() || !asked_ || !failure_.empty()) return;
  const SetupStep& step = steps_[step_];
  if (response.object != step.object) return;  // late answer to an earlier request
  const std::string what = "SDO " + text(step.object) + " (" + step.meaning + ")";
  if (response.kind == Sdo::Kind::abort) return fail(what + ": " + abort_text(response.value));
  if (uploading() != (response.kind == Sdo::Kind::uploaded)) return;
  if (!uploading()) {
    if (step.kind == Kind::write) return next_step();
    verifying_ = true;
    asked_ = std::nullopt;
    return;
  }
  const std::uint32_t mask =
      step.bytes == 4 ? step.mask : step.mask & ((1u << 8 * step.bytes) - 1u);
  const std::uint32_t value = response.value & mask;
  const bool good =
      step.kind == Kind::expect_least ? value >= step.value : value == (step.value & mask);
  if (good) return next_step();
  fail(what + ": expected " + (step.kind == Kind::expect_least ? "at least " : "") +
       hex(step.value) + ", is " + hex(value));
}

void AxisMaster::handle(const Identity& id, const can::Frame& frame, Time now) {
  switch (id.kind) {
    case Identity::Kind::sdo_response:
      return on_response(parse_sdo_response(frame));
    case Identity::Kind::heartbeat:
      heartbeat_seen_ = now;
      if (frame.length == 1 && frame.data[0] == static_cast<std::uint8_t>(NmtState::boot_up)) {
        rebooted_ = configured();
        if (!configured()) restart();
      }
      return;
    case Identity::Kind::emergency:
      emergency_ = static_cast<std::uint16_t>(unsigned_at(frame, 0, 2).value_or(0));
      return;
    case Identity::Kind::tpdo:
      break;
    default:
      return;
  }
  if (id.n == 2) {
    if (const auto v = signed_at(frame, 0, 4)) reading_.velocity_rad_s = axis_.to_rad(*v);
    if (const auto q = signed_at(frame, 4, 4)) {
      const double demand_rad = axis_.to_rad(*q);
      demand_moves_ = demand_rad_ && *demand_rad_ != demand_rad;
      demand_rad_ = demand_rad;
    }
    return;
  }
  const auto status = unsigned_at(frame, 0, 2);
  const auto position = signed_at(frame, 2, 4), torque = signed_at(frame, 6, 2);
  if (id.n != 1 || !torque) return;  // not the mapping we asked for
  statusword_ = static_cast<std::uint16_t>(*status);
  reading_.position_rad = axis_.to_rad(*position);
  reading_.torque_n_m = axis_.to_torque(*torque);
  const DriveState state = decode_statusword(statusword_);
  if (state != reading_.drive) state_since_ = now;
  reading_.drive = state;
  feedback_seen_ = now;
  heard_ = true;
}

std::string AxisMaster::complaint(DriveState expected) const {
  std::string line = name_ + ": expected " + hw::name(expected) + ", is " +
                     hw::name(reading_.drive) + " (statusword " + hex(statusword_) + ")";
  if (emergency_ != 0) line += ": " + emergency_text(emergency_);
  return line;
}

}  // namespace mimesis::hw::cia402
