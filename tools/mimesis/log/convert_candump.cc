// Lines of candump: can-utils.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>
#include <vector>

#include "tools/mimesis/log/convert.h"

namespace mimesis::tool {
namespace {

constexpr std::uint32_t kErrorFlag = 0x20000000;  // as in linux/can.h
constexpr std::uint32_t kErrorMask = 0x1fffffff;
constexpr std::size_t kLongestBus = 15;  // as the kernel has it
constexpr std::size_t kClassicLength = 8, kFdLength = 64;
constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;

using ParsedLine = tl::expected<std::optional<CandumpLine>, Status>;

tl::unexpected<Status> no_frame(std::string reason) {
  return tl::unexpected(Status{std::move(reason)});
}

std::vector<std::string_view> line_words(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t from = line.find_first_not_of(" \t\r");
    if (from == line.npos) return words;
    const std::size_t to = std::min(line.find_first_of(" \t\r", from), line.size());
    words.push_back(line.substr(from, to - from));
    line.remove_prefix(to);
  }
}

std::optional<std::uint32_t> hex_number(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "2A366C" or "2A.36.6C"
std::optional<std::string> hex_bytes(std::string_view text) {
  std::string bytes;
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == '.' && i > 0) {
      ++i;
      continue;
    }
    const auto byte = hex_number(text.substr(i, 2));
    if (!byte || i + 1 >= text.size()) return std::nullopt;
    bytes += static_cast<char>(*byte);
    i += 2;
  }
  return bytes;
}

/// "(1436509052.249713)"
std::optional<std::uint64_t> candump_time(std::string_view word) {
  if (!word.starts_with('(') || !word.ends_with(')')) return std::nullopt;
  word = word.substr(1, word.size() - 2);
  const std::size_t dot = word.find('.');
  if (dot == word.npos || word.size() - dot - 1 > 9 || dot == word.size() - 1) return std::nullopt;
  const auto number = [](std::string_view text) -> std::optional<std::uint64_t> {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
  };
  std::string fraction(word.substr(dot + 1));
  fraction.resize(9, '0');
  const auto seconds = number(word.substr(0, dot)), nanoseconds = number(fraction);
  const std::uint64_t most = std::numeric_limits<std::uint64_t>::max() / kNanosecondsPerSecond - 1;
  if (!seconds || !nanoseconds || *seconds > most) return std::nullopt;
  return *seconds * kNanosecondsPerSecond + *nanoseconds;
}

/// Three digits: 11 bits; eight: 29 bits, or an error frame.
tl::expected<void, Status> set_id(std::string_view text, v1::CanFrame& frame) {
  const auto id = hex_number(text);
  const std::uint32_t most = text.size() == 3 ? 0x7ff : kErrorMask | kErrorFlag;
  if (!id || (text.size() != 3 && text.size() != 8) || *id > most) {
    return no_frame(fmt::format("'{}' is no identifier: expected 3 or 8 hexadecimal digits", text));
  }
  frame.set_error((*id & kErrorFlag) != 0);
  frame.set_extended(text.size() == 8 && !frame.error());
  frame.set_id(*id & kErrorMask);
  return {};
}

/// What stands behind "#" of a classic frame: data and "_E" for a raw length code, or "R4".
tl::expected<void, Status> set_classic(std::string_view text, v1::CanFrame& frame) {
  const std::size_t underscore = text.find('_');
  if (underscore != text.npos) {
    const auto code = hex_number(text.substr(underscore + 1));
    if (!code || *code < 9 || *code > 15) {
      return no_frame(fmt::format("'{}': expected a length code of 9 to F behind the _", text));
    }
    frame.set_raw_length(*code);
    text = text.substr(0, underscore);
  }
  if (text.starts_with('R') || text.starts_with('r')) {
    const auto length = text.size() == 1 ? 0 : hex_number(text.substr(1));
    if (!length || *length > kClassicLength) {
      return no_frame(fmt::format("'{}': expected a length of 0 to 8 behind the R", text));
    }
    frame.set_remote(true);
    frame.set_remote_length(*length);
    return {};
  }
  const auto data = hex_bytes(text);
  if (!data || data->size() > kClassicLength) {
    return no_frame(fmt::format("'{}' is no data: expected up to 8 bytes of two digits", text));
  }
  frame.set_data(*data);
  return {};
}

/// "044#2A366C2BBA"
tl::expected<void, Status> set_frame(std::string_view text, v1::CanFrame& frame) {
  const std::size_t sharp = text.find('#');
  if (sharp == text.npos) return no_frame(fmt::format("'{}': expected ID#DATA", text));
  if (auto done = set_id(text.substr(0, sharp), frame); !done) return done;
  text.remove_prefix(sharp + 1);
  if (!text.starts_with('#')) return set_classic(text, frame);
  const auto flags = hex_number(text.substr(1, 1));
  const auto data = hex_bytes(text.substr(std::min<std::size_t>(2, text.size())));
  if (!flags || !data || data->size() > kFdLength) {
    return no_frame(fmt::format("'#{}': expected ##, a digit of flags and up to 64 bytes", text));
  }
  frame.set_fd(true);
  frame.set_fd_flags(*flags);
  frame.set_data(*data);
  return {};
}

/// "044   [5]  2A 36 6C 2B BA", from the word with the length on; two digits: CAN FD.
tl::expected<void, Status> set_shown(const std::vector<std::string_view>& words, std::size_t at,
                                     v1::CanFrame& frame) {
  if (auto done = set_id(words[at], frame); !done) return done;
  const std::string_view brackets = words[at + 1].substr(1, words[at + 1].size() - 2);
  std::size_t length = 0;
  const auto [end, error] =
      std::from_chars(brackets.data(), brackets.data() + brackets.size(), length);
  frame.set_fd(brackets.size() == 2);
  if (error != std::errc() || end != brackets.data() + brackets.size() ||
      length > (frame.fd() ? kFdLength : kClassicLength)) {
    return no_frame(fmt::format("'{}': expected the length in brackets", words[at + 1]));
  }
  if (words.size() > at + 2 && words[at + 2] == "remote") {
    frame.set_remote(true);
    frame.set_remote_length(static_cast<std::uint32_t>(length));
    return {};
  }
  std::string data;
  for (std::size_t i = at + 2; i < words.size() && i < at + 2 + length; ++i) {
    const auto byte = words[i].size() == 2 ? hex_number(words[i]) : std::nullopt;
    if (!byte) return no_frame(fmt::format("'{}' is no byte", words[i]));
    data += static_cast<char>(*byte);
  }
  if (data.size() != length) {
    return no_frame(fmt::format("expected {} bytes of data, found {}", length, data.size()));
  }
  frame.set_data(data);
  return {};
}

}  // namespace

ParsedLine parse_candump(std::string_view line) {
  const auto words = line_words(line);
  if (words.empty() || line.starts_with('\t')) return std::optional<CandumpLine>();
  CandumpLine out;
  std::size_t at = 0;
  if (words[0].starts_with('(')) {
    out.time_ns = candump_time(words[0]);
    if (!out.time_ns) {
      return no_frame(fmt::format("'{}' is no time: expected (SECONDS.MICROSECONDS)", words[0]));
    }
    ++at;
  }
  if (words.size() < at + 2) return no_frame("expected (TIME) INTERFACE ID#DATA");
  const std::string_view bus = words[at++];
  const bool is_name = bus.size() <= kLongestBus && std::ranges::all_of(bus, [](unsigned char c) {
                         return c > ' ' && c < 0x7f;
                       });
  if (!is_name) return no_frame("the name of the interface is none");
  out.frame.set_bus(std::string(bus));
  tl::expected<void, Status> done;
  const auto brackets = std::ranges::find_if(
      words, [](auto w) { return w.size() > 2 && w.starts_with('[') && w.ends_with(']'); });
  if (brackets != words.end() && brackets - words.begin() > static_cast<std::ptrdiff_t>(at)) {
    done = set_shown(words, static_cast<std::size_t>(brackets - words.begin()) - 1, out.frame);
  } else if (out.time_ns) {
    done = set_frame(words[at], out.frame);
  } else {
    done = no_frame("expected (TIME) INTERFACE ID#DATA, or INTERFACE ID [LENGTH] DATA");
  }
  if (!done) return tl::unexpected(done.error());
  return out;
}

std::string candump_line(std::uint64_t time_ns, const v1::CanFrame& frame) {
  std::string out = fmt::format("({:010}.{:06}) {} ", time_ns / kNanosecondsPerSecond,
                                time_ns % kNanosecondsPerSecond / 1000, frame.bus());
  if (frame.error()) {
    out += fmt::format("{:08X}", frame.id() | kErrorFlag);
  } else {
    out += frame.extended() ? fmt::format("{:08X}", frame.id()) : fmt::format("{:03X}", frame.id());
  }
  out += '#';
  if (frame.fd()) out += fmt::format("#{:X}", frame.fd_flags() & 0xf);
  if (frame.remote()) {
    out += 'R';
    if (frame.remote_length() > 0) out += fmt::format("{:X}", frame.remote_length());
  } else {
    for (const char c : frame.data()) out += fmt::format("{:02X}", static_cast<unsigned char>(c));
  }
  if (frame.raw_length() > 0) out += fmt::format("_{:X}", frame.raw_length());
  return out;
}

}  // namespace mimesis::tool
