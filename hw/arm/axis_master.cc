#include "hw/arm/axis_master.h"

#include <cstdio>
#include <utility>

namespace mimesis::hw::arm {
namespace {

using std::chrono::milliseconds;
using Kind = SetupStep::Kind;

constexpr milliseconds kSdoTimeout(100);
constexpr int kSdoAttempts = 3;

std::string hex(std::uint32_t value) {
  char buffer[16];
  std::snprintf(buffer, sizeof(buffer), "0x%04X", value);
  return buffer;
}

}  // namespace

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

}  // namespace mimesis::hw::arm
