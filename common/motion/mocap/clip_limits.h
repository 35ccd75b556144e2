#pragma once
#include <cmath>
#include <cstddef>
#include <string>

#include "common/error.h"
#include "common/motion/mocap/read_clip.h"
#include "common/motion/mocap/text_scanner.h"

namespace mimesis::mocap {

/// A clip must not need more memory than its file justifies: a joint moved in one frame is 24 bytes
/// in a clip and two or more in a file, and joints that the file does not move are few.
/// @throws ConfigError
inline void check_clip_size(const std::string& file, std::size_t file_bytes, std::size_t joints,
                            std::size_t frames) {
  constexpr std::size_t kMost = 256;  // bytes of clip for one of the file
  if (frames > 0 && 24 * (joints + 1) > kMost * file_bytes / frames) {
    throw ConfigError(file + ": " + std::to_string(frames) + " frames of " +
                      std::to_string(joints) + " joints, expected a file of more than " +
                      std::to_string(file_bytes) + " bytes");
  }
}

/// Nobody is as large or goes as far as 10 km: such lengths overflow what is computed from them.
/// @throws ConfigError
inline void check_lengths(const std::string& file, const Clip& clip) {
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

/// @throws ConfigError
inline void check_options(const ReadOptions& options) {
  if (!std::isfinite(options.unit_m) || options.unit_m < 0.0) {
    throw ConfigError("unit_m " + std::to_string(options.unit_m) +
                      ", expected a length above zero, or 0 for the file's own");
  }
  if (!std::isfinite(options.amc_rate_hz) || options.amc_rate_hz <= 0.0) {
    throw ConfigError("amc_rate_hz " + std::to_string(options.amc_rate_hz) +
                      ", expected a rate above zero");
  }
}

}  // namespace mimesis::mocap
