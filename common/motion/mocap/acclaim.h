#pragma once
#include <Eigen/Geometry>
#include <string>
#include <string_view>
#include <vector>

#include "common/motion/mocap/clip_file.h"

namespace mimesis::mocap {

/// Skeleton of an ASF file, with the data that an AMC file needs.
struct AcclaimSkeleton {
  /// Meaning of a number of an AMC line: a shift along or a turn about an axis of this project.
  struct Freedom {
    int axis = 0;
    bool position = false;  ///< a position; only the root has one
  };
  /// Bone j of the file is joint j: it turns about its upper end.
  struct Bone {
    Eigen::Quaterniond axes = Eigen::Quaterniond::Identity();  ///< C: its own axes, zero posture
    std::vector<Freedom> freedoms;  ///< in the order of the AMC's numbers
    /// Indices of the rotations among `freedoms`, in the order in which they are applied.
    std::vector<std::size_t> turns;
  };
  Skeleton skeleton;        ///< joints depth first, "root" first
  std::vector<Bone> bones;  ///< one a joint
  double unit_m = 0.0;
  bool degrees = true;  ///< the file's `angle`
  Eigen::Vector3d root_position_m = Eigen::Vector3d::Zero();
};

/// Reads the text of an ASF file. Lengths are in inches over `length` of :units (CMU's 0.45); bones
/// without `dof` become joints that never turn; the tip of a bone without children is an end,
/// "ltoes_end". Unknown sections and bone properties are skipped, as the format requires.
/// @throws ConfigError "file:line: ..."; for unsupported properties: dof tx ty tz l of a bone, a
/// turned root (`orientation`)
AcclaimSkeleton parse_asf(std::string_view text, const std::string& file,
                          const ReadOptions& options = {});

/// Reads the text of an AMC file: the rotation of a bone is C·M·C⁻¹, M = R_last·…·R_first of its
/// dof. Angles in the file's unit (:DEGREES, :RADIANS), or else in that of the ASF. Frames count up
/// by one; each has the root and every bone with dof.
/// @param file  named in errors; its base name becomes the clip's
/// @throws ConfigError "file:line: ..."
Clip parse_amc(std::string_view text, const std::string& file, const AcclaimSkeleton& asf,
               const ReadOptions& options = {});

/// The skeleton's file of an AMC: "35_01.amc" -> "35_01.asf" or "35.asf" in the same folder.
/// @throws ConfigError if there is none
std::string find_asf(const std::string& amc);

}  // namespace mimesis::mocap
