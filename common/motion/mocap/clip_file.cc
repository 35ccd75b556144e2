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

}  // namespace mimesis::mocap
