#include "hw/cia402/axis_master.h"

#include <fmt/core.h>

#include <algorithm>

#include "common/time.h"

namespace mimesis::hw::cia402 {
namespace {

using Kind = SetupStep::Kind;
using std::chrono::milliseconds;

constexpr int kSdoAttempts = 3;
constexpr int kModeReads = 20;  // until it is left to be shown by the enabled drive
constexpr std::uint32_t kNoRemote = 0x40000000;  // of a TPDO's COB-ID: no remote requests
constexpr milliseconds kResetHeld(100);

std::string hex(std::uint32_t value) { return fmt::format("0x{:04X}", value); }

bool is_missing(std::uint32_t abort_code) {
  return abort_code == 0x06020000 || abort_code == 0x06090011;
}

/// Stops the drive when its master is lost, or when it does not follow.
bool protects(Object object) {
  return object == object::kQuickStopOption || object == object::kAbortOption ||
         object == object::kMasterHeartbeat || object == object::kHeartbeatLost ||
         object == object::kGuardTime || object == object::kLifeTimeFactor ||
         object == object::kRpdo1Deadline || object == object::kFollowingWindow ||
         object == object::kFollowingTime;
}

std::uint32_t mask_of(const SetupStep& step) {
  return step.bytes == 4 ? step.mask : step.mask & ((1u << 8 * step.bytes) - 1u);
}

std::string what(const SetupStep& step) {
  return "SDO " + text(step.object) + " (" + step.meaning + ")";
}

bool carries(const std::vector<Mapped>& map, Object object, int bytes) {
  return std::ranges::any_of(
      map, [&](const Mapped& m) { return m.object == object && m.bytes == bytes; });
}

}  // namespace

AxisMaster::AxisMaster(std::string name, const Axis& axis, std::vector<SetupStep> steps,
                       Time sdo_timeout)
    : name_(std::move(name)), axis_(axis), wanted_(std::move(steps)), sdo_timeout_(sdo_timeout) {
  for (const SetupStep& step : wanted_) {
    if (step.object == object::kMode) mode_ = static_cast<std::int32_t>(step.value);
    if (step.object == object::kModeDisplay) mode_step_ = step;
  }
  restart();
}

void AxisMaster::restart() {
  steps_ = wanted_;
  maps_ = maps_of(wanted_);
  step_ = 0;
  attempts_ = 0;
  refused_ = 0;
  verifying_ = heard_ = rebooted_ = answered_ = position_known_ = false;
  stop_known_ = stop_open_ = false;
  on_sync_ = true;
  mode_shown_ = false;
  mode_reads_ = 0;
  beats_ = watches_ = deadline_ = true;
  toggle_.reset();
  alternates_ = false;
  misses_ = 0;
  asked_ = std::nullopt;
  demand_rad_ = std::nullopt;
  failure_.clear();
  notes_.clear();
  changed_.clear();
  audit_ = 0;
  audited_ = {{{.kind = Kind::expect,
                .object = object::kFollowingWindow,
                .value = 0,
                .bytes = 4,
                .meaning = "largest following error"},
               false}};
  reading_.drive = DriveState::unknown;
}

bool AxisMaster::uploading() const {
  const Kind kind = steps_[step_].kind;
  return kind == Kind::expect || kind == Kind::expect_least || kind == Kind::learn || verifying_;
}

void AxisMaster::advance(Time now, std::vector<can::Frame>& out) {
  if (configured() || !failure_.empty()) return;
  if (asked_ && now - *asked_ < sdo_timeout_) return;
  const SetupStep& step = steps_[step_];
  if (asked_ && found() && ++attempts_ == kSdoAttempts) {
    fail(fmt::format("no answer to {} within {:.3g} s, {} times", what(step),
                     to_seconds(sdo_timeout_), kSdoAttempts));
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
  refused_ = 0;
  verifying_ = false;
  asked_ = std::nullopt;
  if (step_ == steps_.size()) check_maps();
}

/// The last way: what the axis may accept.
std::string AxisMaster::way_on(const SetupStep& step) const {
  if (step.lost == nullptr) return {};
  const bool beat =
      step.object == object::kMasterHeartbeat || step.object == object::kHeartbeatTime;
  return fmt::format(
      "; {}`accept: [{}]` of its axis uses it without: {}",
      beat ? "`guarding: true` of its axis uses node guarding (100Ch) instead; " : "",
      lack_of(step.object), step.lost);
}

/// A drive with PDOs of its own must carry what moves it and what shows its state.
void AxisMaster::check_maps() {
  if (!watches_ && !deadline_)
    return fail("nothing stops it when the bridge is lost: it lacks 1016:01 and 1400:05");
  const std::vector<Mapped>& command = maps_[0];
  const std::vector<Mapped> needed = maps_of(wanted_)[0];
  for (const Mapped& m : command) {
    const bool ours = m.object == object::kMode || carries(needed, m.object, m.bytes);
    if (!ours) return fail("RPDO1 carries " + text(m.object) + ", which the bridge cannot give");
  }
  const auto demand = [&](bool there, Object object, const char* pdo) {
    if (!there && failure_.empty()) fail(text(object) + " is not in " + pdo);
  };
  for (const Mapped& m : needed) demand(carries(command, m.object, m.bytes), m.object, "RPDO1");
  const auto shown = [&](Object object, int bytes) {
    return carries(maps_[1], object, bytes) || carries(maps_[2], object, bytes);
  };
  demand(shown(object::kStatusword, 2), object::kStatusword, "TPDO1 or TPDO2");
  demand(shown(object::kPosition, 4), object::kPosition, "TPDO1 or TPDO2");
  if (axis_.stop_bit >= 0)
    demand(carries(maps_[3], object::kDigitalInputs, 4), object::kDigitalInputs, "TPDO3");
  shows_velocity_ = shown(object::kVelocity, 4);
}

void AxisMaster::note(const SetupStep& step, std::uint32_t code, const std::string& consequence) {
  if (step.object == object::kHeartbeatTime && !axis_.guarding) beats_ = false;
  if (step.object == object::kMasterHeartbeat) watches_ = false;
  if (step.object == object::kRpdo1Deadline) deadline_ = false;
  if (consequence.empty()) return;
  notes_.push_back(name_ + ": " + what(step) + ": " + abort_text(code) + "; " + consequence);
}

/// The mapping of a PDO that is as the maker has made it.
void AxisMaster::learn_mapping(const SetupStep& refused, std::uint32_t code) {
  const int pdo = refused.pdo;
  on_sync_ = on_sync_ && pdo != 1;
  const Object count{refused.object.index, 0};
  note(refused, code, "its own mapping is used");
  const auto here = steps_.begin() + static_cast<std::ptrdiff_t>(step_);
  steps_.erase(std::remove_if(here, steps_.end(), [&](const SetupStep& s) { return s.pdo == pdo; }),
               steps_.end());
  steps_.insert(steps_.begin() + static_cast<std::ptrdiff_t>(step_), {.kind = Kind::learn,
                                                                      .object = count,
                                                                      .value = 0,
                                                                      .bytes = 1,
                                                                      .meaning = "PDO mapping",
                                                                      .pdo = pdo});
  maps_.at(static_cast<std::size_t>(pdo)).clear();
  asked_ = std::nullopt;
}

void AxisMaster::on_learnt(const SetupStep& step, std::uint32_t value) {
  if (step.object.sub > 0) {
    std::vector<Mapped>& map = maps_.at(static_cast<std::size_t>(step.pdo));
    map.push_back(mapped(value));
    if (bytes_of(map) > 8) {
      map.clear();
      fail(what(step) + ": it carries more than 8 bytes");
    }
    return;
  }
  constexpr std::uint32_t kMost = 8;
  SetupStep entry = step;
  for (std::uint8_t sub = 1; sub <= std::min(value, kMost); ++sub) {
    entry.object.sub = sub;
    steps_.insert(steps_.begin() + static_cast<std::ptrdiff_t>(step_) + sub, entry);
  }
}

void AxisMaster::on_refusal(const SetupStep& step, std::uint32_t code) {
  const bool reads = uploading();
  const bool identifier =
      step.object.sub == 1 && std::ranges::count(kPdoObjects, step.object.index);
  constexpr std::uint32_t kReadOnly = 0x06010002;
  if (identifier && step.object.index >= kPdoObjects[1] && !reads && !is_missing(code) &&
      code != kReadOnly &&
      (step.value & kNoRemote) == 0) {  // it has no remote requests, and wants that to be said
    for (SetupStep& s : steps_)
      if (s.object == step.object) s.value |= kNoRemote;
    asked_ = std::nullopt;
    return;
  }
  if (step.pdo >= 0 && step.kind != Kind::learn) return learn_mapping(step, code);
  if (reads || is_missing(code)) {
    if (step.without == nullptr) return fail(what(step) + ": " + abort_text(code) + way_on(step));
    note(step, code, step.without);
    return next_step();
  }
  refused_ = code;  // it may be as wanted already
  verifying_ = true;
  asked_ = std::nullopt;
}

void AxisMaster::ask_mode(std::vector<can::Frame>& out) {
  constexpr int kEvery = 4;  // cycles
  if (mode_reads_++ % kEvery == 0) out.push_back(sdo_upload(axis_.node_id, object::kModeDisplay));
}

void AxisMaster::on_mode(std::uint32_t shown) {
  shown_mode_ = shown & mode_step_.mask;
  mode_shown_ = shown_mode_ == mode_step_.value;
}

std::string AxisMaster::wrong_mode() const {
  return name_ + ": " + what(mode_step_) + ": expected " + hex(mode_step_.value) + ", is " +
         hex(shown_mode_) + " while it is " + hw::text(reading_);
}

void AxisMaster::reset_fault(Time now) {
  const bool raised = controlword == controlword::kFaultReset;
  if (raised && now - raised_at_ < kResetHeld) return;
  if (!raised) raised_at_ = now;
  controlword = raised ? controlword::kDisableVoltage : controlword::kFaultReset;
}

void AxisMaster::guard(std::vector<can::Frame>& out) const {
  if (axis_.guarding && configured()) out.push_back(guard_request(axis_.node_id));
}

void AxisMaster::audit(std::vector<can::Frame>& out) {
  if (audited_.empty()) return;
  audit_ = (audit_ + 1) % audited_.size();
  out.push_back(sdo_upload(axis_.node_id, audited_[audit_].step.object));
}

void AxisMaster::on_audit(const Sdo& response) {
  if (response.object == object::kModeDisplay && response.kind == Sdo::Kind::uploaded)
    return on_mode(response.value);
  if (audit_ >= audited_.size() || response.object != audited_[audit_].step.object) return;
  auto& [step, known] = audited_[audit_];
  if (response.kind == Sdo::Kind::abort) {  // a drive without it
    if (!known) audited_.erase(audited_.begin() + static_cast<std::ptrdiff_t>(audit_));
    return;
  }
  if (response.kind != Sdo::Kind::uploaded) return;
  const std::uint32_t value = response.value & mask_of(step), wanted = step.value & mask_of(step);
  if (!std::exchange(known, true)) {
    step.value = value;
  } else if (value != wanted) {
    changed_ = what(step) + ": expected " + hex(wanted) + ", is " + hex(value);
  }
}

void AxisMaster::on_response(const Sdo& response) {
  if (configured()) return on_audit(response);
  if (!asked_ || !failure_.empty()) return;
  const SetupStep step = steps_[step_];
  if (response.object != step.object) return;  // late answer to an earlier request
  if (response.kind == Sdo::Kind::abort) return on_refusal(step, response.value);
  if (uploading() != (response.kind == Sdo::Kind::uploaded)) return;
  if (!uploading()) {
    if (step.kind == Kind::write) return next_step();
    verifying_ = true;
    asked_ = std::nullopt;
    return;
  }
  if (step.kind == Kind::learn) {
    on_learnt(step, response.value);
    return next_step();
  }
  const std::uint32_t mask = mask_of(step);
  const std::uint32_t value = response.value & mask;
  if (step.object == object::kModeDisplay) {
    on_mode(response.value);
    if (mode_shown_ || ++mode_reads_ >= kModeReads) return next_step();
    asked_ = std::nullopt;
    return;
  }
  const bool untold = step.object == object::kSupportedModes && response.value == 0;
  const bool good = untold || (step.kind == Kind::expect_least ? value >= step.value
                                                               : value == (step.value & mask));
  if (good) {
    if (step.kind == Kind::write_checked && protects(step.object)) {
      if (step.object == object::kFollowingWindow) audited_.erase(audited_.begin());
      audited_.push_back({step});
    }
    return next_step();
  }
  if (refused_ != 0 && step.without != nullptr) {
    note(step, refused_, step.without);
    return next_step();
  }
  fail(what(step) + ": " + (refused_ != 0 ? abort_text(refused_) + ": " : "") + "expected " +
       (step.kind == Kind::expect_least ? "at least " : "") + hex(step.value) + ", is " +
       hex(value) + way_on(step));
}

void AxisMaster::handle(const Identity& id, const can::Frame& frame, Time now) {
  switch (id.kind) {
    case Identity::Kind::sdo_response:
      return on_response(parse_sdo_response(frame));
    case Identity::Kind::heartbeat:
      if (frame.length == 1 && frame.data[0] == static_cast<std::uint8_t>(NmtState::boot_up)) {
        rebooted_ = configured();
        if (!configured()) restart();
      } else if (axis_.guarding && frame.length == 1) {
        // An answer that repeats the bit comes from the controller of a program that hangs.
        const bool toggle = (frame.data[0] & 0x80) != 0;
        const std::optional<bool> before = std::exchange(toggle_, toggle);
        if (before == toggle) return;
        alternates_ = before.has_value();
      }
      heartbeat_seen_ = now;
      return;
    case Identity::Kind::emergency:
      emergency_ = static_cast<std::uint16_t>(unsigned_at(frame, 0, 2).value_or(0));
      return;
    case Identity::Kind::tpdo:
      if (id.n < static_cast<int>(maps_.size()))
        take_in(maps_.at(static_cast<std::size_t>(id.n)), frame, now);
      return;
    default:
      return;
  }
}

void AxisMaster::take_in(const std::vector<Mapped>& map, const can::Frame& frame, Time now) {
  if (frame.length < bytes_of(map)) return;  // not the mapping we asked for
  int at = 0;
  for (const Mapped& m : map) {
    const std::int32_t value = signed_at(frame, at, m.bytes).value_or(0);
    at += m.bytes;
    if (m.object == object::kStatusword) {
      reading_.statusword = static_cast<std::uint16_t>(value);
      const DriveState state = decode_statusword(reading_.statusword);
      if (state != reading_.drive) state_since_ = now;
      reading_.drive = state;
      feedback_seen_ = now;
      answered_ = true;
    } else if (m.object == object::kPosition) {
      const double before = std::exchange(reading_.position_rad, axis_.to_rad(value));
      if (!shows_velocity_ && position_known_ && now > position_seen_) {
        reading_.velocity_rad_s =
            (reading_.position_rad - before) / to_seconds(now - position_seen_);
      }
      position_known_ = true;
      position_seen_ = now;
    } else if (m.object == object::kTorque) {
      reading_.torque_n_m = axis_.to_torque(value);
    } else if (m.object == object::kVelocity) {
      reading_.velocity_rad_s = axis_.rate_to_rad(value);
    } else if (m.object == object::kDemand) {
      const double demand_rad = axis_.to_rad(value);
      demand_moves_ = demand_rad_ && *demand_rad_ != demand_rad;
      demand_rad_ = demand_rad;
    } else if (m.object == object::kDigitalInputs && axis_.stop_bit >= 0) {
      stop_known_ = true;
      stop_open_ = (static_cast<std::uint32_t>(value) >> axis_.stop_bit & 1) == 0;
    }
  }
  heard_ = position_known_ && reading_.drive != DriveState::unknown &&
           (stop_known_ || axis_.stop_bit < 0) && (alternates_ || !axis_.guarding);
}

std::int32_t AxisMaster::commanded(Object object) const {
  if (object == object::kControlword) return controlword;
  if (object == object::kTarget) return axis_.to_increments(target_rad);
  if (object == object::kTargetVelocity) return axis_.rate_to_increments(target_rad_s);
  if (object == object::kTargetTorque) return axis_.to_thousandths(target_n_m);
  return mode_;
}

can::Frame AxisMaster::command() const {
  can::Frame frame = rpdo(1, axis_.node_id);
  for (const Mapped& m : maps_[0]) {
    append(frame, static_cast<std::uint32_t>(commanded(m.object)), m.bytes);
  }
  return frame;
}

std::string AxisMaster::complaint(DriveState expected) const {
  std::string line = name_ + ": expected " + hw::name(expected) + ", is " + hw::text(reading_);
  if (emergency_ != 0) line += ": " + emergency_text(emergency_);
  return line;
}

}  // namespace mimesis::hw::cia402
