#include "common/motion/mocap/clip_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "common/error.h"
#include "common/motion/mocap/readers.h"

namespace mimesis::mocap {
namespace {

constexpr double kLeastHeight_m = 0.5, kMostHeight_m = 2.5;  // of a figure that stands

bool blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::string shown(std::string_view word) {
  return std::string(word.substr(0, 40)) + (word.size() > 40 ? "..." : "");
}

/// Length of the unit by the figure's standing height, see ReadOptions::unit_m. `map` null: no
/// figure; then what was given or is usual.
double choose_unit_m(const std::string& file, const ReadOptions& options, const BodyMap* map,
                     double usual_m, Clip& clip) {
  struct Unit {
    double length_m;
    const char* name;
  };
  static constexpr std::array<Unit, 5> kUnits = {{{1.0, "m"},
                                                  {0.01, "cm"},
                                                  {0.001, "mm"},
                                                  {0.0254, "inch"},
                                                  {kCmuUnit_m, "CMU's 2.54/0.45 cm"}}};
  if (map == nullptr) return options.unit_m > 0.0 ? options.unit_m : usual_m;
  const double height = stature_m(clip.skeleton, *map);
  const auto within = [&](double unit_m, double least_m, double most_m) {
    return height * unit_m >= least_m && height * unit_m <= most_m;
  };
  const auto fits = [&](double unit_m) { return within(unit_m, kLeastHeight_m, kMostHeight_m); };
  const std::string range = " m tall, expected 0.5 to 2.5 m";
  if (options.unit_m > 0.0) {
    if (fits(options.unit_m)) return options.unit_m;
    throw ConfigError(one_line(fmt::format("{}: with --unit-m {} the figure is {:.3g}{}", file,
                                           options.unit_m, height * options.unit_m, range)));
  }
  if (usual_m == kCmuUnit_m && fits(usual_m)) return usual_m;
  std::vector<Unit> usual_people, fitting;
  std::string statures;
  for (const Unit& unit : kUnits) {
    if (within(unit.length_m, 1.0, 2.2)) usual_people.push_back(unit);
    if (fits(unit.length_m)) fitting.push_back(unit);
    statures += fmt::format("{}{:.3g} m in {}", statures.empty() ? "" : ", ",
                            height * unit.length_m, unit.name);
  }
  const std::vector<Unit>& best = usual_people.empty() && !fits(usual_m) ? fitting : usual_people;
  if (best.empty() && fits(usual_m)) return usual_m;
  if (best.size() != 1) {
    throw ConfigError(one_line(file + ": the figure's standing height is " + statures +
                               ", expected 0.5 to 2.5 m in one of them; --unit-m gives the unit"));
  }
  if (best[0].length_m != usual_m) {
    clip.notes.push_back(fmt::format("lengths are in {}: the figure is then {:.2f} m tall",
                                     best[0].name, height * best[0].length_m));
  }
  return best[0].length_m;
}

// Joints that move a little within their parents have their mean offset.
void settle_offsets(const std::string& file, const std::vector<Eigen::Matrix3Xd>& positions,
                    double unit_m, double most_m, Clip& clip) {
  constexpr double kStill_m = 1e-4;
  for (std::size_t j = 1; j < positions.size(); ++j) {
    if (positions[j].cols() == 0) continue;
    const double way_m =
        (positions[j].rowwise().maxCoeff() - positions[j].rowwise().minCoeff()).maxCoeff() * unit_m;
    if (way_m <= kStill_m) continue;
    Joint& joint = clip.skeleton.joints[j];
    if (way_m > most_m) {
      throw ConfigError(one_line(fmt::format(
          "{}: joint '{}' moves by {:.3g} m within its parent, expected position channels that "
          "change by less than {:.1f} mm but for the root's only child",
          file, joint.name, way_m, 1e3 * most_m)));
    }
    joint.offset_m = positions[j].rowwise().mean();
  }
}

// The file's axis `up` becomes z.
void turn_up(const Eigen::Vector3d& up, Clip& clip) {
  if (up == Eigen::Vector3d::UnitZ()) return;
  const Eigen::Matrix3d turn = math::rotation_onto(up, Eigen::Vector3d::UnitZ());
  clip.root_position_W_m = turn * clip.root_position_W_m;
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    const Eigen::Matrix3d R_WR = turn * math::exp_so3(clip.rotation_rad.col(t).head<3>());
    put_rotation(clip.rotation_rad, 0, t, Eigen::Quaterniond(R_WR));
  }
  int axis = 0;
  up.cwiseAbs().maxCoeff(&axis);
  clip.notes.push_back(
      fmt::format("up is the file's {}{}", up[axis] < 0.0 ? '-' : '+', "zxy"[axis]));
}

}  // namespace

bool same_word(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

void TextScanner::skip_blanks() {
  while (at_ < text_.size() && blank(text_[at_])) ++at_;
}

std::string_view TextScanner::take_word() {
  const std::size_t begin = at_;
  if (at_ < text_.size() && (text_[at_] == '{' || text_[at_] == '}')) {
    return text_.substr(at_++, 1);
  }
  while (at_ < text_.size()) {
    const char c = text_[at_];
    if (blank(c) || c == '\n' || c == '{' || c == '}') break;
    ++at_;
  }
  return text_.substr(begin, at_ - begin);
}

std::string_view TextScanner::word() {
  next_line();
  return take_word();
}

std::string_view TextScanner::word_in_line() {
  skip_blanks();
  return take_word();
}

std::string_view TextScanner::rest_of_line() {
  skip_blanks();
  const std::size_t begin = at_;
  while (at_ < text_.size() && text_[at_] != '\n' && text_[at_] != '{') ++at_;
  std::size_t end = at_;
  while (end > begin && blank(text_[end - 1])) --end;
  return text_.substr(begin, end - begin);
}

void TextScanner::skip_line() { at_ = std::min(text_.find('\n', at_), text_.size()); }

bool TextScanner::next_line() {
  for (skip_blanks(); at_ < text_.size(); skip_blanks()) {
    if (text_[at_] == '\n') {
      ++at_;
      ++line_;
    } else if (text_[at_] == '#' && first_in_line()) {
      skip_line();
    } else {
      break;
    }
  }
  return at_ < text_.size();
}

bool TextScanner::first_in_line() const {
  std::size_t at = at_;
  while (at > begin_ && blank(text_[at - 1])) --at;
  return at == begin_ || text_[at - 1] == '\n';
}

std::size_t TextScanner::lines_left() const {
  TextScanner rest = *this;
  std::size_t count = 0;
  for (; rest.next_line(); rest.skip_line()) ++count;
  return count;
}

double TextScanner::labelled_number(std::string_view label) {
  next_line();
  const std::string_view line = rest_of_line();
  std::size_t at = 0;
  for (const char letter : label) {
    while (at < line.size() && blank(line[at])) ++at;
    if (at == line.size() || lower(line[at]) != letter) {
      fail_found(line, "'" + std::string(label) + ":'");
    }
    ++at;
  }
  while (at < line.size() && (blank(line[at]) || line[at] == ':')) ++at;
  return to_number(line.substr(at));
}

double TextScanner::to_number(std::string_view word) const {
  std::string_view digits = word;
  if (digits.size() > 1 && digits.front() == '+' && digits[1] != '-') digits.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  // a number too small for a double (1e-400) is zero, one too large is not a number
  const bool tiny = error == std::errc::result_out_of_range &&
                    (digits.find("e-") != digits.npos || digits.find("E-") != digits.npos);
  if (digits.empty() || end != digits.data() + digits.size() || (error != std::errc() && !tiny) ||
      !std::isfinite(value)) {
    const std::size_t comma = word.find(',');
    const auto digit = [&](std::size_t i) {
      return i < word.size() && word[i] >= '0' && word[i] <= '9';
    };
    if (comma != word.npos && (digit(comma - 1) || comma == 0) && digit(comma + 1) &&
        word.find(',', comma + 1) == word.npos) {
      fail("decimal comma in '" + shown(word) + "', expected a decimal point");
    }
    fail_found(word, "a number");
  }
  return tiny ? 0.0 : value;
}

double TextScanner::number_in_line() { return to_number(word_in_line()); }
double TextScanner::number() { return to_number(word()); }

long TextScanner::integer() {
  const std::string_view text = word();
  long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || end != text.data() + text.size() || error != std::errc()) {
    fail_found(text, "a whole number");
  }
  return value;
}

std::string_view TextScanner::peek() {
  const std::size_t at = at_;
  const int line = line_;
  const std::string_view found = word();
  at_ = at;
  line_ = line;
  return found;
}

void TextScanner::expect(std::string_view wanted) {
  const std::string_view found = word();
  if (!same_word(found, wanted)) fail_found(found, "'" + std::string(wanted) + "'");
}

void TextScanner::expect_line_end(const std::string& expected) {
  const std::string_view more = word_in_line();
  if (!more.empty()) fail_found(more, "the end of the line" + expected);
}

void TextScanner::fail(const std::string& what) const {
  throw ConfigError(one_line(std::string(file_) + ':' + std::to_string(line_) + ": " + what));
}

void TextScanner::fail_found(std::string_view found, const std::string& expected) const {
  const std::string end = at_ >= text_.size() ? "the end of the file" : "the end of the line";
  fail("found " + (found.empty() ? end : "'" + shown(found) + "'") + ", expected " + expected);
}

std::string read_bytes(const std::string& file) {
  std::error_code error;
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file, error)) {
    throw ConfigError(file + ": cannot be read, expected a motion file");
  }
  in.seekg(0, std::ios::end);
  std::string bytes(static_cast<std::size_t>(std::max<std::streamoff>(in.tellg(), 0)), '\0');
  in.seekg(0);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!in) throw ConfigError(file + ": cannot be read to its end");
  return bytes;
}

std::string base_name(const std::string& file) {
  return std::filesystem::path(file).filename().string();
}

void check_clip_size(const std::string& file, std::size_t file_bytes, std::size_t joints,
                     std::size_t frames) {
  constexpr std::size_t kMost = 256;  // bytes of clip for one of the file
  if (frames > 0 && 24 * (joints + 1) > kMost * file_bytes / frames) {
    throw ConfigError(file + ": " + std::to_string(frames) + " frames of " +
                      std::to_string(joints) + " joints, expected a file of more than " +
                      std::to_string(file_bytes) + " bytes");
  }
}

void check_lengths(const std::string& file, const Clip& clip) {
  constexpr double kMost_m = 1e4;
  const auto check = [&](const Eigen::Vector3d& length_m, const std::string& what) {
    if (length_m.cwiseAbs().maxCoeff() < kMost_m) return;
    throw ConfigError(one_line(file + ": " + what + ", expected less than 10 km"));
  };
  for (const auto* joints : {&clip.skeleton.joints, &clip.skeleton.ends}) {
    for (const Joint& j : *joints) check(j.offset_m, "'" + j.name + "' is too far from its parent");
  }
  for (Eigen::Index f = 0; f < clip.frames(); ++f) {
    check(clip.root_position_W_m.col(f),
          "the root is too far away in frame " + std::to_string(f + 1));
  }
}

void check_options(const ReadOptions& options) {
  if (!std::isfinite(options.unit_m) || options.unit_m < 0.0) {
    throw ConfigError("unit_m " + std::to_string(options.unit_m) +
                      ", expected a length above zero, or 0 for the file's own");
  }
}

void settle_clip(const std::string& file, const ReadOptions& options, double usual_unit_m,
                 const std::vector<Eigen::Matrix3Xd>& positions, Clip& clip) {
  if (options.map) check_body_map(clip, *options.map);
  const auto found =
      options.map ? tl::expected<BodyMap, Status>(*options.map) : find_body_map(clip);
  const BodyMap* map = found ? &*found : nullptr;
  const double unit_m = choose_unit_m(file, options, map, usual_unit_m, clip);
  constexpr double kNoise_m = 2e-3, kNoiseShare = 2e-3;  // of the standing height
  const double stature = map != nullptr ? unit_m * stature_m(clip.skeleton, *map) : 0.0;
  settle_offsets(file, positions, unit_m, std::max(kNoise_m, kNoiseShare * stature), clip);
  if (map != nullptr) turn_up(upward(clip, *map), clip);
  for (Joint& joint : clip.skeleton.joints) joint.offset_m *= unit_m;
  for (Joint& end : clip.skeleton.ends) end.offset_m *= unit_m;
  clip.root_position_W_m *= unit_m;
  check_lengths(file, clip);
}

std::pair<std::string, std::string> split_take(const std::string& file) {
  const std::size_t at = file.rfind('#');
  std::error_code error;
  if (at == std::string::npos || std::filesystem::exists(file, error)) return {file, ""};
  return {file.substr(0, at), file.substr(at + 1)};
}

Clip read_clip(const std::string& file, const ReadOptions& options) {
  const std::string ending = std::filesystem::path(file).extension().string();
  if (same_word(ending, ".bvh")) return parse_bvh(read_bytes(file), file, options);
  if (same_word(ending, ".amc")) {
    const std::string text = read_bytes(file);
    const std::string asf = options.asf.empty() ? find_asf(file) : options.asf;
    Clip clip = parse_amc(text, file, parse_asf(read_bytes(asf), asf, options), options);
    const auto map =
        options.map ? tl::expected<BodyMap, Status>(*options.map) : find_body_map(clip);
    if (options.map) check_body_map(clip, *options.map);
    const double height_m = map ? stature_m(clip.skeleton, *map) : 1.0;
    if (height_m < kLeastHeight_m || height_m > kMostHeight_m) {
      throw ConfigError(one_line(fmt::format(
          "{}: the figure of {} is {:.3g} m tall, expected 0.5 to 2.5 m; --unit-m gives its unit",
          file, asf, height_m)));
    }
    return clip;
  }
  const auto [scene, take] = split_take(file);
  const std::string kind = std::filesystem::path(scene).extension().string();
  for (const char* known : {".glb", ".gltf", ".fbx", ".dae"}) {
    if (same_word(kind, known)) return read_scene(scene, take, options);
  }
  throw ConfigError(file + ": ending '" + ending +
                    "', expected .bvh, .amc, .c3d, .glb, .gltf, .fbx or .dae");
}

}  // namespace mimesis::mocap
