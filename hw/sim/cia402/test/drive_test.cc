#include <gtest/gtest.h>

#include <cmath>

#include "hw/sim/cia402/test/one_drive.h"

namespace mimesis::hw::sim {
namespace {

TEST(AxisPlant, FollowsARampWithoutLag) {
  AxisPlant plant({}, 0.0);
  for (int k = 1; k <= 200; ++k) plant.track(0.005 * k, 1.0, 0.005);
  EXPECT_NEAR(plant.position(), 1.0, 1e-3);
  EXPECT_NEAR(plant.velocity(), 1.0, 1e-3);
}

TEST(AxisPlant, SettlesLikeACriticallyDampedLoop) {
  AxisPlant plant({.bandwidth_rad_s = 50.0, .v_max_rad_s = 100.0, .a_max_rad_s2 = 1e6}, 0.0);
  for (int k = 0; k < 200; ++k) plant.track(1.0, 0.0, 0.0005);  // 0.1 s
  const double wt = 50.0 * 0.1;                                 // q = 1 − (1 + ωt) e^(−ωt)
  EXPECT_NEAR(plant.position(), 1.0 - (1.0 + wt) * std::exp(-wt), 0.005);
}

TEST(AxisPlant, RespectsTheMotorsLimits) {
  AxisPlant plant({.v_max_rad_s = 2.0, .a_max_rad_s2 = 10.0}, 0.0);
  double v = 0.0;
  for (int k = 0; k < 100; ++k) {
    plant.track(5.0, 0.0, 0.005);
    EXPECT_LE(plant.velocity(), 2.0);
    EXPECT_LE(plant.velocity() - v, 10.0 * 0.005 + 1e-12);
    v = plant.velocity();
  }
}

TEST(AxisPlant, BrakesOverTheExactDistance) {
  AxisPlant plant({}, 0.0);
  for (int k = 1; k <= 100; ++k) plant.track(0.01 * k, 2.0, 0.005);
  const double v = plant.velocity(), q = plant.position();
  while (!plant.at_rest()) plant.brake(7.0, 0.005);  // to rest within a step
  EXPECT_NEAR(plant.position() - q, v * v / (2 * 7.0), 1e-9);
}

TEST_F(OneDrive, AnnouncesItself) {
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0], cia402::heartbeat(4, cia402::NmtState::boot_up));
}

TEST_F(OneDrive, AnswersSdoAsTheStandardAsks) {
  EXPECT_EQ(ask(cia402::sdo_upload(4, obj::kDeviceType)).value, 0x00020192u);
  EXPECT_EQ(ask(cia402::sdo_upload(4, obj::kPosition)).value, 40'000u);
  EXPECT_EQ(abort_of(cia402::sdo_upload(4, {0x2001, 0})), 0x06020000u);
  EXPECT_EQ(abort_of(cia402::sdo_upload(4, {0x607D, 7})), 0x06090011u);
  EXPECT_EQ(abort_of(cia402::sdo_download(4, obj::kStatusword, 1, 2)), 0x06010002u);
  EXPECT_EQ(abort_of(cia402::sdo_download(4, obj::kHeartbeatTime, 1, 4)), 0x06070010u);
  EXPECT_EQ(abort_of(cia402::sdo_download(4, obj::kMode, 7, 1)), 0x06090030u) << "no IP";
  can::Frame segmented = cia402::sdo_upload(4, {0x1008, 0});
  segmented.data[0] = 0x60;
  EXPECT_EQ(abort_of(segmented), 0x05040001u);
  out.clear();
  drive.handle(cia402::sdo_upload(5, obj::kDeviceType), out);
  EXPECT_TRUE(out.empty()) << "not its node";
}

TEST_F(OneDrive, MapsPdosOnlyInTheOrderOfTheStandard) {
  EXPECT_EQ(abort_of(cia402::sdo_download(4, {0x1600, 0}, 0, 1)), 0x08000022u) << "PDO still valid";
  ask(cia402::sdo_download(4, {0x1400, 1}, 0x80000204, 4));
  EXPECT_EQ(abort_of(cia402::sdo_download(4, {0x1600, 1}, 0x607A0020, 4)), 0x08000022u)
      << "count not 0";
  ask(cia402::sdo_download(4, {0x1600, 0}, 0, 1));
  EXPECT_EQ(abort_of(cia402::sdo_download(4, {0x1600, 1}, 0x20000020, 4)), 0x06040041u);
  EXPECT_EQ(abort_of(cia402::sdo_download(4, {0x1600, 1}, 0x607A0010, 4)), 0x06040041u)
      << "wrong length";
  for (std::uint8_t i = 1; i <= 3; ++i) {
    EXPECT_EQ(abort_of(cia402::sdo_download(4, {0x1600, i}, 0x607A0020, 4)), 0u);
  }
  EXPECT_EQ(abort_of(cia402::sdo_download(4, {0x1600, 0}, 3, 1)), 0x06040042u) << "12 bytes";
  EXPECT_EQ(abort_of(cia402::sdo_download(4, {0x1600, 0}, 2, 1)), 0u);
}

TEST_F(OneDrive, ObeysOnlyWhenOperational) {
  command(cia402::controlword::kShutdown);
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  drive.handle(cia402::nmt(cia402::Nmt::start, 4), out);
  command(cia402::controlword::kShutdown);
  EXPECT_EQ(drive.state(), DriveState::ready_to_switch_on);
  out.clear();
  drive.handle(cia402::sync(), out);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].id, 0x184u);
  EXPECT_EQ(
      cia402::decode_statusword(static_cast<std::uint16_t>(*cia402::unsigned_at(out[0], 0, 2))),
      DriveState::ready_to_switch_on);
}

TEST_F(OneDrive, SendsHeartbeatsAtItsPeriod) {
  ask(cia402::sdo_download(4, obj::kHeartbeatTime, 100, 2));
  out.clear();
  pass(1s);
  EXPECT_EQ(out.size(), 10u);
  EXPECT_EQ(out[0], cia402::heartbeat(4, cia402::NmtState::pre_operational));
}

TEST_F(OneDrive, TellsOfALostMasterAndStops) {
  ask(cia402::sdo_download(4, obj::kMasterHeartbeat, 0x7F00FA, 4));
  ask(cia402::sdo_download(4, obj::kAbortOption, 3, 2));
  enable();
  drive.handle(cia402::heartbeat(0x7F, cia402::NmtState::operational), out);
  out.clear();
  pass(250ms);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  EXPECT_TRUE(out.empty());
  pass(1ms);
  EXPECT_NE(drive.state(), DriveState::operation_enabled);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0], cia402::emergency(4, 0x8130, 0x11));
}

class OneDriveThatGoesOn : public OneDrive {
 protected:
  OneDriveThatGoesOn() : OneDrive({.axis = {.node_id = 4}, .extrapolated_cycles = 4}) {}
};

/// From rest to 1 rad/s in 0.1 s, then set-points are missing.
TEST_F(OneDriveThatGoesOn, KeepsItsRateWhileSetPointsAreMissing) {
  set(obj::kPeriodValue, 5, 1);
  set(obj::kPeriodExponent, 0xFD, 1);
  aim(0.0);
  enable();
  double at = 0.0;
  for (int k = 1; k <= 40; ++k) {
    at += 0.005 * std::min(1.0, k / 20.0);
    aim(at);
    command(0x0F);
    pass(5ms);
  }
  pass(20ms);
  EXPECT_NEAR(drive.velocity_rad_s(), 1.0, 1e-3);
  EXPECT_NEAR(drive.position_rad(), at + 0.02, 1e-3);
  pass(300ms);  // not for ever
  EXPECT_NEAR(drive.velocity_rad_s(), 0.0, 1e-3);
  EXPECT_NEAR(drive.position_rad(), at + 0.02, 1e-3);
}

}  // namespace
}  // namespace mimesis::hw::sim
