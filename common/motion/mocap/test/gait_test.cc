#include <gtest/gtest.h>

#include <cmath>

#include "common/math/circle.h"
#include "common/math/so3.h"
#include "common/motion/mocap/cycles.h"
#include "common/motion/mocap/test/walker.h"

namespace mimesis::mocap {
namespace {

/// Frames at which the phase 2πt/T + start passes `phase`.
std::vector<double> frames_at(const Walker& w, double phase_rad) {
  std::vector<double> frames;
  const double first = math::wrap_two_pi(phase_rad - w.start_phase_rad) / math::kTwoPi;
  // an event counts at the end of a clip if the heel is seen to swing on by 0.18 of its way
  for (double t = first * w.period_s; t < w.seconds - 0.17 * w.period_s; t += w.period_s) {
    frames.push_back(t * w.rate_hz);
  }
  return frames;
}

void expect_frames(const std::vector<Eigen::Index>& found, const std::vector<double>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(found[i]), expected[i], 1.0);
  }
}

TEST(Gait, FindsStrikesOfTheMadeUpWalker) {
  const Walker walker;
  const GaitEvents events = find_gait_events(walk(walker));
  EXPECT_FALSE(events.backward);
  expect_frames(events.heel_strike[kLeft], frames_at(walker, 0.0));
  expect_frames(events.heel_strike[kRight], frames_at(walker, math::kTwoPi / 2));
}

TEST(Gait, EventsDoNotDependOnTheHeading) {
  const GaitEvents straight = find_gait_events(walk({}));
  for (const double heading : {2.0, -3.0}) {
    const GaitEvents turned = find_gait_events(walk({.turn_rad_s = 0.8, .heading_rad = heading}));
    EXPECT_EQ(turned.heel_strike, straight.heel_strike);
  }
}

TEST(Gait, BackwardsTheFootArrivesWhereItIsFarthestBehind) {
  const Walker walker{.speed_m_s = -0.8};
  const GaitEvents events = find_gait_events(walk(walker));
  EXPECT_TRUE(events.backward);
  expect_frames(events.heel_strike[kLeft], frames_at(walker, math::kTwoPi / 2));
  expect_frames(events.heel_strike[kRight], frames_at(walker, 0.0));
}

TEST(Gait, StandingHasNoEvents) {
  const GaitEvents events = find_gait_events(walk({.swing_rad = 0.03, .speed_m_s = 0.0}));
  for (std::size_t s = 0; s < 2; ++s) EXPECT_TRUE(events.heel_strike[s].empty());
}

TEST(Gait, HeadingHasNoJumpsAndCanBeTakenOut) {
  BodyClip clip = walk({.turn_rad_s = 3.0, .heading_rad = 3.0});
  clip.angles_rad.row(0).setConstant(0.0);
  const Eigen::VectorXd heading = heading_rad(clip);
  EXPECT_NEAR(heading[heading.size() - 1] - heading[0], 3.0 * (599.0 / 120.0), 1e-9);
  remove_heading(clip);
  EXPECT_LT(heading_rad(clip).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT(clip.angles_rad.topRows(3).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Gait, TakingTheHeadingOutKeepsTheTilt) {
  BodyClip clip = walk({.seconds = 0.1});
  const Eigen::Matrix3d tilt = math::exp_so3({0.0, 0.2, 0.0}) * math::exp_so3({0.1, 0.0, 0.0});
  clip.angles_rad.block<3, 1>(0, 3) = math::log_so3(math::exp_so3({0.0, 0.0, 1.3}) * tilt);
  remove_heading(clip);
  EXPECT_LT((math::exp_so3(clip.angles_rad.block<3, 1>(0, 3)) - tilt).norm(), 1e-12);
}

}  // namespace
}  // namespace mimesis::mocap
