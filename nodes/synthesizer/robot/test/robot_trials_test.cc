#include "nodes/synthesizer/robot/robot_trials.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "common/error.h"
#include "common/robot/kinematics.h"
#include "common/shared_data.h"
#include "nodes/synthesizer/robot/test/learned_biped.h"
#include "nodes/synthesizer/sequence/action_course.h"
#include "nodes/synthesizer/sequence/action_maps.h"

namespace mimesis::synthesizer {
namespace {

using testing::biped_data;
using testing::biped_tree;
using testing::described_biped;
constexpr Eigen::Index kJoints = 18, kRows = kJoints + 3;

Eigen::MatrixXd rows_of(const DrawerData& data, Action action, std::size_t trial) {
  const auto& set = data.action[action];
  return set.samples.middleRows(static_cast<Eigen::Index>(trial) * kRows, kRows);
}

/// How far the pelvis comes along its first heading: the velocities, which are those of a turning
/// frame, added up pose by pose.
double walked_m(const Eigen::MatrixXd& rows, double duration_s) {
  const double dt = duration_s / static_cast<double>(rows.cols());
  double x = 0.0, heading = 0.0;
  for (Eigen::Index t = 0; t < rows.cols(); ++t) {
    const double forward = rows(kJoints, t), left = rows(kJoints + 1, t);
    const double middle = heading + 0.5 * dt * rows(kJoints + 2, t);
    x += dt * (forward * std::cos(middle) - left * std::sin(middle));
    heading += dt * rows(kJoints + 2, t);
  }
  return x;
}

TEST(RobotTrials, AreFiftyOfTheUpperBodyAndThePelvisVelocity) {
  const DrawerData& data = biped_data();
  for (const auto& set : data.action) {
    EXPECT_EQ(set.trials.size(), 50U);
    ASSERT_EQ(set.rows.size(), static_cast<std::size_t>(kRows));
    EXPECT_EQ(set.samples.rows(), 50 * kRows);
    EXPECT_EQ(set.rows.back(), "pelvis.turn_rad_s");
    for (const std::string& row : set.rows) {
      EXPECT_EQ(row.find("knee"), std::string::npos);
      EXPECT_EQ(row.find("hip"), std::string::npos);
    }
  }
}

TEST(RobotTrials, AreWithinWhatTheRobotCan) {
  RobotTrialReport report;
  const DrawerData data = generate_robot_data(described_biped(), {}, &report);
  EXPECT_LT(report.hand_error_m, 0.003);
  EXPECT_LT(report.speed_share, 0.5) << report.fastest_joint;
  const robot::RobotTree upper =
      upper_body_tree(biped_tree(), retarget::figure_of(described_biped()));
  for (const Action a : {kNormalStep, kReachingStep, kStanding}) {
    for (std::size_t i = 0; i < 50; ++i) {
      const Eigen::MatrixXd q = rows_of(data, a, i).topRows(kJoints);
      EXPECT_TRUE(((q.colwise() - upper.lower()).array() >= -1e-12).all());
      EXPECT_TRUE(((upper.upper().replicate(1, q.cols()) - q).array() >= -1e-12).all());
    }
  }
}

/// By the robot's own kinematics: at the end of action 2 the left hand is at the handle, at the end
/// of action 3 the right one at the object.
TEST(RobotTrials, HandsAreWhereTheTaskIs) {
  const DrawerData& data = biped_data();
  const robot::RobotTree upper =
      upper_body_tree(biped_tree(), retarget::figure_of(described_biped()));
  const double height = easy_pelvis_height(biped_tree(), retarget::figure_of(described_biped()));
  EXPECT_NEAR(height, 0.6487, 0.001);  // pelvis height of the half-sitting robot
  robot::Kinematics kinematics(upper);
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  X_WB.translation().z() = height;
  for (std::size_t i = 0; i < 10; ++i) {
    const auto& task = data.action[kStanding].trials[i].task;
    kinematics.update(X_WB, rows_of(data, kStanding, i).col(0).head(kJoints));
    const Eigen::Vector3d left = kinematics.X_WL(upper.require_link("left_grip")).translation();
    EXPECT_LT((left - Eigen::Vector3d(task[1], 0.14, 0.92)).norm(), 0.01) << "trial " << i;
    kinematics.update(X_WB, rows_of(data, kStanding, i).rightCols<1>().head(kJoints));
    const Eigen::Vector3d right = kinematics.X_WL(upper.require_link("right_grip")).translation();
    EXPECT_LT((right - Eigen::Vector3d(task[1] - 0.20 + task[2], task[3], 0.90)).norm(), 0.01);
  }
}

/// Loads of the second robot's arms before furniture of its size.
TEST(RobotTrials, OfAnotherRobotAreWithinWhatItCanToo) {
  if (!std::filesystem::exists(shared_data("data/robots/jvrc1.urdf"))) {
    GTEST_SKIP() << "not here: needs data/robots/jvrc1.urdf of the shared folder";
  }
  const robot::Biped biped = model::load_biped("jvrc1.yaml");
  const Drawer drawer = robot_drawer(biped);
  EXPECT_NEAR(drawer.handle_height_m, 1.056, 0.002);  // shoulders 0.154 m higher, arms 7 % longer
  EXPECT_NEAR(drawer.handle_height_m - drawer.object_height_m, 0.021, 0.0011);
  RobotTrialReport report;
  const DrawerData data = generate_robot_data(biped, robot_trial_settings(biped), &report);
  EXPECT_LT(report.hand_error_m, 0.003);
  EXPECT_LT(report.speed_share, 0.7) << report.fastest_joint;
  EXPECT_EQ(data.drawer.handle_height_m, drawer.handle_height_m);
}

TEST(RobotSize, TheBipedsSettingsAreTheDefaults) {
  const RobotTrialSettings s = robot_trial_settings(described_biped()), one;
  for (const auto length :
       {&RobotTrialSettings::least_normal_m, &RobotTrialSettings::most_normal_m,
        &RobotTrialSettings::least_reaching_m, &RobotTrialSettings::most_reaching_m,
        &RobotTrialSettings::least_reach_m, &RobotTrialSettings::most_reach_m,
        &RobotTrialSettings::least_depth_m, &RobotTrialSettings::most_depth_m}) {
    EXPECT_EQ(s.*length, one.*length);
  }
  const StepPlanSettings p = robot_step_plan(described_biped()), standard;
  for (const auto length :
       {&StepPlanSettings::normal_m, &StepPlanSettings::normal_half_m,
        &StepPlanSettings::reaching_m, &StepPlanSettings::reaching_half_m,
        &StepPlanSettings::least_normal_m, &StepPlanSettings::longest_step_m,
        &StepPlanSettings::shortest_step_m, &StepPlanSettings::most_reaching_m,
        &StepPlanSettings::longest_back_m, &StepPlanSettings::stand_half_m,
        &StepPlanSettings::stand_nearer_m, &StepPlanSettings::stand_farther_m}) {
    EXPECT_EQ(p.*length, standard.*length);
  }
}

/// Shorter legs make shorter steps; longer ones do not make longer ones.
TEST(RobotSize, StepsGoWithTheLegsUpToTheBipeds) {
  for (const double factor : {0.5, 1.3}) {
    robot::Biped biped = described_biped();
    std::vector<robot::Link> links = biped.tree.links();
    for (robot::Link& link : links) {
      if (link.joint.ends_with("knee") || link.joint.ends_with("ankle_pitch")) {
        link.X_PJ.translation() *= factor;
      }
    }
    biped.tree = robot::RobotTree("legs", links);
    const double share = std::min(1.0, factor);
    EXPECT_NEAR(robot_step_plan(biped).longest_step_m, share * 0.28, 0.6e-3);
    EXPECT_NEAR(robot_trial_settings(biped).most_normal_m, share * 0.467, 0.6e-3);
    EXPECT_EQ(robot_step_plan(biped).stand_nearer_m, 0.08);  // this follows the arms
  }
}

TEST(RobotTrials, VelocitiesCarryThePelvisByTheLengths) {
  const DrawerData& data = biped_data();
  double least = 1.0, most = 0.0;
  for (std::size_t i = 0; i < 50; ++i) {
    for (const Action a : {kNormalStep, kReachingStep}) {
      const mocap::Trial& trial = data.action[a].trials[i];
      EXPECT_NEAR(walked_m(rows_of(data, a, i), trial.duration_s), trial.step_length_m, 0.003)
          << "action " << a << " trial " << i;
    }
    least = std::min(least, data.action[0].trials[i].step_length_m);
    most = std::max(most, data.action[0].trials[i].step_length_m);
  }
  EXPECT_NEAR(least, 0.8 * 0.421, 1e-9);
  EXPECT_NEAR(most, 1.2 * 0.467, 1e-9);  // the longest of [M18 3.8.4]
}

TEST(RobotTrials, AreTheSameWithTheSameSeedAndOthersWithAnother) {
  RobotTrialSettings settings;
  settings.trials = 4;
  settings.samples = 30;
  const auto make = [&] {
    return generate_robot_data(described_biped(), settings).action[0].samples;
  };
  const Eigen::MatrixXd first = make();
  EXPECT_EQ(first, make());
  settings.seed = 2;
  EXPECT_NE(first, make());
}

TEST(RobotTrials, RefuseActionsOfNoDuration) {
  EXPECT_THROW(generate_robot_data(described_biped(), {.cycle_s = 0.0}), ConfigError);
}

Eigen::MatrixXd reconstructed(const ActionMaps& learned, Action action, std::size_t trial) {
  const motion::MotionModel& model = learned.model().action[action];
  return mixture_rows(model, parameters_of(model.patterns.at(trial)));
}

Eigen::MatrixXd inferred(const ActionMaps& learned, Action action, const ActionTask& task) {
  return mixture_rows(learned.model().action[action], learned.at(action, task));
}

TEST(RobotActionMaps, ReconstructWhatTheyLearned) {
  const DrawerData& data = biped_data();
  double worst_m = 0.0, worst_rad = 0.0;
  const ActionMaps& learned = testing::biped_drawer().actions;
  for (const Action a : {kNormalStep, kReachingStep, kStanding}) {
    for (std::size_t i = 0; i < 50; ++i) {
      const Eigen::MatrixXd made = reconstructed(learned, a, i), was = rows_of(data, a, i);
      ASSERT_EQ(made.rows(), was.rows());
      const Eigen::MatrixXd off = (made - was).cwiseAbs();
      worst_rad = std::max(worst_rad, off.topRows(kJoints).maxCoeff());
      const double seconds = data.action[a].trials[i].duration_s;
      worst_m = std::max(worst_m, std::abs(walked_m(made, seconds) - walked_m(was, seconds)));
    }
  }
  EXPECT_LT(worst_m, 0.005);  // the goal of the steps' errors [M18 3.8.3]
  EXPECT_LT(worst_rad, 0.12);
  EXPECT_GT(learned.model().quality_squared, 0.999);
}

TEST(RobotActionMaps, InferLengthsThatWereNotTrained) {
  const ActionMaps& learned = testing::biped_drawer().actions;
  // novel goals of [M18 3.8.4]; one kernel for joints and velocities misses action 2 by 13 mm
  for (int k = 0; k < 30; ++k) {
    const double u = k / 29.0;
    const ActionTask one{.length_m = 0.505 + 0.056 * u, .duration_s = 1.6};
    const ActionTask two{
        .length_m = 0.163 + 0.196 * u, .duration_s = 1.6, .previous_length_m = one.length_m};
    EXPECT_NEAR(walked_m(inferred(learned, kNormalStep, one), 1.6), one.length_m, 0.002);
    EXPECT_NEAR(walked_m(inferred(learned, kReachingStep, two), 1.6), two.length_m, 0.007);
  }
}

TEST(RobotActionMaps, LearnAnyRows) {
  // compared are the angles of all joints, no velocities
  DrawerData data = biped_data();
  constexpr Eigen::Index kAll = kJoints + 12;
  for (mocap::Trials& set : data.action) {
    Eigen::MatrixXd all(50 * kAll, set.samples.cols());
    for (Eigen::Index i = 0; i < 50; ++i) {
      all.middleRows(i * kAll, kJoints) = set.samples.middleRows(i * kRows, kJoints);
      for (Eigen::Index leg = 0; leg < 12; ++leg) {
        const double size = 0.1 * set.trials[static_cast<std::size_t>(i)].step_length_m;
        for (Eigen::Index t = 0; t < all.cols(); ++t) {
          const double phase =
              2.0 * std::numbers::pi * static_cast<double>(t) / static_cast<double>(all.cols());
          all(i * kAll + kJoints + leg, t) = size * std::sin(phase + static_cast<double>(leg));
        }
      }
    }
    set.samples = all;
    set.rows.resize(static_cast<std::size_t>(kJoints));
    for (int leg = 0; leg < 12; ++leg) set.rows.push_back("leg_" + std::to_string(leg));
  }
  const ActionMaps learned(learn_drawer_model(data, {.first_sources = 3, .further_sources = 2}));
  EXPECT_EQ(learned.row_count(), kAll);
  const Eigen::MatrixXd made = reconstructed(learned, kNormalStep, 7);
  const Eigen::MatrixXd was = data.action[0].samples.middleRows(7 * kAll, kAll);
  EXPECT_LT((made - was).cwiseAbs().maxCoeff(), 0.02);
  const ActionTask task{.length_m = 0.5, .duration_s = 1.6};
  EXPECT_NEAR(inferred(learned, kNormalStep, task).bottomRows<12>().maxCoeff(), 0.05, 0.003);
}

}  // namespace
}  // namespace mimesis::synthesizer
