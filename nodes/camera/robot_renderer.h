#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "common/image/rig.h"
#include "common/kin/arm.h"
#include "common/kin/table.h"
#include "nodes/camera/random_scene.h"
#include "nodes/camera/renderer.h"

namespace mimesis::camera {

/// Whether a camera in frame T (see RobotRenderer) has all of the object in its picture, with 15 mm
/// around it, and the upper faces of the stands, and nothing that stands on the table before them.
bool sees_all(const kin::Table& table, const Eigen::Vector3d& origin_W,
              const image::Camera& camera);

/// The robot's table with the arm before it, seen by a camera in frame T: origin on the table at
/// `origin_W`, x, y, z along y, z, x of W, so that a camera before the robot sees its right hand on
/// the left. Stands have coloured caps, the bar, the object and what blocks a goal are coloured;
/// plinth, posts and the arm (its safety balls) are grey.
class RobotRenderer {
 public:
  /// @param eye 0, 1, ...: noise of its own
  RobotRenderer(const kin::Table& table, const Paints& paints, const Room& room,
                const Eigen::Vector3d& origin_W, const image::Camera& camera, const Faults& faults,
                std::uint64_t seed, int eye);
  RobotRenderer(const RobotRenderer&) = delete;
  RobotRenderer& operator=(const RobotRenderer&) = delete;

  /// @param arm      balls in W; may be empty
  /// @param object_W centre of the upright object
  /// @param t_s      decides the noise
  void render(const std::vector<kin::Ball>& arm, const Eigen::Vector3d& object_W, double t_s,
              image::Image& out);
  void change_faults(const Faults& faults) { faults_ = PictureFaults(faults, noise_seed_); }
  /// Where somebody would click to teach the colours.
  std::vector<Click> clicks() const;

 private:
  Eigen::Vector3d in_T(const Eigen::Vector3d& p_W) const;

  kin::Table robot_;
  Bgr object_color_;
  Eigen::Vector3d origin_;
  image::Camera camera_;
  TablePicture table_;
  MovingLayer layer_;
  std::uint64_t noise_seed_;
  PictureFaults faults_;
  std::vector<Capsule> arm_;
};

}  // namespace mimesis::camera
