#include "hw/bridge/command_track.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/math/path_pace.h"
#include "hw/setpoint_limiter.h"

namespace mimesis::hw::bridge {
namespace {

using namespace std::chrono_literals;

constexpr Time kCycle = 5ms;
constexpr std::array kFast{100.0, 100.0};  // [rad/s]: no limit of speed

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
  CommandTrack track(kCycle, kFast, std::array{12.0, 12.0});
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
  CommandTrack track(kCycle, kFast, std::array{12.0});
  track.begin(0ms, std::array{0.0});
  track.advance();
  track.add(5ms, std::array{0.01});
  track.advance();
  for (int k = 0; k < 50; ++k) EXPECT_LE(track.advance()[0], 0.02 + 1e-12);
}

TEST(CommandTrack, TwoCommandsAtAlmostTheSameTimeMakeNoSpeed) {
  CommandTrack track(kCycle, kFast, std::array{12.0});
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
    CommandTrack track(kCycle, kFast, std::array{12.0, 12.0});
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

/// A curve of two joints that begins at rest, with the limits of an arm: it needs 0.6 of the
/// accelerations, as the planner's paths do, and 0.6 to 0.95 of the speeds. The joints reach their
/// speed within 0.1 to 0.8 s.
class DrawnMotion {
 public:
  explicit DrawnMotion(std::mt19937& random) {
    const auto draw = [&](double lo, double hi) {
      return std::uniform_real_distribution<double>(lo, hi)(random);
    };
    width_ = {draw(0.2, 1.5), draw(0.2, 1.5)};  // [rad]
    rate_ = draw(2.5, 8.0);
    shape_ = draw(0.5, 1.5);
    const double speed = draw(0.6, 0.95);
    for (int k = 0; k < 2000; ++k) {
      const Eigen::Vector2d p = at(k * 0.002), n = at((k + 1) * 0.002), nn = at((k + 2) * 0.002);
      v_max = v_max.cwiseMax((n - p).cwiseAbs() / 0.002 / speed);
      a_max = a_max.cwiseMax((nn - 2.0 * n + p).cwiseAbs() / 4e-6 / 0.6);
    }
  }
  std::array<double, 2> operator()(double t_s) const {
    const double phase = rate_ * t_s * t_s / (t_s + 0.5);
    return {width_[0] * (1.0 - std::cos(phase)), width_[1] * std::sin(shape_ * phase)};
  }
  Eigen::Vector2d at(double t_s) const { return Eigen::Vector2d((*this)(t_s).data()); }

  Eigen::Vector2d v_max = Eigen::Vector2d::Zero(), a_max = Eigen::Vector2d::Zero();

 private:
  std::array<double, 2> width_{};
  double rate_, shape_;
};

/// Drives along a motion as the planner does: brakes on it and goes on as fast as the joints may.
struct Playback {
  void advance(const DrawnMotion& motion, bool brake) {
    constexpr double kStep = 0.005, kH = 1e-3;
    const Eigen::Vector2d here = motion.at(at_s), on = motion.at(at_s + kH),
                          back = motion.at(std::max(at_s - kH, 0.0));
    const auto [lowest, highest] = math::pace_rates(
        (on - here) / kH, (on - 2.0 * here + back) / (kH * kH), pace, 0.95 * motion.a_max);
    pace += std::clamp((brake ? 0.0 : 1.0) - pace, lowest * kStep, highest * kStep);
    pace = std::clamp(pace, 0.0, 1.0);
    at_s += pace * kStep;
  }
  double at_s = 0.0, pace = 1.0;
};

/// A sender that tells 60 cycles ahead, and waits now and then. The machine stops it and the bridge
/// again and again, for up to 0.1 and 0.06 s, so that the bridge falls behind. It catches up, and
/// when it comes to where the sender braked as hard as the joints may, it must have done so.
/// @return how far it is behind after 1.5 s without disturbances [s]
double stay_on_the_path(unsigned seed, bool waits, bool bridge_stalls) {
  std::mt19937 random(seed);
  const auto draw = [&](double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random);
  };
  const DrawnMotion motion(random);
  CommandTrack track(kCycle, {motion.v_max.data(), 2}, {motion.a_max.data(), 2});
  SetpointLimiter limiter(
      {Eigen::Vector2d::Constant(-9.0), Eigen::Vector2d::Constant(9.0), motion.v_max, motion.a_max},
      to_seconds(kCycle));
  std::vector<double> ahead;
  limiter.reset(motion(0.0));
  Playback sender;
  Time sent{}, silent_until{}, stalled_until{}, waits_until{};
  bool brake = false;
  double worst = 0.0, furthest_s = 0.0;
  for (int k = 0; k < 700; ++k) {
    const Time now = k * kCycle;
    const bool calm = k < 20 || k > 400;
    if (!calm && now > silent_until + 50ms && draw(0.0, 1.0) < 0.05) {
      silent_until = now + from_seconds(draw(0.0, 0.1));
    }
    if (bridge_stalls && !calm && now > stalled_until + 100ms && draw(0.0, 1.0) < 0.05) {
      stalled_until = now + from_seconds(draw(0.0, 0.06));
    }
    if (waits && !calm && now > waits_until + 200ms && draw(0.0, 1.0) < 0.02) {
      waits_until = now + from_seconds(draw(0.0, 0.3));
    }
    if (now >= silent_until) brake = now < waits_until;  // silent, it goes on as it said
    if (k > 0) sender.advance(motion, brake);
    if (now >= silent_until) {
      sent = now;
      ahead.clear();
      Playback later = sender;
      for (int row = 0; row < 60 && (!brake || later.pace > 0.0); ++row) {  // up to rest
        later.advance(motion, brake);
        const auto q = motion(later.at_s);
        ahead.insert(ahead.end(), q.begin(), q.end());
      }
      const auto q = motion(sender.at_s);
      k == 0 ? track.begin(now, q, ahead) : track.add(now, q, ahead);
    }
    if (now < stalled_until) continue;
    limiter.follow(track.advance(now - sent > 42500us));
    const auto [away, where] =
        nearest(motion, furthest_s - 0.02, furthest_s + 0.1, limiter.position());
    furthest_s = std::max(furthest_s, where);
    worst = std::max(worst, away);
  }
  EXPECT_LT(worst, 1e-3) << seed;
  EXPECT_GT(furthest_s, 1.0) << seed << ": it does go on";
  return sender.at_s - furthest_s;
}

TEST(CommandTrack, WithGapsTheArmBrakesAndGoesOnOnThePath) {
  for (unsigned seed = 0; seed < 200; ++seed) stay_on_the_path(seed, false, false);
}

TEST(CommandTrack, WhoFellBehindFollowsASenderThatWaits) {
  double behind_s = 0.0;
  for (unsigned seed = 0; seed < 100; ++seed) behind_s += stay_on_the_path(seed, true, true) / 100;
  EXPECT_LT(behind_s, 0.06);
}

TEST(CommandTrack, WithTheWayAheadARegularStreamPassesBitForBit) {
  CommandTrack track(kCycle, kFast, std::array{12.0, 12.0});
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

TEST(CommandTrack, BrakesFromWhereTheJointsHaveGoneInLeftOutCycles) {
  constexpr double kA = 12.0, kCycle_s = 0.005;
  CommandTrack track(kCycle, kFast, std::array{kA, kA});
  const auto line = [](Time t) { return std::array{to_seconds(t), 0.0}; };  // 1 rad/s
  double last = 0.0, speed = 0.0;
  for (int k = 0; k < 400; ++k) {
    std::vector<double> ahead;
    for (int row = 1; row <= 60; ++row)
      std::ranges::copy(line((k + row) * kCycle), std::back_inserter(ahead));
    k == 0 ? track.begin(1s, line(0s), ahead) : track.add(1s + k * kCycle, line(k * kCycle), ahead);
    const double next = track.advance()[0];
    speed = (next - last) / kCycle_s;
    last = next;
  }
  EXPECT_NEAR(speed, 1.0, 1e-3);
  last += 3 * speed * kCycle_s;
  track.coast(3);
  while (speed > 0.0) {
    const double next = track.advance(true)[0];
    ASSERT_NEAR((next - last) / kCycle_s, std::max(0.0, speed - kA * kCycle_s),
                0.02 * kA * kCycle_s);
    ASSERT_LT(next, 2.2) << "it does not come to rest";
    speed = (next - last) / kCycle_s;
    last = next;
  }
}

}  // namespace
}  // namespace mimesis::hw::bridge
