#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <deque>

#include "common/testing/loopback.h"
#include "nodes/walker/test/closed_loop.h"
#include "nodes/walker/test/perfect_robot.h"
#include "nodes/walker/walker_node.h"

namespace mimesis::walker::testing {

using namespace std::chrono_literals;

inline WalkerParams params() {
  WalkerParams p;
  p.ready.approach_s = 0.2;
  return p;
}

inline v1::MotionRows rows_of_all_joints() {
  v1::MotionRows rows;
  rows.set_model("test");
  rows.add_rows("pelvis.x");
  for (const std::string& joint : biped().tree.joint_names()) rows.add_rows(joint);
  return rows;
}

/// All joints half-sitting, but `joint` at `rad`.
inline void set_angles(std::string_view joint, double rad, v1::Motion& motion) {
  motion.add_position_rad(9.9);  // a row that is no joint of the robot
  for (const double q : biped().half_sitting) motion.add_position_rad(q);
  motion.set_position_rad(1 + biped().tree.require_joint(joint), rad);
}

/// One node, a robot that does as told, and what both said.
class Rig {
 public:
  explicit Rig(const WalkerParams& p = params()) : node(p, bus) {}

  void run(runtime::Time duration) {
    for (const runtime::Time end = now + duration; now < end; now += 5ms) {
      if (sends_body) bus.send("sensors", robot.sensors(), now);
      if (sends_joints) bus.send("joint_states", robot.joints(), now);
      if (motion) bus.send("motion", *motion, now);
      node.step(now);
      take();
    }
  }
  /// Until it stands on its own feet.
  void ready() {
    run(1s);
    ASSERT_EQ(state(), v1::WALK_STATE_STANDING) << status.reason();
  }
  void walk(double forward_m_s) {
    motion.emplace();
    motion->set_velocity_forward_m_s(forward_m_s);
    motion->set_smooth_velocity_forward_m_s(forward_m_s);
  }
  /// A motion that stands, all joints half-sitting but one. @return that one's place in a command
  int wish_joint(std::string_view joint, double rad) {
    bus.send("rows", rows_of_all_joints(), now);
    motion.emplace();
    set_angles(joint, rad, *motion);
    return biped().tree.require_joint(joint);
  }
  v1::WalkState state() const { return feedback.state(); }
  bool went_through(v1::WalkState wanted) const {
    return std::ranges::find(states, wanted) != states.end();
  }

  mimesis::testing::Loopback bus;
  PerfectRobot robot{biped()};
  WalkerNode node;
  runtime::Time now = 1s;
  bool sends_body = true, sends_joints = true;
  std::optional<v1::Motion> motion;
  std::optional<v1::JointCommand> command;  // command of the last step
  v1::WalkFeedback feedback;
  v1::WalkBalance balance;
  v1::WalkerStatus status;
  std::deque<v1::WalkState> states;  // without repetitions
  double fastest_rad_s = 0.0;        // change of a set-point
  int statuses = 0, balances = 0;

 private:
  void take() {
    const std::optional<v1::JointCommand> last = command;
    command = bus.take<v1::JointCommand>("command");
    if (command) {
      for (int j = 0; last && j < command->position_rad_size(); ++j) {
        fastest_rad_s = std::max(
            fastest_rad_s, std::abs(command->position_rad(j) - last->position_rad(j)) / kTick_s);
      }
      robot.obey(*command);
    }
    if (auto f = bus.take<v1::WalkFeedback>("feedback")) {
      feedback = *f;
      robot.stand(feedback);
    }
    if (auto b = bus.take<v1::WalkBalance>("balance")) {
      balance = *b;
      ++balances;
      robot.stand(balance);
    }
    while (auto s = bus.take<v1::WalkerStatus>("status")) {
      status = *s;
      ++statuses;
    }
    if (states.empty() || states.back() != feedback.state()) states.push_back(feedback.state());
  }
};

}  // namespace mimesis::walker::testing
