#include "common/motion/mocap/clip_parts.h"

#include "common/error.h"
#include "common/motion/mocap/text_scanner.h"

namespace mimesis::mocap {

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

}  // namespace mimesis::mocap
