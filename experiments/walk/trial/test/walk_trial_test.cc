// The whole walker in the physics, short.
#include <gtest/gtest.h>

#include "experiments/walk/trial/suites.h"
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {
namespace {

const Robot& biped() {
  static const Robot robot = load_robot("biped");
  return robot;
}

TrialSpec stand(double duration_s) {
  TrialSpec spec;
  spec.robot = &biped();
  spec.wish = [](double) {
    walker::WalkerWish w;
    w.walk.walk = false;
    return w;
  };
  spec.duration_s = duration_s;
  return spec;
}

TrialSpec walk(double speed_m_s, double duration_s) {
  TrialSpec spec = stand(duration_s);
  spec.wish = [speed_m_s](double) {
    walker::WalkerWish w;
    w.walk.velocity_m_s.x() = speed_m_s;
    return w;
  };
  return spec;
}

TEST(WalkTrial, StandsWithoutCreeping) {
  const TrialResult r = run_trial(stand(2.0));
  EXPECT_FALSE(r.figures.fell);
  EXPECT_LT(r.walked_m, 0.02);
  EXPECT_EQ(r.figures.steps, 0);
  EXPECT_EQ(r.trouble, "");
}

TEST(WalkTrial, FourStepsLandWhereTheyArePlanned) {
  const TrialResult r = run_trial(walk(0.2, 4.4));
  EXPECT_FALSE(r.figures.fell) << r.figures.how;
  EXPECT_GE(r.figures.steps, 4);
  EXPECT_GT(r.walked_m, 0.4);
  EXPECT_LT(r.figures.step_error_max_m, 0.005);
  EXPECT_LT(r.figures.ankle_pitch_slow_peak_n_m, 30.0);
  EXPECT_LT(r.figures.normal_peak_n, 800.0);
  EXPECT_LT(r.dcm_max_m, 0.03);
}

TEST(WalkTrial, PushIsRecoveredWithTheFeedbackAndNotWithout) {
  TrialSpec spec = stand(5.0);
  spec.pushes.push_back({.at_s = 1.0, .duration_s = 0.1, .impulse_W_ns = {15.0, 0.0, 0.0}});
  EXPECT_FALSE(run_trial(spec).figures.fell);
  spec = walk(0.3, 8.0);
  spec.walker.stabilize = spec.walker.filter = false;
  spec.pushes.push_back({.at_s = 4.0, .duration_s = 0.1, .impulse_W_ns = {10.0, 10.0, 0.0}});
  const TrialResult naive = run_trial(spec);
  EXPECT_TRUE(naive.figures.fell) << "a test of falling that nobody can fail";
}

/// The time of a trial is that of its wishes and pushes, with real senses as with exact ones.
TEST(WalkTrial, TimeBeginsWhenTheGyrosBiasIsKnown) {
  for (const bool real : {false, true}) {
    TrialSpec spec = stand(0.5);
    if (real) use_real_senses(spec.body, spec.walker.stabilizer);
    double asked_s = -1.0, first_s = -1.0, last_s = 0.0, stood_s = 0.0;
    spec.wish = [&](double time_s) {
      asked_s = time_s;
      return walker::WalkerWish();
    };
    run_trial(spec, [&](const TrialTick& tick) {
      if (first_s < 0.0) first_s = tick.time_s;
      last_s = tick.time_s;
      stood_s = tick.world.time_s() - tick.time_s;
      EXPECT_NEAR(tick.time_s, asked_s + walker::kTick_s, 1e-9);
    });
    EXPECT_NEAR(first_s, walker::kTick_s, 1e-9);
    EXPECT_NEAR(last_s, 0.5, 1e-9);
    EXPECT_NEAR(stood_s, real ? 3.0 : 0.0, 1e-9);
  }
}

TEST(Suites, WalkersAreToldStiffnessesThatAreAFifthOffAtMost) {
  for (const auto plant : {hw::sim::Plant::springs, hw::sim::Plant::servo}) {
    const SuiteOptions real(plant), exact(plant, false);
    double least = 2.0, most = 0.0;
    for (std::size_t i = 0; i < 50; ++i) {
      hw::sim::BodyOptions body, without;
      walker::WalkerSettings told, again;
      set_up(real, i, body, told);
      set_up(real, i, body, again);
      EXPECT_EQ(told.stabilizer.ankle_stiffness_n_m_rad, again.stabilizer.ankle_stiffness_n_m_rad);
      EXPECT_TRUE(body.senses.motor_encoders);
      EXPECT_FALSE(told.stabilizer.imu_attitude);
      const double nominal = plant == hw::sim::Plant::springs ? 6000.0 : 1500.0;
      least = std::min(least, told.stabilizer.ankle_stiffness_n_m_rad / nominal);
      most = std::max(most, told.stabilizer.ankle_stiffness_n_m_rad / nominal);
      set_up(exact, i, without, told);
      EXPECT_FALSE(without.senses.motor_encoders);
      EXPECT_TRUE(told.stabilizer.imu_attitude);
      EXPECT_EQ(told.stabilizer.ankle_stiffness_n_m_rad, 0.0);
    }
    EXPECT_GE(least, 0.8);
    EXPECT_LT(least, 0.85);
    EXPECT_LE(most, 1.2);
    EXPECT_GT(most, 1.15);
  }
}

TEST(WalkTrial, SameTrialGivesTheSameBits) {
  const TrialResult a = run_trial(walk(0.2, 2.5)), b = run_trial(walk(0.2, 2.5));
  EXPECT_EQ(a.dcm_max_m, b.dcm_max_m);
  EXPECT_EQ(a.figures.raw_normal_peak_n, b.figures.raw_normal_peak_n);
}

}  // namespace
}  // namespace mimesis::walk
