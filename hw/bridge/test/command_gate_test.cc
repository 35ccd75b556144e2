#include "hw/bridge/command_gate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/testing/no_malloc.h"

namespace mimesis::hw::bridge {
namespace {

using namespace std::chrono_literals;

/// From rest with 7 rad/s² to 1 rad/s.
double way(Time t) {
  constexpr double kV = 1.0, kA = 7.0, kReached_s = kV / kA;
  const double s = to_seconds(t);
  return s < kReached_s ? 0.5 * kA * s * s : kV * (s - 0.5 * kReached_s);
}

class Gate : public ::testing::Test {
 protected:
  Gate() {
    arm.joints.resize(2, {.drive = DriveState::switch_on_disabled, .statusword = 0x250});
    arm.phase = Phase::idle;
    arm.posture_known = true;
  }
  /// A command at `now` that arrives at once.
  std::string offer(double q1, double q2) { return gate.offer(now, now, std::array{q1, q2}, arm); }
  Mode mode() { return gate.decide(now, arm).mode; }
  void follow() {
    ASSERT_EQ(offer(0.0, 0.0), "");
    ASSERT_EQ(mode(), Mode::follow);
    arm.phase = Phase::following;
  }

  GateLimits limits{.hold_after = 17500us,
                    .silence = 100ms,
                    .start_tolerance_rad = 0.02,
                    .jump_rad = 0.1,
                    .v_max_rad_s = {2.0, 2.0},
                    .a_max_rad_s2 = {8.0, 8.0}};
  CommandGate gate{limits};
  Reading arm;
  Time now = 1s;
};

TEST_F(Gate, FollowsAStreamFromTheActualPosture) {
  EXPECT_EQ(mode(), Mode::idle);
  follow();
  now += 5ms;
  EXPECT_EQ(offer(0.01, 0.0), "");
  const Setpoint s = gate.decide(now, arm);
  EXPECT_EQ(s.mode, Mode::follow);
  EXPECT_EQ(s.position_rad[0], 0.01);
}

TEST_F(Gate, HoldsAfterThreeCyclesAndStopsAfterSilence) {
  follow();
  now += 15ms;
  EXPECT_EQ(mode(), Mode::follow) << "three cycles are the network's right";
  now += 5ms;
  EXPECT_EQ(mode(), Mode::hold);
  now += 80ms;
  EXPECT_EQ(mode(), Mode::hold) << "exactly 100 ms";
  now += 1ns;
  EXPECT_EQ(mode(), Mode::idle);
  EXPECT_EQ(gate.reason(), "no command for 0.1 s");
}

TEST_F(Gate, StopsOnThePathThatTheLastCommandTold) {
  const double cycle_s = 0.005;
  const Time begin = now;
  std::vector<double> ahead(2 * 40);
  const auto command = [&] {
    for (int k = 0; k < 80; ++k)
      ahead[static_cast<std::size_t>(k)] = way(now - begin + (k / 2 + 1) * 5ms);
    const double q = way(now - begin);
    return gate.offer(now, now, std::array{q, q}, arm, ahead);
  };
  for (; now < begin + 200ms; now += 5ms) {
    ASSERT_EQ(command(), "");
    ASSERT_EQ(gate.decide(now, arm).mode, Mode::follow);
    arm.phase = Phase::following;
  }
  double last = way(now - begin - 5ms), speed = 1.0;
  int cycles = 0;
  for (Mode mode = Mode::follow; mode == Mode::follow; now += 5ms, ++cycles) {
    const Setpoint s = gate.decide(now, arm);
    mode = s.mode;
    if (mode != Mode::follow) break;
    EXPECT_EQ(s.position_rad[0], s.position_rad[1]) << "off the path";
    const double next = (s.position_rad[0] - last) / cycle_s;
    EXPECT_LE(std::abs(next - speed), 8.0 * cycle_s + 1e-9);
    EXPECT_GE(next, 0.0);
    last = s.position_rad[0], speed = next;
    if (cycles == 25) {
      EXPECT_EQ(command(), "the stream has ended; the arm comes to rest");
    }
  }
  EXPECT_EQ(speed, 0.0);
  EXPECT_LE(cycles * 5ms, 300ms);
  EXPECT_EQ(gate.reason(), "no command for 0.1 s");
  EXPECT_EQ(mode(), Mode::idle);
}

/// The machine lets the bridge wait, and the drives went on: the path is read where they are.
TEST_F(Gate, CyclesThatAreLeftOutAreGoneOnThePath) {
  limits.extrapolated_cycles = 4;
  gate = CommandGate(limits);
  follow();
  const auto after = [&, begin = now](Time pause) {
    now += pause;
    const double q = to_seconds(now - begin);  // 1 rad/s
    EXPECT_EQ(offer(q, 0.0), "");
    return gate.decide(now, arm);
  };
  for (int k = 1; k <= 10; ++k) EXPECT_EQ(after(5ms).missed, 0);
  Setpoint s = after(20ms);
  EXPECT_EQ(s.missed, 3);
  EXPECT_NEAR(s.position_rad[0], 0.07, 1e-12);
  s = after(5ms);
  EXPECT_EQ(s.missed, 0);
  EXPECT_NEAR(s.position_rad[0], 0.075, 1e-12);
  s = after(60ms);
  EXPECT_EQ(s.missed, 4) << "no longer than the drives";
  EXPECT_NEAR(s.position_rad[0], 0.1, 0.0025 + 1e-12) << "and a tenth of a cycle a step";
}

TEST_F(Gate, WhoBrakesSlowlyStopsOffThePathAtLast) {
  limits.a_max_rad_s2 = {2.0, 2.0};  // half a second to rest
  gate = CommandGate(limits);
  const auto slow = [begin = now](Time t) { return 0.95 * std::pow(to_seconds(t - begin), 2); };
  std::vector<double> ahead(2 * 100);
  for (const Time begin = now; now < begin + 500ms; now += 5ms) {
    for (int k = 0; k < 200; ++k)
      ahead[static_cast<std::size_t>(k)] = slow(now + (k / 2 + 1) * 5ms);
    ASSERT_EQ(gate.offer(now, now, std::array{slow(now), slow(now)}, arm, ahead), "");
    ASSERT_EQ(gate.decide(now, arm).mode, Mode::follow);
    arm.phase = Phase::following;
  }
  const Time last = now - 5ms;
  while (mode() == Mode::follow && now < last + 1s) now += 5ms;
  EXPECT_EQ(now - last, 305ms) << "100 ms of silence, 200 ms more on the path";
  EXPECT_EQ(mode(), Mode::idle);
}

TEST_F(Gate, AKnownPathIsFollowedLongerThanAnUnknownOne) {
  CommandGate patient({.hold_after = 17500us,
                       .brake_after = 40ms,
                       .silence = 100ms,
                       .start_tolerance_rad = 0.02,
                       .jump_rad = 0.1,
                       .v_max_rad_s = {2.0, 2.0},
                       .a_max_rad_s2 = {8.0, 8.0}});
  const Time begin = now, sent = now + 200ms;
  double last = 0.0;
  for (; now <= sent; now += 5ms) {
    std::vector<double> ahead;
    for (int k = 1; k <= 40; ++k) ahead.insert(ahead.end(), 2, way(now - begin + k * 5ms));
    const double q = way(now - begin);
    ASSERT_EQ(patient.offer(now, now, std::array{q, q}, arm, ahead), "");
    last = patient.decide(now, arm).position_rad[0];
    arm.phase = Phase::following;
  }
  double step = 0.005;  // 1 rad/s
  for (; now <= sent + 40ms; now += 5ms) {
    const double q = patient.decide(now, arm).position_rad[0];
    EXPECT_GT(q - last, 0.8 * step);
    EXPECT_EQ(patient.reason(), "");
    step = q - last, last = q;
  }
  EXPECT_LT(patient.decide(now, arm).position_rad[0] - last, step - 0.0001) << "it brakes";
  EXPECT_EQ(patient.reason(), "command is late: holding");
}

TEST_F(Gate, RefusesAWayAheadThatIsNoMotion) {
  follow();
  now += 5ms;
  const auto refusal = [&](std::vector<double> ahead) {
    return gate.offer(now, now, std::array{0.0, 0.0}, arm, ahead);
  };
  EXPECT_EQ(refusal({0.01, 0.01, 0.02}), "the way ahead of the command is no motion of 2 joints");
  EXPECT_NE(refusal({0.01, 0.03}), "") << "2 rad/s and as much again in 5 ms are 0.02";
  EXPECT_NE(refusal({0.01, 0.01, 0.01, std::nan("")}), "");
  EXPECT_EQ(refusal({0.01, 0.01, 0.02, 0.02}), "");
}

TEST_F(Gate, HoldsForEverIfARobotWouldFall) {
  CommandGate holds({.hold_after = 17500us,
                     .silence = 100ms,
                     .start_tolerance_rad = 0.02,
                     .jump_rad = 0.1,
                     .v_max_rad_s = {2.0, 2.0},
                     .a_max_rad_s2 = {8.0, 8.0},
                     .names = {"hip", "knee"},
                     .hold_on_silence = true});
  const auto offer_at = [&](double q) { return holds.offer(now, now, std::array{0.0, q}, arm); };
  EXPECT_EQ(holds.decide(now, arm).mode, Mode::idle) << "not before it was powered";
  EXPECT_EQ(offer_at(0.0), "");
  EXPECT_EQ(holds.decide(now, arm).mode, Mode::follow);
  arm.phase = Phase::following;
  now += 101ms;
  EXPECT_EQ(holds.decide(now, arm).mode, Mode::hold);
  EXPECT_EQ(holds.reason(), "no command for 0.1 s: holding");
  now += 3600s;
  EXPECT_EQ(holds.decide(now, arm).mode, Mode::hold);
  EXPECT_EQ(
      offer_at(0.05),
      "knee starts 0.050 rad from its actual position, allowed are 0.020; the drive is switch "
      "on disabled (statusword 0x0250)")
      << "the old stream has ended";
  EXPECT_EQ(offer_at(0.01), "");
  EXPECT_EQ(holds.decide(now, arm).mode, Mode::follow);
  arm.phase = Phase::fault;
  EXPECT_EQ(holds.decide(now, arm).mode, Mode::idle);
  now += 200ms;
  EXPECT_EQ(holds.decide(now, arm).mode, Mode::idle) << "a fault has stopped it";
}

TEST_F(Gate, AHeldStreamMayGoOn) {
  follow();
  now += 50ms;
  EXPECT_EQ(mode(), Mode::hold);
  EXPECT_EQ(offer(0.1, 0.0), "");
  EXPECT_EQ(mode(), Mode::follow);
}

TEST_F(Gate, RefusesAStartAwayFromTheActualPosture) {
  arm.joints[1].position_rad = 0.5;
  EXPECT_EQ(offer(0.0, 0.0),
            "A2 starts 0.500 rad from its actual position, allowed are 0.020; the drive is switch "
            "on disabled (statusword 0x0250)");
  EXPECT_EQ(mode(), Mode::idle);
  EXPECT_EQ(offer(0.0, 0.49), "");
  EXPECT_EQ(mode(), Mode::follow);
}

TEST_F(Gate, RefusesAJumpButNotTheDistanceOfALateCommand) {
  follow();
  now += 5ms;
  EXPECT_EQ(offer(0.2, 0.0),
            "A1 jumps by 0.200 rad, allowed are 0.110; the drive is switch on "
            "disabled (statusword 0x0250)");
  EXPECT_EQ(mode(), Mode::follow) << "the last good one still counts";
  now += 55ms;
  EXPECT_EQ(offer(0.2, 0.0), "") << "0.1 + 2 rad/s · 60 ms";
}

TEST_F(Gate, NothingButRefusedCommandsIsSilence) {
  follow();
  for (int i = 0; i < 25; ++i) {
    now += 5ms;
    offer(3.0, 3.0);
    mode();
  }
  EXPECT_EQ(mode(), Mode::idle);
}

TEST_F(Gate, RefusesWrongSizeOldAndUnknownPosture) {
  EXPECT_EQ(gate.offer(now, now, std::array{0.0}, arm), "command for 1 joints, the arm has 2");
  EXPECT_EQ(gate.offer(now, now - 200ms, std::array{0.0, 0.0}, arm), "command is 0.200 s old");
  arm.posture_known = false;
  EXPECT_EQ(offer(0.0, 0.0), "the arm's posture is not known yet");
}

TEST_F(Gate, RefusesNumbersThatAreNotFinite) {
  follow();
  for (const double q : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(offer(0.0, q), "command holds a position that is not a finite number");
  }
  EXPECT_EQ(gate.decide(now, arm).position_rad[1], 0.0);
}

TEST_F(Gate, NoStampPutsTheWatchdogOff) {
  constexpr Time kMost = Time::max();
  for (const Time ahead : {Time(10s), Time(3600s), kMost - Time(100s)}) {
    follow();
    EXPECT_NE(gate.offer(now, now + ahead, std::array{0.0, 0.0}, arm), "");
    now += 100ms;
    EXPECT_EQ(mode(), Mode::hold);
    now += 1ns;
    EXPECT_EQ(mode(), Mode::idle);
    arm.phase = Phase::idle;
    now += 1s;
  }
  follow();
  EXPECT_EQ(gate.offer(now, now + 10s, std::array{0.0, 0.0}, arm),
            "command is stamped 10.000 s ahead of the bridge's clock");
  EXPECT_EQ(gate.offer(now, now + 17ms, std::array{0.0, 0.0}, arm), "") << "within the tolerance";
  now += 100ms + 1ns;
  EXPECT_EQ(mode(), Mode::idle) << "counted from when it came, not from its stamp";
}

TEST_F(Gate, StampsDoNotStretchTheAllowedJump) {
  follow();
  for (int i = 1; i <= 20; ++i) {
    now += 5ms;
    EXPECT_NE(gate.offer(now, now + 17ms, std::array{0.12, 0.0}, arm), "");
    EXPECT_EQ(offer(0.0, 0.0), "");
  }
}

TEST_F(Gate, AfterAFaultOnlyANewStreamCounts) {
  follow();
  arm.phase = Phase::fault;
  arm.reason = "A1 is broken";
  EXPECT_EQ(mode(), Mode::idle);
  EXPECT_EQ(gate.reason(), "A1 is broken");
  for (int i = 0; i < 60; ++i) {  // continues without interruption
    now += 5ms;
    EXPECT_NE(offer(0.0, 0.0), "");
    EXPECT_EQ(mode(), Mode::idle);
  }
  now += 101ms;
  EXPECT_EQ(mode(), Mode::idle);
  EXPECT_EQ(offer(0.0, 0.0), "");
  arm.phase = Phase::idle;
  EXPECT_EQ(mode(), Mode::follow);
}

TEST_F(Gate, DoesNotAllocateWhileFollowing) {
  follow();
  testing::NoMalloc guard;
  for (int i = 0; i < 100; ++i) {
    now += 5ms;
    offer(0.0, 0.0);
    gate.decide(now, arm);
  }
}

TEST_F(Gate, ObeysOnlyArmedJoints) {
  limits.enables_itself = false;
  gate = CommandGate(limits);
  const auto at_rest = [&] { return offer(0.0, 0.0); };
  EXPECT_EQ(at_rest(), "not enabled (service bridge/enable)");
  EXPECT_EQ(gate.decide(now, arm).mode, Mode::idle);
  arm.joints[1] = {.drive = DriveState::fault, .statusword = 0x218};
  EXPECT_EQ(
      gate.enable(arm),
      "A2: expected a drive without fault whose position is known, is fault (statusword 0x0218)");
  EXPECT_FALSE(gate.enabled());
  arm.joints[1] = arm.joints[0];
  EXPECT_EQ(gate.enable(arm), "");
  EXPECT_EQ(at_rest(), "");
  EXPECT_EQ(gate.decide(now, arm).mode, Mode::follow);
  arm.phase = Phase::fault;
  arm.reason = "A1 (node 1): too hot";
  EXPECT_EQ(gate.decide(now, arm).mode, Mode::idle);
  EXPECT_FALSE(gate.enabled()) << "a fault ends it";
  EXPECT_EQ(gate.enable(arm), "A1 (node 1): too hot");
  arm.phase = Phase::idle;
  now += 200ms;
  gate.decide(now, arm);
  EXPECT_EQ(at_rest(), "not enabled (service bridge/enable)");
  EXPECT_EQ(gate.enable(arm), "");
  EXPECT_EQ(
      offer(0.5, 0.0),
      "A1 starts 0.500 rad from its actual position, allowed are 0.020; the drive is switch on "
      "disabled (statusword 0x0250)")
      << "to where the old command was";
  now += 200ms;
  gate.decide(now, arm);
  EXPECT_EQ(at_rest(), "");
  EXPECT_EQ(gate.decide(now, arm).mode, Mode::follow);
  gate.disable("no more");
  EXPECT_EQ(gate.decide(now, arm).mode, Mode::idle);
  EXPECT_EQ(gate.reason(), "disabled: no more");
}

TEST_F(Gate, AnEmergencyStopIsAQuickStopUntilItIsReleased) {
  follow();
  gate.emergency_stop("somebody shouted");
  EXPECT_EQ(mode(), Mode::idle) << "in the same cycle, not along the path";
  EXPECT_EQ(gate.reason(), "emergency stop: somebody shouted");
  EXPECT_EQ(offer(0.0, 0.0), "emergency stop: somebody shouted");
  EXPECT_EQ(gate.enable(arm),
            "emergency stop: somebody shouted: bridge/reset ends it, once it is released");
  gate.emergency_stop("again");
  EXPECT_EQ(gate.reason(), "emergency stop: somebody shouted") << "the first cause counts";
  gate.release();
  now += 5ms;
  EXPECT_NE(offer(0.0, 0.0), "") << "the stream that was there has no effect";
  EXPECT_EQ(mode(), Mode::idle);
  now += 101ms;
  mode();
  EXPECT_EQ(offer(0.0, 0.0), "");
  EXPECT_EQ(mode(), Mode::follow);
}

}  // namespace
}  // namespace mimesis::hw::bridge
