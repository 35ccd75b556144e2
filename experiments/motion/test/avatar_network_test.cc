#include "experiments/motion/avatar_network.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/math/circle.h"
#include "common/motion/demix/mixture.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kDt = 1.0 / 120.0;

/// A walk with three sources.
const motion::MotionModel& walk() {
  static const motion::MotionModel model = testing::walking_model({.harmonics = 3});
  return model;
}
const std::vector<SourceMap>& maps() {
  static const std::vector<SourceMap> learned = learn_source_maps(walk());
  return learned;
}
AvatarNetwork network(double internal_1_s, double phase_rad) {
  return {walk().patterns.front(), maps(), internal_1_s, phase_rad, kDt};
}

double rms(const Eigen::MatrixXd& x) { return x.norm() / std::sqrt(static_cast<double>(x.size())); }

TEST(AvatarNetwork, EqualPhasesGiveTheModelsCycle) {
  const motion::Pattern& p = walk().patterns.front();
  const Eigen::MatrixXd cycle =
      demix::Mixture{walk().sources, p.weight_rad, p.delay_rad, p.mean_rad, 0}.reconstruct();
  for (Eigen::Index t = 0; t < cycle.cols(); t += 7) {
    const double phase = math::kTwoPi * static_cast<double>(t) / static_cast<double>(cycle.cols());
    const AvatarNetwork avatar = network(1.0, phase);
    EXPECT_LT(rms(avatar.angles() - cycle.col(t)), 2e-3) << t;
    EXPECT_LT(rms(avatar.angles() - avatar.angles_at(phase)), 1e-9);
  }
}

TEST(AvatarNetwork, LeftAloneItKeepsItsPace) {
  AvatarNetwork avatar = network(2.0, 0.5);
  const double duration = walk().patterns.front().trial.duration_s;
  const int steps = static_cast<int>(std::lround(10.0 * duration / kDt));
  for (int i = 0; i < steps; ++i) avatar.step();
  // frequency of a van der Pol oscillator: ω (1 − (νρ/ω)²/16), νρ/ω = 0.1
  EXPECT_NEAR(math::wrap_pi(avatar.phase(0) - 0.5), -10.0 * math::kTwoPi * 0.01 / 16.0, 0.06);
  for (int k = 1; k < avatar.size(); ++k) EXPECT_NEAR(avatar.phase(k), avatar.phase(0), 1e-9);
}

TEST(AvatarNetwork, FollowsItsLeaderThroughOneOscillator) {
  AvatarNetwork leader = network(2.0, 0.0), follower = network(2.0, 1.4), deaf = network(2.0, 1.4);
  double torn = 0.0;
  for (int i = 0; i < 1800; ++i) {
    follower.follow(leader, 3.0);
    leader.step();
    follower.step();
    deaf.step();
    torn = std::max(torn, math::wrap_pi(follower.phase(1) - follower.phase(0)));
  }
  for (int k = 0; k < follower.size(); ++k) {
    EXPECT_LT(std::abs(math::wrap_pi(follower.phase(k) - leader.phase(0))), 0.05) << k;
    EXPECT_NEAR(math::wrap_pi(deaf.phase(k) - leader.phase(0)), 1.4, 0.05) << k;
  }
  EXPECT_GT(torn, 0.1);  // the first is pulled, the others come after it
  EXPECT_LT(torn, 1.4);
}

TEST(AvatarNetwork, InnerCouplingsHoldTheOscillatorsTogether) {
  const auto torn = [](double internal_1_s) {
    AvatarNetwork leader = network(internal_1_s, 0.0), follower = network(internal_1_s, 1.4);
    double most = 0.0;
    for (int i = 0; i < 600; ++i) {
      follower.follow(leader, 3.0);
      leader.step();
      follower.step();
      most = std::max(most, std::abs(math::wrap_pi(follower.phase(0) - follower.phase(1))));
    }
    return most;
  };
  EXPECT_LT(torn(8.0), 0.5 * torn(0.5));
}

TEST(Transient, InStepFromTheStartThereIsNone) {
  const Avatar avatar(walk());
  const Transient t = come_into_step(avatar, avatar, {.offset_rad = 0.0, .duration_s = 6.0});
  EXPECT_LT(t.artifact, 0.06);  // starts on the unit circle, not on its limit cycle
  EXPECT_EQ(t.synchronised_s, 0.0);
  EXPECT_GT(t.least_step, 0.97);
  EXPECT_LT(t.heading_rad, 0.05);
}

TEST(Transient, AheadOrBehindAloneIsNoArtifact) {
  const Avatar avatar(walk());
  const Transient t =
      come_into_step(avatar, avatar, {.external_1_s = 0.0, .offset_rad = 1.5, .duration_s = 6.0});
  EXPECT_LT(t.artifact, 0.06);  // starts on the unit circle, not on its limit cycle
  EXPECT_NEAR(t.synchronised_s, 6.0, 1e-9);
}

TEST(Transient, OscillatorsThatPartAreAnArtifactAndCostTime) {
  const Avatar avatar(walk());
  const Transient loose =
      come_into_step(avatar, avatar, {.internal_1_s = 0.5, .external_1_s = 3.0, .offset_rad = 1.5});
  const Transient tight =
      come_into_step(avatar, avatar, {.internal_1_s = 8.0, .external_1_s = 3.0, .offset_rad = 1.5});
  EXPECT_GT(loose.artifact, 1.5 * tight.artifact);
  EXPECT_GT(tight.artifact, 0.05);
  EXPECT_LT(tight.synchronised_s, loose.synchronised_s);
}

}  // namespace
}  // namespace mimesis::synthesizer
