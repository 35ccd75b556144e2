#include "common/motion/mocap/clip_file.h"

#include <filesystem>

#include "common/error.h"
#include "common/motion/mocap/readers.h"

namespace mimesis::mocap {

Clip read_clip(const std::string& file, const ReadOptions& options) {
  const std::string ending = std::filesystem::path(file).extension().string();
  if (same_word(ending, ".bvh")) return parse_bvh(read_bytes(file), file, options);
  if (same_word(ending, ".amc")) {
    const std::string text = read_bytes(file);
    const std::string asf = options.asf.empty() ? find_asf(file) : options.asf;
    return parse_amc(text, file, parse_asf(read_bytes(asf), asf, options), options);
  }
  throw ConfigError(file + ": ending '" + ending + "', expected .bvh or .amc");
}

std::string csv_text(const Clip& clip) {
  std::string text = "time_s";
  for (const char axis : {'x', 'y', 'z'}) {
    text += ',' + clip.skeleton.joints[0].name + ".p" + axis + "_m";
  }
  for (const Joint& joint : clip.skeleton.joints) {
    for (const char axis : {'x', 'y', 'z'}) text += ',' + joint.name + '.' + axis + "_rad";
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

void write_clip(const Clip& clip, const std::string& file) {
  const std::string ending = std::filesystem::path(file).extension().string();
  if (same_word(ending, ".bvh")) return write_bytes(file, bvh_text(clip));
  if (same_word(ending, ".csv")) return write_bytes(file, csv_text(clip));
  throw ConfigError(file + ": ending '" + ending + "', expected .bvh or .csv");
}

}  // namespace mimesis::mocap
