#pragma once
#include <string>

#include "common/motion/mocap/body.h"

namespace mimesis::mocap {

/// Text of a BVH file of the figure, as parse_bvh() reads it: y up, facing +z, cm, degrees; joints
/// are named as Mixamo and MotionBuilder name them (Hips, LeftUpLeg, ...), without a prefix. Joint
/// centres of every frame come back to 1e-6 m. What a file of this format cannot hold: heels.
std::string bvh_text(const BodyClip& clip);

/// Bytes of a binary glTF 2.0 file (.glb): the joints are nodes of these names with one animation
/// `clip.name`, rotations and the root's path as keys of every frame; every bone carries a wedge,
/// so that viewers show a figure. y up, facing +z, m. Joint centres come back to 1e-5 m (floats).
std::string glb_bytes(const BodyClip& clip);

}  // namespace mimesis::mocap
