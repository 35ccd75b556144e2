#pragma once
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/motion/mocap/c3d.h"

namespace mimesis::mocap {

/// Builds C3D files in memory, for tests and as seeds of the fuzzer.
struct C3dBytes {
  C3dProcessor processor = C3dProcessor::intel;
  bool real = false;
  unsigned points = 2, channels = 3, samples = 2, first = 5, last = 7;
  double scale = 0.5, rate_hz = 50.0;
  unsigned data_start = 0;  ///< in the header; 0: as it is
  bool header_data_start = true;
  unsigned section_blocks = 0;  ///< stated; 0: as it is
  std::string records, data;

  void word(std::string& out, unsigned value) const {
    const char low = static_cast<char>(value & 0xFF), high = static_cast<char>(value >> 8 & 0xFF);
    out += processor == C3dProcessor::mips ? high : low;
    out += processor == C3dProcessor::mips ? low : high;
  }
  void real_number(std::string& out, double value) const {
    auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
    if (processor == C3dProcessor::dec && value != 0.0) bits += 2u << 23;  // bias 128, 0.1f
    const unsigned high = bits >> 16, low = bits & 0xFFFF;
    const bool high_first = processor != C3dProcessor::intel;
    word(out, high_first ? high : low);
    word(out, high_first ? low : high);
  }
  /// A whole number or a real one, as the file has them.
  void number(std::string& out, double value) const {
    if (real) return real_number(out, value);
    word(out, static_cast<unsigned>(static_cast<int>(value)) & 0xFFFF);
  }

  void group(int number, const std::string& name) {
    records += static_cast<char>(name.size());
    records += static_cast<char>(-number);
    records += name;
    word(records, 3);
    records += '\0';  // no description
  }
  void parameter(int group, const std::string& name, int type, const std::vector<int>& dimensions,
                 const std::string& values) {
    records += static_cast<char>(name.size());
    records += static_cast<char>(group);
    records += name;
    word(records, static_cast<unsigned>(5 + dimensions.size() + values.size()));
    records += static_cast<char>(type);
    records += static_cast<char>(dimensions.size());
    for (const int d : dimensions) records += static_cast<char>(d);
    records += values + '\0';
  }
  void words_of(int group, const std::string& name, const std::vector<unsigned>& values) {
    std::string text;
    for (const unsigned v : values) word(text, v);
    const bool one = values.size() == 1;
    parameter(group, name, 2,
              one ? std::vector<int>{} : std::vector{static_cast<int>(values.size())}, text);
  }
  void reals_of(int group, const std::string& name, const std::vector<double>& values) {
    std::string text;
    for (const double v : values) real_number(text, v);
    const bool one = values.size() == 1;
    parameter(group, name, 4,
              one ? std::vector<int>{} : std::vector{static_cast<int>(values.size())}, text);
  }
  /// Strings of one length, padded.
  void texts_of(int group, const std::string& name, const std::vector<std::string>& values,
                std::size_t length) {
    std::string text;
    for (std::string v : values) {
      v.resize(length, ' ');
      text += v;
    }
    parameter(group, name, -1, {static_cast<int>(length), static_cast<int>(values.size())}, text);
  }

  /// All blocks. Values that are not in `records` are only in the header.
  std::string file() const {
    std::string section{1, 'P'};
    section.append({'\0', static_cast<char>(processor)});
    section += records + std::string(2, '\0');
    section.resize((section.size() + 511) / 512 * 512, '\0');
    const auto blocks = static_cast<unsigned>(section.size() / 512);
    section[2] = static_cast<char>(section_blocks > 0 ? section_blocks : blocks);
    std::string head{2, 'P'};
    word(head, points);
    word(head, channels * samples);
    word(head, first);
    word(head, last);
    word(head, 0);
    real_number(head, real ? -scale : scale);
    word(head, header_data_start ? (data_start > 0 ? data_start : blocks + 2) : 0);
    word(head, samples);
    real_number(head, rate_hz);
    head.resize(512, '\0');
    std::string all = head + section + data;
    all.resize((all.size() + 511) / 512 * 512, '\0');
    return all;
  }
};

inline std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

}  // namespace mimesis::mocap
