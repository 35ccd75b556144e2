#pragma once
#include <Eigen/Geometry>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "common/kin/table.h"
#include "nodes/vision/stereo_scene.h"

namespace mimesis::vision {

/// Prior knowledge of the robot's table. Frame W.
struct RobotTableSetup {
  /// Frame T in W: place of its origin; turned by 0 its axes x, y, z are those of y, z, x of W.
  std::vector<double> origin_m{0.0, 0.0, 0.0};
  double yaw_rad = 0.0;                                 ///< of T, about the vertical
  std::vector<double> top_half_m{0.75, 0.9, 0.025};     ///< half extents of the table top, W
  std::vector<double> top_center_m{0.55, 0.0, -0.035};  ///< its centre, W
  double support_half_m = 0.03;  ///< half the width of what an object stands on if it stands high
  double goal_radius_m = 0.02;   ///< an object this near to a goal's centre is placed
  double spacing_m = 0.0375;     ///< of the bar's safety balls
  double small_gap_m = 0.125;    ///< a lone goal that is nearer to the bar's height is a high one
  double lone_s = 8.0;           ///< a goal that is the only one for so long stays alone
  double uncertain_m = 0.008;    ///< a thing is known well enough below this standard deviation
  /// Obstacles are larger, and goals above their stands, by so many standard deviations of what is
  /// known of their places [1].
  double inflation_sigma = 1.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v("origin_m", origin_m, -10.0, 10.0, 3);
    v("yaw_rad", yaw_rad, -3.2, 3.2);
    v("top_half_m", top_half_m, 1e-3, 10.0, 3);
    v("top_center_m", top_center_m, -10.0, 10.0, 3);
    v("inflation_sigma", inflation_sigma, 0.0, 10.0);
  }
};

/// Frame T in W.
Eigen::Isometry3d table_in_world(const RobotTableSetup& setup);

/// The robot's table as it was seen, and how well its places are known.
struct SeenTable {
  kin::Table table;
  Eigen::Matrix3d object_m2 = Eigen::Matrix3d::Zero(), bar_m2 = object_m2;
  std::vector<Eigen::Matrix3d> goals_m2;  ///< of table.goals
};

/// Turns what two cameras measured in frame T into obstacles, goals and the object in W: a bar on
/// two posts; under each goal a stand down to the table; under an object that stands high a plinth.
/// The object is the one known longest of those that stand on no goal, others are obstacles. Of
/// several goals the highest is high, the lowest low; one that stays alone, since the other is
/// covered, is told by its gap to the bar.
/// @returns why there is no table yet: no object, no bar or no goal is seen, one of them is
/// known too badly (mostly since something hides a part of it), or goals are of one height.
/// @param stays_alone  a single goal has been the only one for `lone_s`
tl::expected<SeenTable, Status> robot_table(const StereoScene& scene, const RobotTableSetup& setup,
                                            bool stays_alone = false);

}  // namespace mimesis::vision
