#include "hw/sim/cia402/drive.h"

#include <algorithm>
#include <cmath>

#include "common/time.h"

namespace mimesis::hw::sim {

namespace {

namespace obj = cia402::object;
using can::Frame;
using cia402::NmtState;
using cia402::Object;
using std::chrono::milliseconds;

constexpr std::uint32_t kInvalid = 0x80000000;  // bit of a PDO's COB-ID
constexpr Object kErrorRegister{0x1001, 0};
// A bus keeps no more frames for a process that waits; beyond, the drives' watchdogs decide.
constexpr milliseconds kLongestWait(50);

std::uint32_t bits(std::int32_t value) { return static_cast<std::uint32_t>(value); }

bool is_mapping(std::uint16_t index) {
  return index == 0x1600 || index == 0x1A00 || index == 0x1A01;
}

Object mapped_object(std::uint32_t entry) {
  return {static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8)};
}
int mapped_bytes(std::uint32_t entry) { return static_cast<int>(entry & 0xFF) / 8; }

}  // namespace

Drive::Drive(const DriveConfig& config)
    : config_(config), joint_(AxisPlant(config.plant, config.home_rad)) {
  if (config.in_a_world) joint_ = WorldJoint(config.home_rad);
  using enum Access;
  const cia402::Axis& axis = config_.axis;
  const auto magnitude = [&](double rad) { return bits(std::abs(axis.to_increments(rad))); };
  objects_.add(obj::kDeviceType, 4, read_only, 0x00020192);  // servo drive, profile 402
  objects_.add(kErrorRegister, 1, read_only, 0);
  objects_.add({0x1018, 0}, 1, read_only, 2);
  objects_.add({0x1018, 1}, 4, read_only, 0);  // no vendor
  objects_.add({0x1018, 2}, 4, read_only, 1);
  objects_.add(obj::kAbortOption, 2, read_write, 1);
  objects_.add(obj::kControlword, 2, read_write, 0);
  objects_.add(obj::kStatusword, 2, read_only, 0);
  objects_.add(obj::kQuickStopOption, 2, read_write, 2);
  objects_.add(obj::kMode, 1, read_write, 0);
  objects_.add(obj::kModeDisplay, 1, read_only, 0);
  objects_.add(obj::kDemand, 4, read_only, 0);
  objects_.add(obj::kPosition, 4, read_only, 0);
  objects_.add(obj::kFollowingWindow, 4, read_write, magnitude(config_.following_window_rad));
  objects_.add(obj::kFollowingTime, 2, read_write,
               static_cast<std::uint32_t>(1e3 * config_.following_time_s));
  objects_.add(obj::kVelocity, 4, read_only, 0);
  objects_.add(obj::kTorque, 2, read_only, 0);
  objects_.add(obj::kTarget, 4, read_write, bits(axis.to_increments(config_.home_rad)));
  objects_.add(obj::kPositionMin, 4, read_write, 0x80000000);
  objects_.add(obj::kPositionMax, 4, read_write, 0x7FFFFFFF);
  objects_.add(obj::kMaxVelocity, 4, read_only, magnitude(config_.plant.v_max_rad_s));
  objects_.add(obj::kQuickStopDeceleration, 4, read_write, magnitude(config_.plant.a_max_rad_s2));
  objects_.add(obj::kPeriodValue, 1, read_write, 1);
  objects_.add(obj::kPeriodExponent, 1, read_write, 0xFE);  // 10 ms
  objects_.add(obj::kSupportedModes, 4, read_only, 1u << (cia402::kCyclicSynchronousPosition - 1));
  reset_communication();
  update_objects();
}

void Drive::reset_communication() {
  using enum Access;
  const auto node = static_cast<std::uint32_t>(config_.axis.node_id);
  objects_.add({0x1016, 0}, 1, read_only, 1);
  objects_.add(obj::kMasterHeartbeat, 4, read_write, 0);
  objects_.add(obj::kHeartbeatTime, 2, read_write, 0);
  const auto pdo = [&](std::uint16_t communication, std::uint32_t cob, int mapped,
                       std::uint32_t first) {
    const auto mapping = static_cast<std::uint16_t>(communication + 0x200);
    objects_.add({communication, 1}, 4, read_write, cob);
    objects_.add({communication, 2}, 1, read_write, 1);
    objects_.add({mapping, 0}, 1, read_write, static_cast<std::uint32_t>(mapped));
    for (std::uint8_t i = 1; i <= 4; ++i)
      objects_.add({mapping, i}, 4, read_write, i == 1 ? first : 0);
  };
  pdo(0x1400, 0x200 + node, 1, 0x60400010);
  pdo(0x1800, 0x180 + node, 1, 0x60410010);
  pdo(0x1801, kInvalid | (0x280 + node), 0, 0);
  objects_.add(obj::kRpdo1Deadline, 2, read_write, 0);
  heartbeat_due_ = master_seen_ = rpdo_seen_ = std::nullopt;
}

void Drive::boot(std::vector<Frame>& out) {
  nmt_ = NmtState::pre_operational;
  out.push_back(cia402::heartbeat(config_.axis.node_id, NmtState::boot_up));
}

void Drive::inject(Trouble trouble) {
  if (trouble == Trouble::overcurrent) trouble_ = trouble;  // reported with the next advance
  if (trouble == Trouble::jam) std::visit([](auto& joint) { joint.jam(); }, joint_);
  if (trouble == Trouble::mute) mute_ = true;
}

double Drive::position_rad() const {
  return std::visit([](const auto& joint) { return joint.position(); }, joint_);
}
double Drive::velocity_rad_s() const {
  return std::visit([](const auto& joint) { return joint.velocity(); }, joint_);
}
double Drive::torque_n_m() const {
  return std::visit([](const auto& joint) { return joint.torque(); }, joint_);
}
bool Drive::at_rest() const {
  return std::visit([](const auto& joint) { return joint.at_rest(); }, joint_);
}

bool Drive::lags() const {
  const double error = std::abs(reference_ - position_rad()) * config_.axis.increments_per_rad;
  return error > objects_.get(obj::kFollowingWindow);
}

cia402::QuickStop Drive::quick_stop() const {
  const bool powered = objects_.get(obj::kQuickStopOption) ==
                       static_cast<std::uint32_t>(cia402::QuickStop::stays_powered);
  return powered ? cia402::QuickStop::stays_powered : cia402::QuickStop::disables;
}

double Drive::period_s() const {
  const int exponent = objects_.get_signed(obj::kPeriodExponent);
  return objects_.get(obj::kPeriodValue) * std::pow(10.0, exponent);
}

double Drive::deceleration() const {
  return objects_.get(obj::kQuickStopDeceleration) / config_.axis.increments_per_rad;
}

void Drive::move_joint(double dt) {
  const auto brake = [&] {
    std::visit([&](auto& joint) { joint.brake(deceleration(), dt); }, joint_);
  };
  switch (state_) {
    case DriveState::operation_enabled: {
      const double left = std::min(dt, moves_on_s_);
      const double rate = dt > 0.0 ? reference_rate_ * left / dt : 0.0;
      moves_on_s_ -= left;
      reference_ += reference_rate_ * left;
      std::visit([&](auto& joint) { joint.track(reference_, rate, dt); }, joint_);
      return;
    }
    case DriveState::quick_stop_active:
      brake();
      if (at_rest() && quick_stop() == cia402::QuickStop::disables) {
        state_ = DriveState::switch_on_disabled;
      }
      return;
    case DriveState::fault_reaction_active:
      brake();
      if (at_rest()) state_ = DriveState::fault;
      return;
    default:
      return std::visit([](auto& joint) { joint.lock(); }, joint_);
  }
}

void Drive::fail(std::uint16_t code, std::vector<Frame>& out) {
  if (state_ == DriveState::fault || state_ == DriveState::fault_reaction_active) return;
  state_ = DriveState::fault_reaction_active;
  objects_.set(kErrorRegister, 1);
  out.push_back(cia402::emergency(config_.axis.node_id, code, 1));
}

void Drive::connection_lost(std::uint16_t code, std::vector<Frame>& out) {
  out.push_back(cia402::emergency(config_.axis.node_id, code, 0x10));
  if (state_ != DriveState::operation_enabled) return;
  if (objects_.get(obj::kAbortOption) == 3) state_ = DriveState::quick_stop_active;
  if (objects_.get(obj::kAbortOption) == 1) fail(code, out);
}

void Drive::supervise(std::vector<Frame>& out) {
  const std::uint32_t heartbeat_ms = objects_.get(obj::kHeartbeatTime);
  if (heartbeat_ms > 0 && own_time_ >= heartbeat_due_.value_or(own_time_)) {
    out.push_back(cia402::heartbeat(config_.axis.node_id, nmt_));
    heartbeat_due_ = own_time_ + milliseconds(heartbeat_ms);
  }
  const milliseconds master_ms(objects_.get(obj::kMasterHeartbeat) & 0xFFFF);
  if (master_seen_ && own_time_ - *master_seen_ > master_ms) {
    master_seen_ = std::nullopt;  // watched again from its next heartbeat on
    connection_lost(0x8130, out);
  }
  const milliseconds deadline_ms(objects_.get(obj::kRpdo1Deadline));
  if (rpdo_seen_ && deadline_ms.count() > 0 && own_time_ - *rpdo_seen_ > deadline_ms) {
    rpdo_seen_ = std::nullopt;
    connection_lost(0x8250, out);
  }
  if (state_ == DriveState::operation_enabled && lag_s_ * 1e3 > objects_.get(obj::kFollowingTime)) {
    fail(0x8611, out);
  }
  if (trouble_) fail(0x2310, out);
  trouble_ = std::nullopt;
}

double Drive::held() const {
  return std::visit([](const auto& joint) { return joint.held(); }, joint_);
}

void Drive::update_objects() {
  const cia402::Axis& axis = config_.axis;
  const bool enabled = state_ == DriveState::operation_enabled;
  objects_.set(obj::kDemand, bits(axis.to_increments(enabled ? reference_ : held())));
  objects_.set(obj::kPosition, bits(axis.to_increments(position_rad())));
  objects_.set(obj::kVelocity, bits(axis.to_increments(velocity_rad_s())));
  const double torque = 1e3 * axis.sign * torque_n_m() / axis.rated_torque_n_m;
  objects_.set(obj::kTorque,
               bits(static_cast<std::int32_t>(std::clamp(torque, -32768.0, 32767.0))));
  objects_.set(obj::kStatusword, cia402::encode_statusword(state_));
  objects_.set(obj::kModeDisplay, objects_.get(obj::kMode));
}

void Drive::move(Time now, std::vector<Frame>& out) {
  if (!started_) {
    const std::size_t before = out.size();
    now_ = now;
    boot(out);
    if (mute_) out.resize(before);
  }
  started_ = true;
  const Time passed = std::max(now - now_, Time(0));
  own_time_ += passed;
  now_ = now;
  moved_s_ = to_seconds(passed);
  if (moved_s_ > 0.0) move_joint(moved_s_);
}

void Drive::watch(std::vector<Frame>& out) {
  const std::size_t before = out.size();
  if (state_ == DriveState::operation_enabled && moved_s_ > 0.0) {
    lag_s_ = lags() ? lag_s_ + moved_s_ : 0.0;
  }
  supervise(out);
  update_objects();
  if (mute_) out.resize(before);
}

void Drive::handle(const Frame& frame, std::vector<Frame>& out) {
  if (mute_) return;
  using Kind = cia402::Identity::Kind;
  const cia402::Identity id = cia402::identify(frame);
  const bool mine = id.node == config_.axis.node_id;
  switch (id.kind) {
    case Kind::nmt:
      return on_nmt(frame, out);
    case Kind::sync:
      return on_sync(out);
    case Kind::rpdo:
      if (mine && id.n == 1) on_rpdo(frame);
      return;
    case Kind::sdo_request:
      if (mine && nmt_ != NmtState::stopped) on_sdo(frame, out);
      return;
    case Kind::heartbeat: {
      const std::uint32_t watched = objects_.get(obj::kMasterHeartbeat);
      if (watched != 0 && static_cast<int>(watched >> 16) == id.node) master_seen_ = own_time_;
      return;
    }
    default:
      return;
  }
}

Rack::Rack(const std::vector<DriveConfig>& configs, std::unique_ptr<can::Bus> bus)
    : bus_(std::move(bus)) {
  for (const DriveConfig& config : configs) drives_.emplace_back(config);
}

void Rack::move(Time now) {
  for (Drive& drive : drives_) drive.move(now, outbox_);
}

/// What has arrived; of a flood the rest waits for the next step.
void Rack::receive() {
  constexpr std::size_t kAtOnce = 256, kMost = 16 * kAtOnce;
  std::size_t count = kAtOnce, filled = 0;
  for (; count == kAtOnce && filled < kMost; filled += count) {
    inbox_.resize(filled + kAtOnce);
    count = bus_->receive(std::span(inbox_).subspan(filled));
  }
  inbox_.resize(filled);
}

void Rack::answer(std::span<const Frame> frames) {
  for (Drive& drive : drives_) drive.watch(outbox_);
  for (const Frame& frame : frames) {
    for (Drive& drive : drives_) drive.handle(frame, outbox_);
  }
}

void Rack::answer() {
  receive();
  answer(inbox_);
  if (!outbox_.empty()) bus_->send(outbox_);
  outbox_.clear();
}

void Rack::step(Time now) {
  receive();
  const auto is_sync = [](const Frame& frame) {
    return cia402::identify(frame).kind == cia402::Identity::Kind::sync;
  };
  const Time passed = std::max(now - stepped_.value_or(now), Time(0));
  stepped_ = now;
  const bool brief = passed <= kLongestWait;
  const auto parts =
      brief ? std::max(std::ranges::count_if(inbox_, is_sync), std::ptrdiff_t{1}) : 1;
  auto begin = inbox_.begin();
  for (auto left = parts; left-- > 0;) {
    auto end = left == 0 ? inbox_.end() : std::next(std::find_if(begin, inbox_.end(), is_sync));
    move(now - passed * left / parts);
    answer({begin, end});
    begin = end;
  }
  if (!outbox_.empty()) bus_->send(outbox_);
  outbox_.clear();
}

void Dictionary::add(cia402::Object object, int bytes, Access access, std::uint32_t value) {
  entries_[key(object)] = {bytes, access, value};
}

std::uint32_t Dictionary::get(cia402::Object object) const {
  return entries_.at(key(object)).value;
}

std::int32_t Dictionary::get_signed(cia402::Object object) const {
  const Entry& e = entries_.at(key(object));
  const int unused = 32 - 8 * e.bytes;
  return static_cast<std::int32_t>(e.value << unused) >> unused;
}

void Dictionary::set(cia402::Object object, std::uint32_t value) {
  entries_.at(key(object)).value = value;
}

std::uint32_t Dictionary::refuse_upload(cia402::Object object) const {
  if (contains(object)) return 0;
  const auto next = entries_.lower_bound(key({object.index, 0}));
  const bool index_exists = next != entries_.end() && next->first >> 8 == object.index;
  return index_exists ? 0x06090011 : 0x06020000;
}

std::uint32_t Dictionary::refuse_download(cia402::Object object, int bytes) const {
  if (const std::uint32_t code = refuse_upload(object)) return code;
  const Entry& e = entries_.at(key(object));
  if (e.access == Access::read_only) return 0x06010002;
  return bytes == e.bytes ? 0 : 0x06070010;
}

void Drive::on_nmt(const Frame& frame, std::vector<Frame>& out) {
  const auto command = cia402::unsigned_at(frame, 0, 1), node = cia402::unsigned_at(frame, 1, 1);
  if (!node || (*node != 0 && static_cast<int>(*node) != config_.axis.node_id)) return;
  switch (static_cast<cia402::Nmt>(*command)) {
    case cia402::Nmt::start:
      nmt_ = NmtState::operational;
      return;
    case cia402::Nmt::stop:
      nmt_ = NmtState::stopped;
      break;
    case cia402::Nmt::pre_operational:
      nmt_ = NmtState::pre_operational;
      break;
    case cia402::Nmt::reset_node:
      std::visit([](auto& joint) { joint.lock(); }, joint_);
      state_ = DriveState::switch_on_disabled;
      [[fallthrough]];
    case cia402::Nmt::reset_communication:
      reset_communication();
      boot(out);
      break;
  }
  // Without PDOs there is no command.
  if (state_ == DriveState::operation_enabled) state_ = DriveState::quick_stop_active;
}

std::uint32_t Drive::check_mapping(const cia402::Sdo& request) const {
  const Object o = request.object;
  const auto communication = static_cast<std::uint16_t>(o.index - 0x200);
  if ((objects_.get({communication, 1}) & kInvalid) == 0) return 0x08000022;
  if (o.sub > 0) {
    if (objects_.get({o.index, 0}) != 0) return 0x08000022;
    const Object mapped = mapped_object(request.value);
    const bool fits =
        objects_.contains(mapped) && objects_.bytes(mapped) == mapped_bytes(request.value);
    return fits ? 0 : 0x06040041;
  }
  int bytes = 0;
  for (std::uint8_t i = 1; i <= request.value; ++i) {
    if (!objects_.contains({o.index, i})) return 0x06090030;
    bytes += mapped_bytes(objects_.get({o.index, i}));
  }
  return bytes <= 8 ? 0 : 0x06040042;
}

std::uint32_t Drive::download(const cia402::Sdo& request) {
  if (const std::uint32_t code = objects_.refuse_download(request.object, request.bytes))
    return code;
  if (is_mapping(request.object.index)) {
    if (const std::uint32_t code = check_mapping(request)) return code;
  }
  const bool bad_mode =
      request.object == obj::kMode && request.value != cia402::kCyclicSynchronousPosition;
  const bool no_period = request.object == obj::kPeriodValue && request.value == 0;
  if (bad_mode || no_period) return 0x06090030;
  objects_.set(request.object, request.value);
  update_objects();
  return 0;
}

void Drive::on_sdo(const Frame& frame, std::vector<Frame>& out) {
  const int node = config_.axis.node_id;
  const cia402::Sdo request = cia402::parse_sdo_request(frame);
  const Object o = request.object;
  std::uint32_t code = 0x05040001;
  if (request.kind == cia402::Sdo::Kind::upload) {
    code = objects_.refuse_upload(o);
    if (code == 0) out.push_back(cia402::sdo_uploaded(node, o, objects_.get(o), objects_.bytes(o)));
  } else if (request.kind == cia402::Sdo::Kind::download) {
    code = download(request);
    if (code == 0) out.push_back(cia402::sdo_downloaded(node, o));
  }
  if (code != 0) out.push_back(cia402::sdo_abort(node, o, code));
}

void Drive::on_rpdo(const Frame& frame) {
  if (nmt_ != NmtState::operational || (objects_.get({0x1400, 1}) & kInvalid) != 0) return;
  int offset = 0;
  const std::uint32_t count = objects_.get({0x1600, 0});
  for (std::uint8_t i = 1; i <= count; ++i) {
    const std::uint32_t entry = objects_.get({0x1600, i});
    const auto value = cia402::unsigned_at(frame, offset, mapped_bytes(entry));
    if (!value) return;  // too short: not for this mapping
    objects_.set(mapped_object(entry), *value);
    offset += mapped_bytes(entry);
  }
  rpdo_seen_ = own_time_;
}

void Drive::on_sync(std::vector<Frame>& out) {
  if (nmt_ != NmtState::operational) return;
  obey(static_cast<std::uint16_t>(objects_.get(obj::kControlword)));
  update_objects();
  for (int n = 1; n <= 2; ++n) {
    const auto communication = static_cast<std::uint16_t>(0x1800 + n - 1);
    const auto mapping = static_cast<std::uint16_t>(communication + 0x200);
    if ((objects_.get({communication, 1}) & kInvalid) != 0) continue;
    Frame frame = cia402::tpdo(n, config_.axis.node_id);
    const std::uint32_t count = objects_.get({mapping, 0});
    for (std::uint8_t i = 1; i <= count; ++i) {
      const std::uint32_t entry = objects_.get({mapping, i});
      cia402::append(frame, objects_.get(mapped_object(entry)), mapped_bytes(entry));
    }
    out.push_back(frame);
  }
}

void Drive::obey(std::uint16_t controlword) {
  const DriveState before = state_;
  state_ = cia402::transition(state_, controlword, controlword_, quick_stop());
  controlword_ = controlword;
  if (before == DriveState::fault && state_ != DriveState::fault) {
    objects_.set({0x1001, 0}, 0);
    lag_s_ = 0.0;
  }
  if (state_ != DriveState::operation_enabled) return;
  if (before != DriveState::operation_enabled) {
    reference_ = held();
    lag_s_ = 0.0;
    rpdo_seen_ = own_time_;
  }
  const std::int32_t increments = std::clamp(
      objects_.get_signed(obj::kTarget), objects_.get_signed(obj::kPositionMin),
      std::max(objects_.get_signed(obj::kPositionMin), objects_.get_signed(obj::kPositionMax)));
  const double target = config_.axis.to_rad(increments);
  reference_rate_ = (target - reference_) / period_s();
  moves_on_s_ = (1 + config_.extrapolated_cycles) * period_s();
}

}  // namespace mimesis::hw::sim
