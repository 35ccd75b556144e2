#pragma once
#include <Eigen/Core>
#include <vector>

#include "common/task/symbols.h"

namespace mimesis::camera {

using task::Color, task::Demonstration, task::Goal, task::Grip, task::Transport;

struct TeacherScript {
  /// What the teacher shows; an object of unknown colour is light.
  Demonstration demonstration{Grip::precision, Transport::above, Goal::high};
  double start_s = 0.5;     ///< rest before the first motion
  double duration_s = 6.0;  ///< duration of one demonstration, from reaching to having withdrawn
  double pause_s = 1.5;     ///< rest after each, before the object is back at its start
  int repeat = 1;           ///< number of demonstrations
  bool only_grasp = false;  ///< the teacher stops after grasping [M18 Fig. 2.20]
  double hand_scale = 1.0;  ///< size of the hand over 185 mm [1]
  double tilt_rad = 0.0;    ///< of the palm about its fingers, out of down or sideways
};

/// Linear colour, blue green red, 0..255.
using Bgr = Eigen::Vector3f;

/// Skin and clothes of the teacher.
struct Looks {
  Bgr skin{116.0f, 152.0f, 220.0f}, cloth{66.0f, 62.0f, 60.0f};
  double bare = 0.55;       ///< share of the forearm, from the wrist on, that no sleeve covers [1]
  bool right_hand = false;  ///< the teacher acts with the right hand
};

/// Colours of the things on the table.
struct Paints {
  Bgr light_object{118.0f, 222.0f, 120.0f}, dark_object{44.0f, 106.0f, 26.0f};
  Bgr bar{205.0f, 96.0f, 38.0f};
  Bgr goal_high{36.0f, 214.0f, 224.0f}, goal_low{196.0f, 62.0f, 158.0f};
};

/// The teacher's table, frame T: x right, y up, z towards the camera, origin below the middle of
/// the bar.
struct TeacherTable {
  double object_x_m = -0.27;
  double object_radius_m = 0.024;
  double object_height_m = 0.085;
  double bar_height_m = 0.20;     ///< lower edge of the bar
  double bar_thickness_m = 0.03;  ///< along y
  double bar_width_m = 0.035;     ///< along x
  double bar_half_span_m = 0.13;  ///< along z
  bool bar_removed = false;       ///< the bar is missing, the posts stand [M18 Fig. 2.21]
  double goal_low_x_m = 0.19;
  double goal_low_y_m = 0.03;  ///< upper face of the stand
  double goal_high_x_m = 0.35;
  double goal_high_y_m = 0.12;
  double goal_radius_m = 0.046;
  Paints paints;
};

/// @throws ConfigError if the teacher's hand cannot pass where the demonstration leads it.
void check_passable(const Demonstration& shown, const TeacherTable& table);

/// Where hand and object are at one moment, frame T [m].
struct TeacherPose {
  Eigen::Vector3d wrist = Eigen::Vector3d::Zero();
  Eigen::Vector3d palm =
      Eigen::Vector3d::Zero();  ///< middle of the hand, between knuckles and palm
  Eigen::Vector3d fingers = Eigen::Vector3d::UnitX();       ///< direction wrist -> knuckles
  Eigen::Vector3d palm_normal = -Eigen::Vector3d::UnitY();  ///< out of the palm
  Eigen::Vector3d elbow = Eigen::Vector3d::Zero();
  double scale = 1.0;                                ///< of the hand [1]
  double closure = 0.0;                              ///< fingers: 0 open .. 1 around the object
  Eigen::Vector3d object = Eigen::Vector3d::Zero();  ///< centre
  bool held = false;
};

/// The teacher's motion: reach, grasp, transport past the bar, place, release, withdraw. Each
/// leg is a minimum-jerk stroke; strokes overlap in time and add up, which rounds the corners
/// (Flash & Henis 1991: superposition). Pure function of time; continuous up to the acceleration.
class TeacherMotion {
 public:
  /// @throws ConfigError if the demonstration's path is blocked by the bar.
  TeacherMotion(const TeacherScript& script, const TeacherTable& table);

  /// @param t_s time since the start of the camera.
  TeacherPose pose(double t_s) const;
  /// Time at which the last demonstration has ended.
  double end_s() const;

 private:
  struct Stroke {
    Eigen::Vector2d from, to;
    double begin, end;  ///< fractions of the demonstration
  };
  void add(const Eigen::Vector2d& to, double begin, double end);
  void add_chain(const std::vector<Eigen::Vector2d>& points, double begin, double end);
  void plan_transport();
  void plan_withdrawal();
  Eigen::Vector2d grasp_point(double phase) const;
  double forearm_elevation(const Eigen::Vector2d& wrist) const;

  TeacherScript script_;
  TeacherTable table_;
  Eigen::Vector2d home_, start_, goal_;
  std::vector<Stroke> strokes_;
};

}  // namespace mimesis::camera
