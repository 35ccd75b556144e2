// Modes of operation against closed forms of their motion.
#include <gtest/gtest.h>

#include <cmath>

#include "common/time.h"
#include "hw/sim/cia402/test/one_drive.h"

namespace mimesis::hw::sim {
namespace {

constexpr double kInc = 160'000.0;  // increments per rad

std::uint32_t counts(double rad) {
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::round(rad * kInc)));
}

class Modes : public OneDrive {
 protected:
  explicit Modes(const DriveConfig& config = {.axis = {.node_id = 4}, .home_rad = 0.25})
      : OneDrive(config) {}

  void begin(std::uint32_t mode) {
    set({0x6060, 0}, mode, 1);
    enable();
  }
  std::uint32_t status() { return ask(cia402::sdo_upload(4, obj::kStatusword)).value; }
  std::uint32_t read(cia402::Object object) { return ask(cia402::sdo_upload(4, object)).value; }
  /// Until `done`, at most 20 s; returns how long it took.
  template <class Done>
  Time until(const Done& done) {
    const Time begin = now;
    while (!done() && now - begin < 20s) pass(1ms);
    return now - begin;
  }
};

/// Trapezoid over d with v, a: d/v + v/a.
TEST_F(Modes, ProfilePositionTakesTheTimeOfItsTrapezoid) {
  set({0x6081, 0}, counts(0.5), 4);
  set({0x6083, 0}, counts(2.0), 4);
  set({0x6084, 0}, counts(2.0), 4);
  begin(1);
  set(obj::kTarget, counts(1.25), 4);
  EXPECT_EQ(status() & 0x1400, 0x400u) << "where it is, no set-point taken";
  command(0x1F);
  EXPECT_EQ(status() & 0x1400, 0x1000u) << "acknowledged, on the way";
  double fastest = 0.0;
  const Time taken = until([&] {
    fastest = std::max(fastest, drive.velocity_rad_s());
    return (status() & 0x400) != 0;
  });
  EXPECT_NEAR(to_seconds(taken), 1.0 / 0.5 + 0.5 / 2.0, 0.04);
  EXPECT_NEAR(fastest, 0.5, 0.01);
  EXPECT_NEAR(drive.position_rad(), 1.25, 2e-3);
  command(0x0F);
  EXPECT_EQ(status() & 0x1000, 0u) << "ready for the next";
}

TEST_F(Modes, ProfilePositionWaitsOrTurnsAtOnce) {
  begin(1);
  set(obj::kTarget, counts(1.0), 4);
  command(0x1F);
  command(0x0F);
  pass(100ms);
  set(obj::kTarget, counts(0.0), 4);
  command(0x1F);  // not at once: after the first
  command(0x0F);
  double farthest = 0.0;
  until([&] {
    farthest = std::max(farthest, drive.position_rad());
    return std::abs(drive.position_rad()) < 1e-3;
  });
  EXPECT_NEAR(farthest, 1.0, 2e-3);
  pass(1s);
  set(obj::kTarget, counts(1.0), 4);
  command(0x1F);
  command(0x0F);
  pass(100ms);
  set(obj::kTarget, counts(-0.2), 4);
  command(0x7F);  // at once, relative to the goal: 0.8
  farthest = 0.0;
  until([&] {
    farthest = std::max(farthest, drive.position_rad());
    return (status() & 0x400) != 0;
  });
  EXPECT_NEAR(farthest, 0.8, 2e-3);
}

TEST_F(Modes, HaltStopsAndStaysEnabled) {
  begin(1);
  set(obj::kTarget, counts(3.0), 4);
  command(0x1F);
  pass(500ms);
  ASSERT_GT(drive.velocity_rad_s(), 0.5);
  command(0x11F);
  pass(1s);
  EXPECT_NEAR(drive.velocity_rad_s(), 0.0, 1e-3);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  EXPECT_LT(drive.position_rad(), 2.5);
}

TEST_F(Modes, ProfileVelocityRampsUp) {
  set({0x6083, 0}, counts(2.0), 4);
  begin(3);
  set({0x60FF, 0}, counts(0.8), 4);
  pass(200ms);
  EXPECT_NEAR(drive.velocity_rad_s(), 0.4, 0.02);
  pass(300ms);
  EXPECT_NEAR(drive.velocity_rad_s(), 0.8, 1e-3);
  EXPECT_NE(status() & 0x400, 0u);
}

/// Until the deadline of set-points it goes on: "a motor in velocity mode would just go on".
TEST_F(Modes, CyclicVelocityGoesOnUntilItsDeadline) {
  set(obj::kRpdo1Deadline, 100, 2);
  set(obj::kAbortOption, 3, 2);
  begin(9);
  set({0x60FF, 0}, static_cast<std::uint32_t>(-static_cast<std::int32_t>(counts(0.5))), 4);
  pass(99ms);
  EXPECT_NEAR(drive.velocity_rad_s(), -0.5, 1e-3);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  pass(100ms);
  EXPECT_EQ(drive.velocity_rad_s(), 0.0);
}

/// J q̈ + b q̇ = τ: q̇ = τ/b (1 − e^(−bt/J)), J = 0.5, b = 2.
TEST_F(Modes, CyclicTorqueAcceleratesTheJoint) {
  begin(10);
  set({0x6071, 0}, 20, 2);  // thousandths of 100 N m
  pass(250ms);
  EXPECT_NEAR(drive.velocity_rad_s(), 2.0 / 2.0 * (1.0 - std::exp(-2.0 * 0.25 / 0.5)), 5e-3);
  EXPECT_NEAR(read(obj::kTorque), 20, 1);
  set({0x6072, 0}, 5, 2);
  pass(2s);
  EXPECT_NEAR(drive.velocity_rad_s(), 0.25, 1e-3) << "limited by 6072h";
}

class Switched : public Modes {
 protected:
  Switched()
      : Modes({.axis = {.node_id = 4, .sign = -1},
               .home_rad = 0.25,
               .switch_low_rad = -0.5,
               .switch_high_rad = 1.0}) {}
};

/// The positive switch of an encoder that counts against the joint is at the joint's lower end.
TEST_F(Switched, HomesAtTheSwitchOfItsOwnDirection) {
  set({0x6098, 0}, 18, 1);
  set({0x6099, 1}, counts(0.5), 4);
  set({0x6099, 2}, counts(0.05), 4);
  set({0x607C, 0}, 1000, 4);
  begin(6);
  EXPECT_EQ(status() & 0x3400, 0x400u) << "not started";
  command(0x1F);
  until([&] { return (status() & 0x1000) != 0; });
  EXPECT_EQ(status() & 0x3400, 0x1400u);
  EXPECT_NEAR(drive.position_rad(), -0.5, 5e-3);
  EXPECT_NEAR(static_cast<std::int32_t>(read(obj::kPosition)), 1000, 2);
}

TEST_F(Modes, HomesWhereItIs) {
  EXPECT_EQ(abort_of(cia402::sdo_download(4, {0x6098, 0}, 17, 1)), 0x06090030u) << "no switch";
  set({0x6098, 0}, 37, 1);
  begin(6);
  command(0x1F);
  EXPECT_EQ(read(obj::kPosition), 0u);
  EXPECT_DOUBLE_EQ(drive.position_rad(), 0.25) << "nothing moves";
}

TEST_F(Modes, AChangeOfModeStartsAtTheActualPosition) {
  begin(9);
  set({0x60FF, 0}, counts(0.5), 4);
  pass(500ms);
  set(obj::kTarget, 0, 4);
  set({0x6060, 0}, 1, 1);
  command(0x0F);
  pass(500ms);
  EXPECT_NEAR(drive.velocity_rad_s(), 0.0, 1e-3);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  EXPECT_NEAR(drive.position_rad(), 0.5, 0.05) << "not to a target of another mode";
}

TEST_F(Modes, QuickStopByTheSlowRampIfAsked) {
  set({0x6084, 0}, counts(1.0), 4);
  set(obj::kQuickStopDeceleration, counts(10.0), 4);
  set(obj::kQuickStopOption, 5, 2);  // slow down ramp, stays powered
  begin(9);
  set({0x60FF, 0}, counts(1.0), 4);
  pass(200ms);
  const double q = drive.position_rad();
  command(0x02);
  pass(2s);
  EXPECT_EQ(drive.state(), DriveState::quick_stop_active);
  EXPECT_NEAR(drive.position_rad() - q, 0.5, 0.01);
}

TEST_F(Modes, TroubleOverTheBus) {
  EXPECT_EQ(abort_of(cia402::sdo_download(4, {0x2F00, 1}, 99, 1)), 0x06090031u);
  begin(8);
  set({0x2F00, 1}, static_cast<std::uint32_t>(Trouble::over_temperature), 1);
  out.clear();
  pass(1ms);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0], cia402::emergency(4, 0x4310, 0x09));
  set({0x2F00, 2}, 300, 2);
  drive.handle(cia402::sdo_download(4, {0x2F00, 1}, static_cast<std::uint32_t>(Trouble::power), 1),
               out);
  out.clear();
  EXPECT_TRUE((drive.handle(cia402::sdo_upload(4, obj::kMode), out), out.empty())) << "no supply";
  pass(299ms);
  EXPECT_TRUE(out.empty());
  pass(2ms);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0], cia402::heartbeat(4, cia402::NmtState::boot_up));
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
}

TEST_F(Modes, ADriveThatHangsMovesNotAndGoesOn) {
  begin(9);
  set({0x60FF, 0}, counts(0.5), 4);
  pass(300ms);
  drive.inject(Trouble::stall, 100ms);
  const double q = drive.position_rad();
  pass(99ms);
  EXPECT_DOUBLE_EQ(drive.position_rad(), q);
  pass(100ms);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  EXPECT_GT(drive.position_rad(), q + 0.03);
}

}  // namespace
}  // namespace mimesis::hw::sim
