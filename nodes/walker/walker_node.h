#pragma once
#include <algorithm>
#include <string>

#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "nodes/walker/conduct.h"
#include "nodes/walker/walker_messages.h"
#include "nodes/walker/walker_params.h"
#include "proto/foxglove/scene.pb.h"

namespace mimesis::walker {

/// Makes a biped follow a wished motion and keeps it balanced: Walker between messages. Conduct
/// decides the phase at every tick.
class WalkerNode {
 public:
  using Params = WalkerParams;
  /// @throws ConfigError for a robot that is no biped, or a stack or gait that does not fit it
  WalkerNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);
  bool at_rest() const;  ///< stands, or is not balancing

 private:
  /// Times that Walker::step took on this machine.
  struct StepTimes {
    double mean_s = 0.0, worst_s = 0.0;
    std::uint64_t ticks = 0;

    void add(double s) {
      mean_s += (s - mean_s) / static_cast<double>(++ticks);
      worst_s = std::max(worst_s, s);
    }
  };
  struct LastStatus {
    v1::WalkState state = v1::WALK_STATE_UNSPECIFIED;
    std::string reason;
    runtime::Time due{};  // next repetition
  };

  void take_sensors(runtime::Time now);
  void take_motion(runtime::Time now);
  Condition condition();
  std::string posture_fault(const Eigen::Quaterniond& R_WI) const;
  void enter(Phase phase);
  void hold_actual_posture();
  void balance();
  v1::WalkState state() const;
  void publish(runtime::Time now);
  void stand_in_feedback();
  void publish_feedback(runtime::Time now);
  void publish_status(runtime::Time now);

  Params params_;
  runtime::Bus& bus_;
  robot::Biped biped_;
  WalkerSettings settings_;
  Walker walker_;
  WalkWish wish_;
  Conduct conduct_;
  Approach approach_;
  MotionReader reader_;
  robot::Kinematics kinematics_;  // kinematics of the set-points
  Eigen::Vector3d up_I_;          // half-sitting

  Sensors sensors_, blind_;
  std::string body_fault_ = "nothing heard of IMU and foot forces",
              joints_fault_ = "nothing heard of encoders", drives_fault_ = "no bridge heard";
  std::string sensors_line_, posture_line_, pause_line_, refusal_;  // log lines of this tick
  MotionWish motion_;
  bool motion_heard_ = false;
  Eigen::VectorXd q_;                   // set-points
  const WalkerOutput* tick_ = nullptr;  // the walker's last one
  GroundPose place_;                    // middle of the feet
  runtime::Time last_{};                // step
  std::uint64_t steps_ = 0, failed_ = 0, clipped_ = 0, limited_ = 0;
  StepTimes step_times_;
  LastStatus last_status_;

  v1::JointCommand command_message_;
  v1::WalkFeedback feedback_message_;
  v1::WalkBalance balance_message_;
  foxglove::FrameTransforms transforms_message_;
  runtime::Throttle clips_{std::chrono::seconds(1)}, troubles_{std::chrono::seconds(1)},
      refusals_{std::chrono::seconds(1)};

  runtime::Latest<v1::Motion> motion_in_;
  runtime::Latest<v1::MotionRows> rows_in_;
  runtime::Latest<v1::BodySensors> body_in_;
  runtime::Latest<v1::JointState> joints_in_;
  runtime::Out<v1::JointCommand> command_;
  runtime::Out<v1::WalkFeedback> feedback_;
  runtime::Out<v1::WalkBalance> balance_;
  runtime::Out<v1::WalkerStatus> status_;
  runtime::Out<foxglove::FrameTransforms> transforms_;
  runtime::Out<foxglove::SceneUpdate> plan_;
};

}  // namespace mimesis::walker
