#include "hw/can/multicast.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <string_view>
#include <vector>

#include "common/error.h"
#include "hw/can/messages.h"

namespace mimesis::hw::can {
namespace {

/// Reads msgpack, as far as the map of a frame needs it: no arrays, no maps in maps.
class Unpacker {
 public:
  explicit Unpacker(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  struct Value {
    enum class Kind : std::uint8_t { nothing, number, bytes, bad } kind = Kind::bad;
    std::uint64_t number = 0;  // also of booleans
    std::span<const std::uint8_t> bytes{};
  };

  std::optional<std::size_t> map_size() {
    const std::uint64_t type = big_endian(1);
    if (type >= 0x80 && type <= 0x8F) return type & 0xF;
    return type == 0xDE ? std::optional<std::size_t>(big_endian(2)) : std::nullopt;
  }
  Value value() {
    using enum Value::Kind;
    const std::uint64_t type = big_endian(1);
    if (!good_) return {};
    if (type <= 0x7F) return {number, type};
    if (type >= 0xA0 && type <= 0xBF) return take(type & 0x1F);
    switch (type) {
      case 0xC0:
        return checked({nothing});
      case 0xC2:
      case 0xC3:
        return checked({number, type & 1});
      case 0xC4:  // bin, str with 8 and 16 bits of length
      case 0xD9:
        return take(big_endian(1));
      case 0xC5:
      case 0xDA:
        return take(big_endian(2));
      case 0xCA:  // floats: the time, which nobody needs
        big_endian(4);
        return checked({nothing});
      case 0xCB:
        big_endian(8);
        return checked({nothing});
      case 0xCC:
      case 0xCD:
      case 0xCE:
      case 0xCF:
        return checked({number, big_endian(1 << (type - 0xCC))});
      default:
        return {};
    }
  }

 private:
  std::uint64_t big_endian(std::size_t bytes) {
    good_ = good_ && rest_.size() >= bytes;
    std::uint64_t value = 0;
    for (std::size_t i = 0; good_ && i < bytes; ++i) value = value << 8 | rest_[i];
    if (good_) rest_ = rest_.subspan(bytes);
    return value;
  }
  Value take(std::uint64_t count) {
    if (!good_ || rest_.size() < count) return {};
    const auto bytes = rest_.first(count);
    rest_ = rest_.subspan(count);
    return {Value::Kind::bytes, 0, bytes};
  }
  Value checked(const Value& value) const { return good_ ? value : Value{}; }

  std::span<const std::uint8_t> rest_;
  bool good_ = true;
};

void append_key(std::string& out, std::string_view key) {
  out.push_back(static_cast<char>(0xA0 | key.size()));
  out.append(key);
}
void append_big_endian(std::string& out, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<char>(value >> 8 * i));
}

class MulticastBus final : public Bus {
 public:
  explicit MulticastBus(const std::string& group) : room_(Messages::kMost * kMulticastBytes) {
    const auto refuse = [&](const std::string& why) {
      close_all();
      throw ConfigError("CAN bus 'udp_multicast:" + group + "': " + why);
    };
    group_.sin_family = AF_INET;
    group_.sin_port = htons(kMulticastPort);
    if (inet_aton(group.c_str(), &group_.sin_addr) == 0 ||
        !IN_MULTICAST(ntohl(group_.sin_addr.s_addr)))
      refuse("expected a multicast group such as 239.74.163.2");
    in_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    out_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const in_addr here{.s_addr = htonl(INADDR_LOOPBACK)};
    const ip_mreq member{.imr_multiaddr = group_.sin_addr, .imr_interface = here};
    const int on = 1, hops = 0;
    own_.sin_family = AF_INET;
    own_.sin_addr = here;
    socklen_t size = sizeof own_;
    const auto* group_address = reinterpret_cast<const sockaddr*>(&group_);
    auto* own = reinterpret_cast<sockaddr*>(&own_);
    const bool made = in_ >= 0 && out_ >= 0 &&
                      setsockopt(in_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
                      bind(in_, group_address, sizeof group_) == 0 &&
                      setsockopt(in_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &member, sizeof member) == 0 &&
                      setsockopt(out_, IPPROTO_IP, IP_MULTICAST_IF, &here, sizeof here) == 0 &&
                      setsockopt(out_, IPPROTO_IP, IP_MULTICAST_TTL, &hops, sizeof hops) == 0 &&
                      bind(out_, own, sizeof own_) == 0 && getsockname(out_, own, &size) == 0;
    if (!made) refuse(std::strerror(errno));
  }
  ~MulticastBus() override { close_all(); }
  MulticastBus(const MulticastBus&) = delete;
  MulticastBus& operator=(const MulticastBus&) = delete;

  void send(std::span<const Frame> frames) override {
    const std::chrono::duration<double> now = std::chrono::system_clock::now().time_since_epoch();
    while (!frames.empty()) {
      const auto batch = frames.first(std::min(frames.size(), Messages::kMost));
      std::array<std::size_t, Messages::kMost + 1> begins{};
      packed_.clear();
      for (std::size_t i = 0; i < batch.size(); ++i) {
        pack(batch[i], now.count(), packed_);
        begins[i + 1] = packed_.size();
      }
      messages_.clear();
      for (std::size_t i = 0; i < batch.size(); ++i) {
        messages_.add(packed_.data() + begins[i], begins[i + 1] - begins[i],
                      reinterpret_cast<sockaddr*>(&group_), sizeof group_);
      }
      const std::size_t sent = messages_.send(out_);
      counters_.sent += sent;
      counters_.errors += batch.size() - sent;
      frames = frames.subspan(batch.size());
    }
  }

  std::size_t receive(std::span<Frame> frames) override {
    std::size_t filled = 0;
    while (filled < frames.size()) {
      const std::size_t room = std::min(frames.size() - filled, Messages::kMost);
      std::array<sockaddr_in, Messages::kMost> from{};
      messages_.clear();
      for (std::size_t i = 0; i < room; ++i) {
        messages_.add(&room_[i * kMulticastBytes], kMulticastBytes,
                      reinterpret_cast<sockaddr*>(&from[i]), sizeof from[i]);
      }
      const std::size_t got = messages_.receive(in_);
      if (got == 0) break;
      for (std::size_t i = 0; i < got; ++i) {
        const bool ours =
            from[i].sin_port == own_.sin_port && from[i].sin_addr.s_addr == own_.sin_addr.s_addr;
        if (ours) continue;
        const auto frame = unpack({&room_[i * kMulticastBytes], messages_.bytes(i)});
        ++(!frame || (frame->id & kErrorFlag) != 0 ? counters_.errors : counters_.received);
        if (frame) frames[filled++] = *frame;
      }
    }
    return filled;
  }

 private:
  void close_all() const {
    if (in_ >= 0) close(in_);
    if (out_ >= 0) close(out_);
  }

  sockaddr_in group_{}, own_{};
  int in_ = -1, out_ = -1;
  std::vector<std::uint8_t> room_;
  std::string packed_;
  Messages messages_;
};

}  // namespace

void pack(const Frame& frame, double time_s, std::string& out) {
  const bool remote = (frame.id & kRemoteFlag) != 0;
  const bool fd = frame.length > 8 || (frame.flags & kFd) != 0;
  const auto flag = [&](std::string_view key, bool value) {
    append_key(out, key);
    out.push_back(static_cast<char>(value ? 0xC3 : 0xC2));
  };
  out.push_back(static_cast<char>(0x8B));  // map of eleven
  append_key(out, "timestamp");
  out.push_back(static_cast<char>(0xCB));
  append_big_endian(out, std::bit_cast<std::uint64_t>(time_s), 8);
  append_key(out, "arbitration_id");
  out.push_back(static_cast<char>(0xCE));
  append_big_endian(out, frame.id & 0x1FFFFFFF, 4);
  flag("is_extended_id", (frame.id & kExtendedFlag) != 0);
  flag("is_remote_frame", remote);
  flag("is_error_frame", (frame.id & kErrorFlag) != 0);
  append_key(out, "channel");
  out.push_back(static_cast<char>(0xC0));
  append_key(out, "dlc");
  out.push_back(static_cast<char>(frame.length));
  append_key(out, "data");
  out.push_back(static_cast<char>(0xC4));
  out.push_back(static_cast<char>(remote ? 0 : frame.length));
  if (!remote) out.append(reinterpret_cast<const char*>(frame.data.data()), frame.length);
  flag("is_fd", fd);
  flag("bitrate_switch", (frame.flags & 1) != 0);
  flag("error_state_indicator", (frame.flags & 2) != 0);
}

std::optional<Frame> unpack(std::span<const std::uint8_t> bytes) {
  using Kind = Unpacker::Value::Kind;
  Unpacker in(bytes);
  const auto count = in.map_size();
  if (!count) return std::nullopt;
  Frame frame;
  std::uint64_t id = 1u << 30, length = 65;
  std::span<const std::uint8_t> data;
  for (std::size_t i = 0; i < *count; ++i) {
    const auto key = in.value(), value = in.value();
    if (key.kind != Kind::bytes || value.kind == Kind::bad) return std::nullopt;
    const std::string_view name(reinterpret_cast<const char*>(key.bytes.data()), key.bytes.size());
    if (name == "arbitration_id") id = value.number;
    if (name == "dlc") length = value.number;
    if (name == "data") data = value.bytes;
    if (value.kind != Kind::number || value.number == 0) continue;
    if (name == "is_extended_id") frame.id |= kExtendedFlag;
    if (name == "is_remote_frame") frame.id |= kRemoteFlag;
    if (name == "is_error_frame") frame.id |= kErrorFlag;
    if (name == "is_fd") frame.flags |= kFd;
    if (name == "bitrate_switch") frame.flags |= 1;
    if (name == "error_state_indicator") frame.flags |= 2;
  }
  const bool remote = (frame.id & kRemoteFlag) != 0;
  const bool wide = (frame.id & (kExtendedFlag | kErrorFlag)) != 0;
  if (id > (wide ? 0x1FFFFFFFu : 0x7FFu) || length > frame.data.size()) return std::nullopt;
  if (length > 8 && (frame.flags & kFd) == 0) return std::nullopt;
  if (remote ? !data.empty() : data.size() != length) return std::nullopt;
  frame.id |= static_cast<std::uint32_t>(id);
  frame.length = static_cast<std::uint8_t>(length);
  std::copy(data.begin(), data.end(), frame.data.begin());
  return frame;
}

std::unique_ptr<Bus> open_multicast(const std::string& group) {
  return std::make_unique<MulticastBus>(group);
}

}  // namespace mimesis::hw::can
