// Drives that take velocities as joints: cyclic synchronous and profile velocity.
#include <gtest/gtest.h>

#include <cmath>

#include "hw/cia402/test/joint_driver_bench.h"

namespace mimesis::hw::cia402 {
namespace {

class VelocityAxes : public Bench, public ::testing::WithParamInterface<const char*> {
 protected:
  void begin(std::int64_t supported_modes = -1) {
    std::vector<Axis> all = axes();
    std::vector<sim::DriveConfig> configs;
    for (Axis& axis : all) {
      axis.mode = GetParam();
      configs.push_back({.axis = axis, .home_rad = target[configs.size()]});
      if (supported_modes >= 0) configs.back().made[0x6502'00] = supported_modes;
    }
    rack.emplace(configs, wire.join());
    driver.emplace(JointDriverOptions{.axes = all, .limits = limits(), .tracking_window_rad = 0.1},
                   wire.join());
    idle(500ms);
  }
  /// A swing of 0.8 rad in one second, and back; up to 1.26 rad/s, 3.9 rad/s².
  void swing(int k, const std::vector<double>& start) {
    for (std::size_t i = 0; i < kAxes; ++i)
      target[i] = start[i] + 0.4 * (1.0 - std::cos(M_PI * k / 200.0)) * (i == 1 ? -1.0 : 1.0);
    cycle({.mode = Mode::follow, .position_rad = target});
  }
  double off(std::size_t i) { return std::abs(rack->drives()[i].position_rad() - target[i]); }
};

TEST_P(VelocityAxes, FollowPositionsAndRest) {
  begin();
  follow(100ms);
  ASSERT_EQ(reading().phase, Phase::following) << reading().reason;
  const std::vector<double> start = target;
  double farthest = 0.0;
  for (int k = 1; k <= 400; ++k) {
    swing(k, start);
    for (std::size_t i = 0; i < kAxes; ++i) farthest = std::max(farthest, off(i));
  }
  EXPECT_EQ(reading().phase, Phase::following) << reading().reason;
  EXPECT_LT(farthest, 0.013) << "two cycles at the largest speed";
  EXPECT_LT(fastest_motion, kV + 1e-3);
  follow(500ms);
  for (std::size_t i = 0; i < kAxes; ++i) EXPECT_LT(off(i), 1e-3) << i;
  target.assign(kAxes, 3.0);  // beyond the limit of 2 rad
  follow(4s);
  for (auto& drive : rack->drives()) EXPECT_LT(drive.position_rad(), 2.0 + 1e-3);
  idle(1s);
  EXPECT_EQ(reading().phase, Phase::idle) << reading().reason;
}

/// What held a joint for a moment has put it behind: velocities alone would leave it there.
TEST_P(VelocityAxes, CatchUp) {
  begin();
  follow(100ms);
  for (int k = 0; k < 100; ++k) {
    if (k == 40) rack->drives()[0].inject(sim::Trouble::jam, 50ms);
    target[0] += 0.001;
    cycle({.mode = Mode::follow, .position_rad = target});
    if (k == 50) {
      EXPECT_GT(off(0), 0.005);
    }
  }
  follow(1s);
  EXPECT_EQ(reading().phase, Phase::following) << reading().reason;
  EXPECT_LT(off(0), 1e-4);
}

/// The drives would turn for ever at the last velocity.
TEST_P(VelocityAxes, StopWithoutTheBridge) {
  begin();
  const std::vector<double> start = target;
  follow(100ms);
  for (int k = 1; k <= 100; ++k) swing(k, start);
  ASSERT_EQ(reading().phase, Phase::following) << reading().reason;
  ASSERT_GT(fastest_motion, 1.0);
  for (int k = 0; k < 24; ++k) cycle({}, true);
  EXPECT_FALSE(any_enabled());
  for (int k = 0; k < 100; ++k) cycle({}, true);
  for (auto& drive : rack->drives()) EXPECT_LT(std::abs(drive.velocity_rad_s()), 1e-3);
}

TEST_P(VelocityAxes, AJamIsNoticed) {
  begin();
  const std::vector<double> start = target;
  follow(100ms);
  rack->drives()[2].inject(sim::Trouble::jam);
  for (int k = 1; k <= 200 && reading().phase == Phase::following; ++k) swing(k, start);
  EXPECT_EQ(reading().phase, Phase::fault);
  EXPECT_NE(reading().reason.find("A3 (node 9)"), std::string::npos) << reading().reason;
}

TEST_P(VelocityAxes, ADriveWithoutTheModeIsRefused) {
  begin(1 << 7);  // cyclic synchronous position alone
  EXPECT_EQ(reading().phase, Phase::fault);
  const char* mode =
      GetParam() == std::string("csv") ? "cyclic synchronous velocity" : "profile velocity";
  EXPECT_NE(reading().reason.find(std::string("SDO 6502:00 (") + mode + ")"), std::string::npos)
      << reading().reason;
}

INSTANTIATE_TEST_SUITE_P(Modes, VelocityAxes, ::testing::Values("csv", "pv"));

}  // namespace
}  // namespace mimesis::hw::cia402
