#include "experiments/motion/folk_dance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/math/circle.h"
#include "experiments/motion/styled_walks.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer {
namespace {

/// Synthetic walkers: happy (1.1 m/s, 1 s), neutral (0.9 m/s, 1.1 s), turning by ±1 rad/s.
const motion::MotionModel& model() {
  static const motion::MotionModel walkers = [] {
    constexpr int kHarmonics = 8;
    const auto walk = [](double speed, double duration, double turn) {
      return testing::walking_model({.speed_m_s = speed,
                                     .duration_s = duration,
                                     .turn_rad_s = turn,
                                     .harmonics = kHarmonics});
    };
    motion::MotionModel m = walk(1.1, 1.0, 0.0);
    for (const double turn : {0.0, 1.0, -1.0}) {
      m.patterns.push_back(walk(0.9, 1.1, turn).patterns.front());
    }
    m.tied = true;  // the batch blends postures: that these delays differ does no harm
    return m;
  }();
  return walkers;
}

FolkDance dance(const DanceSettings& settings = {}) {
  return {model(), {.happy = 0, .normal = 1, .left = 2, .right = 3}, settings};
}

void run(FolkDance& d, double until_s) {
  while (d.time_s() < until_s) d.step();
}

TEST(DanceTrack, IsClosedAndItsHeadingIsItsTangent) {
  const DanceTrack track{8.0, 1.5, 0.5};
  for (double s = 0.01; s < track.length_m(); s += 0.05) {
    const Eigen::Vector2d step =
        track.point(track.wrapped(s + 0.005)) - track.point(track.wrapped(s - 0.005));
    EXPECT_NEAR(step.norm(), 0.01, 1e-4) << s;
    EXPECT_NEAR(math::wrap_pi(std::atan2(step.y(), step.x()) - track.heading(s)), 0.0, 0.01) << s;
  }
  EXPECT_EQ(track.sector(4.0), DanceSector::corridor);
  EXPECT_EQ(track.sector(8.1), DanceSector::parting);
  EXPECT_EQ(track.sector(8.1 + track.curve_m()), DanceSector::outside);
  EXPECT_EQ(track.sector(track.length_m() - 0.1), DanceSector::entrance);
}

TEST(FolkDance, KeepsTheBeatAndTheFeetRight) {
  FolkDance d = dance();
  run(d, 80.0);
  const DanceNumbers& n = d.numbers();
  EXPECT_EQ(n.wrong_foot, 0);
  EXPECT_GE(n.entrances, 3 * d.size());
  EXPECT_LT(n.entrance_error_rad, 0.5);
  EXPECT_LT(n.beat_error_rad, 0.15);
  EXPECT_LT(n.couple_error_rad, 0.15);
  EXPECT_LT(n.apart_m, 0.3);
  EXPECT_GT(n.least_distance_m, 0.5);
  EXPECT_GT(n.spread_rad, 1.0);  // outside no dancer is in step
  for (int i = 0; i < d.size(); ++i) EXPECT_GE(d.dancer(i).laps, 3) << i;
}

TEST(FolkDance, EveryoneStaysOnTheWay) {
  FolkDance d = dance();
  double farthest = 0.0, outside = 0.0;
  while (d.time_s() < 40.0) {
    d.step();
    for (int i = 0; i < d.size(); ++i) {
      const Dancer& who = d.dancer(i);
      Eigen::Vector2d p = d.batch().root(i).position_W_m;
      p.y() *= who.side;
      farthest = std::max(farthest, (p - d.track().point(who.track_m)).norm());
      if (who.sector == DanceSector::outside) {
        outside = std::max(outside, who.frequency_rad_s * 1.1 / math::kTwoPi);
      }
    }
  }
  EXPECT_LT(farthest, 0.7);
  EXPECT_GT(outside, 1.1);  // they hurry
}

TEST(FolkDance, TheMusicMendsWhatTheEntranceLeft) {
  FolkDance coupled = dance(), deaf = dance({.beat_1_s = 0.0, .partner_1_s = 0.0});
  run(coupled, 60.0);
  run(deaf, 60.0);
  EXPECT_LT(coupled.numbers().beat_error_rad, 0.5 * deaf.numbers().beat_error_rad);
}

TEST(FolkDance, StandingFeetStand) {
  FolkDance d = dance();
  FootSlide slide(1.0 / 60.0);
  while (d.time_s() < 40.0) {
    d.step();
    slide.observe(d.batch(), 3);
  }
  EXPECT_LT(slide.mean_m_s(), 0.083);
}

TEST(FolkDance, IsDeterministic) {
  FolkDance a = dance({.couples = 3}), b = dance({.couples = 3});
  run(a, 10.0);
  run(b, 10.0);
  for (int i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.batch().root(i).position_W_m, b.batch().root(i).position_W_m);
    EXPECT_EQ(a.batch().phase(i), b.batch().phase(i));
  }
}

}  // namespace
}  // namespace mimesis::synthesizer
