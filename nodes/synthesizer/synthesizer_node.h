#pragma once
#include <memory>
#include <vector>

#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "nodes/synthesizer/director.h"
#include "nodes/synthesizer/synthesizer_messages.h"
#include "nodes/synthesizer/synthesizer_params.h"
#include "proto/motion.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::synthesizer {

/// Generates the motion of one robot or of many characters, steered by goals, styles, a beat and
/// the commands of a crowd. A robot is led from the place in its feedback.
class SynthesizerNode {
 public:
  using Params = SynthesizerParams;
  /// @throws ConfigError for a model file that is missing, damaged or of another version, and for a
  /// style that it has not; for a robot whose file is none, and more than one character of it.
  SynthesizerNode(const Params& params, runtime::Bus& bus);
  /// Called at rate_hz: advances the motion from one period before `now` to `now`.
  void step(runtime::Time now);

 private:
  /// Last status published about a character.
  struct LastStatus {
    GoalKind kind = GoalKind::none;
    bool reached = false;
    std::string reason;
    runtime::Time due{};  // time of the next repetition
  };

  std::string set_goal(const v1::MotionGoal& goal);
  void set_first_goal();
  void take_feedback(runtime::Time now);
  void take_senses(runtime::Time now);
  const RobotFeedback* feedback(runtime::Time now);
  void take_goals(runtime::Time now);
  void take_styles(runtime::Time now);
  void take_beat(runtime::Time now);
  void take_crowd(runtime::Time now);
  bool is_for_us(const std::string& node) const;
  void obey(const v1::GaitCommand& gait, double age_s);
  void release_stale(runtime::Time now);
  void publish_rows(runtime::Time now);
  void publish_motion(runtime::Time now);
  void publish_status(runtime::Time now);
  void publish_figures(runtime::Time now);
  void refuse(std::uint32_t character, const std::string& why, runtime::Time now);

  Params params_;
  std::string name_;
  double period_s_;
  runtime::Queue<v1::MotionGoal, 4096> goal_in_;
  runtime::Queue<v1::StyleWish, 4096> style_in_;
  runtime::Latest<v1::Beat> beat_in_;
  runtime::Queue<v1::CrowdCommand, 64> crowd_in_;
  runtime::Latest<v1::WalkFeedback> feedback_in_;
  runtime::Latest<v1::HeadSight> sight_in_;
  runtime::Latest<v1::HandTouch> touch_in_;
  runtime::Out<v1::MotionRows> rows_;
  runtime::Out<v1::Motion> motion_;
  runtime::Out<v1::MotionBatch> batch_;
  runtime::Out<v1::MotionStatus> status_;
  runtime::Out<v1::MotionStatus> reached_;
  runtime::Out<foxglove::SceneUpdate> figures_;
  runtime::PortsEnd ports_end_;
  std::unique_ptr<const ActionMaps> drawer_;
  std::unique_ptr<const BipedDrawer> robot_drawer_;
  std::unique_ptr<Director> director_;
  std::optional<FigureDrawing> drawing_;
  runtime::Time drawing_due_{};
  std::optional<RobotFeedback> feedback_;
  std::string robot_;    // node of the feedback
  DrawerSenses senses_;  // of a drawer, in this step
  bool rows_sent_ = false, beat_heard_ = false;
  runtime::Time beat_stamp_{}, feedback_stamp_{}, sight_stamp_{};
  std::vector<runtime::Time> commanded_;  // per character: stamp of the command it obeys, or 0
  std::vector<LastStatus> last_status_;
  // rates of a single character
  std::vector<double> velocity_rad_s_;
  std::vector<float> angles_, last_angles_;
  runtime::Throttle bad_goal_{std::chrono::seconds(1)}, bad_style_{std::chrono::seconds(1)},
      bad_beat_{std::chrono::seconds(1)}, bad_crowd_{std::chrono::seconds(1)},
      bad_feedback_{std::chrono::seconds(1)}, bad_sight_{std::chrono::seconds(1)};
  v1::Motion motion_message_;  // kept, so that their buffers are
  v1::MotionBatch batch_message_;
};

}  // namespace mimesis::synthesizer
