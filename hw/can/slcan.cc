#include "hw/can/slcan.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/can/error.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>

#include "common/error.h"

namespace mimesis::hw::can {
namespace {

constexpr std::size_t kLongestLine = 64;

/// A number of exactly `digits` hexadecimal (or decimal) digits at the front, which are taken off.
std::optional<std::uint32_t> take_number(std::string_view& text, std::size_t digits,
                                         std::uint32_t base = 16) {
  if (text.size() < digits) return std::nullopt;
  std::uint32_t value = 0;
  for (const char c : text.substr(0, digits)) {
    const int digit = c >= '0' && c <= '9'   ? c - '0'
                      : c >= 'A' && c <= 'F' ? c - 'A' + 10
                      : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                             : 99;
    if (digit >= static_cast<int>(base)) return std::nullopt;
    value = value * base + static_cast<std::uint32_t>(digit);
  }
  text.remove_prefix(digits);
  return value;
}

/// sXRRRTTT: state and counters of receive and transmit errors.
std::optional<Frame> state_frame(std::string_view line) {
  if (line.empty()) return std::nullopt;
  const char state = line.front();
  line.remove_prefix(1);
  const auto received = take_number(line, 3, 10), sent = take_number(line, 3, 10);
  if (!received || !sent) return std::nullopt;
  Frame frame{.id = kErrorFlag, .length = 8};
  frame.data[6] = static_cast<std::uint8_t>(std::min(*sent, 255u));
  frame.data[7] = static_cast<std::uint8_t>(std::min(*received, 255u));
  frame.id |= state == 'b' ? kBusOff : kControllerState;
  switch (state) {
    case 'a':
      frame.data[1] = CAN_ERR_CRTL_ACTIVE;
      return frame;
    case 'w':
      frame.data[1] = CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING;
      return frame;
    case 'p':
      frame.data[1] = kPassive;
      return frame;
    case 'b':
      return frame;
    default:
      return std::nullopt;
  }
}

/// eNX..: N errors on the bus.
std::optional<Frame> bus_errors_frame(std::string_view line) {
  const auto count = take_number(line, 1);
  if (!count || line.size() < *count) return std::nullopt;
  Frame frame{.id = kErrorFlag, .length = 8};
  for (const char c : line.substr(0, *count)) {
    const auto broken = [&](std::uint8_t how, std::uint8_t where) {
      frame.id |= CAN_ERR_PROT | CAN_ERR_BUSERROR;
      frame.data[2] |= how;
      frame.data[3] = where;
    };
    if (c == 'a') frame.id |= CAN_ERR_BUSERROR | CAN_ERR_ACK;
    if (c == 'b') broken(CAN_ERR_PROT_BIT0, 0);
    if (c == 'B') broken(CAN_ERR_PROT_BIT1, 0);
    if (c == 'c') broken(0, CAN_ERR_PROT_LOC_CRC_SEQ);
    if (c == 'f') broken(CAN_ERR_PROT_FORM, 0);
    if (c == 's') broken(CAN_ERR_PROT_STUFF, 0);
    if (c == 'o' || c == 'O') {
      frame.id |= kControllerState;
      frame.data[1] |= c == 'o' ? CAN_ERR_CRTL_RX_OVERFLOW : CAN_ERR_CRTL_TX_OVERFLOW;
    }
  }
  return frame;
}

class SlcanBus final : public Bus {
 public:
  explicit SlcanBus(const std::string& device) {
    const std::size_t at = device.find('@');
    const std::string path = device.substr(0, at);
    const std::string bitrate = at == std::string::npos ? "1000000" : device.substr(at + 1);
    const auto refuse = [&](const std::string& why) {
      if (line_ >= 0) close(line_);
      throw ConfigError("CAN adapter '" + device + "': " + why);
    };
    constexpr std::array kBitrates{"10000",  "20000",  "50000",  "100000", "125000",
                                   "250000", "500000", "800000", "1000000"};
    const auto* rate = std::ranges::find(kBitrates, bitrate);
    if (rate == kBitrates.end()) {
      refuse(fmt::format("bit rate '{}', expected one of {}", bitrate, fmt::join(kBitrates, ", ")));
    }
    line_ = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    termios settings{};
    if (line_ < 0 || ioctl(line_, TIOCEXCL) < 0 || tcgetattr(line_, &settings) < 0)
      refuse(std::strerror(errno));
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    cfsetspeed(&settings, B115200);  // USB does not care
    const bool set = tcsetattr(line_, TCSANOW, &settings) == 0 && tcflush(line_, TCIOFLUSH) == 0;
    if (!set) refuse(std::strerror(errno));
    const std::string open = fmt::format("C\rS{}\rO\r", rate - kBitrates.begin());
    if (write(line_, open.data(), open.size()) != std::ssize(open))
      refuse("does not take commands");
  }
  ~SlcanBus() override {
    if (write(line_, "C\r", 2) < 0) ++counters_.errors;  // the adapter is gone
    close(line_);
  }
  SlcanBus(const SlcanBus&) = delete;
  SlcanBus& operator=(const SlcanBus&) = delete;

  /// A line that the port has taken a part of is completed first; frames that do not fit are gone.
  void send(std::span<const Frame> frames) override {
    begun_.erase(0, put(begun_));
    lines_.clear();
    ends_.clear();
    for (const Frame& frame : frames) {
      if (begun_.empty() && to_line(frame, lines_)) ends_.push_back(lines_.size());
    }
    const std::size_t written = put(lines_);
    std::size_t sent = 0;
    while (sent < ends_.size() && ends_[sent] <= written) ++sent;
    const std::size_t whole = sent == 0 ? 0 : ends_[sent - 1];
    if (written > whole) begun_ = lines_.substr(written, ends_[sent++] - written);
    counters_.sent += sent;
    counters_.errors += frames.size() - sent;
  }

  std::size_t receive(std::span<Frame> frames) override {
    std::size_t filled = 0;
    while (filled < frames.size()) {
      if (next_ == got_) {
        const ssize_t bytes = read(line_, arrived_.data(), arrived_.size());
        if (bytes <= 0) break;
        got_ = static_cast<std::size_t>(bytes);
        next_ = 0;
      }
      const char c = arrived_[next_++];
      const bool complains = c == '\a';
      if (complains) ++counters_.errors;
      if (c != '\r' && !complains) {
        if (heard_.size() < kLongestLine) heard_.push_back(c);
        continue;
      }
      if (const auto frame = from_line(heard_)) {
        ++((frame->id & kErrorFlag) != 0 ? counters_.errors : counters_.received);
        frames[filled++] = *frame;
      }
      heard_.clear();
    }
    return filled;
  }

 private:
  std::size_t put(const std::string& bytes) const {
    const ssize_t written = bytes.empty() ? 0 : write(line_, bytes.data(), bytes.size());
    return written < 0 ? 0 : static_cast<std::size_t>(written);
  }

  int line_ = -1;
  std::string lines_, begun_, heard_;
  std::vector<std::size_t> ends_;
  std::array<char, 1024> arrived_{};
  std::size_t got_ = 0, next_ = 0;
};

}  // namespace

bool to_line(const Frame& frame, std::string& out) {
  const bool fd = frame.length > 8 || (frame.flags & kFd) != 0;
  if (fd || (frame.id & kErrorFlag) != 0) return false;
  const bool wide = (frame.id & kExtendedFlag) != 0, remote = (frame.id & kRemoteFlag) != 0;
  const char kind = remote ? (wide ? 'R' : 'r') : (wide ? 'T' : 't');
  const std::uint32_t id = frame.id & (wide ? 0x1FFFFFFFu : 0x7FFu);
  fmt::format_to(std::back_inserter(out), "{}{:0{}X}{}", kind, id, wide ? 8 : 3, frame.length);
  for (std::size_t i = 0; !remote && i < frame.length; ++i)
    fmt::format_to(std::back_inserter(out), "{:02X}", frame.data[i]);
  out.push_back('\r');
  return true;
}

std::optional<Frame> from_line(std::string_view line) {
  if (line.empty()) return std::nullopt;
  const char kind = line.front();
  line.remove_prefix(1);
  if (kind == 's') return state_frame(line);
  if (kind == 'e') return bus_errors_frame(line);
  const bool wide = kind == 'T' || kind == 'R', remote = kind == 'r' || kind == 'R';
  if (!wide && !remote && kind != 't') return std::nullopt;
  const auto id = take_number(line, wide ? 8 : 3), length = take_number(line, 1);
  if (!id || !length || *id > (wide ? 0x1FFFFFFFu : 0x7FFu) || *length > 8) return std::nullopt;
  Frame frame{.id = *id | (wide ? kExtendedFlag : 0) | (remote ? kRemoteFlag : 0),
              .length = static_cast<std::uint8_t>(*length)};
  for (std::size_t i = 0; !remote && i < *length; ++i) {
    const auto byte = take_number(line, 2);
    if (!byte) return std::nullopt;
    frame.data[i] = static_cast<std::uint8_t>(*byte);
  }
  const bool stamped = line.size() == 4;  // milliseconds, of adapters that are told to
  return line.empty() || stamped ? std::optional(frame) : std::nullopt;
}

std::unique_ptr<Bus> open_slcan(const std::string& device) {
  return std::make_unique<SlcanBus>(device);
}

}  // namespace mimesis::hw::can
