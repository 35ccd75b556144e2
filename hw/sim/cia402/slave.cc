#include "hw/sim/cia402/slave.h"

#include <algorithm>
#include <utility>

namespace mimesis::hw::sim {
namespace {

using can::Frame;
using std::chrono::milliseconds;
using enum Type;
using enum Access;

constexpr std::int64_t kInvalid = 0x80000000;   // bit of a PDO's COB-ID: not in use
constexpr std::int64_t kNoRemote = 0x40000000;  // no remote requests for a TPDO
constexpr std::uint32_t kNoId = 0xFFFFFFFF;
constexpr int kMostMapped = 8;
constexpr milliseconds kSdoTimeout(1000);

constexpr Address rpdo_object(int n, int sub) {
  return 0x1400'00u + (static_cast<unsigned>(n) << 8) + static_cast<unsigned>(sub);
}
constexpr Address tpdo_object(int n, int sub) { return rpdo_object(n, sub) + 0x400'00u; }
constexpr Address mapping_of(Address pdo) { return (pdo & 0xFFFFFF00u) + 0x200'00u; }

bool is_pdo(Address a) { return a >= 0x1400'00 && a < 0x1C00'00; }
bool is_mapping(Address a) { return is_pdo(a) && (a >> 16 & 0x2) != 0; }

Address mapped_address(std::int64_t entry) { return static_cast<Address>(entry >> 8); }
int mapped_bits(std::int64_t entry) { return static_cast<int>(entry & 0xFF); }

/// Identifiers that no PDO may have [CiA 301, table 40].
bool restricted(std::int64_t id) {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) ||
         (id >= 0x601 && id <= 0x67F) || id >= 0x6E0;
}

Address address_in(const Frame& f) {
  return std::uint32_t{f.data[2]} << 16 | std::uint32_t{f.data[1]} << 8 | f.data[3];
}

}  // namespace

Slave::Slave(int node, const std::string& name, std::uint32_t device_type,
             const SlaveHabits& habits)
    : node_(node), habits_(habits) {
  const std::int64_t no_remote = habits.cob_bit30 ? kNoRemote : 0;
  constexpr std::int64_t kMost16 = 0xFFFF, kMost32 = 0xFFFFFFFF;
  objects.add({{.address = 0x1000'00, .value = device_type},
               {.address = 0x1001'00, .type = u8, .carried = Carried::tpdo},
               {.address = 0x1003'00, .type = u8, .access = rw, .high = 0},
               {.address = 0x1005'00, .value = 0x80},
               {.address = 0x1008'00, .type = text, .text = name},
               {.address = 0x1009'00, .type = text, .text = "simulated"},
               {.address = 0x100A'00, .type = text, .text = "1"},
               {.address = 0x100C'00, .type = u16, .access = rw},
               {.address = 0x100D'00, .type = u8, .access = rw},
               {.address = 0x1014'00, .value = 0x80 + node},
               {.address = 0x1016'00, .type = u8, .value = 2},
               {.address = 0x1016'01, .access = rw, .low = 0, .high = 0x7FFFFF},
               {.address = 0x1016'02, .access = rw, .low = 0, .high = 0x7FFFFF},
               {.address = 0x1017'00, .type = u16, .access = rw},
               {.address = 0x1018'00, .type = u8, .value = 2},
               {.address = 0x1018'01, .value = 0},  // no vendor
               {.address = 0x1018'02, .value = 1},
               {.address = 0x1029'00, .type = u8, .value = 1},
               {.address = 0x1029'01, .type = u8, .access = rw, .high = 2}});
  for (unsigned sub = 1; sub <= 4; ++sub) objects.add({.address = 0x1003'00 + sub});
  for (int n = 0; n < kPdos; ++n) {
    const std::int64_t off = n == 0 ? 0 : kInvalid, base = 0x100 * n + node;
    objects.add({{.address = rpdo_object(n, 0), .type = u8, .value = 5},
                 {.address = rpdo_object(n, 1),
                  .access = rw,
                  .value = off | (0x200 + base),
                  .high = kMost32},
                 {.address = rpdo_object(n, 2), .type = u8, .access = rw, .value = 1},
                 {.address = rpdo_object(n, 5), .type = u16, .access = rw, .high = kMost16},
                 {.address = tpdo_object(n, 0), .type = u8, .value = 5},
                 {.address = tpdo_object(n, 1),
                  .access = rw,
                  .value = off | no_remote | (0x180 + base),
                  .high = kMost32},
                 {.address = tpdo_object(n, 2), .type = u8, .access = rw, .value = 1},
                 {.address = tpdo_object(n, 3), .type = u16, .access = rw},
                 {.address = tpdo_object(n, 5), .type = u16, .access = rw}});
    for (const Address map : {mapping_of(rpdo_object(n, 0)), mapping_of(tpdo_object(n, 0))}) {
      objects.add({.address = map, .type = u8, .access = rw});
      for (unsigned sub = 1; sub <= kMostMapped; ++sub)
        objects.add({.address = map + sub, .access = rw});
    }
  }
  objects.remove(rpdo_object(0, 3));
  learn_identifiers();
}

void Slave::learn_identifiers() {
  for (int n = 0; n < kPdos; ++n) {
    const Entry* e = objects.find(rpdo_object(n, 1));
    rpdo_id_[static_cast<std::size_t>(n)] = e == nullptr || (e->value & kInvalid) != 0
                                                ? kNoId
                                                : static_cast<std::uint32_t>(e->value & 0x7FF);
  }
}

void Slave::reset_communication() {
  objects.reset(0x1000'00, 0x1FFF'FF);
  learn_identifiers();
  transfer_.reset();
  heartbeat_due_.reset();
  master_seen_ = {};
  guard_seen_.reset();
  guard_toggle_ = guard_lost_ = false;
  master_lost_ = {};
  taken_ = {};
  late_ = {};
  waiting_ = {};
  syncs_ = {};
  sent_at_ = {};
}

void Slave::boot(Frames& out) {
  reset_communication();
  state_ = habits_.starts_itself ? kOperational : kPreOperational;
  later_.clear();
  if (habits_.no_boot_message) return;
  out.push_back({.id = 0x700u + static_cast<std::uint32_t>(node_), .length = 1, .data = {0}});
}

Event Slave::leave(State state) {
  const bool was_operational = operational();
  state_ = state;
  waiting_ = {};
  return was_operational && !operational() ? Event::not_operational : Event::none;
}

Event Slave::on_nmt(const Frame& frame, Frames& out) {
  if (frame.length < 2 || (frame.data[1] != 0 && frame.data[1] != node_)) return Event::none;
  switch (frame.data[0]) {
    case 0x01:
      return leave(kOperational);
    case 0x02:
      transfer_.reset();
      return leave(kStopped);
    case 0x80:
      return leave(kPreOperational);
    case 0x81:
      objects.reset(0x2000'00, 0xFFFF'FF);
      boot(out);
      return Event::reset_node;
    case 0x82: {
      const Event left = leave(kPreOperational);
      boot(out);
      return left;
    }
    default:
      return Event::none;
  }
}

Event Slave::handle(const Frame& frame, Frames& out) {
  if (frame.id == (can::kRemoteFlag | (0x700u + static_cast<std::uint32_t>(node_)))) {
    on_guard_request(out);
    return Event::none;
  }
  if ((frame.id & (can::kErrorFlag | can::kExtendedFlag | can::kRemoteFlag)) != 0)
    return Event::none;
  if (frame.id == 0x000) return on_nmt(frame, out);
  if (frame.id == 0x080) {
    if (!operational()) return Event::none;
    for (int n = 0; n < kPdos; ++n) {
      auto& waiting = waiting_[static_cast<std::size_t>(n)];
      if (waiting) unpack(n, *waiting);
      waiting.reset();
    }
    return Event::sync;
  }
  if (frame.id == 0x600u + static_cast<std::uint32_t>(node_)) {
    if (state_ != kStopped) on_sdo(frame, out);
    return Event::none;
  }
  if (frame.id > 0x700 && frame.id < 0x780) {
    for (unsigned i = 0; i < master_seen_.size(); ++i) {
      const std::int64_t watched = objects.value(0x1016'01 + i);
      const bool active = (watched & 0xFFFF) != 0;
      if (!active || watched >> 16 != frame.id - 0x700) continue;
      if (std::exchange(master_lost_[i], false)) end_error(0x10, out);
      master_seen_[i] = now_;
    }
    return Event::none;
  }
  for (int n = 0; operational() && n < kPdos; ++n) {
    if (frame.id == rpdo_id_[static_cast<std::size_t>(n)]) return take(n, frame, out);
  }
  return Event::none;
}

/// [CiA 301, 7.2.8.3.1]; a node that sends heartbeats is not guarded.
void Slave::on_guard_request(Frames& out) {
  if (objects.value(0x1017'00) != 0) return;
  const unsigned toggle = std::exchange(guard_toggle_, !guard_toggle_) && !habits_.stuck_toggle;
  out.push_back({.id = 0x700u + static_cast<std::uint32_t>(node_),
                 .length = 1,
                 .data = {static_cast<std::uint8_t>(toggle << 7 | state_)}});
  if (std::exchange(guard_lost_, false)) end_error(0x10, out);
  guard_seen_ = now_;
}

Event Slave::take(int n, const Frame& frame, Frames& out) {
  const Address mapping = mapping_of(rpdo_object(n, 0));
  int bits = 0;
  for (std::int64_t i = 1; i <= objects.value(mapping); ++i)
    bits += mapped_bits(objects.value(mapping + static_cast<Address>(i)));
  if (8 * frame.length < bits) {
    emergency(0x8210, 0x10, out);
    return Event::none;
  }
  const auto k = static_cast<std::size_t>(n);
  if (std::exchange(late_[k], false)) end_error(0x10, out);
  taken_[k] = now_;
  if (objects.value(rpdo_object(n, 2)) <= 240) {
    waiting_[k] = frame;
    return Event::none;
  }
  unpack(n, frame);
  return Event::set_points;
}

void Slave::unpack(int n, const Frame& frame) {
  const Address mapping = mapping_of(rpdo_object(n, 0));
  std::size_t at = 0;
  for (std::int64_t i = 1; i <= objects.value(mapping); ++i) {
    const std::int64_t entry = objects.value(mapping + static_cast<Address>(i));
    const auto bytes = static_cast<std::size_t>(mapped_bits(entry) / 8);
    const Entry* target = objects.find(mapped_address(entry));
    if (target != nullptr && at + bytes <= frame.length)
      objects.set(target->address, decode(target->type, std::span(frame.data).subspan(at, bytes)));
    at += bytes;
  }
}

Frame Slave::packed(int n) const {
  const Address mapping = mapping_of(tpdo_object(n, 0));
  Frame frame{.id = static_cast<std::uint32_t>(objects.value(tpdo_object(n, 1)) & 0x7FF)};
  for (std::int64_t i = 1; i <= objects.value(mapping); ++i) {
    const std::int64_t entry = objects.value(mapping + static_cast<Address>(i));
    const std::int64_t value = objects.value(mapped_address(entry));
    for (int bit = 0; bit < mapped_bits(entry); bit += 8)
      frame.data[frame.length++] = static_cast<std::uint8_t>(value >> bit);
  }
  return frame;
}

void Slave::send_synchronous(Frames& out) {
  for (int n = 0; operational() && n < kPdos; ++n) {
    const auto k = static_cast<std::size_t>(n);
    const std::int64_t type = objects.value(tpdo_object(n, 2));
    if ((objects.value(tpdo_object(n, 1)) & kInvalid) != 0 || type > 240) continue;
    const Frame frame = packed(n);
    if (type == 0 ? frame == sent_[k] : ++syncs_[k] < type) continue;
    syncs_[k] = 0;
    sent_[k] = frame;
    out.push_back(frame);
  }
}

Event Slave::advance(Time now, Frames& out) {
  now_ = now;
  const milliseconds heartbeat(objects.value(0x1017'00));
  if (heartbeat.count() > 0 && now >= heartbeat_due_.value_or(now)) {
    out.push_back(
        {.id = 0x700u + static_cast<std::uint32_t>(node_), .length = 1, .data = {state_}});
    heartbeat_due_ = now + heartbeat;
  }
  if (transfer_ && now - transfer_->since > kSdoTimeout)
    abort(transfer_->address, abort_code::kTimeout, out);
  while (!later_.empty() && now >= later_.front().first) {
    out.push_back(later_.front().second);
    later_.erase(later_.begin());
  }
  for (int n = 0; operational() && n < kPdos; ++n) {  // TPDOs by event
    const auto k = static_cast<std::size_t>(n);
    if ((objects.value(tpdo_object(n, 1)) & kInvalid) != 0) continue;
    if (objects.value(tpdo_object(n, 2)) < 254) continue;
    const milliseconds timer(objects.value(tpdo_object(n, 5)));
    const Time inhibit = objects.value(tpdo_object(n, 3)) * std::chrono::microseconds(100);
    const Frame frame = packed(n);
    const Time age = sent_at_[k] ? now - *sent_at_[k] : Time::max();
    const bool due = (timer.count() > 0 && age >= timer) || !(frame == sent_[k]);
    if (!due || age < inhibit) continue;
    sent_[k] = frame;
    sent_at_[k] = now;
    out.push_back(frame);
  }
  return watch(out);
}

void Slave::watch_set_points() {
  for (std::optional<Time>& taken : taken_) taken = now_;
}

/// The master is gone: what 1029h wants.
Event Slave::lose_master(Frames& out) {
  emergency(0x8130, 0x10, out);
  const std::int64_t behaviour = objects.value(0x1029'01);
  if (behaviour != 1 && operational()) leave(behaviour == 0 ? kPreOperational : kStopped);
  return Event::lost;
}

Event Slave::watch(Frames& out) {
  Event event = Event::none;
  const milliseconds life_time(objects.value(0x100C'00) * objects.value(0x100D'00));
  if (guard_seen_ && life_time.count() > 0 && now_ - *guard_seen_ > life_time) {
    guard_seen_.reset();
    guard_lost_ = true;
    event = lose_master(out);
  }
  for (unsigned i = 0; i < master_seen_.size(); ++i) {
    const milliseconds limit(objects.value(0x1016'01 + i) & 0xFFFF);
    if (!master_seen_[i] || now_ - *master_seen_[i] <= limit) continue;
    master_seen_[i].reset();  // watched again from its next heartbeat on
    master_lost_[i] = true;
    event = lose_master(out);
  }
  for (int n = 0; n < kPdos; ++n) {
    auto& taken = taken_[static_cast<std::size_t>(n)];
    const milliseconds limit(objects.value(rpdo_object(n, 5)));
    if (!taken || limit.count() == 0 || now_ - *taken <= limit) continue;
    taken.reset();
    late_[static_cast<std::size_t>(n)] = true;
    emergency(0x8250, 0x10, out);
    event = Event::lost;
  }
  return event;
}

void Slave::emergency(std::uint16_t code, std::uint8_t error_bits, Frames& out) {
  const std::int64_t bits = objects.value(0x1001'00) | error_bits | 1;  // bit 0: any error
  objects.set(0x1001'00, bits);
  for (unsigned sub = 4; sub > 1; --sub)
    objects.set(0x1003'00 + sub, objects.value(0x1003'00 + sub - 1));
  objects.set(0x1003'01, code);
  objects.set(0x1003'00, std::min<std::int64_t>(4, objects.value(0x1003'00) + 1));
  out.push_back({.id = static_cast<std::uint32_t>(objects.value(0x1014'00)),
                 .length = 8,
                 .data = {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8),
                          static_cast<std::uint8_t>(bits)}});
}

void Slave::end_error(std::uint8_t error_bits, Frames& out) {
  const std::int64_t bits = objects.value(0x1001'00) & ~std::int64_t{error_bits};
  if (bits > 1) return objects.set(0x1001'00, bits);
  clear_error(out);
}

void Slave::clear_error(Frames& out) {
  objects.set(0x1001'00, 0);
  out.push_back({.id = static_cast<std::uint32_t>(objects.value(0x1014'00)), .length = 8});
}

// SDO server [CiA 301, 7.2.4.3].

void Slave::answer(std::uint8_t command, Address address, std::uint32_t value, Frames& out) {
  Frame f{.id = 0x580u + static_cast<std::uint32_t>(node_), .length = 8};
  f.data[0] = command;
  f.data[1] = static_cast<std::uint8_t>(address >> 8);
  f.data[2] = static_cast<std::uint8_t>(address >> 16);
  f.data[3] = static_cast<std::uint8_t>(address);
  for (std::size_t i = 0; i < 4; ++i) f.data[4 + i] = static_cast<std::uint8_t>(value >> 8 * i);
  out.push_back(f);
}

void Slave::abort(Address address, std::uint32_t code, Frames& out) {
  transfer_.reset();
  if (habits_.odd_abort && (code == abort_code::kNoObject || code == abort_code::kNoSub))
    code = 0x06010000;
  answer(0x80, address, code, out);
}

void Slave::on_sdo(const Frame& frame, Frames& out) {
  const std::size_t before = out.size();
  serve(frame, out);
  if (habits_.sdo_delay.count() == 0) return;
  for (std::size_t i = before; i < out.size(); ++i)
    later_.emplace_back(now_ + habits_.sdo_delay, out[i]);
  out.resize(before);
}

void Slave::serve(const Frame& frame, Frames& out) {
  if (frame.length != 8) return;
  const Address address = address_in(frame);
  const auto in_transfer = [&](bool up) { return transfer_ && transfer_->up == up; };
  switch (frame.data[0] >> 5) {
    case 0:
      return in_transfer(false) ? next_download(frame, out)
                                : abort(address, abort_code::kCommand, out);
    case 1:
      return begin_download(frame, address, out);
    case 2:
      return begin_upload(address, out);
    case 3:
      return in_transfer(true) ? next_upload(frame, out)
                               : abort(address, abort_code::kCommand, out);
    case 4:
      transfer_.reset();  // the client has given up
      return;
    default:
      return abort(address, abort_code::kCommand, out);  // blocks
  }
}

void Slave::begin_upload(Address address, Frames& out) {
  std::vector<std::uint8_t> data;
  if (const std::uint32_t code = objects.read(address, data)) return abort(address, code, out);
  const auto size = static_cast<std::uint32_t>(data.size());
  if (size == 0 || size > 4) {
    transfer_ = Transfer{.up = true, .address = address, .data = std::move(data), .since = now_};
    return answer(0x41, address, size, out);
  }
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= std::uint32_t{data[i]} << 8 * i;
  transfer_.reset();
  const unsigned sized = habits_.four_byte_sdo ? 0x43u : 0x43u | (4 - size) << 2;
  answer(static_cast<std::uint8_t>(habits_.unsized_sdo ? 0x42u : sized), address, value, out);
}

void Slave::next_upload(const Frame& frame, Frames& out) {
  Transfer& t = *transfer_;
  const bool toggle = (frame.data[0] & 0x10) != 0;
  if (toggle != t.toggle) return abort(t.address, abort_code::kToggle, out);
  const std::size_t count = std::min<std::size_t>(7, t.data.size() - t.done);
  const bool last = t.done + count == t.data.size();
  Frame f{.id = 0x580u + static_cast<std::uint32_t>(node_), .length = 8};
  f.data[0] = static_cast<std::uint8_t>((toggle ? 0x10 : 0) | (7 - count) << 1 | (last ? 1 : 0));
  std::copy_n(t.data.begin() + static_cast<std::ptrdiff_t>(t.done), count, f.data.begin() + 1);
  out.push_back(f);
  t.done += count;
  t.toggle = !t.toggle;
  t.since = now_;
  if (last) transfer_.reset();
}

void Slave::begin_download(const Frame& frame, Address address, Frames& out) {
  const unsigned command = frame.data[0];
  if ((command & 2u) == 0) {
    const Entry* e = objects.find(address);
    std::vector<std::uint8_t> ignored;
    if (e == nullptr) return abort(address, objects.read(address, ignored), out);
    if (e->access == Access::ro) return abort(address, abort_code::kReadOnly, out);
    transfer_ = Transfer{.address = address, .since = now_};
    return answer(0x60, address, 0, out);
  }
  transfer_.reset();
  // Without a size the number is as long as the object.
  const Entry* e = objects.find(address);
  const std::size_t own =
      e == nullptr || e->type == Type::text ? 4 : static_cast<std::size_t>(bytes_of(e->type));
  const std::size_t size = (command & 1u) != 0 ? 4 - (command >> 2 & 3u) : own;
  if (const std::uint32_t code = download(address, std::span(frame.data).subspan(4, size)))
    return abort(address, code, out);
  answer(0x60, address, 0, out);
}

void Slave::next_download(const Frame& frame, Frames& out) {
  constexpr std::size_t kMostBytes = 256;
  Transfer& t = *transfer_;
  const bool toggle = (frame.data[0] & 0x10) != 0, last = (frame.data[0] & 1) != 0;
  if (toggle != t.toggle) return abort(t.address, abort_code::kToggle, out);
  const std::size_t count = 7 - (frame.data[0] >> 1 & 7u);
  t.data.insert(t.data.end(), frame.data.begin() + 1,
                frame.data.begin() + 1 + static_cast<std::ptrdiff_t>(count));
  if (t.data.size() > kMostBytes) return abort(t.address, abort_code::kLength, out);
  t.toggle = !t.toggle;
  t.since = now_;
  const Address address = t.address;
  if (last) {
    const std::vector<std::uint8_t> data = std::move(t.data);
    if (const std::uint32_t code = download(address, data)) return abort(address, code, out);
    transfer_.reset();
  }
  Frame f{.id = 0x580u + static_cast<std::uint32_t>(node_), .length = 8};
  f.data[0] = static_cast<std::uint8_t>(0x20 | (toggle ? 0x10 : 0));
  out.push_back(f);
}

std::uint32_t Slave::download(Address address, std::span<const std::uint8_t> data) {
  std::int64_t value = 0;
  if (const std::uint32_t code = objects.refuse_write(address, data, value)) return code;
  if (const std::uint32_t code = refuse(address, value)) return code;
  objects.write(address, data, value);
  if (is_pdo(address)) learn_identifiers();
  return 0;
}

std::uint32_t Slave::refuse(Address address, std::int64_t value) const {
  if (is_mapping(address)) return refuse_mapping(address, value);
  if (is_pdo(address) && (address & 0xFF) == 1) {
    const std::int64_t before = objects.value(address);
    if (habits_.cob_bit30 && address >= 0x1800'00 && (value & kNoRemote) == 0)
      return abort_code::kRange;
    const bool moved = ((value ^ before) & 0x7FF) != 0;
    const bool on = (value & kInvalid) == 0, was_on = (before & kInvalid) == 0;
    return (on && restricted(value & 0x7FF)) || (on && was_on && moved) ? abort_code::kRange : 0;
  }
  if (address == 0x1016'01 || address == 0x1016'02) {
    const std::int64_t other = objects.value(address ^ 3u);
    const bool both = (value & 0xFFFF) != 0 && (other & 0xFFFF) != 0;
    return both && value >> 16 == other >> 16 ? abort_code::kIncompatible : 0;
  }
  return 0;
}

/// A mapping changes only while the PDO is off and its number of objects is 0.
std::uint32_t Slave::refuse_mapping(Address address, std::int64_t value) const {
  const Address map = address & 0xFFFFFF00u, pdo = map - 0x200'00u;
  const auto fits = [&](std::int64_t entry) {
    const Entry* e = objects.find(mapped_address(entry));
    if (e == nullptr || e->carried == Carried::no) return false;
    const bool way = pdo >= 0x1800'00 || e->carried == Carried::rpdo;  // what is set can be shown
    return way && 8 * bytes_of(e->type) == mapped_bits(entry);
  };
  if ((objects.value(pdo + 1) & kInvalid) == 0) return abort_code::kState;
  if (address != map) {
    if (objects.value(map) != 0) return abort_code::kState;
    return fits(value) ? 0 : abort_code::kNotMappable;
  }
  if (value > kMostMapped) return abort_code::kTooHigh;
  int bits = 0;
  for (std::int64_t i = 1; i <= value; ++i) {
    const std::int64_t entry = objects.value(map + static_cast<Address>(i));
    if (!fits(entry)) return abort_code::kNotMappable;
    bits += mapped_bits(entry);
  }
  return bits <= 64 ? 0 : abort_code::kPdoLength;
}

}  // namespace mimesis::hw::sim
