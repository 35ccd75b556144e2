#pragma once
#include <string>
#include <string_view>

#include "common/motion/mocap/clip_file.h"

namespace mimesis::mocap {

/// Length of the unit of a BVH file whose joints have these names [m]: CMU's 2.54/0.45 cm where the
/// root is "Hips" over "LHipJoint" and "RHipJoint", as CMU's conversions have it; 1 cm otherwise.
double bvh_unit_m(const Skeleton& skeleton);

/// Reads the text of a BVH file. Any order of channels, per joint; a position channel stands in
/// place of the joint's OFFSET. Joints other than the root may have position channels if  - they
/// keep still (to 0.1 mm): their offset is then that of frame 0, or  - it is the only child of the
/// root: if it moves, or the root stays at the origin, the two  become
///    one root, which carries both motions (Bandai: joint_Root over Hips becomes Hips).
/// Ends are named after their joint, "LeftToeBase_end". A frame time within 1e-4 of that of a whole
/// rate means that rate (.0083333 s: 120 Hz).
/// @param file  named in errors; its base name becomes the clip's.
/// @throws ConfigError "file:line: found ..., expected ..."
Clip parse_bvh(std::string_view text, const std::string& file, const ReadOptions& options = {});

/// The clip as a BVH file: y up, unit `bvh_unit_m`, joints depth first, the root's channels
/// Xposition Yposition Zposition Zrotation Yrotation Xrotation, the others' Zrotation Yrotation
/// Xrotation [°]. A last joint without an end gets one at its centre, which the format demands.
/// Read again it is the same motion to 1e-6 rad and 1e-6 m.
/// @throws ConfigError if the clip has no joints, no rate, values that are not finite, or names
/// that BVH cannot hold (empty, with braces or line ends)
std::string bvh_text(const Clip& clip);

}  // namespace mimesis::mocap
