#include "nodes/walker/conduct.h"

#include <gtest/gtest.h>

#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {
namespace {

/// Steps of a conduct whose condition a test changes.
struct ConductRig {
  explicit ConductRig(const ConductSettings& settings = {}) : conduct(settings) {}

  Phase run(double s) {
    for (double t = 0.0; t < s - 1e-9; t += kTick_s) conduct.step(now, kTick_s);
    return conduct.phase();
  }
  /// To balance, from the start.
  void balance() {
    run(kTick_s);
    run(kTick_s);
    now.actuators = {};
    run(kTick_s);
    now.approached = true;
    run(kTick_s);
    ASSERT_EQ(conduct.phase(), Phase::balancing);
  }

  Condition now{.sensors = {},
                .actuators = "drives are off",
                .posture = {},
                .falling = {},
                .paused = {},
                .stands = true,
                .approached = false};
  Conduct conduct;
};

TEST(Conduct, GoesFromWaitingOverArmingAndApproachingToBalance) {
  ConductRig rig;
  rig.now.sensors = "no IMU";
  EXPECT_EQ(rig.run(1.0), Phase::waiting);
  EXPECT_EQ(rig.conduct.reason(), "no IMU");
  rig.now.sensors = {};
  rig.now.posture = "lies on its side";
  EXPECT_EQ(rig.run(1.0), Phase::waiting);
  EXPECT_EQ(rig.conduct.reason(), "lies on its side");
  rig.now.posture = {};
  EXPECT_EQ(rig.run(kTick_s), Phase::enabling);
  EXPECT_EQ(rig.run(1.0), Phase::enabling);
  EXPECT_EQ(rig.conduct.reason(), "drives are off");
  rig.now.actuators = {};
  EXPECT_EQ(rig.run(kTick_s), Phase::approaching);
  EXPECT_EQ(rig.run(1.0), Phase::approaching);
  rig.now.approached = true;
  EXPECT_EQ(rig.run(kTick_s), Phase::balancing);
  EXPECT_EQ(rig.conduct.reason(), "");
}

TEST(Conduct, LostSensorsWhileStandingAreSafeUntilTheyAreBack) {
  ConductRig rig({.blind_s = 3.0, .recovery_s = 0.5, .silence_s = 0.25});
  rig.balance();
  rig.now.sensors = "IMU is silent";
  EXPECT_EQ(rig.run(kTick_s), Phase::safe);
  EXPECT_EQ(rig.conduct.reason(), "IMU is silent");
  rig.now.sensors = {};
  rig.now.approached = false;
  EXPECT_EQ(rig.run(0.45), Phase::safe);
  rig.now.sensors = "IMU is silent";
  rig.run(kTick_s);
  rig.now.sensors = {};
  EXPECT_EQ(rig.run(0.45), Phase::safe);  // the count starts again
  EXPECT_EQ(rig.run(0.1), Phase::approaching);
}

TEST(Conduct, LostSensorsWhileWalkingEndTheStepsFirst) {
  ConductRig rig({.blind_s = 3.0, .recovery_s = 0.5, .silence_s = 0.25});
  rig.balance();
  rig.now.stands = false;
  rig.now.sensors = "IMU is silent";
  EXPECT_EQ(rig.run(1.0), Phase::balancing);
  EXPECT_TRUE(rig.conduct.blind());
  EXPECT_EQ(rig.conduct.reason(), "IMU is silent");
  rig.now.sensors = {};
  EXPECT_EQ(rig.run(kTick_s), Phase::balancing);  // back in time
  EXPECT_FALSE(rig.conduct.blind());
  EXPECT_EQ(rig.conduct.reason(), "");
  rig.now.sensors = "IMU is silent";
  EXPECT_EQ(rig.run(2.9), Phase::balancing);
  EXPECT_EQ(rig.run(0.2), Phase::safe);  // independent of the plan
}

TEST(Conduct, AWalkThatThePlanHasLeftBehindIsNotGoneOn) {
  ConductRig rig;
  rig.balance();
  rig.now.stands = false;
  rig.now.paused = "stood still";
  EXPECT_EQ(rig.run(kTick_s), Phase::safe);
  EXPECT_EQ(rig.conduct.reason(), "stood still");
  rig.now.paused = {};
  rig.now.posture = "on one foot";
  EXPECT_EQ(rig.run(10.0), Phase::safe);
  rig.now.posture = {};
  rig.now.approached = false;
  EXPECT_EQ(rig.run(0.6), Phase::approaching);
}

TEST(Conduct, WhoFellStaysSafeUntilTheDrivesWereOff) {
  ConductRig rig;
  rig.balance();
  rig.now.stands = false;
  rig.now.falling = "tilted by 0.7 rad";
  EXPECT_EQ(rig.run(kTick_s), Phase::safe);
  EXPECT_EQ(rig.conduct.reason(), "tilted by 0.7 rad");
  rig.now.falling = {};
  rig.now.approached = false;
  EXPECT_EQ(rig.run(10.0), Phase::safe);
  rig.now.actuators = "drives are off";
  EXPECT_EQ(rig.run(kTick_s), Phase::waiting);
  rig.now.actuators = {};
  EXPECT_EQ(rig.run(0.2), Phase::waiting);  // silent: the bridge asks for that
  EXPECT_EQ(rig.run(0.1), Phase::approaching);
}

TEST(Conduct, DrivesThatStopEndEverything) {
  for (const bool approached : {false, true}) {
    ConductRig rig;
    rig.run(2 * kTick_s);
    rig.now.actuators = {};
    rig.now.approached = approached;
    rig.run(3 * kTick_s);
    EXPECT_EQ(rig.conduct.phase(), approached ? Phase::balancing : Phase::approaching);
    rig.now.actuators = "following error";
    EXPECT_EQ(rig.run(kTick_s), Phase::waiting);
    EXPECT_EQ(rig.conduct.reason(), "following error");
  }
}

TEST(Conduct, AnApproachThatGoesWrongIsHeld) {
  ConductRig rig;
  rig.run(2 * kTick_s);
  rig.now.actuators = {};
  rig.run(kTick_s);
  rig.now.posture = "tilted";
  EXPECT_EQ(rig.run(kTick_s), Phase::safe);
  EXPECT_EQ(rig.conduct.reason(), "tilted");
  rig.now.posture = {};
  EXPECT_EQ(rig.run(0.6), Phase::approaching);
}

}  // namespace

namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

TEST(Approach, EndsAtTheGoalAtRestWithinTheSpeedThatIsAllowed) {
  Approach approach;
  const VectorXd from = Vector2d(0.0, 1.0), to = Vector2d(0.6, 0.9), fastest = Vector2d(4.0, 1.0);
  approach.start(from, to, fastest, 0.1, 0.5);
  // 1.875 · 0.6 / (0.1 · 4) = 2.8125 s; the other joint needs 1.875 s
  EXPECT_NEAR(approach.duration_s(), 2.8125, 1e-12);
  VectorXd last = from;
  double most = 0.0;
  int ticks = 0;
  for (; !approach.done(); ++ticks) {
    approach.step(0.005);
    // rates are those of the positions
    EXPECT_LT(((approach.q() - last) / 0.005 - approach.dq()).norm(), 5e-3);
    most = std::max(most, std::abs(approach.dq()[0]));
    last = approach.q();
  }
  EXPECT_EQ(ticks, 563);
  EXPECT_NEAR(most, 0.4, 1e-4);
  EXPECT_TRUE(approach.q().isApprox(to, 1e-12));
  EXPECT_LT(approach.dq().norm(), 1e-12);
}

TEST(Approach, ShortWaysTakeTheLeastTimeAndHalfTheWayIsInTheMiddle) {
  Approach approach;
  const VectorXd from = Vector2d(0.0, 0.0), to = Vector2d(0.01, -0.02), fastest = Vector2d(4, 4);
  approach.start(from, to, fastest, 0.1, 1.0);
  EXPECT_DOUBLE_EQ(approach.duration_s(), 1.0);
  for (int i = 0; i < 100; ++i) approach.step(0.005);
  EXPECT_TRUE(approach.q().isApprox(0.5 * to, 1e-12));
}

}  // namespace

}  // namespace mimesis::walker
