#pragma once
#include <Eigen/Geometry>
#include <span>
#include <string>
#include <vector>

#include "common/robot/link_shapes.h"
#include "experiments/motion/film.h"

namespace mimesis::film {

using synthesizer::Colour;
using synthesizer::FilmFrame;

/// A robot's links (robot::link_shapes).
class RobotFigure {
 public:
  /// @throws ConfigError if the URDF cannot be read
  RobotFigure(const robot::Biped& biped, const std::string& urdf_file);

  /// `q`: dof [rad]. `pale`: 0 as it is .. 1 white.
  void add_to(FilmFrame& frame, const Eigen::Isometry3d& X_WB, const Eigen::VectorXd& q,
              double pale = 0.0) const;

 private:
  robot::Biped biped_;
  std::vector<robot::LinkShape> shapes_;
};

/// A drawer in its furniture; axes as hw::sim::Drawer has them.
struct FilmDrawer {
  Eigen::Vector3d front_W_m, handle_W_m, object_W_m;  ///< positions, as in v1.DrawerState
  double yaw_rad = 0.0;                               ///< its axis, away from the robot
  double depth_m = 0.45, width_m = 0.50;
};
void add_drawer(FilmFrame& frame, const FilmDrawer& drawer);
/// A push that acts at a point: an arrow that ends there, 2 cm a newton second.
void add_push(FilmFrame& frame, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& impulse_W_ns);

/// Looks from a side, a little from above and without perspective, at a place on the ground: a
/// robot of this height fills the picture of 2:3. `from_rad`: where the camera stands, seen from
/// the robot; −0.9: in front to its right, 2.3: behind to its left, which shows what hands do.
synthesizer::FilmCamera camera_beside(const Eigen::Vector2d& p_W_m, double yaw_rad,
                                      double from_rad = -0.9, double height_m = 1.9,
                                      int width_px = 400);

}  // namespace mimesis::film
