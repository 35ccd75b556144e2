// What a Drive answers on the bus: NMT, SDO server, PDOs.
#include <algorithm>

#include "hw/sim/drives/drive.h"

namespace mimesis::hw::sim {
namespace {

namespace obj = arm::object;
using arm::NmtState;
using arm::Object;
using can::Frame;

constexpr std::uint32_t kInvalid = 0x80000000;

bool is_mapping(std::uint16_t index) {
  return index == 0x1600 || index == 0x1A00 || index == 0x1A01;
}

Object mapped_object(std::uint32_t entry) {
  return {static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8)};
}
int mapped_bytes(std::uint32_t entry) { return static_cast<int>(entry & 0xFF) / 8; }

}  // namespace

void Drive::on_nmt(const Frame& frame, std::vector<Frame>& out) {
  const auto command = arm::unsigned_at(frame, 0, 1), node = arm::unsigned_at(frame, 1, 1);
  if (!node || (*node != 0 && static_cast<int>(*node) != config_.axis.node_id)) return;
  switch (static_cast<arm::Nmt>(*command)) {
    case arm::Nmt::start:
      nmt_ = NmtState::operational;
      return;
    case arm::Nmt::stop:
      nmt_ = NmtState::stopped;
      break;
    case arm::Nmt::pre_operational:
      nmt_ = NmtState::pre_operational;
      break;
    case arm::Nmt::reset_node:
      std::visit([](auto& joint) { joint.lock(); }, joint_);
      state_ = DriveState::switch_on_disabled;
      [[fallthrough]];
    case arm::Nmt::reset_communication:
      reset_communication();
      boot(out);
      break;
  }
  // Without PDOs nobody steers any more.
  if (state_ == DriveState::operation_enabled) state_ = DriveState::quick_stop_active;
}

std::uint32_t Drive::check_mapping(const arm::Sdo& request) const {
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

std::uint32_t Drive::download(const arm::Sdo& request) {
  if (const std::uint32_t code = objects_.refuse_download(request.object, request.bytes))
    return code;
  if (is_mapping(request.object.index)) {
    if (const std::uint32_t code = check_mapping(request)) return code;
  }
  const bool bad_mode =
      request.object == obj::kMode && request.value != arm::kCyclicSynchronousPosition;
  const bool no_period = request.object == obj::kPeriodValue && request.value == 0;
  if (bad_mode || no_period) return 0x06090030;
  objects_.set(request.object, request.value);
  update_objects();
  return 0;
}

void Drive::on_sdo(const Frame& frame, std::vector<Frame>& out) {
  const int node = config_.axis.node_id;
  const arm::Sdo request = arm::parse_sdo_request(frame);
  const Object o = request.object;
  std::uint32_t code = 0x05040001;
  if (request.kind == arm::Sdo::Kind::upload) {
    code = objects_.refuse_upload(o);
    if (code == 0) out.push_back(arm::sdo_uploaded(node, o, objects_.get(o), objects_.bytes(o)));
  } else if (request.kind == arm::Sdo::Kind::download) {
    code = download(request);
    if (code == 0) out.push_back(arm::sdo_downloaded(node, o));
  }
  if (code != 0) out.push_back(arm::sdo_abort(node, o, code));
}

void Drive::on_rpdo(const Frame& frame, Time now) {
  if (nmt_ != NmtState::operational || (objects_.get({0x1400, 1}) & kInvalid) != 0) return;
  int offset = 0;
  const std::uint32_t count = objects_.get({0x1600, 0});
  for (std::uint8_t i = 1; i <= count; ++i) {
    const std::uint32_t entry = objects_.get({0x1600, i});
    const auto value = arm::unsigned_at(frame, offset, mapped_bytes(entry));
    if (!value) return;  // too short: not for this mapping
    objects_.set(mapped_object(entry), *value);
    offset += mapped_bytes(entry);
  }
  rpdo_seen_ = now;
}

void Drive::on_sync(std::vector<Frame>& out) {
  if (nmt_ != NmtState::operational) return;
  obey(static_cast<std::uint16_t>(objects_.get(obj::kControlword)));
  update_objects();
  for (int n = 1; n <= 2; ++n) {
    const auto communication = static_cast<std::uint16_t>(0x1800 + n - 1);
    const auto mapping = static_cast<std::uint16_t>(communication + 0x200);
    if ((objects_.get({communication, 1}) & kInvalid) != 0) continue;
    Frame frame = arm::tpdo(n, config_.axis.node_id);
    const std::uint32_t count = objects_.get({mapping, 0});
    for (std::uint8_t i = 1; i <= count; ++i) {
      const std::uint32_t entry = objects_.get({mapping, i});
      arm::append(frame, objects_.get(mapped_object(entry)), mapped_bytes(entry));
    }
    out.push_back(frame);
  }
}

void Drive::obey(std::uint16_t controlword) {
  const DriveState before = state_;
  state_ = arm::transition(state_, controlword, controlword_, quick_stop());
  controlword_ = controlword;
  if (before == DriveState::fault && state_ != DriveState::fault) {
    objects_.set({0x1001, 0}, 0);
    lag_s_ = 0.0;
  }
  if (state_ != DriveState::operation_enabled) return;
  if (before != DriveState::operation_enabled) {
    reference_ = held();
    lag_s_ = 0.0;
    rpdo_seen_ = now_;
  }
  const std::int32_t increments = std::clamp(
      objects_.get_signed(obj::kTarget), objects_.get_signed(obj::kPositionMin),
      std::max(objects_.get_signed(obj::kPositionMin), objects_.get_signed(obj::kPositionMax)));
  const double target = config_.axis.to_rad(increments);
  interpolation_left_s_ = period_s();
  reference_rate_ = (target - reference_) / interpolation_left_s_;
}

}  // namespace mimesis::hw::sim
