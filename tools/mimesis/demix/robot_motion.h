#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/motion/mocap/cycles.h"
#include "common/motion/model/motion_model.h"
#include "common/motion/retarget/to_robot.h"

namespace mimesis::tool {

struct RobotChoice {
  std::string file;  ///< its description, such as biped.yaml; empty: no robot
  /// Margin at both ends of every joint when clips are retargeted, a quarter of its range at most:
  /// for the overshoot of the mixture [rad].
  double limit_margin_rad = 0.05;
};

/// Result of retargeting a clip.
struct RetargetedClip {
  std::string file;
  long frames = 0;
  retarget::RobotReport report;          ///< limits are those with the margin, speeds the robot's
  retarget::Deviation ankle_m, wrist_m;  ///< deviations of the figure in the model (figure_clip())
};

/// A robot that clips are retargeted to.
class Robot {
 public:
  /// @throws ConfigError as model::load_biped(), retarget::figure_of(); for a joint that slides
  explicit Robot(const RobotChoice& choice);

  /// Trials of the robot's figure (its rows move the pelvis by the standing foot), then of its
  /// joints by name. Adds to clips().
  tl::expected<mocap::Trials, Status> cut(const mocap::BodyClip& recorded,
                                          const mocap::CycleOptions& options);

  mocap::Body body() const { return retarget::robot_body(tree_, figure_); }
  /// Limits of the robot's joints for the rows named as they are; empty for other rows.
  std::vector<std::optional<motion::RowLimits>> limits(const std::vector<std::string>& rows) const;
  const std::vector<RetargetedClip>& clips() const { return clips_; }

 private:
  explicit Robot(const robot::Biped& biped, double limit_margin_rad);

  robot::RobotTree tree_, narrow_;  ///< tree as in the file; with the margin
  retarget::RobotFigure figure_;
  std::vector<RetargetedClip> clips_;
};

/// Tables of what became of the clips, and of the rows that come nearest to their limits.
void print_retargeting(const std::vector<RetargetedClip>& clips);
void print_limits(const motion::MotionModel& model);
nlohmann::ordered_json retargeting_json(const std::vector<RetargetedClip>& clips);
nlohmann::ordered_json limits_json(const motion::MotionModel& model);

}  // namespace mimesis::tool
