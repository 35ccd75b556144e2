#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/motion/mocap/body.h"
#include "common/motion/mocap/body_map.h"

namespace mimesis::mocap {

/// Interpretation of a motion file where the file itself is not explicit.
struct ReadOptions {
  /// Length of the file's unit. 0: ASF its own `length` (CMU: 1/0.45 inch). BVH 1 cm or, with
  /// joints named as CMU's conversion names them, CMU's 2.54/0.45 cm; if a person would then not be
  /// 1.0 to 2.2 m tall, that of m, cm, mm, inch and CMU's that makes it so.
  double unit_m = 0.0;
  std::string asf{};             ///< skeleton of an AMC; empty: the .asf beside it whose name fits
  std::optional<BodyMap> map{};  ///< joints of the figure; none: find_body_map()
};

/// Reads a .bvh, .amc, .glb, .gltf, .fbx or .dae file, by its ending; the last four as
/// read_scene(), "walks.glb#Walk" one of their animations. @throws ConfigError "file:line: what,
/// expected ..."
Clip read_clip(const std::string& file, const ReadOptions& options = {});

/// Reads the text of a BVH file. Any order of channels, per joint; a position channel stands in
/// place of the joint's OFFSET. Lines that begin with '#' are comments. A root with one child that
/// has three position channels becomes one with it and carries both motions (Bandai: joint_Root
/// over Hips becomes Hips); other joints must keep still within their parents, to 2 mm or 0.2 % of
/// the stature: their offset is then that of frame 0, or the mean if they move by more than 0.1 mm.
/// Ends are named after their joint, "LeftToeBase_end". A frame time within 1e-4 of that of a whole
/// rate means that rate (.0083333 s: 120 Hz). Frames are those that are there, whatever `Frames:`
/// says. If a person stands along another axis of the file than y, that axis is up. `notes` tell
/// what was mended or taken.
/// @param file  named in errors; its base name becomes the clip's.
/// @throws ConfigError "file:line: found ..., expected ..."; if the figure's standing height is
/// outside 0.5 to 2.5 m under the unit given, or under all units
Clip parse_bvh(std::string_view text, const std::string& file, const ReadOptions& options = {});

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

/// "walks.glb#Walk": file and animation; a file that is there by the whole name has none.
std::pair<std::string, std::string> split_take(const std::string& file);

/// Reads an animation of a scene: glTF, FBX, Collada, as assimp reads them. The root is the joint
/// from which limbs branch; nodes above it count in its motion. The zero posture is that of the
/// nodes without animation. The rate is that of the densest track, 30 to 1000 Hz; between keys it
/// is interpolated.
/// @param take  name of the animation; empty: the only one
/// @throws ConfigError "file: ...": damaged, no skeleton, no animation, or several to choose from;
/// as parse_bvh() for lengths
Clip read_scene(const std::string& file, const std::string& take, const ReadOptions& options = {});

/// The skeleton's file of an AMC: "35_01.amc" -> "35_01.asf" or "35.asf" in the same folder.
/// @throws ConfigError if there is none
std::string find_asf(const std::string& amc);

}  // namespace mimesis::mocap
