#pragma once
#include <Eigen/Geometry>
#include <array>
#include <optional>

#include "nodes/synthesizer/robot/robot_feedback.h"
#include "nodes/synthesizer/sequence/trials.h"

namespace mimesis::synthesizer {

/// A robot's knowledge of a drawer.
struct DrawerSeen {
  Eigen::Vector2d front_W_m = Eigen::Vector2d::Zero();  ///< middle of the closed front
  Eigen::Vector3d handle_W_m = Eigen::Vector3d::Zero(), object_W_m = Eigen::Vector3d::Zero();
  double opened_m = 0.0;
  bool held = false, taken = false;
  std::array<double, 2> age_s{};  ///< since handle and object were in view
};

/// Measurements since the last step.
struct DrawerSenses {
  /// What the camera in the head sees, in the frame H of the head's link; empty: hidden or out of
  /// view.
  struct Sight {
    double age_s = 0.0;  ///< since the image was taken
    std::optional<Eigen::Vector3d> handle_H_m, object_H_m;
  };
  std::optional<Sight> sight;   ///< empty: no image arrived
  std::array<bool, 2> holds{};  ///< switches between the fingers: left, right
};

/// Variances of a tracked place, for each coordinate.
struct TrackerSettings {
  double seen_m = 0.005;                         ///< deviation of what a camera sees
  double walking_m = 0.005, standing_m = 0.001;  ///< drift of the robot's own place, in √s
  double gate = 5.0;      ///< deviations beyond which a sighting is held to be elsewhere
  int elsewhere = 3;      ///< so many of those that agree move the place
  double smooth_s = 0.1;  ///< time in which a correction is given on
  int late_ticks = 2;     ///< from the encoders to the head in the robot's feedback
};

/// A place that rests in W but for the drift of the robot's own W, from sightings with noise: a
/// Kalman filter for each coordinate. Sightings far off do not count, until some that agree with
/// each other say that it has been moved. Corrections are given on smoothly.
class TrackedPlace {
 public:
  TrackedPlace(const TrackerSettings& settings, double dt_s) : settings_(settings), dt_s_(dt_s) {}

  void step(double drift_m);
  /// @return how far it has been moved, if it has: not by a correction
  std::optional<Eigen::Vector3d> see(const Eigen::Vector3d& p_W_m);
  /// It has been moved along with something else; `deviation_m`: of each coordinate of `by_W_m`.
  void shift(const Eigen::Vector3d& by_W_m, double deviation_m);

  bool known() const { return known_; }
  Eigen::Vector3d p_W_m() const { return p_W_m_ - left_W_m_; }
  double deviation_m() const;  ///< of each coordinate
  double age_s() const { return age_s_; }

 private:
  void put(const Eigen::Vector3d& p_W_m, double variance);

  TrackerSettings settings_;
  double dt_s_, age_s_ = 1e3, variance_ = 0.0;
  bool known_ = false;
  int elsewhere_ = 0;
  Eigen::Vector3d p_W_m_ = Eigen::Vector3d::Zero(),
                  left_W_m_ = Eigen::Vector3d::Zero(),  ///< of corrections, not given on yet
      other_W_m_ = Eigen::Vector3d::Zero(),             ///< mean of the sightings elsewhere
      off_W_m_ = Eigen::Vector3d::Zero();               ///< mean of what sightings differed by
};

/// Where handle and object are in the robot's own W, by its head's camera, encoders and fingers. A
/// place that is hidden stays where it was; a handle in the hand moves with the hand, which
/// opens the drawer; an object in the hand is at the hand. A drawer is closed when it is first
/// seen, and where it is seen after it was moved. Does not allocate.
class DrawerTracker {
 public:
  /// `handle_left_m`: of the handle from the middle of the front.
  DrawerTracker(double handle_left_m, double dt_s, const TrackerSettings& settings = {});

  /// Once a step. `robot` null: it does not say where it is. `heading_rad`: of the way to the
  /// drawer. @return null until both have been seen, and without a robot
  const DrawerSeen* step(const RobotFeedback* robot, double heading_rad,
                         const DrawerSenses& senses);

 private:
  static constexpr std::size_t kPast = 64;
  void see(const DrawerSenses::Sight& sight, const Eigen::Vector3d& way);
  void move_with_hand(const RobotFeedback& robot, const DrawerSenses& senses,
                      const Eigen::Vector3d& way);

  double handle_left_m_, dt_s_;
  TrackerSettings settings_;
  TrackedPlace handle_, object_;               ///< with the drawer closed
  std::array<Eigen::Isometry3d, kPast> X_WH_;  ///< ring: the head in the last steps
  std::uint64_t steps_ = 0;
  double gripped_m_ = 0.0;  ///< place of the left hand along the way where the drawer is closed
  DrawerSeen seen_;
};

}  // namespace mimesis::synthesizer
