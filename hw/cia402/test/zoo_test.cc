// A zoo of drives: each habit of a maker is enabled and moved by 0.020 rad, or refused with the
// true name of what it lacks. Where a public report tells of the habit, it is named.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "common/error.h"
#include "hw/can/testing/memory_wire.h"
#include "hw/cia402/joint_driver.h"
#include "hw/sim/cia402/drive.h"

namespace mimesis::hw::cia402 {
namespace {

using namespace std::chrono_literals;

struct Animal {
  std::string habits;        ///< of the simulated drive, separated by blanks
  std::string accept;        ///< of its axis
  std::string refused_with;  ///< in the reason; empty: it is moved
  const char* report = "";
  double sdo_timeout_s = 0.1;
  bool guarding = false;
};

const Animal kZoo[] = {
    {"cob_bit30", "", "", "canopen-python/canopen#228, CANopenNode/CANopenNode#589"},
    {"mode_shown_late", "", "", "ros-industrial/ros2_canopen#444"},
    {"mode_lag", "", "", "ros-industrial/ros2_canopen#234"},
    {"no_6007", "", "SDO 6007:00 (quick stop when the connection is lost): object does not exist"},
    {"no_6007", "no_6007", ""},
    {"no_60C2", "", "SDO 60C2:01 (interpolation period): object does not exist"},
    {"no_60C2", "no_60C2", ""},
    {"no_1016", "", "SDO 1016:01 (watch over our heartbeat): object does not exist",
     "ros-industrial/ros_canopen#367"},
    {"no_1016", "no_1016", "", "ros-industrial/ros_canopen#367"},
    {"no_1016 no_1400_05", "no_1016", "nothing stops it when the bridge is lost"},
    {"no_1017", "", "SDO 1017:00 (the drive's heartbeat): object does not exist",
     "ros-industrial/ros_canopen#105, #106"},
    {"no_1017", "no_1017", "", "ros-industrial/ros_canopen#105, #106"},
    {"no_1016 no_1017", "", "", "ros-industrial/ros_canopen#106", 0.1, true},
    {"", "", "", "CANopenNode/CANopenNode#348", 0.1, true},
    {"no_1016 no_100C", "", "SDO 100C:00 (time between our guard requests): object does not exist",
     "", 0.1, true},
    {"stuck_toggle", "", "no answer to node guarding with a new toggle bit for 0.25 s", "", 0.1,
     true},
    {"no_1400_05", "", ""},
    {"no_6502", "", ""},
    {"modes_unknown", "", "", "ros-industrial/ros_canopen#462"},
    {"late_boot", "", "", "ros-industrial/ros2_canopen#370"},
    {"no_boot_message", "", "", "ros-industrial/ros2_canopen#199"},
    {"starts_itself", "", ""},
    {"slow_sdo", "", "no answer to SDO 6502:00 (cyclic synchronous position) within 0.1 s, 3 times",
     "ros-industrial/ros2_canopen#194"},
    {"slow_sdo", "", "", "ros-industrial/ros2_canopen#194", 0.5},
    {"unsized_sdo", "", "", "esp-cpp/espp#762, mcbridejc/zencan#29"},
    {"four_byte_sdo", "", "", "canopen-python/canopen#395"},
    {"odd_abort no_6502", "", "", "ros-industrial/ros_canopen#434"},
    {"odd_abort no_6007", "", "SDO 6007:00 (quick stop when the connection is lost): unsupported"},
    {"event_pdo", "", "SDO 1400:02 (PDO on SYNC): object is read-only"},
    {"velocity_pdo", "", "RPDO1 carries 60FF:00, which the bridge cannot give",
     "canopen-python/canopen#541"},
    {"fixed_tpdo_map", "", "6064:00 is not in TPDO1 or TPDO2", "canopen-python/canopen#541"},
    {"boots_in_fault", "", "", "ICube-Robotics/ethercat_driver_ros2#151"},
    {"boots_in_fault sticky_reset", "", "", "nasa-jpl/fastcat#5, ros-industrial/ros_canopen#138"},
    {"boots_in_fault keeps_fault", "", "is fault (statusword 0x0218); it stays so after a reset",
     "canopen-python/canopen#261"},
    {"slow_switch_on", "", ""},
    {"no_bit12", "", "does not follow: bit 12 of its statusword is 0 for 0.3 s"},
    {"no_bit12", "no_bit12", ""},
    {"ignores_targets", "", "does not follow: bit 12 of its statusword is 0 for 0.3 s",
     "OpenEtherCATsociety/SOEM#518"},
    {"stands", "", "does not move: asked for", "ros-industrial/ros_canopen#307"},
    {"other_bits", "", "", "OpenEtherCATsociety/SOEM#518"},
    {"emergencies", "", ""},
    {"cob_bit30 mode_shown_late no_6502 four_byte_sdo other_bits late_boot", "", ""},
};

class Zoo : public ::testing::TestWithParam<Animal> {
 protected:
  Phase step(Mode mode, double target) {
    const std::array q{target};
    driver->read(now);
    driver->write(now, {.mode = mode, .position_rad = q});
    rack->step(now + 2500us);
    now += 5ms;
    return driver->reading().phase;
  }
  void idle(Time duration) {
    for (const Time end = now + duration; now < end;) step(Mode::idle, 0.0);
  }
  can::MemoryWire wire;
  std::optional<sim::Rack> rack;
  std::optional<JointDriver> driver;
  Time now = 1s;
};

TEST_P(Zoo, IsMovedOrRefusedByName) {
  const Animal& animal = GetParam();
  SCOPED_TRACE(animal.habits);
  const auto words = [](const std::string& text) {
    std::vector<std::string> all;
    std::istringstream in(text);
    for (std::string word; in >> word;) all.push_back(word);
    return all;
  };
  sim::DriveConfig config{
      .axis = {.node_id = 3, .accept = words(animal.accept), .guarding = animal.guarding}};
  sim::take_habits(config, words(animal.habits));
  const auto one = [](double x) { return Eigen::VectorXd::Constant(1, x); };
  rack.emplace(std::vector{config}, wire.join());
  driver.emplace(
      JointDriverOptions{
          .axes = {config.axis},
          .limits = {.q_min = one(-1), .q_max = one(1), .v_max = one(1), .a_max = one(5)},
          .tracking_window_rad = 0.1,
          .sdo_timeout_s = animal.sdo_timeout_s},
      wire.join());
  const auto& reason = driver->reading().reason;
  bool reset = false;
  for (const Time end = now + 40s; now < end;) {
    const Phase phase = step(Mode::idle, 0.0);
    if (phase != Phase::fault || reset || now < 35s) continue;
    reset = driver->reset_faults().empty();
  }
  double farthest = 0.0;
  constexpr int kCycles = 240;
  for (int k = 0; k < kCycles && driver->reading().phase != Phase::fault; ++k) {
    step(Mode::follow, 0.01 * (1.0 - std::cos(2.0 * M_PI * k / kCycles)));
    farthest = std::max(farthest, rack->drives()[0].position_rad());
  }
  if (animal.refused_with.empty()) {
    EXPECT_EQ(driver->reading().phase, Phase::following) << reason;
    EXPECT_NEAR(farthest, 0.020, 0.001);
  } else {
    EXPECT_EQ(driver->reading().phase, Phase::fault);
    EXPECT_NE(reason.find(animal.refused_with), std::string::npos) << reason;
    EXPECT_LT(farthest, animal.habits == "no_bit12" ? 0.03 : 1e-6);
  }
}
INSTANTIATE_TEST_SUITE_P(Drives, Zoo, ::testing::ValuesIn(kZoo));

TEST(Habits, AreAllInTheZoo) {
  for (const std::string_view habit : sim::known_habits()) {
    const auto shows = [&](const Animal& a) {
      return (" " + a.habits + " ").find(" " + std::string(habit) + " ") != std::string::npos;
    };
    EXPECT_TRUE(std::ranges::any_of(kZoo, shows)) << habit;
  }
  sim::DriveConfig config;
  EXPECT_THROW(sim::take_habits(config, {"no_6008"}), ConfigError);
}

/// Its master stops in motion: the drive, which has no deadline of set-points, stops 200 ms after
/// the last guard request. Without a life time it goes on.
TEST_F(Zoo, AGuardedDriveStopsWithoutItsMaster) {
  sim::DriveConfig config{.axis = {.node_id = 3, .guarding = true}};
  sim::take_habits(config, {"no_1016", "no_1017", "no_1400_05"});
  const auto one = [](double x) { return Eigen::VectorXd::Constant(1, x); };
  rack.emplace(std::vector{config}, wire.join());
  driver.emplace(
      JointDriverOptions{
          .axes = {config.axis},
          .limits = {.q_min = one(-1), .q_max = one(1), .v_max = one(1), .a_max = one(5)}},
      wire.join());
  idle(1s);
  double target = 0.0;
  for (int k = 0; k < 200; ++k) step(Mode::follow, target += 0.001);
  ASSERT_EQ(driver->reading().phase, Phase::following) << driver->reading().reason;
  const sim::Drive& drive = rack->drives()[0];
  Time stopped{};
  for (const Time last = now; now < last + 1s && stopped == Time{}; now += 1ms) {
    rack->step(now);
    if (drive.state() != DriveState::operation_enabled) stopped = now - last;
  }
  EXPECT_GT(stopped, 90ms);
  EXPECT_LT(stopped, 210ms);
}

/// However small: three increments are a motion.
TEST_F(Zoo, AMotionOfThreeIncrementsIsWatched) {
  for (const auto& [increments, phase] :
       {std::pair{2.4, Phase::following}, std::pair{3.1, Phase::fault}}) {
    sim::DriveConfig config{.axis = {.node_id = 3}};
    sim::take_habits(config, {"stands"});
    const auto one = [](double x) { return Eigen::VectorXd::Constant(1, x); };
    driver.reset();
    rack.emplace(std::vector{config}, wire.join());
    driver.emplace(
        JointDriverOptions{
            .axes = {config.axis},
            .limits = {.q_min = one(-1), .q_max = one(1), .v_max = one(1), .a_max = one(5)}},
        wire.join());
    idle(1s);
    const double target = increments / config.axis.increments_per_rad;
    for (int k = 0; k < 200; ++k) step(Mode::follow, target);
    EXPECT_EQ(driver->reading().phase, phase) << increments << driver->reading().reason;
  }
}

/// A drive that lags behind a slow motion by more than the window of its user, and says nothing.
TEST_F(Zoo, ADeviationBeyondTheWindowThatLasts) {
  sim::DriveConfig config{.axis = {.node_id = 3},
                          .plant = {.v_max_rad_s = 1.0},
                          .following_window_rad = 1.0,
                          .fixed = {0x6065'00},
                          .made = {{0x6065'00, 1600}}};
  config.plant.bandwidth_rad_s = 2.0;  // 2 v / ω behind
  const auto one = [](double x) { return Eigen::VectorXd::Constant(1, x); };
  rack.emplace(std::vector{config}, wire.join());
  driver.emplace(
      JointDriverOptions{
          .axes = {config.axis},
          .limits = {.q_min = one(-1), .q_max = one(1), .v_max = one(1), .a_max = one(5)},
          .following_window_rad = 0.01},
      wire.join());
  idle(1s);
  rack->drives()[0].inject(sim::Trouble::jam);
  double target = 0.0;
  for (int k = 0; k < 400 && driver->reading().phase != Phase::fault; ++k)
    step(Mode::follow, target = std::min(0.02, target + 0.0002));
  EXPECT_EQ(driver->reading().phase, Phase::fault);
}

}  // namespace
}  // namespace mimesis::hw::cia402
