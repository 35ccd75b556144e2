#include "nodes/synthesizer/sequence/drawer_sequence.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mimesis::synthesizer {
namespace {

const ActionMaps& trained_maps() {
  static const ActionMaps maps(
      learn_drawer_model(generate_drawer_data(mocap::standard_body(), {}, {.paces = {0.8, 1.2}})));
  return maps;
}

struct Jump {
  double at_s, by_m;
};

struct Played {
  SequenceState last;
  std::vector<PlannedAction> history;
  double distance_m = 0.0;
  double joint_speed_rad_s = 0.0;  // largest of any angle
  double slide_m_s = 0.0;          // largest sliding of held foot points
  double below_ground_m = 0.0, pelvis_jump_m = 0.0;
};

// The lowest point of a foot in W, and which.
std::pair<int, Eigen::Vector3d> lowest(const mocap::Body& body, const mocap::BodyPose& pose,
                                       mocap::Side side) {
  const int ankle = side == mocap::kLeft ? mocap::kLeftAnkle : mocap::kRightAnkle;
  const Eigen::Vector3d heel = pose.point(ankle, body.heel_m[side]),
                        toe = pose.point(ankle, body.toe_m[side]);
  return heel.z() < toe.z() ? std::pair{0, heel} : std::pair{1, toe};
}

Played play(double distance_m, const std::vector<Jump>& jumps = {}) {
  auto sequence = DrawerSequence::start(trained_maps(), {.front_W_m = distance_m});
  if (!sequence) throw std::runtime_error(sequence.error().reason);
  const auto& body = trained_maps().model().body;
  Played p;
  SequenceState before;
  std::array<std::pair<int, Eigen::Vector3d>, 2> low_before;
  double front = distance_m;
  std::size_t next = 0;
  while (!sequence->state().done && sequence->state().time_s < 20.0) {
    if (next < jumps.size() && sequence->state().time_s >= jumps[next].at_s)
      sequence->set_goal({.front_W_m = front += jumps[next++].by_m});
    const SequenceState& s = sequence->step();
    const auto pose = forward_kinematics(
        body, std::span<const double, mocap::kBodyRows>(s.angle_rad.data(), mocap::kBodyRows),
        s.pelvis_W_m);
    for (const auto side : {mocap::kLeft, mocap::kRight}) {
      const auto low = lowest(body, pose, side);
      p.below_ground_m = std::max(p.below_ground_m, -low.second.z());
      if (before.time_s > 0.0 && before.stands[side] && s.stands[side] &&
          low.first == low_before[side].first)
        p.slide_m_s =
            std::max(p.slide_m_s, (low.second - low_before[side].second).head<2>().norm() /
                                      (s.time_s - before.time_s));
      low_before[side] = low;
    }
    if (before.time_s > 0.0) {
      p.joint_speed_rad_s =
          std::max(p.joint_speed_rad_s, (s.angle_rad - before.angle_rad).cwiseAbs().maxCoeff() /
                                            (s.time_s - before.time_s));
      p.pelvis_jump_m = std::max(p.pelvis_jump_m, (s.pelvis_W_m - before.pelvis_W_m).norm());
    }
    before = s;
  }
  p.last = sequence->state();
  p.history = sequence->history();
  p.distance_m = sequence->distance_m();
  return p;
}

int count_of(const Played& p, Action action) {
  return static_cast<int>(
      std::ranges::count_if(p.history, [&](const auto& a) { return a.action == action; }));
}

void expect_natural(const Played& p) {
  EXPECT_TRUE(p.last.done);
  EXPECT_LT(p.last.left_error_m, 0.005);
  EXPECT_LT(p.last.right_error_m, 0.005);
  EXPECT_LT(p.slide_m_s, 0.083);  // recorded feet slide as much
  EXPECT_LT(p.below_ground_m, 0.005);
  EXPECT_LT(p.joint_speed_rad_s, 22.0);
  EXPECT_LT(p.pelvis_jump_m, 0.02);  // 4 m/s
}

// [M18 3.3.3]: 0.956 for action 1 with 3 periodic sources, 0.967 for all with two more
TEST(DrawerModel, IsAsGoodAsThePublishedOne) {
  EXPECT_GT(trained_maps().model().first_quality_squared, 0.956);
  EXPECT_GT(trained_maps().model().quality_squared, 0.967);
  for (const auto& a : trained_maps().model().action) {
    EXPECT_EQ(a.sources.rows(), 6);
    EXPECT_EQ(a.patterns.size(), 30U);
    EXPECT_TRUE(
        a.patterns[0].delay_rad.isApprox(trained_maps().model().action[0].patterns[7].delay_rad));
  }
  EXPECT_EQ(trained_maps().model().action[0].patterns[3].weight_rad.rightCols(2).norm(), 0.0);
}

TEST(ActionMaps, FollowTheLengthAndStayWithinWhatWasTrained) {
  const auto& maps = trained_maps();
  const auto& r = maps.ranges().normal;
  const int hip = 3 * mocap::kLeftHip + 1;
  auto swing = [&](double length) {
    return std::abs(maps.at(kNormalStep, {.length_m = length, .duration_s = r.duration_mean_s})
                        .weight_rad(hip, 1));
  };
  EXPECT_GT(swing(1.8), 1.2 * swing(1.3));  // longer steps, larger swing of the hip
  EXPECT_NEAR(swing(9.0), swing(2.5), 0.02);
  EXPECT_DOUBLE_EQ(maps.at(kNormalStep, {.length_m = 1.5, .duration_s = 1.25}).frequency_rad_s,
                   2.0 * 3.14159265358979323846 / 1.25);
}

TEST(DrawerSequence, ThreeActionsLeadToTheObject) {
  for (const double d : {2.34, 2.5, 2.64, 2.8, 2.94}) {
    const Played p = play(d);
    expect_natural(p);
    EXPECT_EQ(p.history.size(), 3U) << d;
    EXPECT_NEAR(p.distance_m, 0.6, 1e-3) << d;
  }
}

TEST(DrawerSequence, FarGoalsTakeMoreSteps) {
  for (const auto& [d, cycles] : {std::pair{3.84, 2}, {4.62, 2}, {5.3, 3}}) {
    const Played p = play(d);
    expect_natural(p);
    EXPECT_EQ(count_of(p, kNormalStep), cycles) << d;
    EXPECT_NEAR(p.distance_m, 0.6, 1e-3) << d;
  }
}

TEST(DrawerSequence, JumpsAreFollowedInEveryAction) {
  // in the normal step, before its end, in the reaching step early and late, and while standing
  for (const Jump jump :
       {Jump{0.3, 0.5}, {0.8, -0.4}, {1.0, 0.9}, {1.4, 0.4}, {1.9, 0.7}, {2.6, 0.5}, {3.5, 1.2}}) {
    const Played p = play(2.64, {jump});
    expect_natural(p);
    EXPECT_NEAR(p.distance_m, 0.6, 0.0851) << jump.at_s << " s " << jump.by_m << " m";
    EXPECT_EQ(p.last.refused, "") << jump.at_s;
  }
}

// fig. 3.39: a large jump during the reaching step brings a further action of type 2
TEST(DrawerSequence, ALargeJumpAddsAShortStep) {
  const Played calm = play(2.64), jumped = play(2.64, {{1.6, 0.5}});
  EXPECT_EQ(count_of(calm, kReachingStep), 1);
  EXPECT_EQ(count_of(jumped, kReachingStep), 2);
  EXPECT_NEAR(jumped.distance_m, 0.6, 1e-3);
}

TEST(DrawerSequence, SaysWhenItCannotFollow) {
  const Played p = play(2.64, {{3.2, -0.4}});
  EXPECT_NE(p.last.refused.find("too near"), std::string::npos) << p.last.refused;
  EXPECT_FALSE(DrawerSequence::start(trained_maps(), {.front_W_m = 0.2}).has_value());
}

// Between transitions the posture is the mixture of the mapped parameters, as demix reconstructs
// it: the same delays, the same ramp.
TEST(DrawerSequence, PlaysTheMappedMixture) {
  const double d = 2.64;
  auto sequence = DrawerSequence::start(trained_maps(), {.front_W_m = d});
  ASSERT_TRUE(sequence.has_value());
  const auto plan = sequence->plan();
  const auto& maps = trained_maps();
  const motion::MotionModel& model = maps.model().action[0];
  double most_delay = 0.0;
  for (const Action action : {kNormalStep, kReachingStep}) {
    const MotionParameters p = maps.at(action, {.length_m = plan[action].length_m,
                                                .duration_s = plan[action].duration_s,
                                                .previous_length_m = plan[0].length_m,
                                                .final_distance_m = 0.6});
    demix::Mixture mix;
    mix.sources = model.sources;
    mix.weights = p.weight_rad;
    mix.delay_rad = p.delay_rad;
    mix.means = p.mean_rad;
    mix.fixed = 1;
    const Eigen::MatrixXd rows = mix.reconstruct();
    most_delay = std::max(most_delay, p.delay_rad.cwiseAbs().maxCoeff());
    int compared = 0;
    while (sequence->state().action <= action && sequence->state().phase_rad < 5.5) {
      const SequenceState& s = sequence->step();
      if (s.action != action || s.phase_rad < 1.2 || s.phase_rad > 5.0) continue;
      const double at = s.phase_rad / (2.0 * 3.14159265358979323846) * 100.0;
      const auto k = static_cast<Eigen::Index>(at);
      const double u = at - static_cast<double>(k);
      const Eigen::VectorXd want = (1.0 - u) * rows.col(k) + u * rows.col(k + 1);
      for (const int joint : {mocap::kRoot, mocap::kSpine, mocap::kChest, mocap::kHead,
                              mocap::kRightShoulder, mocap::kRightElbow})
        EXPECT_LT(
            (s.angle_rad - want.head(mocap::kBodyRows)).segment(3 * joint, 3).cwiseAbs().maxCoeff(),
            0.01)
            << action << " " << s.phase_rad << " " << joint;
      ++compared;
    }
    EXPECT_GT(compared, 50);
    while (sequence->state().action == action) sequence->step();
  }
  EXPECT_GT(most_delay, 0.1);  // otherwise the test does not check delays
}

// The sources' delays and the ramp are played as they were learned: before arms reach, the mixture
// has the hands where they belong but for some cm; the feet need as little.
TEST(DrawerSequence, TheMixtureAloneComesNear) {
  for (const double d : {2.45, 2.85}) {
    auto sequence = DrawerSequence::start(trained_maps(), {.front_W_m = d});
    bool stands = false;
    double squares = 0.0, steps = 0.0;
    while (!sequence->state().done) {
      const SequenceState& s = sequence->step();
      if (s.action == kStanding && !stands) {
        EXPECT_LT(s.left_without_m, 0.03);
        stands = true;
      }
      squares += s.correction_m * s.correction_m;
      ++steps;
    }
    EXPECT_LT(sequence->state().right_without_m, 0.05);
    EXPECT_LT(std::sqrt(squares / steps), 0.08);
  }
}

// fig. 3.38: where the second action was long, the stand begins in another posture, though its
// distance is the same
TEST(DrawerSequence, PostureBeforeStandingDependsOnTheStepBefore) {
  auto posture = [](double d) {
    auto sequence = DrawerSequence::start(trained_maps(), {.front_W_m = d});
    while (sequence->step().action != kStanding) {
    }
    return sequence->state();
  };
  const auto a = posture(0.6 + 0.39 / 0.23), b = posture(0.6 + 0.53 / 0.23);
  EXPECT_GT((a.angle_rad - b.angle_rad).cwiseAbs().maxCoeff(), 0.03);
}

TEST(DrawerSequence, SameInputsSameBits) {
  const Played a = play(2.7, {{1.2, 0.3}}), b = play(2.7, {{1.2, 0.3}});
  EXPECT_EQ(a.last.angle_rad, b.last.angle_rad);
  EXPECT_EQ(a.last.pelvis_W_m, b.last.pelvis_W_m);
}

// The upper body's primitive works in any phase of any action.
TEST(ArmReach, ReachesInAnyPhaseOfTheGaitAndComesBack) {
  const auto& body = trained_maps().model().body;
  for (double onset = 0.1; onset < 1.1; onset += 0.2) {
    auto sequence = DrawerSequence::start(trained_maps(), {.front_W_m = 5.3});
    ArmReach arm;
    double error = 1.0, last_share = 0.0, most_speed = 0.0, at_most = 0.0;
    while (sequence->state().time_s < onset + 1.2) {
      const SequenceState& s = sequence->step();
      if (std::abs(s.time_s - onset) < 0.0025) arm.start(true, 0.6);
      if (std::abs(s.time_s - onset - 0.8) < 0.0025) arm.start(false, 0.3);
      arm.step(0.005);
      if (s.time_s < onset + 0.7 && arm.share() - last_share > most_speed) {
        most_speed = arm.share() - last_share;
        at_most = s.time_s - onset;
      }
      last_share = arm.share();
      Eigen::VectorXd angles = s.angle_rad;
      const Eigen::Vector3d target = s.pelvis_W_m + Eigen::Vector3d(0.45, -0.15, 0.25);
      arm.apply(body, mocap::kRight, s.pelvis_W_m, target, angles);
      const auto pose = forward_kinematics(
          body, std::span<const double, mocap::kBodyRows>(angles.data(), mocap::kBodyRows),
          s.pelvis_W_m);
      if (std::abs(s.time_s - onset - 0.7) < 0.0025)
        error = (pose.point(mocap::kRightWrist, body.hand_m[mocap::kRight]) - target).norm();
      const auto gait = forward_kinematics(
          body, std::span<const double, mocap::kBodyRows>(s.angle_rad.data(), mocap::kBodyRows),
          s.pelvis_W_m);
      const Eigen::Vector3d from = gait.point(mocap::kRightWrist, body.hand_m[mocap::kRight]);
      const Eigen::Vector3d hand = pose.point(mocap::kRightWrist, body.hand_m[mocap::kRight]);
      EXPECT_LT((hand - (from + arm.share() * (target - from))).norm(), 1e-6) << s.time_s;
      EXPECT_EQ(angles.head(3 * mocap::kRightShoulder),
                s.angle_rad.head(3 * mocap::kRightShoulder));
    }
    EXPECT_LT(error, 1e-6) << onset;
    EXPECT_EQ(arm.share(), 0.0);
    EXPECT_NEAR(at_most, 0.3, 0.03);  // bell-shaped speed, fastest in the middle
  }
}

// eq. 3.12 against its solution
TEST(ArmReach, IsThePointAttractorOfTheText) {
  ArmReach arm;
  arm.start(true, 1.0);
  const double rest = 0.004, u = 2.0 * std::log((1.0 - rest) / rest);
  for (int i = 1; i <= 100; ++i) {
    arm.step(0.01);
    const double x = 0.5 * (1.0 + std::tanh(0.5 * u * (0.01 * i - 0.5)));
    EXPECT_NEAR(arm.share(), std::clamp((x - rest) / (1.0 - 2.0 * rest), 0.0, 1.0), 1e-9);
  }
}

}  // namespace
}  // namespace mimesis::synthesizer
