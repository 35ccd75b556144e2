#include "common/motion/retarget/to_robot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/model/files.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/retarget/test/walk.h"
#include "common/shared_data.h"

namespace mimesis::retarget {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::Vector3d, Eigen::VectorXd;

const robot::Biped& described() {
  static const robot::Biped biped = model::load_biped("biped.yaml");
  return biped;
}
const robot::RobotTree& biped() { return described().tree; }
RobotFigure biped_figure() { return figure_of(described()); }

/// A swaying, stepping, waving robot, well within its limits: `frames` postures at 100 Hz.
std::vector<Posture> own_motion(int frames) {
  std::vector<Posture> postures;
  for (int t = 0; t < frames; ++t) {
    const double phase = 0.06 * t;
    Posture p;
    p.X_WB.translation() = Vector3d(0.003 * t, 0.02 * std::sin(phase), 0.64);
    p.X_WB.linear() = math::exp_so3({0.03 * std::sin(phase), 0.05, 0.1 * std::cos(phase)});
    p.q = VectorXd::Zero(biped().dof());
    for (const auto& [joint, angle] : biped_figure().start_rad) {
      const int i = biped().require_joint(joint);
      p.q[i] = angle + 0.08 * std::sin(phase + i);
    }
    p.q[biped().require_joint("left_elbow")] -= 0.3 * (1.0 + std::sin(2.0 * phase));
    postures.push_back(p);
  }
  return postures;
}

/// Goals that the links of these postures fulfil: feet and hands with orientation.
std::vector<FrameGoals> own_goals(const std::vector<Posture>& postures) {
  std::vector<FrameGoals> goals;
  robot::Kinematics k(biped());
  for (const Posture& p : postures) {
    k.update(p.X_WB, p.q);
    FrameGoals frame;
    for (const char* name : {"left_sole", "right_sole", "left_grip", "right_grip"}) {
      Goal g;
      g.link = biped().require_link(name);
      g.X_WE = k.X_WL(g.link);
      frame.exact.push_back(g);
    }
    Goal chest;
    chest.link = biped().require_link("chest");
    chest.X_WE = k.X_WL(chest.link);
    frame.wishes.push_back(chest);
    goals.push_back(frame);
  }
  return goals;
}

bool within_limits(const std::vector<Posture>& postures) {
  for (const Posture& p : postures) {
    if ((p.q.array() < biped().lower().array()).any()) return false;
    if ((p.q.array() > biped().upper().array()).any()) return false;
  }
  return true;
}

double worst_error(const std::vector<Posture>& postures, const std::vector<FrameGoals>& goals) {
  robot::Kinematics k(biped());
  double worst = 0.0;
  for (std::size_t t = 0; t < postures.size(); ++t) {
    k.update(postures[t].X_WB, postures[t].q);
    worst = std::max(worst, errors(k, goals[t].exact).error.cwiseAbs().maxCoeff());
  }
  return worst;
}

TEST(NullSpace, StepsDoNotMoveTheGoals) {
  const MatrixXd J = MatrixXd::Random(5, 9);
  std::vector<bool> locked(9, false);
  locked[2] = locked[7] = true;
  const NullSpace n(J, locked);
  EXPECT_EQ(n.basis().cols(), 2);  // 9 − 2 locked − 5
  const VectorXd step = n.project(VectorXd::Random(9));
  EXPECT_GT(step.norm(), 1e-3);
  EXPECT_LT((J * step).norm(), 1e-13);
  EXPECT_EQ(step[2], 0.0);
  EXPECT_LT((n.project(step) - step).norm(), 1e-13);
  const VectorXd wanted = VectorXd::Random(5), reached = n.reach(wanted, 0.0);
  EXPECT_LT((J * reached - wanted).norm(), 1e-10);
  EXPECT_LT((n.basis().transpose() * reached).norm(), 1e-10);  // the shortest
  EXPECT_EQ(reached[7], 0.0);
}

TEST(Posture, ErrorsHaveTheJacobianOfTheirDecrease) {
  const std::vector<Posture> p = own_motion(20);
  const std::vector<FrameGoals> goals = own_goals({p[15]});
  robot::Kinematics k(biped());
  k.update(p[0].X_WB, p[0].q);
  const GoalErrors at = errors(k, goals[0].exact);
  const VectorXd step = 1e-6 * VectorXd::Random(6 + biped().dof());
  const Posture moved = advance(p[0], step);
  EXPECT_LT((difference(p[0], moved) - step).norm(), 1e-12);
  k.update(moved.X_WB, moved.q);
  const GoalErrors then = errors(k, goals[0].exact);
  // exact in positions; in orientations to first order of the (small) error
  EXPECT_LT((at.error - then.error - at.jacobian * step).norm(), 0.2 * step.norm());
  EXPECT_GT((at.error - then.error).norm(), 0.5 * step.norm());
}

TEST(LimitBarrier, RisesTowardsLimitsWithTheDerivativesItSays) {
  const LimitBarrier barrier(biped());
  VectorXd q = 0.5 * (biped().lower() + biped().upper()), first, second;
  EXPECT_EQ(barrier.value(q), 0.0);
  const int knee = biped().require_joint("left_knee");
  double before = 0.0;
  for (const double distance : {0.1, 0.05, 0.01, 0.004, 0.001}) {
    q[knee] = biped().lower()[knee] + distance;
    EXPECT_GT(barrier.value(q), before);
    before = barrier.value(q);
    barrier.derivatives(q, first, second);
    EXPECT_LT(first[knee], 0.0);  // downhill is away from the lower limit
    VectorXd up = q, down = q;
    up[knee] += 1e-7;
    down[knee] -= 1e-7;
    EXPECT_NEAR(first[knee], (barrier.value(up) - barrier.value(down)) / 2e-7, 1e-4 * -first[knee]);
  }
  q[knee] = biped().upper()[knee] - 0.01;
  barrier.derivatives(q, first, second);
  EXPECT_GT(first[knee], 0.0);
}

TEST(ToRobot, ItsOwnMotionIsFoundAgain) {
  const std::vector<Posture> own = own_motion(40);
  const std::vector<FrameGoals> goals = own_goals(own);
  RobotReport report;
  Posture start = own[0];
  start.q = RobotGoals(biped(), biped_figure()).start({}).q;  // not the solution
  const std::vector<Posture> found = follow(biped(), start, goals, report, 5);
  EXPECT_LT(worst_error(found, goals), 1e-6);
  EXPECT_TRUE(within_limits(found));
  EXPECT_TRUE(report.joints_at_limits.empty());
  EXPECT_LE(report.roughness_after, report.roughness_before);
}

TEST(ToRobot, WhatItCannotReachItMissesWithinTheLimitsAndSaysSo) {
  const std::vector<Posture> own = own_motion(30);
  std::vector<FrameGoals> goals = own_goals(own);
  for (std::size_t t = 0; t < goals.size(); ++t) {
    // Both hands far ahead, feet where they are: no posture does that
    for (const std::size_t hand : {2u, 3u}) goals[t].exact[hand].X_WE.translation().x() += 1.6;
  }
  RobotReport report;
  const std::vector<Posture> found = follow(biped(), own[0], goals, report);
  EXPECT_TRUE(within_limits(found));
  EXPECT_GT(worst_error(found, goals), 0.05);
  EXPECT_FALSE(report.joints_at_limits.empty());
  // Stretched: the hands come as near as they can, not anywhere
  robot::Kinematics k(biped());
  k.update(found[20].X_WB, found[20].q);
  const Goal& left = goals[20].exact[2];
  EXPECT_LT((k.X_WL(left.link).translation() - left.X_WE.translation()).norm(), 0.3);
}

TEST(Smoothing, LowersRoughnessAndDoesNotMoveTheHand) {
  std::vector<Posture> rough = own_motion(40);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (Posture& p : rough) {
    for (Index i = 0; i < p.q.size(); ++i) p.q[i] += 0.03 * unit(random);
    p.q = p.q.cwiseMax(biped().lower()).cwiseMin(biped().upper());
  }
  const std::vector<FrameGoals> goals = own_goals(rough);  // where this noisy motion has them
  std::vector<std::vector<Goal>> exact;
  for (const FrameGoals& frame : goals) exact.push_back({frame.exact[2], frame.exact[3]});
  std::vector<Posture> smoothed = rough;
  robot::Kinematics k(biped());
  const double before = roughness(rough);
  double last = before;
  for (int sweep = 0; sweep < 4; ++sweep) {
    smooth(k, exact, smoothed, 3);
    EXPECT_LT(roughness(smoothed), last);
    last = roughness(smoothed);
  }
  EXPECT_LT(last, 0.26 * before);  // the hands' own noise remains
  double moved = 0.0;
  for (std::size_t t = 0; t < exact.size(); ++t) {
    k.update(smoothed[t].X_WB, smoothed[t].q);
    moved = std::max(moved, errors(k, exact[t]).error.cwiseAbs().maxCoeff());
  }
  EXPECT_LT(moved, 1e-9);
  EXPECT_TRUE(within_limits(smoothed));
  for (const std::size_t end : {std::size_t{0}, rough.size() - 1}) {
    EXPECT_EQ(smoothed[end].q, rough[end].q);
    EXPECT_EQ(smoothed[end].X_WB.matrix(), rough[end].X_WB.matrix());
  }
}

TEST(Smoothing, ASineHasTheRoughnessOfItsSecondDifference) {
  std::vector<Posture> p(50);
  for (int t = 0; t < 50; ++t) {
    p[static_cast<std::size_t>(t)].q = VectorXd::Constant(1, std::sin(0.2 * t));
  }
  double sum = 0.0;
  for (int t = 1; t < 49; ++t) {
    sum += std::pow(2.0 * (1.0 - std::cos(0.2)) * std::sin(0.2 * t), 2.0);
  }
  EXPECT_NEAR(roughness(p), sum, 1e-12);
}

TEST(ToRobot, AWalkKeepsFeetAndHands) {
  const mocap::BodyClip walk = made_up_walk();
  const RobotClip clip = retarget(walk, biped(), biped_figure());
  ASSERT_EQ(clip.frames(), walk.frames());
  const RobotReport& r = clip.report;
  EXPECT_LT(r.foot_m.max, 1e-6);
  EXPECT_LT(r.foot_rad.max, 1e-6);
  EXPECT_LT(r.hand_m.max, 1e-6);
  EXPECT_LT(r.hand_rad.max, 0.05);
  EXPECT_LT(r.chest_rad.max, 0.05);
  EXPECT_LT(r.head_rad.max, 0.05);
  EXPECT_TRUE(r.joints_at_limits.empty());
  EXPECT_EQ(r.frames_at_limits, 0);
  EXPECT_LT(r.roughness_after, 0.7 * r.roughness_before);
  EXPECT_LT(r.speed_share, 1.0);
  EXPECT_FALSE(r.fastest_joint.empty());
  EXPECT_EQ(clip.joints, biped().joint_names());
  std::vector<Posture> postures;
  for (Index t = 0; t < clip.frames(); ++t) postures.push_back(clip.posture(t));
  EXPECT_TRUE(within_limits(postures));
}

TEST(RobotBody, StandsWhereTheRobotStands) {
  // The robot's skeleton with arms hanging as in the zero posture, against the robot itself
  const RobotFigure figure = biped_figure();
  const mocap::Body body = robot_body(biped(), figure);
  std::array<double, mocap::kBodyRows> hanging{};
  hanging[3 * mocap::kLeftShoulder] = -0.5 * std::numbers::pi;
  hanging[3 * mocap::kRightShoulder] = 0.5 * std::numbers::pi;
  const mocap::BodyPose pose = forward_kinematics(body, hanging, {0.0, 0.0, 0.705});
  robot::Kinematics k(biped());
  Posture zero;
  zero.X_WB.translation().z() = 0.705;
  k.update(zero.X_WB, VectorXd::Zero(biped().dof()));
  const mocap::BodyPose same = body_pose(k, figure);
  for (std::size_t j = 0; j < mocap::kBodyJoints; ++j) {
    EXPECT_LT((pose.p_WJ[j] - same.p_WJ[j]).norm(), 1e-12) << mocap::kBodyJointNames[j];
    EXPECT_LT((pose.R_WJ[j] - same.R_WJ[j]).norm(), 1e-12) << mocap::kBodyJointNames[j];
  }
  const Eigen::Isometry3d& grip = k.X_WL(biped().require_link("left_grip"));
  EXPECT_LT((same.point(mocap::kLeftWrist, body.hand_m[0]) - grip.translation()).norm(), 1e-12);
  EXPECT_NEAR(same.point(mocap::kRightAnkle, body.toe_m[1]).z(), 0.0, 1e-12);
  EXPECT_GT(same.p_WJ[mocap::kLeftElbow].y(), 0.2);
  // Its goals are fulfilled where it stands already
  const RobotGoals goals(biped(), figure);
  EXPECT_LT(errors(k, goals.exact(same)).error.norm(), 1e-9);
  EXPECT_LT(errors(k, goals.wishes(same)).error.norm(), 1e-9);
}

/// Reads and shortens a recorded walk; the shared folder is there.
mocap::BodyClip recorded(const std::string& file) {
  mocap::BodyClip walk = mocap::to_body(mocap::read_clip(file));
  walk.angles_rad = MatrixXd(walk.angles_rad.leftCols(140));
  walk.root_position_W_m = Eigen::Matrix3Xd(walk.root_position_W_m.leftCols(140));
  return walk;
}

TEST(ToRobot, RecordedWalksKeepFeetAndHandsOnTwoRobots) {
  const std::string shared = shared_data("data/").string();
  if (!std::filesystem::exists(shared + "mocap"))
    GTEST_SKIP() << "not here: needs the shared folder's mocap";
  const robot::Biped jvrc1 = model::load_biped("jvrc1.yaml");
  for (const char* file : {"cmu_bvh/07_01.bvh", "cmu_amc/16_15.amc", "cmu_amc/35_02.amc"}) {
    const mocap::BodyClip walk = recorded(shared + "mocap/" + file);
    for (const robot::Biped* robot : {&described(), &jvrc1}) {
      const robot::RobotTree* tree = &robot->tree;
      const RobotClip clip = retarget(walk, *tree, figure_of(*robot), 5);
      const RobotReport& r = clip.report;
      SCOPED_TRACE(std::string(file) + " " + tree->name());
      EXPECT_LT(r.foot_m.max, 1e-6);
      EXPECT_LT(r.foot_rad.max, 1e-6);
      EXPECT_LT(r.hand_m.max, 1e-6);
      EXPECT_LT(r.chest_rad.max, 0.35);
      EXPECT_LT(r.stance_speed_m_s, 0.05);
      const BodyMotion body = retarget(walk, robot_body(*tree, figure_of(*robot)));
      EXPECT_GT(r.scale * stance_speed(walk, body.contacts), 0.07);
      EXPECT_LT(foot_heights(body).standing_most, 1e-6);
      EXPECT_LT(r.roughness_after, r.roughness_before);
      EXPECT_TRUE((clip.q.array() >= tree->lower().replicate(1, clip.frames()).array()).all());
      EXPECT_TRUE((clip.q.array() <= tree->upper().replicate(1, clip.frames()).array()).all());
    }
  }
}

TEST(ToRobot, RefusesARobotWithoutTheFiguresLinks) {
  RobotFigure figure = biped_figure();
  figure.elbow[0] = "tentacle";
  EXPECT_THROW(robot_body(biped(), figure), ConfigError);
  EXPECT_THROW(retarget(made_up_walk(), biped(), figure), ConfigError);
  figure = biped_figure();
  figure.start_rad["fin"] = 0.1;
  EXPECT_THROW(RobotGoals(biped(), figure), ConfigError);
}

TEST(FigureClip, ItsFeetAreTheRobots) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  const robot::RobotTree& tree = biped.tree;
  const RobotFigure names = figure_of(biped);
  mocap::BodyClip recorded = made_up_walk();
  recorded.first_frame = 7;
  const RobotClip motion = retarget(recorded, tree, names, 1);
  const FigureClip figure = figure_clip(motion, recorded, tree, names);
  EXPECT_EQ(figure.clip.name, "made-up");
  EXPECT_EQ(figure.clip.first_frame, 7);
  EXPECT_EQ(figure.clip.frames(), motion.frames());
  EXPECT_LT(figure.ankle_m.max, 1e-6);
  EXPECT_LT(figure.wrist_m.max, 0.01);
  robot::Kinematics k(tree);
  for (const Eigen::Index t : {Eigen::Index{0}, Eigen::Index{60}, motion.frames() - 1}) {
    k.update(motion.posture(t).X_WB, motion.q.col(t));
    const mocap::BodyPose pose = figure.clip.pose(t);
    const auto toe = pose.point(mocap::kRightAnkle, figure.clip.body.toe_m[mocap::kRight]);
    const Eigen::Isometry3d& X_WL = k.X_WL(tree.require_link(names.ankle[1]));
    EXPECT_LT((toe - X_WL * names.toe_m[1]).norm(), 1e-6) << t;
    EXPECT_LT((pose.R_WJ[mocap::kHead] - k.X_WL(tree.require_link(names.head)).linear()).norm(),
              1e-9);
  }
  // no jumps by 2 pi
  const auto steps = figure.clip.angles_rad.rightCols(motion.frames() - 1) -
                     figure.clip.angles_rad.leftCols(motion.frames() - 1);
  EXPECT_LT(steps.cwiseAbs().maxCoeff(), 0.5);
}
}  // namespace
}  // namespace mimesis::retarget
