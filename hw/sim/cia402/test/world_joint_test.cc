// A drive whose joint a world moves: its motor goes where the set-points say, the joint sags.
#include <gtest/gtest.h>

#include "hw/sim/cia402/test/one_drive.h"

namespace mimesis::hw::sim {
namespace {

constexpr double kDeceleration_rad_s2 = 8.0;

class InAWorld : public OneDrive {
 protected:
  InAWorld()
      : OneDrive({.axis = {.node_id = 4},
                  .plant = {.a_max_rad_s2 = kDeceleration_rad_s2},
                  .in_a_world = true,
                  .home_rad = 0.25}) {}
  double motor() const { return drive.world_joint().motor(); }
  void measure(double position_rad) { drive.world_joint().measure(position_rad, 0.0, 0.0); }
};

TEST_F(InAWorld, MovesEvenlyOverThePeriod) {
  enable();
  aim(0.26);
  sync();
  pass(5ms);
  EXPECT_NEAR(motor(), 0.255, 1e-5);  // 10 ms by default
  pass(5ms);
  EXPECT_NEAR(motor(), 0.26, 1e-5);
  pass(5ms);
  EXPECT_NEAR(motor(), 0.26, 1e-5);
}

/// Sagging under its load, it is enabled where its motor is held, not where the joint is.
TEST_F(InAWorld, IsEnabledWhereItsMotorIsHeld) {
  measure(0.21);
  pass(1ms);
  enable();
  pass(1ms);
  EXPECT_NEAR(motor(), 0.25, 1e-5);
}

TEST_F(InAWorld, KeepsItsPositionLimits) {
  set(obj::kPositionMin, static_cast<std::uint32_t>(cia402::Axis{}.to_increments(0.2)), 4);
  set(obj::kPositionMax, static_cast<std::uint32_t>(cia402::Axis{}.to_increments(0.3)), 4);
  enable();
  const auto follow = [&] {
    for (int k = 0; k < 3; ++k) {
      sync();
      pass(10ms);
      measure(motor());
    }
  };
  aim(0.5);
  follow();
  EXPECT_NEAR(motor(), 0.3, 1e-5);
  aim(-0.5);
  follow();
  EXPECT_NEAR(motor(), 0.2, 1e-5);
}

/// A step that goes beyond the end of the interpolation leaves the motor at the mean rate of the
/// step; from there it brakes over v²/2a.
TEST_F(InAWorld, BrakesOverTheExactDistanceFromTheMeanRate) {
  enable();
  aim(0.29);
  sync();
  drive.advance(now += 20ms, out);
  ASSERT_NEAR(motor(), 0.29, 1e-5);
  command(cia402::controlword::kQuickStop);
  ASSERT_EQ(drive.state(), DriveState::quick_stop_active);
  drive.advance(now += 1s, out);
  const double rate = 0.04 / 0.02;
  EXPECT_NEAR(motor() - 0.29, rate * rate / (2.0 * kDeceleration_rad_s2), 1e-4);
}

TEST_F(InAWorld, AJammedMotorStays) {
  enable();
  drive.inject(Trouble::jam);
  aim(0.26);
  sync();
  pass(10ms);
  EXPECT_NEAR(motor(), 0.25, 1e-5);
}

/// The time of a following error is counted from when it began, not in all.
TEST_F(InAWorld, OnlyALongFollowingErrorIsAFault) {
  measure(0.25);
  enable();
  for (int k = 0; k < 3; ++k) {
    measure(0.18);
    pass(40ms);  // 40 of the 50 ms
    EXPECT_EQ(drive.state(), DriveState::operation_enabled);
    measure(0.25);
    pass(1ms);
  }
  measure(0.18);
  out.clear();
  pass(49ms);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  pass(2ms);
  EXPECT_NE(drive.state(), DriveState::operation_enabled);
  ASSERT_FALSE(out.empty());
  EXPECT_EQ(out[0], cia402::emergency(4, 0x8611, 0x21));
}

}  // namespace
}  // namespace mimesis::hw::sim
