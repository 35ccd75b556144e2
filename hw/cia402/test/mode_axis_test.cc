// Modes of operation: frames byte for byte, and a simulated drive that homes, goes to a goal, turns
// and pushes.
#include "hw/cia402/mode_axis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "common/time.h"
#include "hw/can/testing/memory_wire.h"
#include "hw/sim/cia402/drive.h"

namespace mimesis::hw::cia402 {
namespace {

using namespace std::chrono_literals;

class OneMode : public ::testing::Test {
 protected:
  void begin(JointSetup joint,
             const sim::DriveConfig& config = {.axis = {.node_id = 5, .sign = -1}}) {
    joint.q_min = -2.0;
    joint.q_max = 2.0;
    joint.v_max = 1.0;
    joint.a_max = 4.0;
    rack.emplace(std::vector{config}, wire.join());
    axis.emplace("A1", config.axis, joint, 200.0, wire.join());
  }
  /// Cycles until `done`; false after 20 s or a failure.
  template <class Done>
  bool until(const Done& done, bool power = true) {
    std::array<can::Frame, 256> frames;
    for (const Time end = now + 20s; now < end; now += 5ms) {
      axis->cycle(now, power);
      rack->step(now + 2500us);
      const std::size_t count = tap->receive(frames);
      for (const can::Frame& f : std::span(frames).first(count)) {
        if (f.id == 0x205 && axis->enabled()) last_command = f;
      }
      if (!axis->failure().empty() || done()) return axis->failure().empty();
    }
    return false;
  }
  bool enable() {
    return until([&] { return axis->enabled(); });
  }
  std::string sent() const { return frame_text(last_command).substr(4); }
  const sim::Drive& drive() const { return rack->drives()[0]; }

  can::MemoryWire wire;
  std::unique_ptr<can::Bus> tap = wire.join();
  std::optional<sim::Rack> rack;
  std::optional<ModeAxis> axis;
  can::Frame last_command;
  Time now = 1s;
};

TEST_F(OneMode, ProfilePositionGoesToEachGoalAndTurnsAtOnce) {
  begin({.mode = OperationMode::profile_position, .profile_v = 0.5});
  ASSERT_TRUE(enable()) << axis->failure();
  axis->move_to(0.5);
  const Time start = now;
  ASSERT_TRUE(until([&] { return axis->done(); })) << axis->failure();
  EXPECT_NEAR(to_seconds(now - start), 0.5 / 0.5 + 0.5 / 4.0, 0.1) << "trapezoid: d/v + v/a";
  EXPECT_NEAR(drive().position_rad(), 0.5, 2e-3);
  EXPECT_EQ(sent(), "0F0080C7FEFF") << "enabled, -80000 increments: the drive counts the other way";
  axis->move_to(-1.0);
  ASSERT_TRUE(until([&] { return drive().position_rad() < 0.0; }));
  axis->move_to(0.2);
  EXPECT_FALSE(axis->done());
  ASSERT_TRUE(until([&] { return axis->done(); }));
  EXPECT_NEAR(drive().position_rad(), 0.2, 2e-3);
  ASSERT_TRUE(until([&] { return !axis->enabled(); }, false));
}

TEST_F(OneMode, CyclicVelocityAndTorque) {
  begin({.mode = OperationMode::cyclic_velocity});
  axis->turn(0.25);
  ASSERT_TRUE(enable()) << axis->failure();
  until([&, end = now + 500ms] { return now > end; });
  EXPECT_NEAR(drive().velocity_rad_s(), 0.25, 1e-3);
  EXPECT_EQ(sent(), "0F00C063FFFF") << "-40000 increments a second";
  begin({.mode = OperationMode::cyclic_torque});
  axis->push(-3.0);
  ASSERT_TRUE(enable()) << axis->failure();
  const Time start = now;
  until([&] { return now > start + 250ms; });
  // J = 0.5, b = 2: v = τ/b (1 − e^(−bt/J))
  EXPECT_NEAR(drive().velocity_rad_s(), -1.5 * (1.0 - std::exp(-4.0 * 0.25)), 0.05);
  EXPECT_EQ(sent(), "0F001E00") << "30 thousandths of 100 N m";
}

/// The one before has left its PDOs and mode behind: nothing is enabled before all is set anew.
TEST_F(OneMode, TakesOverADriveFromAnotherMode) {
  begin({.mode = OperationMode::cyclic_velocity});
  axis->turn(0.5);
  ASSERT_TRUE(enable());
  until([&, end = now + 300ms] { return now > end; });
  ASSERT_TRUE(until([&] { return drive().state() == DriveState::switch_on_disabled; }, false));
  const double stood = drive().position_rad();
  axis.emplace("A1", Axis{.node_id = 5, .sign = -1},
               JointSetup{.q_min = -2,
                          .q_max = 2,
                          .v_max = 1,
                          .a_max = 4,
                          .mode = OperationMode::profile_position,
                          .profile_v = 0.5},
               200.0, wire.join());
  ASSERT_TRUE(until([&] {
    EXPECT_TRUE(drive().state() != DriveState::operation_enabled || axis->known());
    return axis->enabled() || HasFailure();
  })) << axis->failure();
  EXPECT_DOUBLE_EQ(drive().position_rad(), stood);
  axis->move_to(0.0);
  ASSERT_TRUE(until([&] { return axis->done(); })) << axis->failure();
  EXPECT_NEAR(drive().position_rad(), 0.0, 2e-3);
}

TEST_F(OneMode, StopsByItselfWithoutItsMaster) {
  begin({.mode = OperationMode::cyclic_velocity});
  axis->turn(0.5);
  ASSERT_TRUE(enable());
  axis.reset();
  for (const Time end = now + 300ms; now < end; now += 5ms) rack->step(now);
  EXPECT_EQ(drive().velocity_rad_s(), 0.0) << "a motor in velocity mode would just go on";
  EXPECT_NE(drive().state(), DriveState::operation_enabled);
}

TEST_F(OneMode, HomesAtASwitchAndWhereItIs) {
  sim::DriveConfig config{.axis = {.node_id = 5}, .home_rad = 0.3};
  config.switch_low_rad = -0.5;
  begin({.mode = OperationMode::homing, .profile_v = 0.5, .homing_method = 17}, config);
  ASSERT_TRUE(until([&] { return axis->done(); })) << axis->failure();
  EXPECT_EQ(sent(), "1F00") << "bit 4 stays until the end";
  EXPECT_NEAR(drive().position_rad(), -0.5, 5e-3);
  ASSERT_TRUE(until([&, end = now + 50ms] { return now > end; }));
  EXPECT_NEAR(axis->reading().position_rad, 0.0, 5e-3) << "the drive counts from there";
  begin({.mode = OperationMode::homing, .profile_v = 0.5, .homing_method = 35}, config);
  ASSERT_TRUE(until([&] { return axis->done(); })) << axis->failure();
  EXPECT_DOUBLE_EQ(drive().position_rad(), 0.3);
}

TEST_F(OneMode, AnInterruptedHomingIsNotHome) {
  sim::DriveConfig config{.axis = {.node_id = 5}, .home_rad = 0.3};
  config.switch_low_rad = -0.5;
  begin({.mode = OperationMode::homing, .profile_v = 0.5, .homing_method = 17}, config);
  ASSERT_TRUE(until([&] { return drive().position_rad() < 0.0; })) << axis->failure();
  // a second master, which knows nothing of bit 4
  tap->send(std::array{can::Frame{.id = 0x205, .length = 2, .data = {0x0F, 0}}, sync()});
  rack->step(now);
  EXPECT_FALSE(until([&] { return axis->done(); }));
  EXPECT_EQ(axis->failure().substr(0, 37), "A1 (node 5): homing was interrupted, ");
}

TEST_F(OneMode, SaysWhatIsWrong) {
  begin({.mode = OperationMode::homing, .profile_v = 0.5, .homing_method = 17});
  EXPECT_FALSE(until([] { return false; }));
  EXPECT_EQ(axis->failure().substr(0, 44), "A1 (node 5): SDO 6098:00 (homing method): va");
  begin({.mode = OperationMode::homing, .profile_v = 0.0, .homing_method = 35},
        {.axis = {.node_id = 5}, .lacks = {0x6099'01}});
  EXPECT_FALSE(until([] { return false; }));
  EXPECT_NE(axis->failure().find("6099:01 (homing speed)"), std::string::npos) << axis->failure();
  begin({.mode = OperationMode::cyclic_velocity});
  ASSERT_TRUE(enable());
  rack->drives()[0].inject(sim::Trouble::overcurrent);
  EXPECT_FALSE(until([] { return false; }));
  EXPECT_EQ(axis->failure(),
            "A1 (node 5): expected operation enabled, is fault (statusword 0x0218): continuous "
            "over-current (0x2310)");
  begin({.mode = OperationMode::cyclic_velocity});
  ASSERT_TRUE(enable());
  rack->drives()[0].inject(sim::Trouble::mute);
  EXPECT_FALSE(until([] { return false; }));
  EXPECT_EQ(axis->failure(), "A1 (node 5): no feedback for 0.5 s");
}

}  // namespace
}  // namespace mimesis::hw::cia402
