// Messages in terms of the robot, and the other way round: every figure in its place, on its side,
// with its sign.
#include "nodes/walker/walker_messages.h"

#include <gtest/gtest.h>

#include "nodes/walker/test/node_rig.h"

namespace mimesis::walker {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::biped;

Vector3d to_eigen(const v1::Vector3& v) { return {v.x_m(), v.y_m(), v.z_m()}; }

/// Rows of a motion in another order than the robot's joints, with one that is no joint of it.
v1::MotionRows shuffled_rows() {
  v1::MotionRows rows;
  const std::vector<std::string> names = biped().tree.joint_names();
  for (auto name = names.rbegin(); name != names.rend(); ++name) rows.add_rows(*name);
  rows.add_rows("pelvis.x");
  return rows;
}

TEST(MotionReader, FindsTheUpperBodyByNameAndGoesOnAtItsRates) {
  MotionReader reader(biped());
  const v1::MotionRows rows = shuffled_rows();
  ASSERT_EQ(reader.set_rows(rows), "");
  v1::Motion motion;
  for (int row = 0; row < rows.rows_size(); ++row) {
    motion.add_position_rad(0.01 * row);
    motion.add_velocity_rad_s(1.0 - 0.1 * row);
  }
  MotionWish wish;
  ASSERT_EQ(reader.read(motion, 0.05, true, wish), "");
  ASSERT_EQ(wish.upper_body.size(), std::ssize(biped().upper_body));
  const auto at = [](std::size_t i) { return static_cast<Eigen::Index>(i); };
  for (std::size_t i = 0; i < biped().upper_body.size(); ++i) {
    const int row = biped().tree.dof() - 1 - biped().upper_body[i];
    EXPECT_DOUBLE_EQ(wish.upper_body_rate[at(i)], 1.0 - 0.1 * row);
    EXPECT_DOUBLE_EQ(wish.upper_body[at(i)], 0.01 * row + 0.05 * (1.0 - 0.1 * row));
  }
  motion.clear_velocity_rad_s();  // at rest
  ASSERT_EQ(reader.read(motion, 0.05, true, wish), "");
  EXPECT_EQ(wish.upper_body_rate.norm(), 0.0);
  EXPECT_DOUBLE_EQ(wish.upper_body[0], 0.01 * (biped().tree.dof() - 1 - biped().upper_body[0]));
  motion.clear_position_rad();  // nothing of the arms: no wish
  ASSERT_EQ(reader.read(motion, 0.0, true, wish), "");
  EXPECT_EQ(wish.upper_body.size(), 0);
}

TEST(MotionReader, SaysTheFirstJointThatIsMissingAndForgetsItWithOtherRows) {
  MotionReader reader(biped());
  const std::string& first = biped().tree.moved(biped().upper_body.front()).joint;
  EXPECT_EQ(reader.set_rows({}),
            "rows of motion '' have no joint '" + first + "', expected all of the upper body");
  EXPECT_EQ(reader.set_rows(shuffled_rows()), "");
  v1::Motion motion;
  for (int row = 0; row < shuffled_rows().rows_size(); ++row) motion.add_position_rad(0.0);
  MotionWish wish;
  EXPECT_EQ(reader.read(motion, 0.0, true, wish), "");
  for (int row = 0; row <= shuffled_rows().rows_size(); ++row) motion.add_velocity_rad_s(0.0);
  EXPECT_EQ(reader.read(motion, 0.0, true, wish), "motion with 32 joint rates, its rows are 31");
}

TEST(MotionReader, ReadsTheWalk) {
  v1::Motion motion;
  motion.set_velocity_forward_m_s(0.1);
  motion.set_velocity_left_m_s(0.2);
  motion.set_yaw_rate_rad_s(0.3);
  motion.set_smooth_velocity_forward_m_s(0.4);
  motion.set_smooth_velocity_left_m_s(0.5);
  motion.set_smooth_yaw_rate_rad_s(0.6);
  motion.mutable_position_pelvis_in_world_m()->set_x_m(7.0);
  motion.mutable_position_pelvis_in_world_m()->set_y_m(-8.0);
  motion.set_heading_rad(0.9);
  motion.set_stands(true);
  const MotionReader reader(biped());
  MotionWish wish;
  ASSERT_EQ(reader.read(motion, 0.0, false, wish), "");
  EXPECT_EQ(wish.velocity_m_s, Vector2d(0.1, 0.2));
  EXPECT_EQ(wish.yaw_rate_rad_s, 0.3);
  ASSERT_EQ(reader.read(motion, 0.0, true, wish), "");
  EXPECT_EQ(wish.velocity_m_s, Vector2d(0.4, 0.5));
  EXPECT_EQ(wish.yaw_rate_rad_s, 0.6);
  EXPECT_EQ(wish.pelvis_W_m, Vector2d(7.0, -8.0));
  EXPECT_EQ(wish.heading_rad, 0.9);
  EXPECT_TRUE(wish.stands);
}

TEST(MotionReader, ReadsLandingsAndHandsAndForgetsThoseOfBefore) {
  v1::Motion motion;
  for (const v1::Foot foot : {v1::FOOT_RIGHT, v1::FOOT_LEFT}) {
    v1::Footprint& landing = *motion.add_landings();
    landing.set_foot(foot);
    const double far = foot == v1::FOOT_LEFT ? 2.0 : 1.0;
    landing.mutable_position_in_world_m()->set_x_m(1.5 * far);
    landing.mutable_position_in_world_m()->set_y_m(-0.1 * far);
    landing.set_yaw_rad(0.2 * far);
  }
  v1::HandGoal& hand = *motion.add_hands();
  hand.set_left(true);
  hand.set_share(0.7);
  hand.mutable_position_in_world_m()->set_z_m(1.1);
  const MotionReader reader(biped());
  MotionWish wish;
  ASSERT_EQ(reader.read(motion, 0.0, true, wish), "");
  ASSERT_TRUE(wish.landing[0] && wish.landing[1]);
  EXPECT_EQ(wish.landing[0]->side, kRight);
  EXPECT_EQ(wish.landing[1]->side, kLeft);
  EXPECT_EQ(wish.landing[0]->p_W_m, Vector2d(1.5, -0.1));
  EXPECT_EQ(wish.landing[1]->yaw_rad, 0.4);
  EXPECT_EQ(wish.hand[kLeft].share, 0.7);
  EXPECT_EQ(wish.hand[kLeft].p_W_m, Vector3d(0.0, 0.0, 1.1));
  EXPECT_EQ(wish.hand[kRight].share, 0.0);
  ASSERT_EQ(reader.read({}, 0.0, true, wish), "");
  EXPECT_FALSE(wish.landing[0] || wish.landing[1]);
  EXPECT_EQ(wish.hand[kLeft].share, 0.0);
  *motion.add_landings() = motion.landings(0);
  EXPECT_EQ(reader.read(motion, 0.0, true, wish), "3 landings, expected at most 2");
}

/// Figures that are all different, of feet in the other order, by an attitude a little too long.
v1::BodySensors distinct_sensors(double length) {
  v1::BodySensors message;
  const Eigen::Quaterniond R(Eigen::AngleAxisd(0.5, Vector3d(0.6, -0.48, 0.64)));
  message.mutable_world_from_imu()->set_w(length * R.w());
  message.mutable_world_from_imu()->set_x(length * R.x());
  message.mutable_world_from_imu()->set_y(length * R.y());
  message.mutable_world_from_imu()->set_z(length * R.z());
  message.mutable_gyro_in_imu()->set_x_rad_s(1.0);
  message.mutable_gyro_in_imu()->set_y_rad_s(2.0);
  message.mutable_gyro_in_imu()->set_z_rad_s(3.0);
  message.mutable_specific_force_in_imu()->set_x_m_s2(4.0);
  message.mutable_specific_force_in_imu()->set_y_m_s2(5.0);
  message.mutable_specific_force_in_imu()->set_z_m_s2(6.0);
  for (const v1::Foot foot : {v1::FOOT_RIGHT, v1::FOOT_LEFT}) {
    v1::FootWrench& wrench = *message.add_feet();
    wrench.set_foot(foot);
    const double tens = foot == v1::FOOT_LEFT ? 10.0 : 20.0;
    wrench.set_force_x_n(tens + 1.0);
    wrench.set_force_y_n(tens + 2.0);
    wrench.set_force_z_n(tens + 3.0);
    wrench.set_moment_x_n_m(tens + 4.0);
    wrench.set_moment_y_n_m(tens + 5.0);
    wrench.set_moment_z_n_m(tens + 6.0);
  }
  return message;
}

TEST(ReadBody, TakesImuAndFeetAsTheyAre) {
  Sensors sensors;
  ASSERT_EQ(read_body(distinct_sensors(1.04), sensors), "");
  const Eigen::AngleAxisd R(0.5, Vector3d(0.6, -0.48, 0.64));
  EXPECT_LT((sensors.R_WI.toRotationMatrix() - R.toRotationMatrix()).norm(), 1e-12);
  EXPECT_EQ(sensors.gyro_I, Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(sensors.specific_force_I, Vector3d(4.0, 5.0, 6.0));
  for (const Side side : robot::kSides) {
    const double tens = side == kLeft ? 10.0 : 20.0;
    EXPECT_EQ(sensors.foot_S[side].force, Vector3d::Constant(tens) + Vector3d(1.0, 2.0, 3.0));
    EXPECT_EQ(sensors.foot_S[side].moment, Vector3d::Constant(tens) + Vector3d(4.0, 5.0, 6.0));
  }
}

TEST(ReadBody, RefusesAnAttitudeThatIsNoneAndAFootThatIsMissing) {
  Sensors sensors;
  EXPECT_EQ(read_body(distinct_sensors(1.1), sensors),
            "attitude of the IMU has length 1.1, expected 1");
  EXPECT_EQ(read_body(distinct_sensors(0.9), sensors),
            "attitude of the IMU has length 0.9, expected 1");
  for (const int missing : {0, 1}) {
    v1::BodySensors message = distinct_sensors(1.0);
    message.mutable_feet()->DeleteSubrange(missing, 1);
    EXPECT_EQ(read_body(message, sensors), "foot forces of one foot only, expected both");
  }
}

TEST(ReadJoints, TakesPositionsAndRatesOfAllJoints) {
  Sensors sensors;
  sensors.q = sensors.dq = Eigen::VectorXd::Zero(3);
  v1::JointState message;
  for (int j = 0; j < 3; ++j) {
    message.add_position_rad(1.0 + j);
    message.add_velocity_rad_s(-1.0 - j);
  }
  ASSERT_EQ(read_joints(message, sensors), "");
  EXPECT_EQ(sensors.q, Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(sensors.dq, Vector3d(-1.0, -2.0, -3.0));
  message.mutable_velocity_rad_s()->RemoveLast();
  EXPECT_EQ(read_joints(message, sensors),
            "encoders of 3 positions and 2 rates, the robot has 3 joints");
}

Eigen::Isometry3d pose(double x_m, double y_m, double z_m, double yaw_rad) {
  return Eigen::Translation3d(x_m, y_m, z_m) * Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ());
}

/// A tick in which no two figures are the same.
WalkerOutput distinct_tick() {
  WalkerOutput tick;
  tick.X_WB = pose(1.0, 2.0, 0.7, 0.3);
  tick.com.p_W_m = {1.1, 2.2};
  tick.com.v_W = {0.31, -0.12};
  tick.pattern.com.p_W_m = {1.15, 2.17};
  tick.pattern.com.v_W = {0.2, 0.1};
  tick.pattern.zmp_W_m = {1.3, 2.4};
  tick.pattern.foot[kLeft].X_WS = pose(0.9, 2.6, 0.04, 0.35);
  tick.pattern.foot[kRight].X_WS = pose(0.8, 2.1, 0.0, -0.25);
  tick.pattern.swing = kLeft;
  tick.pattern.to_landing_s = 0.33;
  tick.pattern.landing = {.side = kLeft, .p_W_m = {1.6, 2.7}, .yaw_rad = -0.45};
  tick.pattern.steps = 5;
  tick.stabilizer.com_W_m = {1.21, 2.32, 0.81};
  tick.stabilizer.wished_zmp_W_m = {1.4, 2.5};
  tick.stabilizer.zmp_W_m = {1.7, 2.8};
  tick.stabilizer.dcm_error_W_m = {0.01, -0.02};
  return tick;
}

TEST(WalkFeedbackMessage, SaysWhereTheRobotIsAndWhatItPlans) {
  const WalkerOutput tick = distinct_tick();
  v1::WalkFeedback out;
  to_proto(tick, out);
  to_proto(tick, out);  // a message that is used again
  EXPECT_EQ(to_eigen(out.position_pelvis_in_world_m()), Vector3d(1.0, 2.0, 0.7));
  EXPECT_NEAR(out.heading_rad(), 0.3, 1e-12);
  EXPECT_EQ(out.velocity_pelvis_in_world().x_m_s(), 0.31);
  EXPECT_EQ(out.velocity_pelvis_in_world().y_m_s(), -0.12);
  EXPECT_EQ(out.swing(), v1::FOOT_LEFT);
  EXPECT_EQ(out.to_landing_s(), 0.33);
  EXPECT_EQ(out.landing().foot(), v1::FOOT_LEFT);
  EXPECT_EQ(to_eigen(out.landing().position_in_world_m()), Vector3d(1.6, 2.7, 0.0));
  EXPECT_EQ(out.landing().yaw_rad(), -0.45);
  ASSERT_EQ(out.feet_size(), 2);
  EXPECT_EQ(out.feet(0).foot(), v1::FOOT_LEFT);
  EXPECT_EQ(to_eigen(out.feet(0).position_in_world_m()), Vector3d(0.9, 2.6, 0.04));
  EXPECT_NEAR(out.feet(0).yaw_rad(), 0.35, 1e-12);
  EXPECT_EQ(out.feet(1).foot(), v1::FOOT_RIGHT);
  EXPECT_NEAR(out.feet(1).yaw_rad(), -0.25, 1e-12);
  EXPECT_EQ(out.steps(), 5U);
}

TEST(WalkBalanceMessage, SaysPlanMeasurementAndWhatTheFilterAdds) {
  WalkerOutput tick = distinct_tick();
  v1::WalkBalance out;
  to_proto(tick, out);
  EXPECT_EQ(to_eigen(out.com_planned_in_world_m()), Vector3d(1.1, 2.2, 0.81));
  EXPECT_EQ(to_eigen(out.com_measured_in_world_m()), Vector3d(1.21, 2.32, 0.81));
  EXPECT_EQ(to_eigen(out.zmp_planned_in_world_m()), Vector3d(1.3, 2.4, 0.0));
  EXPECT_EQ(to_eigen(out.zmp_wished_in_world_m()), Vector3d(1.4, 2.5, 0.0));
  EXPECT_EQ(to_eigen(out.zmp_measured_in_world_m()), Vector3d(1.7, 2.8, 0.0));
  EXPECT_EQ(to_eigen(out.dcm_error_in_world_m()), Vector3d(0.01, -0.02, 0.0));
  EXPECT_LT((to_eigen(out.filter_shift_in_world_m()) - Vector3d(-0.05, 0.03, 0.0)).norm(), 1e-12);
  EXPECT_FALSE(out.saturated());
  tick.stabilizer.saturated = true;
  to_proto(tick, out);
  EXPECT_TRUE(out.saturated());
}

TEST(FrameTransforms, ArePosesOfAllLinksAtTheirTime) {
  robot::Kinematics kinematics(biped().tree);
  const Eigen::Isometry3d X_WB = pose(1.0, -2.0, 0.7, 0.4);
  kinematics.update(X_WB, biped().half_sitting);
  foxglove::FrameTransforms out;
  to_proto(kinematics, 12'345'678'901ns, out);
  ASSERT_EQ(out.transforms_size(), std::ssize(biped().tree.links()));
  for (int i = 0; i < out.transforms_size(); ++i) {
    const foxglove::FrameTransform& frame = out.transforms(i);
    EXPECT_EQ(frame.timestamp().seconds(), 12);
    EXPECT_EQ(frame.timestamp().nanos(), 345'678'901);
    EXPECT_EQ(frame.parent_frame_id(), "world");
    EXPECT_EQ(frame.child_frame_id(), "robot/" + biped().tree.link(i).name);
    const auto& p = frame.translation();
    const auto& R = frame.rotation();
    const Eigen::Isometry3d X =
        Eigen::Translation3d(p.x(), p.y(), p.z()) * Eigen::Quaterniond(R.w(), R.x(), R.y(), R.z());
    EXPECT_TRUE(X.isApprox(kinematics.X_WL(i), 1e-9)) << frame.child_frame_id();
  }
}

}  // namespace
}  // namespace mimesis::walker
