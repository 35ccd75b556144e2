#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/motion/mocap/markers.h"
#include "common/motion/mocap/test/reader_checks.h"

namespace mimesis::mocap {
namespace {

/// Builds C3D files in memory.
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

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

constexpr C3dProcessor kProcessors[] = {C3dProcessor::intel, C3dProcessor::dec, C3dProcessor::mips};

// Coordinate k of marker m in frame t, as the file's number.
double raw(unsigned t, unsigned m, unsigned k) { return 100.0 * t + 10.0 * m + k - 105.0; }

// 3 frames (5 to 7) of 2 points, the second missing in frame 6, and 2 samples of 3 channels.
void add_data(C3dBytes& c, unsigned frames = 3) {
  for (unsigned t = 0; t < frames; ++t) {
    for (unsigned m = 0; m < c.points; ++m) {
      for (unsigned k = 0; k < 3; ++k) c.number(c.data, raw(t, m, k));
      c.number(c.data, t == 1 && m == 1 ? -1.0 : 2.0);
    }
    for (unsigned s = 0; s < c.channels * c.samples; ++s) c.number(c.data, 10.0 * t + s);
  }
}

C3dBytes whole(C3dProcessor processor, bool real) {
  C3dBytes c;
  c.processor = processor;
  c.real = real;
  c.group(1, "POINT");
  c.group(2, "ANALOG");
  c.words_of(1, "USED", {2});
  c.words_of(1, "FRAMES", {3});
  c.reals_of(1, "RATE", {50.0});
  c.reals_of(1, "SCALE", {real ? -0.5 : 0.5});
  c.texts_of(1, "LABELS", {"LKNE", "RKNE", "SPARE"}, 5);
  c.texts_of(1, "UNITS", {"mm"}, 4);
  c.words_of(2, "USED", {3});
  c.reals_of(2, "RATE", {100.0});
  add_data(c);
  return c;
}

Markers read(const C3dBytes& c) { return parse_c3d(bytes_of(c.file()), "folder/t.c3d"); }

TEST(C3d, EveryProcessorWholeAndReal) {
  for (const C3dProcessor processor : kProcessors) {
    for (const bool real : {false, true}) {
      SCOPED_TRACE(static_cast<int>(processor) * 10 + real);
      const Markers m = read(whole(processor, real));
      EXPECT_EQ(m.name, "t.c3d");
      EXPECT_EQ(m.labels, (std::vector<std::string>{"LKNE", "RKNE"}));
      EXPECT_EQ(m.rate_hz, 50.0);
      EXPECT_EQ(m.first_frame, 5);
      ASSERT_EQ(m.position_m.rows(), 6);
      ASSERT_EQ(m.frames(), 3);
      const double unit = real ? 1e-3 : 0.5e-3;
      for (unsigned t = 0; t < 3; ++t) {
        for (unsigned r = 0; r < 6; ++r) {
          if (t == 1 && r >= 3) {
            EXPECT_TRUE(std::isnan(m.position_m(r, t)));
          } else {
            EXPECT_NEAR(m.position_m(r, t), raw(t, r / 3, r % 3) * unit, 1e-12);
          }
        }
      }
    }
  }
}

TEST(C3d, VaxNumbers) {  // 1, -1.5, π and the smallest and largest exponents, from DEC's layout
  const auto value = [](const std::array<std::uint32_t, 4>& b) {
    return vax_float(b[1] << 24 | b[0] << 16 | b[3] << 8 | b[2]);
  };
  EXPECT_EQ(value({0x80, 0x40, 0, 0}), 1.0);
  EXPECT_EQ(value({0xC0, 0xC0, 0, 0}), -1.5);
  EXPECT_NEAR(value({0x49, 0x41, 0xDB, 0x0F}), 3.14159265, 3e-7);
  EXPECT_EQ(value({0x00, 0x00, 0xFF, 0xFF}), 0.0);
  EXPECT_EQ(value({0x80, 0x00, 0, 0}), std::ldexp(1.0, -128));
  EXPECT_EQ(value({0x80, 0x7F, 0, 0}), std::ldexp(1.0, 126));
  EXPECT_TRUE(std::isnan(value({0x00, 0x80, 0, 0})));
}

TEST(C3d, HeaderHoldsWhereParametersAreMissing) {
  C3dBytes c;
  add_data(c);
  const Markers m = read(c);
  EXPECT_EQ(m.labels, (std::vector<std::string>{"point 1", "point 2"}));
  EXPECT_EQ(m.rate_hz, 50.0);
  EXPECT_EQ(m.frames(), 3);
  EXPECT_NEAR(m.position_m(5, 2), raw(2, 1, 2) * 0.5e-3, 1e-12);
}

TEST(C3d, ParametersHoldWhereTheHeaderDiffers) {
  C3dBytes c = whole(C3dProcessor::intel, false);
  c.last = 6;
  c.scale = 7.0;
  c.rate_hz = 60.0;
  const std::string honest = whole(C3dProcessor::intel, false).file();
  std::string lying = c.file();
  lying[2] = 9;   // points
  lying[18] = 1;  // samples a frame
  const Markers a = parse_c3d(bytes_of(honest), "t"), b = parse_c3d(bytes_of(lying), "t");
  ASSERT_EQ(a.frames(), b.frames());
  EXPECT_EQ(a.position_m.col(2), b.position_m.col(2));
  EXPECT_EQ(a.rate_hz, b.rate_hz);
}

TEST(C3d, DataAreFoundWhateverTheHeaderSays) {
  const auto read_with = [](unsigned parameter, unsigned header, bool in_header) {
    C3dBytes c = whole(C3dProcessor::mips, true);
    if (parameter > 0) c.words_of(1, "DATA_START", {parameter});
    c.data_start = header;
    c.header_data_start = in_header;
    return read(c).position_m(5, 2);
  };
  const double wanted = raw(2, 1, 2) * 1e-3;
  EXPECT_NEAR(read_with(3, 3, true), wanted, 1e-9);   // one block of parameters: data in block 3
  EXPECT_NEAR(read_with(0, 0, false), wanted, 1e-9);  // 0: behind the parameters
  EXPECT_NEAR(read_with(3, 9999, true), wanted, 1e-9);
  EXPECT_NEAR(read_with(9999, 3, true), wanted, 1e-9);
  EXPECT_NEAR(read_with(2, 3, true), wanted, 1e-9);  // within the parameters
}

TEST(C3d, Units) {
  for (const auto& [unit, metres] : {std::pair{"cm", 1e-2},
                                     {"m", 1.0},
                                     {"MM", 1e-3},
                                     {"", 1e-3},
                                     {"mete", 1.0},
                                     {"Mill", 1e-3}}) {
    C3dBytes c;
    c.group(1, "POINT");
    c.texts_of(1, "UNITS", {unit}, 4);
    add_data(c);
    const Markers m = read(c);
    EXPECT_NEAR(m.position_m(0, 0), -52.5 * metres, 1e-12) << unit;
  }
  C3dBytes c;
  c.group(1, "POINT");
  c.texts_of(1, "UNITS", {"yd"}, 4);
  add_data(c);
  EXPECT_EQ(message_of([&] { read(c); }),
            "folder/t.c3d: POINT:UNITS is 'yd', expected mm, cm, m or in");
}

TEST(C3d, MoreThan255Labels) {
  C3dBytes c;
  c.points = 300;
  c.channels = 0;
  c.last = c.first;
  c.group(1, "POINT");
  std::vector<std::string> a, b;
  for (int i = 0; i < 300; ++i) (i < 255 ? a : b).push_back("M" + std::to_string(i));
  c.texts_of(1, "LABELS", a, 6);
  c.texts_of(1, "LABELS2", b, 6);
  add_data(c, 1);
  const Markers m = read(c);
  ASSERT_EQ(m.labels.size(), 300u);
  EXPECT_EQ(m.labels[254], "M254");
  EXPECT_EQ(m.labels[299], "M299");
}

// 70 000 frames: too many for the words of the header and POINT:FRAMES.
TEST(C3d, MoreThan65535Frames) {
  constexpr unsigned kFrames = 70000;
  for (const bool trial : {true, false}) {
    C3dBytes c;
    c.points = 1;
    c.channels = 0;
    c.first = 1;
    c.last = 65535;
    c.group(1, "POINT");
    c.group(2, "TRIAL");
    c.words_of(1, "FRAMES", {65535});
    if (trial) {
      c.words_of(2, "ACTUAL_START_FIELD", {1, 0});
      c.words_of(2, "ACTUAL_END_FIELD", {kFrames & 0xFFFF, kFrames >> 16});
    } else {
      c.reals_of(1, "LONG_FRAMES", {kFrames});
    }
    for (unsigned t = 0; t < kFrames; ++t) {
      for (unsigned k = 0; k < 4; ++k) c.word(c.data, k < 3 ? t % 30000 : 0);
    }
    const Markers m = read(c);
    ASSERT_EQ(m.frames(), kFrames);
    EXPECT_NEAR(m.position_m(0, 69999), 9999 * 0.5e-3, 1e-9);
  }
  C3dBytes c;  // above 32767 the words are unsigned
  c.points = 1;
  c.channels = 0;
  c.first = 1;
  c.last = 40000;
  c.group(1, "POINT");
  c.words_of(1, "FRAMES", {40000});
  c.data.assign(40000 * 8, '\0');
  EXPECT_EQ(read(c).frames(), 40000);
}

TEST(C3d, RefusesDamage) {
  const std::string good = whole(C3dProcessor::intel, false).file();
  const auto says = [&](std::size_t at, int byte) {
    std::string bad = good;
    bad[at] = static_cast<char>(byte);
    return message_of([&] { parse_c3d(bytes_of(bad), "t.c3d"); });
  };
  EXPECT_EQ(message_of([&] { parse_c3d({}, "t.c3d"); }),
            "t.c3d: 0 bytes, expected a C3D file of 1024 or more");
  EXPECT_EQ(says(1, 7), "t.c3d: byte 1: found 7, expected 80, the mark of a C3D file");
  EXPECT_EQ(says(0, 99), "t.c3d: byte 0: parameters in block 99, expected block 2 to 3");
  EXPECT_EQ(says(515, 83),
            "t.c3d: byte 515: processor 83, expected 84 (Intel), 85 (DEC) or 86 (SGI/MIPS)");
  C3dBytes c = whole(C3dProcessor::intel, false);
  c.data.resize(40);
  C3dBytes many = whole(C3dProcessor::intel, false);
  many.records = whole(C3dProcessor::intel, false).records;
  many.words_of(1, "USED", {60000});  // the first of a name holds, as in the file's own order
  EXPECT_EQ(read(many).position_m.rows(), 6);
  C3dBytes cut;
  cut.last = 500;
  add_data(cut);
  EXPECT_EQ(message_of([&] { read(cut); }),
            "folder/t.c3d: byte 1536: the file ends after 18 frames of 28 bytes, expected 496");
  C3dBytes no_rate;
  no_rate.rate_hz = 0.0;
  add_data(no_rate);
  EXPECT_NE(message_of([&] { read(no_rate); }).find("no frame rate"), std::string::npos);
  C3dBytes nothing;
  nothing.points = nothing.channels = 0;
  EXPECT_NE(message_of([&] { read(nothing); }).find("expected data"), std::string::npos);
  C3dBytes huge;
  huge.group(1, "POINT");
  huge.parameter(1, "HUGE", 4, {255, 255, 255, 255}, "");
  add_data(huge);
  EXPECT_NE(message_of([&] { read(huge); }).find("parameter 'HUGE' of 16913002500 bytes"),
            std::string::npos);
}

TEST(C3d, RealNumbersThatAreNotFiniteAreMissing) {
  C3dBytes c = whole(C3dProcessor::intel, true);
  c.data.clear();
  for (int i = 0; i < 3 * 14; ++i) c.number(c.data, i == 1 ? NAN : i == 16 ? INFINITY : 1.0);
  const Markers m = read(c);
  EXPECT_TRUE(m.position_m.col(0).head<3>().array().isNaN().all());
  EXPECT_TRUE(m.position_m.col(1).head<3>().array().isNaN().all());
  EXPECT_TRUE(m.position_m.col(0).tail<3>().allFinite());
}

}  // namespace
}  // namespace mimesis::mocap
