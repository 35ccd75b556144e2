#include "hw/cia402/canopen.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "common/error.h"

namespace mimesis::hw::cia402 {
namespace {

using can::Frame;

// Base identifiers of the predefined connection set [CiA 301, 7.3.3].
constexpr std::uint32_t kNmt = 0x000, kSync = 0x080, kEmergency = 0x080, kTpdo1 = 0x180,
                        kRpdo1 = 0x200, kSdoResponse = 0x580, kSdoRequest = 0x600,
                        kHeartbeat = 0x700;

Frame frame(std::uint32_t base, int node) {
  MIMESIS_ASSERT(node >= 0 && node <= kLastNode);
  return Frame{.id = base + static_cast<std::uint32_t>(node)};
}

Frame sdo(std::uint32_t base, int node, unsigned command, Object object, std::uint32_t value) {
  Frame f = frame(base, node);
  append(f, command, 1);
  append(f, object.index, 2);
  append(f, object.sub, 1);
  append(f, value, 4);
  return f;
}

/// Command byte of an expedited transfer with size: 4 - bytes in bits 2-3, e = s = 1.
unsigned expedited(unsigned command, int bytes) {
  MIMESIS_ASSERT(bytes >= 1 && bytes <= 4);
  return command | static_cast<unsigned>(4 - bytes) << 2 | 3u;
}

struct Text {
  std::uint32_t code;
  const char* text;
};

constexpr std::array kAborts = {
    Text{0x05030000, "toggle bit not alternated"},
    Text{0x05040000, "SDO protocol timed out"},
    Text{0x05040001, "command specifier not known"},
    Text{0x06010000, "unsupported access"},
    Text{0x06010001, "object is write-only"},
    Text{0x06010002, "object is read-only"},
    Text{0x06020000, "object does not exist"},
    Text{0x06040041, "object cannot be mapped to a PDO"},
    Text{0x06040042, "mapped objects exceed the PDO's length"},
    Text{0x06060000, "hardware error"},
    Text{0x06070010, "length of the value does not match"},
    Text{0x06090011, "sub-index does not exist"},
    Text{0x06090030, "value out of range"},
    Text{0x06090031, "value too high"},
    Text{0x06090032, "value too low"},
    Text{0x08000000, "general error"},
    Text{0x08000020, "value cannot be stored"},
    Text{0x08000021, "value cannot be stored because of local control"},
    Text{0x08000022, "value cannot be stored in this state"},
};

constexpr std::array kEmergencies = {
    Text{0x0000, "error reset"},
    Text{0x2310, "continuous over-current"},
    Text{0x3210, "DC link over-voltage"},
    Text{0x3220, "DC link under-voltage"},
    Text{0x4310, "drive too hot"},
    Text{0x7300, "position sensor"},
    Text{0x8110, "CAN overrun"},
    Text{0x8120, "CAN error passive"},
    Text{0x8130, "heartbeat of the master lost"},
    Text{0x8140, "recovered from bus-off"},
    Text{0x8210, "PDO of wrong length"},
    Text{0x8250, "RPDO timed out"},
    Text{0x8611, "following error"},
};

template <std::size_t N>
std::string find(const std::array<Text, N>& table, std::uint32_t code, int digits) {
  const std::string number = fmt::format("0x{:0{}X}", code, digits);
  for (const Text& t : table) {
    if (t.code == code) return std::string(t.text) + " (" + number + ")";
  }
  return number;
}

using can::Frame;

constexpr std::size_t kPerSegment = 7, kMostBytes = 1u << 16;
constexpr std::uint32_t kToggle = 0x05030000, kCommand = 0x05040001, kNoMemory = 0x05040005;

std::uint32_t number(const std::vector<std::uint8_t>& data) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < data.size(); ++i) value |= std::uint32_t{data[i]} << 8 * i;
  return value;
}

}  // namespace

void append(Frame& f, std::uint32_t value, int bytes) {
  MIMESIS_ASSERT(f.length + bytes <= 8);
  for (int i = 0; i < bytes; ++i) f.data[f.length++] = static_cast<std::uint8_t>(value >> 8 * i);
}

std::optional<std::uint32_t> unsigned_at(const Frame& f, int offset, int bytes) {
  if (offset + bytes > f.length) return std::nullopt;
  std::uint32_t value = 0;
  for (int i = 0; i < bytes; ++i) {
    value |= std::uint32_t{f.data[static_cast<std::size_t>(offset + i)]} << 8 * i;
  }
  return value;
}

std::optional<std::int32_t> signed_at(const Frame& f, int offset, int bytes) {
  const auto value = unsigned_at(f, offset, bytes);
  if (!value) return std::nullopt;
  const int unused = 32 - 8 * bytes;
  return static_cast<std::int32_t>(*value << unused) >> unused;
}

Frame nmt(Nmt command, int node) {
  Frame f = frame(kNmt, 0);
  append(f, static_cast<std::uint32_t>(command), 1);
  append(f, static_cast<std::uint32_t>(node), 1);
  return f;
}

Frame sync() { return frame(kSync, 0); }

Frame heartbeat(int node, NmtState state) {
  Frame f = frame(kHeartbeat, node);
  append(f, static_cast<std::uint32_t>(state), 1);
  return f;
}

Frame guard_request(int node) {
  Frame f = frame(kHeartbeat, node);
  f.id |= can::kRemoteFlag;
  f.length = 1;
  return f;
}

Frame emergency(int node, std::uint16_t code, std::uint8_t error_register) {
  Frame f = frame(kEmergency, node);
  append(f, code, 2);
  append(f, error_register, 1);
  append(f, 0, 4);
  append(f, 0, 1);
  return f;
}

std::string text(Object object) { return fmt::format("{:04X}:{:02X}", object.index, object.sub); }

Frame sdo_upload(int node, Object object) { return sdo(kSdoRequest, node, 0x40, object, 0); }
Frame sdo_download(int node, Object object, std::uint32_t value, int bytes) {
  return sdo(kSdoRequest, node, expedited(0x20, bytes), object, value);
}
Frame sdo_abort(int node, Object object, std::uint32_t code) {
  return sdo(kSdoResponse, node, 0x80, object, code);
}

Sdo parse_sdo_response(const Frame& f) {
  Sdo s;
  if (f.length != 8) return s;
  const unsigned command = f.data[0];
  s.object = {static_cast<std::uint16_t>(*unsigned_at(f, 1, 2)), f.data[3]};
  s.value = *unsigned_at(f, 4, 4);
  if (command == 0x80) {
    s.kind = Sdo::Kind::abort;
  } else if (command >> 5 == 0x60 >> 5) {
    s.kind = Sdo::Kind::downloaded;
  } else if (command >> 5 == 0x40 >> 5 && (command & 2u) != 0) {  // expedited
    s.kind = Sdo::Kind::uploaded;
    s.bytes = (command & 1u) != 0 ? 4 - static_cast<int>(command >> 2 & 3u) : 4;
    if (s.bytes < 4) s.value &= (1u << 8 * s.bytes) - 1u;
  }
  return s;
}

std::string abort_text(std::uint32_t code) { return find(kAborts, code, 8); }
std::string emergency_text(std::uint16_t code) { return find(kEmergencies, code, 4); }

Frame rpdo(int n, int node) { return frame(kRpdo1 + 0x100u * static_cast<unsigned>(n - 1), node); }
Frame tpdo(int n, int node) { return frame(kTpdo1 + 0x100u * static_cast<unsigned>(n - 1), node); }

Identity identify(const Frame& f) {
  using enum Identity::Kind;
  if ((f.id & (can::kErrorFlag | can::kExtendedFlag | can::kRemoteFlag)) != 0) return {};
  const int node = static_cast<int>(f.id & 0x7F);
  const std::uint32_t base = f.id & 0x780;
  if (f.id == kNmt) return {nmt};
  if (f.id == kSync) return {sync};
  if (node == 0) return {};
  switch (base) {
    case kEmergency:
      return {emergency, node};
    case kSdoResponse:
      return {sdo_response, node};
    case kSdoRequest:
      return {sdo_request, node};
    case kHeartbeat:
      return {heartbeat, node};
    default:
      break;
  }
  if (base >= 0x180 && base <= 0x500) {  // 180 TPDO1, 200 RPDO1, 280 TPDO2, ... 500 RPDO4
    const bool receive = (base & 0x80) == 0;
    const int n = static_cast<int>(receive ? base >> 8 : (base + 0x80) >> 8);
    return {receive ? rpdo : tpdo, node, n - 1};
  }
  return {};
}

Frame SdoTransfer::first() const {
  if (up_) return sdo_upload(node_, object_);
  const std::size_t size = data_.size();
  if (size >= 1 && size <= 4)
    return sdo_download(node_, object_, number(data_), static_cast<int>(size));
  Frame frame = sdo_upload(node_, object_);
  frame.data[0] = 0x21;  // segments of a size that bytes 4 to 7 tell
  for (std::size_t i = 0; i < 4; ++i) frame.data[4 + i] = static_cast<std::uint8_t>(size >> 8 * i);
  return frame;
}

/// The next segment, or the request for it.
Frame SdoTransfer::segment_request() const {
  Frame frame = sdo_upload(node_, {});
  const unsigned toggle = toggle_ ? 0x10 : 0;
  frame.data.fill(0);
  if (up_) {
    frame.data[0] = static_cast<std::uint8_t>(0x60u | toggle);
    return frame;
  }
  const std::size_t count = std::min(kPerSegment, data_.size() - sent_);
  const bool last = sent_ + count == data_.size();
  frame.data[0] = static_cast<std::uint8_t>(toggle | (kPerSegment - count) << 1 | (last ? 1u : 0u));
  std::copy_n(data_.begin() + static_cast<std::ptrdiff_t>(sent_), count, frame.data.begin() + 1);
  return frame;
}

std::optional<Frame> SdoTransfer::finish(std::string failure) {
  done_ = true;
  failure_ = std::move(failure);
  return std::nullopt;
}

std::optional<Frame> SdoTransfer::give_up(std::uint32_t code, const std::string& why) {
  finish(why);
  Frame frame = sdo_abort(node_, object_, code);
  frame.id = sdo_upload(node_, object_).id;  // from the client
  return frame;
}

std::optional<Frame> SdoTransfer::handle(const Frame& frame) {
  const Identity id = identify(frame);
  if (done_ || id.kind != Identity::Kind::sdo_response || id.node != node_ || frame.length != 8)
    return std::nullopt;
  const Sdo answer = parse_sdo_response(frame);
  if (frame.data[0] == 0x80) return finish(abort_text(answer.value));
  if (!segments_ && answer.object != object_) return std::nullopt;  // to an earlier request
  return up_ ? on_upload(frame) : on_download(frame);
}

std::optional<Frame> SdoTransfer::on_upload(const Frame& frame) {
  const unsigned command = frame.data[0];
  if (!segments_) {
    if (command >> 5 != 2)
      return give_up(kCommand, fmt::format("answer 0x{:02X} to an upload", command));
    const bool sized = (command & 1u) != 0;
    if ((command & 2u) != 0) {
      const std::size_t size = sized ? 4 - (command >> 2 & 3u) : 4;
      data_.assign(frame.data.begin() + 4,
                   frame.data.begin() + 4 + static_cast<std::ptrdiff_t>(size));
      return finish();
    }
    if (sized) announced_ = *unsigned_at(frame, 4, 4);
    if (announced_.value_or(0) > kMostBytes)
      return give_up(kNoMemory, fmt::format("an object of {} bytes", *announced_));
    segments_ = true;
    return segment_request();
  }
  if (command >> 5 != 0)
    return give_up(kCommand, fmt::format("answer 0x{:02X} instead of a segment", command));
  if (((command & 0x10u) != 0) != toggle_) return give_up(kToggle, abort_text(kToggle));
  const std::size_t count = kPerSegment - (command >> 1 & 7u);
  data_.insert(data_.end(), frame.data.begin() + 1,
               frame.data.begin() + 1 + static_cast<std::ptrdiff_t>(count));
  if (data_.size() > kMostBytes)
    return give_up(kNoMemory, fmt::format("more than {} bytes", kMostBytes));
  toggle_ = !toggle_;
  if ((command & 1u) == 0) return segment_request();
  if (announced_ && *announced_ != data_.size())
    return finish(fmt::format("{} bytes announced, {} sent", *announced_, data_.size()));
  return finish();
}

std::optional<Frame> SdoTransfer::on_download(const Frame& frame) {
  const unsigned command = frame.data[0];
  const bool expedited = data_.size() >= 1 && data_.size() <= 4;
  if (!segments_) {
    if (command >> 5 != 3)
      return give_up(kCommand, fmt::format("answer 0x{:02X} to a download", command));
    if (expedited) return finish();
    segments_ = true;
    return segment_request();
  }
  if (command >> 5 != 1)
    return give_up(kCommand, fmt::format("answer 0x{:02X} to a segment", command));
  if (((command & 0x10u) != 0) != toggle_) return give_up(kToggle, abort_text(kToggle));
  sent_ += std::min(kPerSegment, data_.size() - sent_);
  toggle_ = !toggle_;
  if (sent_ == data_.size()) return finish();
  return segment_request();
}

}  // namespace mimesis::hw::cia402
