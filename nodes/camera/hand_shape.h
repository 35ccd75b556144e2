#pragma once
#include <Eigen/Core>
#include <vector>

#include "nodes/camera/teacher_motion.h"

namespace mimesis::camera {

/// Segment swept by a ball whose radius changes linearly. Frame T [m].
struct Capsule {
  Eigen::Vector3d a, b;
  double radius_a, radius_b;
  bool skin;  ///< else: cloth of the sleeve
};

/// A left arm: 5 of the palm, 15 of the fingers, forearm and
/// sleeve. Phalange lengths after
/// Buchholz et al. 1992 for a hand of 185 mm; thicknesses and postures by eye.
void hand_capsules(const TeacherPose& pose, Grip grip, std::vector<Capsule>& out);

}  // namespace mimesis::camera
