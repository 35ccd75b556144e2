#include "hw/joints/machine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/error.h"
#include "common/testing/loopback.h"

namespace mimesis::hw {
namespace {

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

/// The rows of hw/README.md, and of the literature: 30 axes at 200 Hz do not fit on one bus.
TEST(Loads, OfTheReadmeAndOfTheLiterature) {
  const auto percent = [](int axes, bool powered) {
    return std::lround(100.0 * bus_load(axes, 200.0, 1'000'000, powered).worst);
  };
  EXPECT_EQ(percent(6, false), 43);
  EXPECT_EQ(percent(7, false), 50);
  EXPECT_EQ(percent(30, false), 210);
  EXPECT_EQ(percent(9, true), 71);
  EXPECT_EQ(percent(30, true), 234);
  EXPECT_EQ(most_axes(200.0, 1'000'000, false), 10);
  EXPECT_EQ(most_axes(1000.0, 1'000'000, false), 2) << "classic CAN is out";
  const double rate = largest_rate(7, 1'000'000, false);
  EXPECT_LE(bus_load(7, rate, 1'000'000, false).worst, kLargestLoad);
  EXPECT_GT(bus_load(7, 1e4 / (1e4 / rate - 1.0), 1'000'000, false).worst, kLargestLoad);
  EXPECT_EQ(largest_rate(126, 10'000, false), 0.0);
}

}  // namespace
}  // namespace mimesis::hw
