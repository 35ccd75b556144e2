#include "experiments/motion/least_jerk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/error.h"
#include "experiments/motion/sequencer.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kLeastJerkPi = std::numbers::pi, kBeta = Sequencer::kBeta;
constexpr Eigen::Index kLeastJerkSamples = 40;

/// One row of a ramp cos(φ/2) and a wave cos φ + ½ sin 3φ.
motion::MotionModel model_of_one_row() {
  motion::MotionModel model;
  model.rows = {"knee.y"};
  model.fixed = 1;
  model.tied = true;
  model.sources.resize(2, kLeastJerkSamples);
  for (Eigen::Index t = 0; t < kLeastJerkSamples; ++t) {
    const double phase = 2.0 * kLeastJerkPi * static_cast<double>(t) / kLeastJerkSamples;
    model.sources.col(t) << std::cos(0.5 * phase), std::cos(phase) + 0.5 * std::sin(3.0 * phase);
  }
  motion::Pattern pattern;
  pattern.trial.duration_s = 1.0;
  pattern.mean_rad = Eigen::VectorXd::Zero(1);
  pattern.weight_rad = pattern.delay_rad = Eigen::MatrixXd::Zero(1, 2);
  model.patterns = {pattern};
  return model;
}

MotionParameters one_row(double mean, double ramp, double wave, double frequency) {
  return {Eigen::VectorXd::Constant(1, mean), Eigen::RowVector2d(ramp, wave),
          Eigen::RowVector2d(0.0, 0.4), frequency};
}

/// Joint angle at φ in [0, 2π) of an action.
double angle(const MotionParameters& p, double phase) {
  const double at = phase - p.delay_rad(0, 1);
  return p.mean_rad[0] + p.weight_rad(0, 0) * std::cos(0.5 * phase) +
         p.weight_rad(0, 1) * (std::cos(at) + 0.5 * std::sin(3.0 * at));
}

const MotionParameters kBefore = one_row(0.2, 0.4, 0.3, 5.0),
                       kAfter = one_row(-0.3, -0.2, 0.5, 8.0);

/// Phases and angles of a sequencer's frames at 1/dt from φ = 1 of one action to φ = 1 of the next.
struct Frames {
  std::vector<double> phase, angle;
};
Frames play(Sequencer& s, double dt) {
  Frames out;
  for (double phase = 1.0; phase < 2.0 * kLeastJerkPi + 1.0;) {
    const MotionParameters& p = s.at(phase);
    out.phase.push_back(phase);
    out.angle.push_back(angle(p, std::fmod(phase, 2.0 * kLeastJerkPi)));
    // midpoint rule: the interval's ends are where they belong
    const double half = s.at(phase + 0.5 * dt * p.frequency_rad_s).frequency_rad_s;
    phase += dt * half;
  }
  return out;
}

TEST(LeastJerk, JoinsTheActionsWithVelocityAndAcceleration) {
  Sequencer s(kBefore, 1, 1.0);
  s.use_least_jerk(model_of_one_row());
  ASSERT_TRUE(s.announce(kAfter));
  const double dt = 1e-3;
  const Frames f = play(s, dt);
  double value = 0.0, velocity = 0.0, acceleration = 0.0;
  for (std::size_t i = 2; i + 1 < f.angle.size(); ++i) {
    const auto& x = f.angle;
    value = std::max(value, std::abs(x[i] - x[i - 1]));
    velocity = std::max(velocity, std::abs(x[i] - 2.0 * x[i - 1] + x[i - 2]) / dt);
    acceleration = std::max(
        acceleration, std::abs(x[i + 1] - 3.0 * x[i] + 3.0 * x[i - 1] - x[i - 2]) / (dt * dt));
  }
  // changes from frame to frame, of the order dt: no jump in any of the three
  EXPECT_LT(value, 20.0 * dt);
  EXPECT_LT(velocity, 250.0 * dt);
  EXPECT_LT(acceleration, 8000.0 * dt);
  EXPECT_GT(acceleration, 100.0 * dt);
}

/// Third derivatives by equal times of the motion within the interval, without jumps.
TEST(LeastJerk, IsAQuinticInTime) {
  const double dt = 1e-3;
  LeastJerkTransition t(model_of_one_row(), kBeta);
  t.prepare(kBefore, kAfter);
  MotionParameters p = kBefore;
  // by time: the phase at equal steps, with the frequencies handed out
  std::vector<double> x;
  double phase = -kBeta * kLeastJerkPi;
  while (phase < kBeta * kLeastJerkPi) {
    t.at(phase, p);
    EXPECT_TRUE(p.weight_rad.isZero(0.0));
    x.push_back(p.mean_rad[0]);
    for (int i = 0; i < 10; ++i) {  // midpoint rule of dφ/dt = ω(φ)
      t.at(phase, p);
      t.at(phase + 0.05 * dt * p.frequency_rad_s, p);
      phase += 0.1 * dt * p.frequency_rad_s;
    }
  }
  EXPECT_NEAR(static_cast<double>(x.size() - 1) * dt, t.duration_s(), 1.1 * dt);
  // sixth differences of a polynomial of fifth degree are 0 (to rounding, over wide steps)
  const std::size_t step = x.size() / 7;
  for (std::size_t i = 0; i + 6 * step < x.size(); ++i) {
    const double sixth = x[i] - 6.0 * x[i + step] + 15.0 * x[i + 2 * step] -
                         20.0 * x[i + 3 * step] + 15.0 * x[i + 4 * step] - 6.0 * x[i + 5 * step] +
                         x[i + 6 * step];
    EXPECT_NEAR(sixth, 0.0, 2e-6);
  }
}

TEST(LeastJerk, EndsAreTheActions) {
  LeastJerkTransition t(model_of_one_row(), kBeta);
  t.prepare(kBefore, kAfter);
  MotionParameters p = kBefore;
  t.at(-kBeta * kLeastJerkPi, p);
  EXPECT_NEAR(p.mean_rad[0], angle(kBefore, 2.0 * kLeastJerkPi - kBeta * kLeastJerkPi), 1e-6);
  EXPECT_NEAR(p.frequency_rad_s, 5.0, 1e-9);
  t.at(kBeta * kLeastJerkPi, p);
  EXPECT_NEAR(p.mean_rad[0], angle(kAfter, kBeta * kLeastJerkPi), 1e-6);
  EXPECT_NEAR(p.frequency_rad_s, 8.0, 1e-9);
  t.at(0.0, p);
  EXPECT_NEAR(p.frequency_rad_s, 6.5, 1e-9);
  // at one frequency time is phase
  t.prepare(one_row(0.0, 0.0, 0.1, 4.0), one_row(0.0, 0.0, 0.2, 4.0));
  EXPECT_NEAR(t.duration_s(), 2.0 * kBeta * kLeastJerkPi / 4.0, 1e-12);
}

TEST(LeastJerk, FollowsOneAnotherWithTheWidestInterval) {
  // β = 1: the next transition begins where the last one ends
  Sequencer s(one_row(0.0, 0.0, 0.0, 6.0), 1, 1.0, 1.0);
  s.use_least_jerk(model_of_one_row());
  ASSERT_TRUE(s.announce(one_row(1.0, 0.0, 0.0, 6.0)));
  double last = s.at(1.0).mean_rad[0];
  for (double phase = 1.0; phase < 6.5 * kLeastJerkPi; phase += 0.01) {
    if (!s.announced() && s.transitions() == 1) {
      ASSERT_TRUE(s.announce(one_row(2.0, 0.0, 0.0, 6.0)) || phase < 3.0 * kLeastJerkPi);
    }
    const double now = s.at(phase).mean_rad[0];
    EXPECT_LT(std::abs(now - last), 0.01);
    last = now;
  }
  EXPECT_NEAR(last, 2.0, 1e-6);
  EXPECT_EQ(s.transitions(), 2);
}

TEST(LeastJerk, RefusesWhatDoesNotFit) {
  EXPECT_THROW(LeastJerkTransition(model_of_one_row(), 0.0), ConfigError);
  EXPECT_THROW(LeastJerkTransition(model_of_one_row(), 1.1), ConfigError);
  motion::MotionModel two = model_of_one_row();
  two.rows.push_back("knee.z");
  two.patterns[0].mean_rad = Eigen::VectorXd::Zero(2);
  two.patterns[0].weight_rad = two.patterns[0].delay_rad = Eigen::MatrixXd::Zero(2, 2);
  Sequencer s(kBefore, 1);
  EXPECT_THROW(s.use_least_jerk(two), ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
