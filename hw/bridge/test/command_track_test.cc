#include "hw/bridge/command_track.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "hw/setpoint_limiter.h"

namespace mimesis::hw::bridge {
namespace {

using namespace std::chrono_literals;

constexpr Time kCycle = 5ms;

/// Two joints on an ellipse from rest, at most 1.5 rad/s and 7.5 rad/s²: within the limits below.
std::array<double, 2> path(double t_s) {
  const double phase = 3.0 * t_s * t_s / (t_s + 1.0);
  return {0.5 * (1.0 - std::cos(phase)), 0.4 * std::sin(phase)};
}
double off_the_path(double q1, double q2, double t_s) {
  double least = 1.0;
  for (double t = t_s - 0.15; t < t_s + 0.05; t += 1e-4) {
    const auto [p1, p2] = path(std::max(t, 0.0));
    least = std::min(least, std::hypot(q1 - p1, q2 - p2));
  }
  return least;
}

TEST(CommandTrack, ARegularStreamPassesBitForBit) {
  CommandTrack track(2, kCycle);
  track.begin(1s, path(0.0));
  track.advance();
  for (int k = 1; k < 400; ++k) {
    const auto q = path(to_seconds(k * kCycle));
    track.add(1s + k * kCycle, q);
    const std::vector<double>& now = track.advance();
    EXPECT_EQ(now[0], q[0]);
    EXPECT_EQ(now[1], q[1]);
  }
}

TEST(CommandTrack, AStreamThatEndsGoesOnForACycleAtMost) {
  CommandTrack track(1, kCycle);
  track.begin(0ms, std::array{0.0});
  track.advance();
  track.add(5ms, std::array{0.01});
  track.advance();
  for (int k = 0; k < 50; ++k) EXPECT_LE(track.advance()[0], 0.02 + 1e-12);
}

TEST(CommandTrack, TwoCommandsAtAlmostTheSameTimeMakeNoSpeed) {
  CommandTrack track(1, kCycle);
  track.begin(0ms, std::array{0.0});
  track.advance();
  track.add(1ns, std::array{0.1});
  for (int k = 0; k < 50; ++k) EXPECT_LE(track.advance()[0], 0.2 + 1e-12);
}

/// Sender and bridge step at the same rate, each late by up to `late` of its own; the bridge takes
/// the newest command.
TEST(CommandTrack, WithJitterTheLimiterStaysOnThePathOfTheStream) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::mt19937 draw(seed);
    const double late_s = 0.5e-3 + 7e-3 * (seed % 8) / 7.0;
    std::uniform_real_distribution<double> uniform(0.0, late_s);
    CommandTrack track(2, kCycle);
    SetpointLimiter direct({Eigen::Vector2d::Constant(-9.0), Eigen::Vector2d::Constant(9.0),
                            Eigen::Vector2d::Constant(2.0), Eigen::Vector2d::Constant(12.0)},
                           to_seconds(kCycle));
    SetpointLimiter limiter = direct;
    const std::array start = path(0.0);
    track.begin(0ms, start);
    limiter.reset(start);
    direct.reset(start);
    double worst = 0.0, worst_direct = 0.0, sent_s = 0.0;
    std::array<double, 2> newest = start;
    int next = 1;
    double next_s = to_seconds(kCycle) + uniform(draw);
    for (int k = 1; k < 400; ++k) {
      const double now_s = k * to_seconds(kCycle) + uniform(draw);
      for (; next_s <= now_s; next_s = ++next * to_seconds(kCycle) + uniform(draw)) {
        sent_s = std::max(sent_s, next_s);
        newest = path(sent_s);
        track.add(from_seconds(sent_s), newest);
      }
      limiter.follow(track.advance());
      direct.follow(newest);
      worst = std::max(worst, off_the_path(limiter.position()[0], limiter.position()[1], now_s));
      worst_direct =
          std::max(worst_direct, off_the_path(direct.position()[0], direct.position()[1], now_s));
    }
    EXPECT_LT(worst, 1e-3) << seed << ": the commands as they come leave it by " << worst_direct;
  }
}

}  // namespace
}  // namespace mimesis::hw::bridge
