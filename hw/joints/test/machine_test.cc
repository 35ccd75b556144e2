#include "hw/joints/machine.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>

#include "common/error.h"
#include "common/runtime/param_source.h"
#include "common/testing/loopback.h"
#include "hw/can/bus.h"
#include "hw/can/testing/memory_wire.h"
#include "hw/cia402/joint_driver.h"
#include "hw/powercube/driver.h"
#include "hw/sim/cia402/drive.h"
#include "hw/sim/powercube/module.h"

namespace mimesis::hw {
namespace {

using namespace std::chrono_literals;

class MachineFiles : public ::testing::Test {
 protected:
  std::string joint(int i, const std::string& more = "") {
    return "  - {name: A" + std::to_string(i + 1) + ", bus: " + std::to_string(i / 4) +
           ", node_id: " + std::to_string(11 + i) + ", increments_per_turn: 4096, gear_ratio: 160" +
           more + "}\n";
  }
  std::string text(const std::string& third = "") {
    std::string all =
        "robot: lwr4.yaml\nbuses: [{can: \"socketcan:can0\"}, {can: \"socketcan:can1\", "
        "bitrate_bit_s: 500000}]\njoints:\n";
    for (int i = 0; i < 7; ++i) all += i == 2 && !third.empty() ? third : joint(i);
    return all;
  }
  Machine load(const std::string& text) {
    const std::string file = graph_.directory() + "/machine.yaml";
    std::ofstream(file) << text;
    return load_machine(file);
  }
  std::string refusal(const std::string& text) {
    try {
      load(text);
    } catch (const ConfigError& e) {
      const std::string why = e.what();
      return why.substr(why.find("machine.yaml") + 12);
    }
    return "accepted";
  }
  testing::Loopback graph_;
};

TEST_F(MachineFiles, SayWhereTheDrivesAre) {
  const Machine machine = load(text(joint(2,
                                          ", sign: -1, offset_rad: 0.5, q_max_rad: 1, v_max_rad_s: "
                                          "0.2, j_max_rad_s3: 50, stop_bit: 3")));
  ASSERT_EQ(machine.axes.size(), 7u);
  EXPECT_EQ(machine.axes[6].node_id, 17);
  EXPECT_DOUBLE_EQ(machine.axes[0].increments_per_rad, 4096 * 160 / (2.0 * M_PI));
  EXPECT_EQ(machine.axes[2].sign, -1);
  EXPECT_EQ(machine.axes[2].offset_rad, 0.5);
  EXPECT_EQ(machine.buses[0].joints, 4);
  EXPECT_EQ(machine.buses[1].joints, 3);
  EXPECT_EQ(machine.bitrates[1], 500'000);
  const Joints robot = load_joints("lwr4.yaml");
  EXPECT_EQ(machine.joints.limits.q_max[2], 1.0) << "narrower than the robot's";
  EXPECT_EQ(machine.joints.limits.v_max[2], 0.2);
  EXPECT_EQ(machine.joints.limits.j_max[2], 50.0);
  EXPECT_EQ(part_of(machine.joints.limits, 1, 3).j_max[1], 50.0);
  EXPECT_EQ(machine.joints.limits.j_max[1], 0.0) << "none";
  EXPECT_EQ(machine.axes[2].stop_bit, 3);
  EXPECT_EQ(machine.axes[1].stop_bit, -1);
  EXPECT_EQ(machine.joints.limits.q_min[2], robot.limits.q_min[2]);
  EXPECT_EQ(load(text(joint(2, ", q_max_rad: 99"))).joints.limits.q_max[2], robot.limits.q_max[2])
      << "never wider";
}

TEST_F(MachineFiles, SayWhatIsWrong) {
  const auto third = [&](const std::string& key, const std::string& value) {
    std::string line = joint(2);
    const std::size_t at = line.find(key + ": ") + key.size() + 2;
    return text(line.replace(at, line.find_first_of(",}", at) - at, value));
  };
  EXPECT_EQ(refusal(third("name", "A4")),
            ": joints[2].name: 'A4', expected A3, which lwr4.yaml has here");
  EXPECT_EQ(refusal(third("bus", "2")), ": joints[2].bus: 2, there are 2");
  EXPECT_EQ(refusal(third("bus", "1")),
            ": joints[3].bus: 0 behind bus 1: expected the joints of a bus one after the other, in "
            "the robot's order");
  EXPECT_EQ(refusal(third("node_id", "11")), ": axes[2].node_id: 11 is used by axes[0]");
  EXPECT_EQ(refusal(third("node_id", "127")).substr(0, 6), ":6:33:") << "place in the file";
  EXPECT_EQ(refusal(text(joint(2, ", q_min_rad: 1, q_max_rad: 0.5"))),
            ": joints[2]: limits leave no room: 1 to 0.5 rad");
  EXPECT_EQ(refusal(third("gear_ratio", "100000")).substr(0, 40), "accepted");
  EXPECT_EQ(refusal(third("increments_per_turn", "1e8")),
            ": joints[2]: 7.56e+09 increments at a limit, expected at most 2^31");
  EXPECT_EQ(refusal(text().substr(0, text().rfind("  - "))), ": joints: 6 given, lwr4.yaml has 7");
}

TEST_F(MachineFiles, NameDescriptionsOfCanopenDrivesAlone) {
  const std::string eds = graph_.directory() + "/drive.eds", robot = graph_.directory() + "/r.yaml";
  std::ofstream(eds) << "[DeviceInfo]\n";
  const std::string named = text(joint(2, ", eds: " + eds));
  EXPECT_EQ(load(named).eds, (std::vector<std::string>{"", "", eds, "", "", "", ""}));
  std::ifstream in(runtime::find_model_file("lwr4.yaml"));
  std::string model(std::istreambuf_iterator<char>(in), {});
  std::ofstream(robot) << model.replace(model.find("drives: cia402"), 14, "drives: powercube");
  const auto of_robot = [&](std::string all) {
    return all.replace(all.find("lwr4.yaml"), 9, robot);
  };
  EXPECT_EQ(load(of_robot(text())).joints.drives, "powercube");
  EXPECT_EQ(refusal(of_robot(named)),
            ": joints[2].eds: drives of kind powercube are not CANopen's, and have none");
}

constexpr int kMbit = 1'000'000;

Joints robot_with(bool walks, const std::string& drives = "cia402") {
  Joints joints;
  joints.walks = walks;
  joints.drives = drives;
  return joints;
}

/// The rows of hw/README.md, and of the literature: 30 axes at 200 Hz do not fit on one bus.
TEST(Loads, OfTheReadmeAndOfTheLiterature) {
  const Joints arm = robot_with(false), biped = robot_with(true);
  const std::vector<cia402::Axis> axes(126);
  const auto first = [&](std::size_t n) { return std::span(axes).first(n); };
  const auto percent = [&](std::size_t n, const Joints& joints) {
    return std::lround(100.0 * bus_load(first(n), joints, 200.0, kMbit).worst);
  };
  EXPECT_EQ(percent(6, arm), 43);
  EXPECT_EQ(percent(7, arm), 50);
  EXPECT_EQ(percent(30, arm), 210);
  EXPECT_EQ(percent(9, biped), 71);
  EXPECT_EQ(percent(30, biped), 234);
  EXPECT_EQ(fewest_buses(first(30), arm, 200.0, kMbit), 3);
  EXPECT_EQ(fewest_buses(first(31), arm, 200.0, kMbit), 4);
  EXPECT_EQ(fewest_buses(first(30), arm, 1000.0, kMbit), 15) << "classic CAN is out";
  EXPECT_EQ(fewest_buses(first(1), arm, 1000.0, 200'000), 0);
  const double rate = largest_rate(first(7), arm, kMbit);
  EXPECT_LE(bus_load(first(7), arm, rate, kMbit).worst, kLargestLoad);
  EXPECT_GT(bus_load(first(7), arm, 1e4 / (1e4 / rate - 1.0), kMbit).worst, kLargestLoad);
  EXPECT_EQ(largest_rate(first(1), arm, kMbit), 1000.0);
  EXPECT_EQ(largest_rate(axes, arm, 10'000), 0.0);
}

/// Most bits that pass `tap` in a second of following, by the frames that driver and devices send.
template <class Devices>
long bits_of_a_second(Actuators& driver, const Devices& devices, can::Bus& tap, Time cycle,
                      std::size_t axes) {
  const std::vector<double> q(axes, 0.0);
  std::vector<can::Frame> frames(4096);
  long bits = 0;
  for (Time now{}; now < 4s; now += cycle) {
    driver.read(now);
    driver.write(now, {.mode = now < 2s ? Mode::idle : Mode::follow, .position_rad = q});
    devices(now + cycle / 2);
    const std::size_t count = tap.receive(frames);
    for (std::size_t i = 0; now >= 3s && i < count; ++i) bits += can::worst_bits(frames[i].length);
  }
  EXPECT_EQ(driver.read(4s).phase, Phase::following);
  return bits;
}

/// An emergency stop's input is one more PDO of its drive, a powered drive reports more.
TEST(Loads, AreThoseOfTheFramesOnTheWire) {
  for (const bool walks : {false, true}) {
    can::MemoryWire wire;
    const auto tap = wire.join();
    const std::vector<cia402::Axis> axes{
        {.node_id = 1}, {.node_id = 2, .stop_bit = 3}, {.node_id = 3, .stop_bit = 3}};
    const auto all = [](double x) { return Eigen::VectorXd::Constant(3, x); };
    sim::Rack rack({{.axis = axes[0]}, {.axis = axes[1]}, {.axis = axes[2]}}, wire.join());
    cia402::JointDriver driver(
        {.axes = axes,
         .limits = {.q_min = all(-1), .q_max = all(1), .v_max = all(1), .a_max = all(5)},
         .quick_stop = walks ? cia402::QuickStop::stays_powered : cia402::QuickStop::disables},
        wire.join());
    const auto step = [&](Time now) { rack.step(now); };
    EXPECT_NEAR(static_cast<double>(bits_of_a_second(driver, step, *tap, 5ms, 3)),
                kMbit * bus_load(axes, robot_with(walks), 200.0, kMbit).worst, 1.0);
  }
}

TEST(Loads, OfPowerCubeModulesToo) {
  can::MemoryWire wire;
  const auto tap = wire.join();
  const auto theirs = wire.join();
  const std::vector<cia402::Axis> axes{{.node_id = 1}, {.node_id = 2}};
  const auto all = [](double x) { return Eigen::VectorXd::Constant(2, x); };
  std::array modules{sim::Module({.module = 1}), sim::Module({.module = 2})};
  powercube::Driver driver(
      {.axes = axes,
       .limits = {.q_min = all(-1), .q_max = all(1), .v_max = all(1), .a_max = all(5)}},
      wire.join());
  const auto step = [&](Time now) {
    std::vector<can::Frame> heard(64), out;
    const std::size_t count = theirs->receive(heard);
    for (sim::Module& module : modules) {
      module.advance(now);
      for (const can::Frame& f : std::span(heard).first(count)) module.handle(f, out);
    }
    theirs->send(out);
  };
  const double said = kMbit * bus_load(axes, robot_with(false, "powercube"), 50.0, kMbit).worst;
  const auto sent = static_cast<double>(bits_of_a_second(driver, step, *tap, 20ms, 2));
  EXPECT_NEAR(sent, said, 0.01 * said) << "states are asked for in every fourth cycle";
}

}  // namespace
}  // namespace mimesis::hw
