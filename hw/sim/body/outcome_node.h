#pragma once
#include <array>
#include <optional>
#include <string>

#include "common/runtime/ports.h"
#include "hw/sim/body/drawer.h"
#include "hw/sim/body/walk_judge.h"
#include "proto/motion.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::hw::sim {

/// Says once how a walk ended: the robot fell, it stands at the motion's goal, or time is up.
class OutcomeJudge {
 public:
  struct Settings {
    double settle_s;      ///< time of standing at the goal
    double time_limit_s;  ///< 0: none
  };
  OutcomeJudge(const Settings& settings, runtime::Bus& bus);

  /// After every step of the world. `drawer`: null if there is none; else the object is the goal.
  void step(runtime::Time now, const BodyTruth& truth, const Drawer* drawer);

 private:
  void watch_wishes();
  void watch_steps();
  void decide(runtime::Time now, const BodyTruth& truth, const Drawer* drawer);
  void end(runtime::Time now, const std::string& failure, const Drawer* drawer);

  Settings settings_;
  WalkJudge judge_;
  v1::WalkFeedback planned_;  // newest
  bool reached_ = false, ended_ = false;
  std::string refused_;  // why the motion's goal cannot be reached
  std::optional<double> standing_since_s_;
  std::array<std::optional<Eigen::Vector2d>, 2> wished_W_m_;  // next landings: left, right

  runtime::Queue<v1::WalkFeedback, 16> walk_;
  runtime::Latest<v1::WalkBalance> balance_;
  runtime::Queue<v1::MotionStatus, 16> motion_;
  runtime::Queue<v1::Motion, 16> wish_;
  runtime::Out<v1::WalkOutcome> outcome_;
};

}  // namespace mimesis::hw::sim
