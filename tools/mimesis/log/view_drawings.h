#pragma once
#include <google/protobuf/message.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/image/pinhole.h"
#include "common/kin/arm.h"
#include "common/model/drawing.h"
#include "proto/bridge.pb.h"
#include "proto/cognition.pb.h"
#include "proto/foxglove/image.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"
#include "proto/planner.pb.h"
#include "proto/scene.pb.h"

namespace mimesis::tool {

/// Takes a message for a topic of the log that is being written, stamped with the time it shows.
using Draw = std::function<void(const std::string& topic, const google::protobuf::Message& message,
                                std::chrono::nanoseconds stamp)>;

/// Draws the arm and its hand where their states say they are: shapes on view/robot, poses on
/// view/robot_frames at 25 Hz. Every message on view/robot is whole, so that a viewer may seek.
class RobotView {
 public:
  explicit RobotView(kin::ArmModel arm) : arm_(std::move(arm)) {}

  /// False: the state is not finite, or of an arm with another number of joints.
  bool see(const v1::JointState& state, const Draw& draw);
  bool see(const v1::HandState& state, const Draw& draw);

 private:
  kin::ArmModel arm_;
  std::vector<Eigen::Isometry3d> X_;
  std::optional<std::chrono::nanoseconds> due_;  ///< of the next poses; none before the first
  std::optional<double> closure_;                ///< as drawn last
};

/// The camera's calibration in frame "camera".
foxglove::CameraCalibration to_calibration(const image::View& view, std::chrono::nanoseconds stamp);

/// The teacher's table T as frame "teacher" in "world", the camera as "camera" in "teacher". Nobody
/// measures where the teacher's table is: it is shown 2.6 m in front of the robot, facing it.
foxglove::FrameTransforms to_camera_frames(const image::View& view, std::chrono::nanoseconds stamp);

/// Activity u(x) of all fields as curves on a board that stands left of the robot's table, in the
/// plane y = 1.25 m of W: x along the board, the first field on top, a grey line at u = 0. One
/// entity, replaced by every message.
foxglove::SceneUpdate to_board(const v1::FieldActivity& fields);

/// Colour of a point of activity u: blue at rest, grey at 0, orange when active.
model::Rgba activity_color(double u);

/// Draws what the planner knew on view/roadmap: its roadmap when the scene is first seen, and for
/// every plan that finds a scene or a decision changed.
class RoadmapView {
 public:
  /// Makes the drawing for a scene, and the decision and stamp of a status.
  using Make =
      std::function<foxglove::SceneUpdate(const v1::Scene& scene, const v1::TaskStatus& status)>;
  explicit RoadmapView(Make make) : make_(std::move(make)) {}

  /// False: a place of the scene is not finite.
  bool see(const v1::Scene& scene, const Draw& draw);
  bool see(const v1::TaskStatus& status, const Draw& draw);

 private:
  void draw_roadmap(std::uint64_t stamp_ns, const Draw& draw);

  Make make_;
  std::optional<v1::Scene> scene_;  ///< the last one
  v1::Transport decided_ = v1::TRANSPORT_UNSPECIFIED;
  std::pair<std::string, v1::Transport> shown_;  ///< scene without its header, decision
};

/// Draws the way of the hand in all motions of the plan so far on view/path, with the hand's pose
/// at grasp and release.
class PathView {
 public:
  explicit PathView(kin::ArmModel arm) : arm_(std::move(arm)) {}

  /// False: not a motion of this arm.
  bool see(const v1::Trajectory& motion, const Draw& draw);

 private:
  struct Motion {
    v1::TaskPhase phase;
    std::vector<Eigen::Isometry3d> X_WE;
  };
  kin::ArmModel arm_;
  std::vector<Motion> motions_;  ///< of the plan
};

}  // namespace mimesis::tool
