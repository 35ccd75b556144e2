#pragma once
#include <Eigen/Core>
#include <vector>

#include "nodes/camera/teacher_script.h"

namespace mimesis::camera {

/// Where hand and object are at one moment, frame T [m].
struct TeacherPose {
  Eigen::Vector3d wrist = Eigen::Vector3d::Zero();
  Eigen::Vector3d palm =
      Eigen::Vector3d::Zero();  ///< middle of the hand, between knuckles and palm
  Eigen::Vector3d fingers = Eigen::Vector3d::UnitX();       ///< direction wrist -> knuckles
  Eigen::Vector3d palm_normal = -Eigen::Vector3d::UnitY();  ///< out of the palm
  Eigen::Vector3d elbow = Eigen::Vector3d::Zero();
  double closure = 0.0;                              ///< fingers: 0 open .. 1 around the object
  Eigen::Vector3d object = Eigen::Vector3d::Zero();  ///< centre
  bool held = false;
};

/// The teacher's motion: reach, grasp, transport past the bridge, place, release, withdraw. Each
/// leg is a minimum-jerk stroke; strokes overlap in time and add up, which rounds the corners
/// (Flash & Henis 1991: superposition). Pure function of time; continuous up to the acceleration.
class TeacherMotion {
 public:
  /// @throws ConfigError if the lesson's path is blocked by the bridge.
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
