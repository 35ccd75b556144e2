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
struct Nearest {
  double away = 1e9, at_s = 0.0;
};
/// Of the curve's chords over 2 ms: they are within 1e-5 rad of the curves here.
template <class Curve>
Nearest nearest(const Curve& curve, double from_s, double to_s, const Eigen::Vector2d& q) {
  constexpr double kChord_s = 2e-3;
  const auto at = [&](double t) { return Eigen::Vector2d(curve(std::max(t, 0.0)).data()); };
  Nearest found;
  Eigen::Vector2d a = at(from_s);
  for (double t = from_s; t < to_s; t += kChord_s) {
    const Eigen::Vector2d b = at(t + kChord_s), along = b - a;
    const double share =
        std::clamp((q - a).dot(along) / std::max(along.squaredNorm(), 1e-300), 0.0, 1.0);
    const double away = (q - a - share * along).norm();
    if (away < found.away) found = {away, t + share * kChord_s};
    a = b;
  }
  return found;
}
double off_the_path(const SetpointLimiter& limiter, double t_s) {
  return nearest(path, t_s - 0.15, t_s + 0.05, limiter.position()).away;
}

TEST(CommandTrack, ARegularStreamPassesBitForBit) {
  CommandTrack track(kCycle, std::array{12.0, 12.0});
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
  CommandTrack track(kCycle, std::array{12.0});
  track.begin(0ms, std::array{0.0});
  track.advance();
  track.add(5ms, std::array{0.01});
  track.advance();
  for (int k = 0; k < 50; ++k) EXPECT_LE(track.advance()[0], 0.02 + 1e-12);
}

TEST(CommandTrack, TwoCommandsAtAlmostTheSameTimeMakeNoSpeed) {
  CommandTrack track(kCycle, std::array{12.0});
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
    CommandTrack track(kCycle, std::array{12.0, 12.0});
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
      worst = std::max(worst, off_the_path(limiter, now_s));
      worst_direct = std::max(worst_direct, off_the_path(direct, now_s));
    }
    EXPECT_LT(worst, 1e-3) << seed << ": the commands as they come leave it by " << worst_direct;
  }
}

/// A sender that tells 60 cycles ahead and is stopped by the machine again and again, for up to
/// 0.1 s; curves, speeds and limits are drawn. The joints reach their speed within 0.1 to 0.8 s.
TEST(CommandTrack, WithGapsTheArmBrakesAndGoesOnOnThePath) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const auto draw = [&](double lo, double hi) {
      return std::uniform_real_distribution<double>(lo, hi)(random);
    };
    const std::array width{draw(0.2, 1.5), draw(0.2, 1.5)};  // [rad]
    const double rate = draw(2.5, 8.0), shape = draw(0.5, 1.5);
    const auto at = [&](double t_s) {
      const double phase = rate * t_s * t_s / (t_s + 0.5);  // from rest
      return std::array{width[0] * (1.0 - std::cos(phase)), width[1] * std::sin(shape * phase)};
    };
    // Limits of the arm: the path needs 0.6 of them, as the planner's paths do.
    std::array<double, 2> v{}, a{};
    for (int k = 0; k < 2000; ++k) {
      const auto p = at(k * 0.002), n = at((k + 1) * 0.002), nn = at((k + 2) * 0.002);
      for (std::size_t j : {0, 1}) {
        v[j] = std::max(v[j], std::abs(n[j] - p[j]) / 0.002 / 0.6);
        a[j] = std::max(a[j], std::abs(nn[j] - 2.0 * n[j] + p[j]) / 4e-6 / 0.6);
      }
    }
    CommandTrack track(kCycle, a);
    SetpointLimiter limiter({Eigen::Vector2d::Constant(-9.0), Eigen::Vector2d::Constant(9.0),
                             Eigen::Vector2d(v[0], v[1]), Eigen::Vector2d(a[0], a[1])},
                            to_seconds(kCycle));
    std::vector<double> ahead(2 * 60);
    limiter.reset(at(0.0));
    Time sent{}, silent_until{};
    double worst = 0.0, furthest_s = 0.0;
    for (int k = 0; k < 700; ++k) {
      const Time now = k * kCycle;
      if (k > 20 && now > silent_until + 50ms && draw(0.0, 1.0) < 0.05) {
        silent_until = now + from_seconds(draw(0.0, 0.1));
      }
      if (now >= silent_until) {
        sent = now;
        for (std::size_t row = 0; row < 60; ++row) {
          std::ranges::copy(at(to_seconds(now + kCycle * static_cast<int>(row + 1))),
                            &ahead[2 * row]);
        }
        k == 0 ? track.begin(now, at(0.0), ahead) : track.add(now, at(to_seconds(now)), ahead);
      }
      limiter.follow(track.advance(now - sent > 17500us));
      const auto [away, where] =
          nearest(at, furthest_s - 0.02, to_seconds(now) + 0.05, limiter.position());
      furthest_s = std::max(furthest_s, where);
      worst = std::max(worst, away);
    }
    EXPECT_LT(worst, 1e-3) << seed;
    EXPECT_GT(furthest_s, 2.5) << seed << ": it does go on";
  }
}

TEST(CommandTrack, WithTheWayAheadARegularStreamPassesBitForBit) {
  CommandTrack track(kCycle, std::array{0.1, 0.1});  // less than the path needs
  std::vector<double> ahead(2 * 60);
  for (int k = 0; k < 400; ++k) {
    for (std::size_t row = 0; row < 60; ++row) {
      std::ranges::copy(path(to_seconds((k + 1 + static_cast<int>(row)) * kCycle)),
                        &ahead[2 * row]);
    }
    const auto q = path(to_seconds(k * kCycle));
    k == 0 ? track.begin(1s, q, ahead) : track.add(1s + k * kCycle, q, ahead);
    const std::vector<double>& now = track.advance();
    EXPECT_EQ(now[0], q[0]);
    EXPECT_EQ(now[1], q[1]);
  }
}

}  // namespace
}  // namespace mimesis::hw::bridge
