#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "common/error.h"
#include "common/motion/mocap/markers.h"
#include "common/motion/mocap/readers.h"

namespace mimesis::mocap {
namespace {

/// Numbers of a C3D file at byte offsets. The caller has checked that the offsets are inside.
struct C3dWords {
  std::span<const std::byte> bytes;
  C3dProcessor processor = C3dProcessor::intel;
  std::string file;

  unsigned u8(std::size_t at) const { return std::to_integer<unsigned>(bytes[at]); }
  int i8(std::size_t at) const { return static_cast<std::int8_t>(u8(at)); }
  unsigned u16(std::size_t at) const {
    return processor == C3dProcessor::mips ? u8(at) << 8 | u8(at + 1) : u8(at + 1) << 8 | u8(at);
  }
  int i16(std::size_t at) const { return static_cast<std::int16_t>(u16(at)); }
  double f32(std::size_t at) const {
    const std::uint32_t first = u16(at), second = u16(at + 2);
    switch (processor) {
      case C3dProcessor::dec:
        return vax_float(first << 16 | second);
      case C3dProcessor::mips:
        return std::bit_cast<float>(first << 16 | second);
      case C3dProcessor::intel:
        break;
    }
    return std::bit_cast<float>(second << 16 | first);
  }

  /// @throws ConfigError "file: byte N: what" always
  [[noreturn]] void fail(std::size_t at, const std::string& what) const {
    throw ConfigError(one_line(file + ": byte " + std::to_string(at) + ": " + what));
  }

  /// "file: what"
  [[noreturn]] void fail(const std::string& what) const {
    throw ConfigError(one_line(file + ": " + what));
  }
};

std::string upper(std::string name) {
  for (char& c : name) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return name;
}

std::string text_at(const C3dWords& words, std::size_t at, std::size_t length) {
  std::string text;
  for (std::size_t i = 0; i < length; ++i) text += static_cast<char>(words.u8(at + i));
  return text;
}

bool printable(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c < '\x7f'; });
}

/// The parameter section of a C3D file. Names are upper case, "POINT:RATE".
class C3dParameters {
 public:
  /// Reads the records from `begin` on. The chain ends at its end mark, where it leaves [begin,
  /// limit) or at an invalid record (a name that is not printable).
  /// @throws ConfigError where the data of a record leave the file's parameters
  /// A record: length of the name (negative: locked), group (negative: defines it), name, way to
  /// the next record from here, then what the kind of record needs.
  C3dParameters(const C3dWords& words, std::size_t begin, std::size_t limit)
      : words_(words), end_(begin) {
    for (std::size_t at = begin; at + 4 <= limit;) {
      const auto length = static_cast<std::size_t>(std::abs(words.i8(at)));
      if (length == 0) break;
      const std::size_t behind_name = at + 2 + length;
      if (behind_name + 2 > limit || !printable(text_at(words, at + 2, length))) break;
      read_record(at, limit);
      const std::size_t step = words.u16(behind_name);
      if (step < 2) break;
      at = behind_name + step;
    }
  }

  std::size_t end() const { return end_; }  ///< behind the last record
  /// First element; whole numbers signed, or unsigned.
  std::optional<double> number(const std::string& name, bool is_unsigned = false) const {
    const Parameter* p = find(name);
    if (!p || p->count == 0 || p->type < 0) return std::nullopt;
    return value(*p, 0, is_unsigned);
  }

  /// All elements of NAME, NAME2, NAME3, ... as far as they are there, whole numbers unsigned.
  std::vector<double> numbers(const std::string& name) const {
    std::vector<double> all;
    const Parameter* p = find(name);
    for (int part = 2; p && p->type > 0; p = find(name + std::to_string(part++))) {
      for (std::size_t i = 0; i < p->count; ++i) all.push_back(value(*p, i, true));
    }
    return all;
  }

  /// Strings of NAME, NAME2, ...: the first dimension is their length. Without blanks at the end.
  std::vector<std::string> texts(const std::string& name) const {
    std::vector<std::string> all;
    const Parameter* p = find(name);
    for (int part = 2; p && p->type == -1; p = find(name + std::to_string(part++))) {
      for (std::size_t at = 0; p->length > 0 && at + p->length <= p->count; at += p->length) {
        std::string text = text_at(words_, p->at + at, p->length);
        const std::size_t end = text.find_last_not_of(std::string(" \0\t", 3));
        text.resize(end == text.npos ? 0 : end + 1);
        all.push_back(std::move(text));
      }
    }
    return all;
  }

 private:
  struct Parameter {
    int type = 0;                               // -1 characters, 1 bytes, 2 words, 4 floats
    std::size_t at = 0, count = 0, length = 0;  // place of the data; length: the first dimension
  };
  void read_record(std::size_t at, std::size_t limit) {
    const auto length = static_cast<std::size_t>(std::abs(words_.i8(at)));
    const int group = words_.i8(at + 1);
    const std::string name = upper(text_at(words_, at + 2, length));
    const std::size_t behind_name = at + 2 + length;
    end_ = std::max(end_, behind_name + 2);
    if (group < 0) {
      groups_.emplace(-group, name);
    } else {
      Parameter parameter;
      end_ = std::max(end_, read_data(behind_name + 2, limit, name, parameter));
      parameters_.emplace(std::pair(group, name), parameter);
    }
  }

  // Type, number of dimensions, dimensions, data. Returns where they end.
  std::size_t read_data(std::size_t at, std::size_t limit, const std::string& name, Parameter& p) {
    if (at + 2 > limit) words_.fail(at, "parameter '" + name + "' is cut off");
    p.type = words_.i8(at);
    if (p.type != -1 && p.type != 1 && p.type != 2 && p.type != 4) {
      words_.fail(at, "parameter '" + name + "' of type " + std::to_string(p.type) +
                          ", expected -1, 1, 2 or 4");
    }
    const std::size_t dimensions = words_.u8(at + 1);
    if (dimensions > 7 || at + 2 + dimensions > limit) {
      words_.fail(at + 1, "parameter '" + name + "' of " + std::to_string(dimensions) +
                              " dimensions, expected 0 to 7");
    }
    p.count = p.length = 1;
    for (std::size_t d = 0; d < dimensions; ++d) {
      const std::size_t size = words_.u8(at + 2 + d);
      if (d == 0) p.length = size;
      p.count *= size;  // at most 255⁷
    }
    p.at = at + 2 + dimensions;
    const std::size_t size = p.count * static_cast<std::size_t>(std::abs(p.type));
    if (size > limit - p.at) {
      words_.fail(at, "parameter '" + name + "' of " + std::to_string(size) + " bytes, expected " +
                          std::to_string(limit - p.at) + " or fewer before the end of the section");
    }
    return p.at + size;
  }

  double value(const Parameter& p, std::size_t index, bool is_unsigned) const {
    const std::size_t at = p.at + index * static_cast<std::size_t>(std::abs(p.type));
    if (p.type == 4) return words_.f32(at);
    if (p.type == 1) return words_.u8(at);
    if (is_unsigned) return words_.u16(at);
    return words_.i16(at);
  }

  const C3dParameters::Parameter* find(const std::string& name) const {
    const std::size_t colon = name.find(':');
    for (const auto& [number, group] : groups_) {
      if (group != name.substr(0, colon)) continue;
      const auto found = parameters_.find({number, name.substr(colon + 1)});
      if (found != parameters_.end()) return &found->second;
    }
    return nullptr;
  }

  const C3dWords& words_;
  std::size_t end_ = 0;
  std::map<int, std::string> groups_;
  std::map<std::pair<int, std::string>, Parameter> parameters_;
};

constexpr std::size_t kBlock = 512;
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// Words of the header, which is the first block.
struct Header {
  explicit Header(const C3dWords& w)
      : points(w.u16(2)),
        analog_a_frame(w.u16(4)),
        first(w.u16(6)),
        last(w.u16(8)),
        scale(w.f32(12)),
        data_start(w.u16(16)),
        samples(w.u16(18)),
        rate_hz(w.f32(20)) {}
  unsigned points, analog_a_frame, first, last;
  double scale;
  unsigned data_start, samples;
  double rate_hz;
};

// How the data are laid out.
struct Layout {
  std::size_t start = 0;  // byte
  std::size_t frames = 0, points = 0, channels = 0, samples = 0;
  std::size_t word = 2;  // bytes of a number
  double scale = 1.0;    // scale of whole numbers, in the file's unit
  std::size_t frame_bytes() const { return word * (4 * points + channels * samples); }
};

bool positive(double x) { return std::isfinite(x) && x > 0.0; }

C3dWords open_words(std::span<const std::byte> bytes, const std::string& file) {
  C3dWords words{bytes, C3dProcessor::intel, file};
  if (bytes.size() < 2 * kBlock) {
    words.fail(std::to_string(bytes.size()) + " bytes, expected a C3D file of 1024 or more");
  }
  if (words.u8(1) != 0x50) {
    words.fail(1, "found " + std::to_string(words.u8(1)) + ", expected 80, the mark of a C3D file");
  }
  const std::size_t section = (words.u8(0) - std::size_t{1}) * kBlock;
  if (words.u8(0) < 2 || section + kBlock > bytes.size()) {
    words.fail(0, "parameters in block " + std::to_string(words.u8(0)) + ", expected block 2 to " +
                      std::to_string(bytes.size() / kBlock));
  }
  const unsigned processor = words.u8(section + 3);
  if (processor < 84 || processor > 86) {
    words.fail(section + 3, "processor " + std::to_string(processor) +
                                ", expected 84 (Intel), 85 (DEC) or 86 (SGI/MIPS)");
  }
  words.processor = static_cast<C3dProcessor>(processor);
  return words;
}

class C3dReader {
 public:
  C3dReader(std::span<const std::byte> bytes, const std::string& file)
      : words_(open_words(bytes, file)),
        header_(words_),
        section_((words_.u8(0) - 1) * kBlock),
        section_end_(end_of_section()),
        parameters_(words_, section_ + 4, limit()) {}

  Markers read() {
    Markers markers;
    markers.name = base_name(words_.file);
    markers.rate_hz = rate();
    unit_m_ = unit();
    layout(markers.rate_hz);
    markers.first_frame = first_frame();
    markers.labels = labels();
    read_points(markers);
    return markers;
  }

 private:
  std::size_t end_of_section() const {
    const std::size_t blocks = words_.u8(section_ + 2);
    const std::size_t end = blocks > 0 ? section_ + blocks * kBlock : words_.bytes.size();
    return std::min(end, words_.bytes.size());
  }

  // Parameters may run beyond their section, but not into the data.
  std::size_t limit() const {
    const std::size_t data = header_.data_start > 0 ? (header_.data_start - 1) * kBlock : 0;
    return std::min(std::max(section_end_, data), words_.bytes.size());
  }

  double rate() const {
    const double rate_hz = parameters_.number("POINT:RATE").value_or(0.0);
    if (positive(rate_hz)) return rate_hz;
    if (positive(header_.rate_hz)) return header_.rate_hz;
    words_.fail("POINT:RATE and byte 20 give no frame rate, expected one above zero");
  }

  double unit() const {
    const std::vector<std::string> units = parameters_.texts("POINT:UNITS");
    if (units.empty() || units[0].empty()) return 1e-3;
    struct Unit {
      std::string_view name;
      std::array<std::string_view, 2> words;
      double length_m;
    };
    static constexpr std::array<Unit, 4> kUnits{{{"mm", {"millimeters", "millimetres"}, 1e-3},
                                                 {"cm", {"centimeters", "centimetres"}, 1e-2},
                                                 {"m", {"meters", "metres"}, 1.0},
                                                 {"in", {"inches", "inches"}, 0.0254}}};
    for (const Unit& unit : kUnits) {
      const bool spelt = std::ranges::any_of(unit.words, [&](std::string_view word) {
        // files have room for four letters: "mete"
        return units[0].size() >= 4 && same_word(word.substr(0, units[0].size()), units[0]);
      });
      if (spelt || same_word(units[0], unit.name)) return unit.length_m;
    }
    words_.fail("POINT:UNITS is '" + units[0] + "', expected mm, cm, m or in");
  }

  void layout(double rate_hz) {
    const double scale = parameters_.number("POINT:SCALE").value_or(header_.scale);
    if (!std::isfinite(scale) || scale == 0.0) {
      words_.fail("POINT:SCALE gives no scale, expected one above zero, or below for real numbers");
    }
    layout_.word = scale < 0.0 ? 4 : 2;
    layout_.scale = scale < 0.0 ? 1.0 : scale;
    layout_.points = size_of(parameters_.number("POINT:USED", true).value_or(header_.points));
    const double used = header_.samples > 0 ? header_.analog_a_frame / header_.samples : 0.0;
    layout_.channels = size_of(parameters_.number("ANALOG:USED", true).value_or(used));
    layout_.samples = layout_.channels > 0 ? samples(rate_hz) : 0;
    if (layout_.frame_bytes() == 0) {
      words_.fail("POINT:USED is 0 and there are no analog channels, expected data");
    }
    layout_.start = data_start();
    layout_.frames = frames();
  }

  static std::size_t size_of(double count) {
    return count >= 0.0 && count <= 65535.0 ? static_cast<std::size_t>(count) : 0;
  }

  std::size_t samples(double rate_hz) const {
    const double ratio = parameters_.number("ANALOG:RATE").value_or(0.0) / rate_hz;
    const double whole = std::round(ratio);
    if (whole >= 1.0 && whole <= 65535.0 && std::abs(ratio - whole) < 1e-3 * whole) {
      return static_cast<std::size_t>(whole);
    }
    if (header_.samples > 0) return header_.samples;
    if (header_.analog_a_frame >= layout_.channels)
      return header_.analog_a_frame / layout_.channels;
    words_.fail("ANALOG:RATE and byte 18 give no samples a frame, expected one or more");
  }

  // Behind the parameters; or where parameter and header agree, for there are files whose last
  // parameters were overwritten by the data.
  std::size_t data_start() const {
    const std::size_t stated = size_of(parameters_.number("POINT:DATA_START", true).value_or(0.0));
    for (const std::size_t block : {stated, std::size_t{header_.data_start}}) {
      if (block * kBlock < section_ + 2 * kBlock || block * kBlock > words_.bytes.size()) continue;
      const std::size_t start = (block - 1) * kBlock;
      if (start >= parameters_.end() || stated == header_.data_start) return start;
    }
    return std::min(std::max(section_end_, parameters_.end()), words_.bytes.size());
  }

  std::optional<double> trial_field(const char* name) const {
    const std::vector<double> words = parameters_.numbers(name);
    if (words.size() < 2) return std::nullopt;
    return words[0] + 65536.0 * words[1];
  }

  std::size_t frames() const {
    const auto first = trial_field("TRIAL:ACTUAL_START_FIELD");
    const auto last = trial_field("TRIAL:ACTUAL_END_FIELD");
    const double in_header =
        header_.last >= header_.first ? header_.last - header_.first + 1.0 : 0.0;
    const double capacity = std::floor(static_cast<double>(words_.bytes.size() - layout_.start) /
                                       static_cast<double>(layout_.frame_bytes()));
    double fewest = 0.0;
    for (const double count : {parameters_.number("POINT:LONG_FRAMES").value_or(0.0),
                               first && last ? *last - *first + 1.0 : 0.0,
                               parameters_.number("POINT:FRAMES", true).value_or(0.0), in_header}) {
      if (!(count >= 1.0)) continue;
      if (count <= capacity) return static_cast<std::size_t>(count);
      fewest = fewest > 0.0 ? std::min(fewest, count) : count;
    }
    if (fewest == 0.0) words_.fail("POINT:FRAMES and the header give no frames, expected some");
    words_.fail(words_.bytes.size(),
                "the file ends after " + std::to_string(static_cast<long>(capacity)) +
                    " frames of " + std::to_string(layout_.frame_bytes()) + " bytes, expected " +
                    std::to_string(static_cast<long long>(std::min(fewest, 1e15))));
  }

  long first_frame() const {
    return static_cast<long>(trial_field("TRIAL:ACTUAL_START_FIELD").value_or(header_.first));
  }

  std::vector<std::string> labels() const {
    std::vector<std::string> names = parameters_.texts("POINT:LABELS");
    names.resize(layout_.points);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names[i].empty()) names[i] = "point " + std::to_string(i + 1);
    }
    return names;
  }

  // x, y, z, then residual and cameras: below zero if the point is missing.
  void read_points(Markers& markers) const {
    const Layout& l = layout_;
    markers.position_m.resize(3 * static_cast<Eigen::Index>(l.points),
                              static_cast<Eigen::Index>(l.frames));
    double* out = markers.position_m.data();
    for (std::size_t t = 0; t < l.frames; ++t) {
      std::size_t at = l.start + t * l.frame_bytes();
      for (std::size_t m = 0; m < l.points; ++m, at += 4 * l.word, out += 3) {
        bool seen = number(at + 3 * l.word) >= 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
          out[k] = number(at + k * l.word) * l.scale * unit_m_;
          seen = seen && std::isfinite(out[k]);
        }
        if (!seen) std::fill(out, out + 3, kMissing);
      }
    }
  }

  double number(std::size_t at) const {
    return layout_.word == 4 ? words_.f32(at) : words_.i16(at);
  }

  C3dWords words_;
  Header header_;
  std::size_t section_, section_end_;
  C3dParameters parameters_;
  Layout layout_;
  double unit_m_ = 1e-3;
};

}  // namespace

double vax_float(std::uint32_t bits) {
  const int exponent = static_cast<int>(bits >> 23 & 0xFF);
  const bool negative = bits >> 31;
  if (exponent == 0) return negative ? std::numeric_limits<double>::quiet_NaN() : 0.0;
  const double mantissa = static_cast<double>((bits & 0x7FFFFF) | 0x800000);
  return std::ldexp(negative ? -mantissa : mantissa, exponent - 128 - 24);
}

Markers parse_c3d(std::span<const std::byte> bytes, const std::string& file) {
  return C3dReader(bytes, file).read();
}

Markers read_c3d(const std::string& file) {
  const std::string bytes = read_bytes(file);
  return parse_c3d(std::as_bytes(std::span(bytes)), file);
}

}  // namespace mimesis::mocap
