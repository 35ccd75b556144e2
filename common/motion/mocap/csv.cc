#include "common/motion/mocap/csv.h"

#include <cmath>

#include "common/error.h"
#include "common/motion/mocap/text_scanner.h"
#include "common/motion/mocap/write_text.h"

namespace mimesis::mocap {
namespace {

// In quotes where the format needs them (RFC 4180).
std::string cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == text.npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

}  // namespace

void check_writable(const Clip& clip) {
  const auto refuse = [&](const std::string& what) {
    throw ConfigError(one_line(clip.name + ": " + what));
  };
  const auto& joints = clip.skeleton.joints;
  if (joints.empty() || joints[0].parent != -1) refuse("no root joint, expected it as joint 0");
  for (std::size_t j = 1; j < joints.size(); ++j) {
    if (joints[j].parent < 0 || joints[j].parent >= static_cast<int>(j)) {
      refuse("joint '" + joints[j].name + "' before its parent, expected parents first");
    }
  }
  for (const Joint& end : clip.skeleton.ends) {
    if (end.parent < 0 || end.parent >= static_cast<int>(joints.size())) {
      refuse("end '" + end.name + "' without a joint");
    }
  }
  if (!(clip.rate_hz > 0.0) || !std::isfinite(clip.rate_hz)) refuse("no rate, expected one in Hz");
  if (clip.rotation_rad.rows() != 3 * static_cast<Eigen::Index>(joints.size()) ||
      clip.root_position_W_m.cols() != clip.frames() || clip.frames() < 1) {
    refuse("frames that do not fit the skeleton, expected three rows a joint");
  }
  bool finite = clip.rotation_rad.allFinite() && clip.root_position_W_m.allFinite();
  for (const Joint& joint : joints) finite = finite && joint.offset_m.allFinite();
  for (const Joint& end : clip.skeleton.ends) finite = finite && end.offset_m.allFinite();
  if (!finite) refuse("a number that is not finite");
}

std::string csv_text(const Clip& clip) {
  check_writable(clip);
  std::string text = "time_s";
  for (const char axis : {'x', 'y', 'z'}) {
    text += ',' + cell(clip.skeleton.joints[0].name + ".p" + axis + "_m");
  }
  for (const Joint& joint : clip.skeleton.joints) {
    for (const char axis : {'x', 'y', 'z'}) text += ',' + cell(joint.name + '.' + axis + "_rad");
  }
  text += '\n';
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    append_exact(text, static_cast<double>(t) / clip.rate_hz);
    const auto column = [&](const auto& numbers) {
      for (Eigen::Index r = 0; r < numbers.rows(); ++r) {
        text += ',';
        append_exact(text, numbers(r, t));
      }
    };
    column(clip.root_position_W_m);
    column(clip.rotation_rad);
    text += '\n';
  }
  return text;
}

void write_csv(const Clip& clip, const std::string& file) { write_bytes(file, csv_text(clip)); }

}  // namespace mimesis::mocap
