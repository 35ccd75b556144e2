// Tests of the simulated body: its trouble, ground and outcome.
#include "common/error.h"
#include "common/model/files.h"
#include "common/testing/refusal.h"
#include "hw/bridge/test/body/robot.h"

namespace mimesis::hw::sim {
namespace {

TEST_F(Robot, TakesPushesAndMotorFaultsAsMessages) {
  start();
  v1::BodyTrouble trouble;
  trouble.set_push_x_n_s(15.0);
  trouble.set_push_duration_s(0.1);
  body_graph.send("trouble", trouble, now);
  double fastest = 0.0;
  for (int k = 0; k < 40; ++k) {
    tick(true);
    fastest = std::max(fastest, truth.com_velocity_in_world().x_m_s());
  }
  EXPECT_NEAR(fastest, 15.0 / 58.0, 0.1) << "what the feet do not take away";
  trouble.Clear();
  trouble.set_motor("left_knee");
  trouble.set_motor_fault("off");
  body_graph.send("trouble", trouble, now);
  trouble.set_motor("tail");
  body_graph.send("trouble", trouble, now);
  run(2s);
  EXPECT_EQ(status.state(), "fault") << "following error of the limp knee";
  EXPECT_NE(status.reason().find("left_knee (node 4)"), std::string::npos) << status.reason();
  EXPECT_TRUE(truth.fell());
  ASSERT_EQ(outcomes.size(), 1u);
  EXPECT_TRUE(outcomes[0].fell());
  EXPECT_EQ(outcomes[0].reason(), "fell: " + truth.how());
}

TEST_F(Robot, APushToTheLeftLoadsTheLeftFoot) {
  start_body({.pushes = {{.at_s = 0.5, .impulse_W_ns = {0.0, 8.0, 0.0}}}});
  run(500ms, false);
  double left = 0.0, right = 0.0;
  for (int k = 0; k < 40; ++k) {
    tick(false);
    left = std::max(left, sensors.feet(0).force_z_n() - sensors.feet(1).force_z_n());
    right = std::min(right, truth.normal_n(0) - truth.normal_n(1));
  }
  EXPECT_GT(left, 100.0);
  EXPECT_GT(right, -left);
  EXPECT_EQ(sensors.feet(0).foot(), v1::FOOT_LEFT);
  EXPECT_GT(truth.feet(0).position_in_world_m().y_m(), 0.05);
  EXPECT_GT(truth.hands_in_world_m(0).y_m(), 0.05);
}

TEST_F(Robot, StandsSquareOnASlopeThatRisesForward) {
  start_body({.slope_forward_rad = 0.05, .slope_left_rad = 0.02});
  run(50ms, false);
  EXPECT_NEAR(2.0 * truth.world_from_pelvis().y(), -0.05, 0.005) << "nose up";
  EXPECT_NEAR(2.0 * truth.world_from_pelvis().x(), 0.02, 0.005) << "left side up";
}

TEST_F(Robot, ReachesTheGoalOnceItStandsThere) {
  start_body({.time_limit_s = 5.0, .settle_s = 0.5});
  start_bridge();
  run(1s);
  v1::WalkBalance old;  // balance of an old plan
  old.mutable_zmp_planned_in_world_m()->set_x_m(0.5);
  body_graph.send("balance", old, now);
  run(100ms);
  v1::WalkFeedback walk;
  walk.set_state(v1::WALK_STATE_STANDING);
  v1::MotionStatus motion;
  body_graph.send("walk", walk, now);
  run(1s);
  EXPECT_TRUE(outcomes.empty());
  motion.set_reached(true);
  body_graph.send("motion", motion, now);
  run(480ms);
  EXPECT_TRUE(outcomes.empty());
  run(5s);
  ASSERT_EQ(outcomes.size(), 1u) << "once";
  EXPECT_TRUE(outcomes[0].success());
  EXPECT_NEAR(outcomes[0].normal_peak_n(), 569.0, 10.0);
  EXPECT_EQ(outcomes[0].zmp_error_rms_m(), 0.0);
}

TEST_F(Robot, TellsOfTheDrawerAndWantsItsObject) {
  start_body({.drawer = {.present = true, .drawer = {.front_x_m = 3.0, .jumps = {{1.2, 0.5}}}},
              .settle_s = 0.2});
  start_bridge();
  run(1s);
  EXPECT_DOUBLE_EQ(body_graph.take_last<v1::DrawerState>("drawer")->front_in_world_m().x_m(), 3.0);
  v1::WalkFeedback walk;
  walk.set_state(v1::WALK_STATE_STANDING);
  v1::MotionStatus motion;
  motion.set_reached(true);
  body_graph.send("walk", walk, now);
  body_graph.send("motion", motion, now);
  run(500ms);
  const auto drawer = body_graph.take_last<v1::DrawerState>("drawer");
  EXPECT_NEAR(drawer->front_in_world_m().x_m(), 3.3, 0.02) << "at 1 m/s, since 1.2 s of the world";
  EXPECT_FALSE(drawer->taken());
  ASSERT_EQ(outcomes.size(), 1u);
  EXPECT_EQ(outcomes[0].reason(), "the object was not taken");
  EXPECT_FALSE(outcomes[0].success());
}

TEST_F(Robot, TakesTheObjectThatIsAtItsHand) {
  testing::Loopback elsewhere;
  SimBodyNode twin({}, elsewhere);
  for (Time t = 1s; t < 1100ms; t += kTick) twin.step(t);
  const v1::Vector3 hand = elsewhere.take_last<v1::BodyTruth>("truth")->hands_in_world_m(1);
  start_body({.drawer = {.present = true,
                         .drawer = {.front_x_m = hand.x_m() - 0.1,
                                    .object_height_m = hand.z_m(),
                                    .object_left_m = hand.y_m(),
                                    .object_depth_m = 0.1,
                                    .collides = false},
                         .right_gripper = {.joint = "none"}},
              .settle_s = 0.2});
  v1::WalkFeedback walk;
  walk.set_state(v1::WALK_STATE_STANDING);
  v1::MotionStatus motion;
  motion.set_reached(true);
  body_graph.send("walk", walk, now);
  body_graph.send("motion", motion, now);
  run(500ms, false);
  ASSERT_EQ(outcomes.size(), 1u);
  EXPECT_TRUE(outcomes[0].success()) << outcomes[0].reason();
  EXPECT_LT(outcomes[0].reach_error_m(), 0.01);
}

TEST(DrawerSettingsOf, HeightsThatAreNotGivenAreTheRobots) {
  robot::Biped biped = model::load_biped("biped.yaml");
  biped.X_WB_half_sitting.translation().z() += 0.1;  // on stilts
  const DrawerSettings own = drawer_settings({}, biped);
  EXPECT_NEAR(own.handle_height_m, 1.02, 1e-12);
  EXPECT_NEAR(own.object_height_m, 1.00, 1e-12);
  EXPECT_NEAR(own.handle_left_m, 0.14, 1e-12);
  const DrawerSettings given = drawer_settings(
      {.handle_height_m = 0.8, .handle_left_m = 0.2, .object_height_m = 0.7}, biped);
  EXPECT_EQ(given.handle_height_m, 0.8);
  EXPECT_EQ(given.handle_left_m, 0.2);
  EXPECT_EQ(given.object_height_m, 0.7);
}

/// Objects within reach of the hands in half-sitting, and gripping.
class Grip : public Robot {
 protected:
  /// With the object at the right hand, or the handle at the left one.
  void put_at_hands(const GripperParams& left, const GripperParams& right) {
    mimesis::testing::Loopback elsewhere;
    SimBodyNode twin({}, elsewhere);
    for (Time t = 1s; t < 1100ms; t += kTick) twin.step(t);
    const v1::BodyTruth at = *elsewhere.take_last<v1::BodyTruth>("truth");
    const v1::Vector3 &l = at.hands_in_world_m(0), &r = at.hands_in_world_m(1);
    start_body({.drawer = {.present = true,
                           .drawer = {.front_x_m = l.x_m(),
                                      .handle_height_m = l.z_m(),
                                      .handle_left_m = l.y_m(),
                                      .object_height_m = r.z_m(),
                                      .object_left_m = r.y_m(),
                                      .object_depth_m = r.x_m() - l.x_m(),
                                      .collides = false},
                           .left_gripper = left,
                           .right_gripper = right}});
    run(500ms, false);
    drawer = *body_graph.take_last<v1::DrawerState>("drawer");
  }
  v1::DrawerState drawer;
};

// Half-sitting holds the left gripper at -0.17 rad, the right one at 0.17 rad.
TEST_F(Grip, AHandWithoutAGripperIsClosed) {
  put_at_hands({.joint = "none"}, {.joint = "none"});
  EXPECT_TRUE(drawer.held());
  EXPECT_TRUE(drawer.taken());
}

TEST_F(Grip, GrippersAreThoseOfTheDescription) {
  put_at_hands({}, {});
  EXPECT_FALSE(drawer.held()) << "closed beyond -0.25 rad";
  EXPECT_FALSE(drawer.taken());
}

TEST_F(Grip, AGripperThatIsNotBeyondItsAngleIsOpen) {
  put_at_hands({.joint = "left_gripper", .closed_rad = -0.25},
               {.joint = "right_gripper", .closed_rad = 0.25});
  EXPECT_FALSE(drawer.held());
  EXPECT_FALSE(drawer.taken());
}

TEST_F(Grip, AGripperClosesOnTheFarSideOfItsAngle) {
  put_at_hands({.joint = "left_gripper", .closed_rad = -0.1},
               {.joint = "right_gripper", .closed_rad = 0.1});
  EXPECT_TRUE(drawer.held());
  EXPECT_TRUE(drawer.taken());
}

TEST_F(Grip, EachHandHasItsOwnGripperAndSign) {
  put_at_hands({.joint = "left_gripper", .closed_rad = 0.1},
               {.joint = "right_gripper", .closed_rad = 0.1});
  EXPECT_FALSE(drawer.held()) << "it is at -0.17 rad";
  EXPECT_TRUE(drawer.taken());
}

TEST_F(Robot, LengthsOfStepsAreHeldAgainstTheWish) {
  start_body({.time_limit_s = 1.0});
  run(200ms, false);
  const double left_y = truth.feet(0).position_in_world_m().y_m(),
               right_y = truth.feet(1).position_in_world_m().y_m();
  const auto footprint = [](v1::Foot foot, double x_m, double y_m) {
    v1::Footprint print;
    print.set_foot(foot);
    print.mutable_position_in_world_m()->set_x_m(x_m);
    print.mutable_position_in_world_m()->set_y_m(y_m);
    return print;
  };
  v1::Motion wish;  // 0.09 m was wished at first, then 0.05 m; the foot stands beside the other
  *wish.add_landings() = footprint(v1::FOOT_LEFT, 0.09, left_y);
  body_graph.send("wish", wish, now);
  *wish.mutable_landings(0) = footprint(v1::FOOT_LEFT, 0.05, left_y);
  body_graph.send("wish", wish, now);
  // a landing without a foot does not count
  wish.mutable_landings(0)->set_foot(v1::FOOT_UNSPECIFIED);
  body_graph.send("wish", wish, now);
  v1::WalkFeedback walk;
  walk.set_state(v1::WALK_STATE_WALKING);
  walk.set_swing(v1::FOOT_LEFT);
  *walk.mutable_landing() = footprint(v1::FOOT_LEFT, 0.0, left_y);
  *walk.add_feet() = footprint(v1::FOOT_LEFT, 0.0, left_y);
  *walk.add_feet() = footprint(v1::FOOT_RIGHT, 0.0, right_y);
  body_graph.send("walk", walk, now);
  walk.set_steps(1);
  body_graph.send("walk", walk, now);
  run(1s, false);
  ASSERT_EQ(outcomes.size(), 1u);
  EXPECT_EQ(outcomes[0].steps(), 1u);
  EXPECT_NEAR(outcomes[0].step_length_error_max_m(), 0.05, 0.003);
  EXPECT_LT(outcomes[0].step_error_max_m(), 0.003) << "it is where the plan has it";
}

TEST_F(Robot, AWorldThatIsLateLeavesOutWhatItCannotSimulate) {
  start_body({.time_limit_s = 1.5});
  run(1s, false);
  now += 1s;  // a second of the clock without a step: the world advances by 0.05 s
  tick(false);
  EXPECT_FALSE(truth.fell()) << truth.how();
  run(450ms, false);  // its time is 0.995 s + 0.05 s + 0.45 s
  EXPECT_TRUE(outcomes.empty());
  run(15ms, false);
  ASSERT_EQ(outcomes.size(), 1u);
  EXPECT_EQ(outcomes[0].reason(), "goal not reached in time");
  expect_stands(1s, false, "after a second that was left out");
}

TEST_F(Robot, ABodyThatStopsForASecondIsAFaultOfTheBridgeAndStands) {
  start();
  for (int k = 0; k < 200; ++k) {
    step_bridge();
    now += kTick;
  }
  EXPECT_EQ(status.state(), "fault");
  EXPECT_NE(status.reason().find("no feedback for 0.0075 s"), std::string::npos) << status.reason();
  run(100ms);
  EXPECT_EQ(count(v1::DRIVE_STATE_QUICK_STOP_ACTIVE), 30) << "stopped as soon as they can hear";
  expect_stands(2s, true, "after a second without a world");
}

TEST_F(Robot, TimeIsUp) {
  start_body({.time_limit_s = 0.5});
  run(1s);
  ASSERT_EQ(outcomes.size(), 1u);
  EXPECT_FALSE(outcomes[0].success());
  EXPECT_EQ(outcomes[0].reason(), "goal not reached in time");
  EXPECT_EQ(outcomes[0].normal_peak_n(), 0.0) << "nobody walked";
}

TEST(SimBody, RefusesBadConfigurationInOneLine) {
  const auto refusal = [](const SimBodyParams& params) -> std::string {
    testing::Loopback graph;
    return testing::refusal([&] { SimBodyNode node(params, graph); }, "accepted");
  };
  EXPECT_EQ(refusal({.buses = {{"embedded:a", 29}}}), "buses: carry 29 joints, the robot has 30");
  EXPECT_NE(refusal({.faults = {{.joint = "tail"}}}).find("'tail'"), std::string::npos);
  EXPECT_NE(refusal({.pushes = {{.link = "tail"}}}).find("'tail'"), std::string::npos);
  EXPECT_NE(refusal({.robot = "nobody.yaml"}).find("nobody.yaml"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::hw::sim
