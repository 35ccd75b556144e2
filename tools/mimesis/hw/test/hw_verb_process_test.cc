// `mimesis hw` against the simulated drives as a process, on the embedded bus.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "common/machine_time.h"
#include "common/testing/process.h"
#include "hw/cia402/cia402.h"
#include "hw/cia402/test/eds_text.h"
#include "tools/mimesis/hw/bus_watch.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

class Hw : public testing::VerbTest {
 protected:
  Hw() {
    std::string text = "robot: lwr4.yaml\nbuses: [{can: \"embedded:arm\"}]\njoints:\n";
    // The drives' own default: 160 000 increments a radian.
    for (int i = 1; i <= 7; ++i) {
      text += "  - {name: A" + std::to_string(i) + ", node_id: " + std::to_string(i) +
              ", increments_per_turn: " + std::to_string(2.0 * M_PI * 160'000.0) + "}\n";
    }
    file_ = graph_.directory() + "-machine.yaml";
    std::ofstream(file_) << text;
    drives_.emplace(graph_, "mimesis_sim_drives", std::vector<std::string>{});
    EXPECT_TRUE(drives_->wait_ready(graph_, "sim_drives", 60s)) << drives_->errors();
  }
  ~Hw() override { std::filesystem::remove(file_); }

  int run(std::vector<std::string> words, bool json = false) {
    words.insert(words.begin(), "hw");
    if (words[1] != "check") words.insert(words.end(), {"--graph", graph_.name()});
    if (json) words.emplace_back("--json");
    return call(words);
  }
  Json json() { return Json::parse(output_, nullptr, false); }

  testing::TestGraph graph_;
  std::optional<testing::Process> drives_;
  std::string file_;
};

TEST_F(Hw, ScanFindsTheDrives) {
  ASSERT_EQ(run({"scan", "embedded:arm"}, true), 0) << errors_;
  const Json found = json();
  ASSERT_EQ(found.size(), 7u) << output_;
  EXPECT_EQ(found[6]["node"], 7);
  EXPECT_EQ(found[6]["device_type"], 0x00020192);
  EXPECT_EQ(found[6]["name"], "mimesis simulated drive");
  EXPECT_EQ(found[6]["state"], "switch on disabled");
  EXPECT_EQ(run({"scan", "embedded:nobody", "--timeout", "0.1"}), 3);
  EXPECT_EQ(errors_, "nobody answers on embedded:nobody within 0.1 s\n");
  EXPECT_EQ(run({"scan", "can0"}), 2);
}

TEST_F(Hw, SdoLeavesToABridgeWhatProtectsADrive) {
  testing::TestNode bridge(graph_, {}, {}, "bridge");
  bridge.bus().serve("enable", v1::Publication::default_instance(),
                     v1::Publication::default_instance(),
                     [](const std::string& request) { return request; });
  bridge.open();
  for (const char* object : {"1016:01", "6065", "6007", "1400:05"}) {
    EXPECT_EQ(run({"sdo", "embedded:arm", "3", object, "1", "--type", "u32"}), 2) << object;
    EXPECT_NE(errors_.find("node bridge counts on it: --force"), std::string::npos) << errors_;
    EXPECT_EQ(run({"sdo", "embedded:arm", "3", object}), 0) << errors_;
  }
  EXPECT_EQ(run({"sdo", "embedded:arm", "3", "6065", "1234", "--type", "u32", "--force"}), 0);
  EXPECT_EQ(run({"sdo", "embedded:arm", "3", "2000", "name", "--type", "text"}), 0) << errors_;
  EXPECT_NE(errors_.find("may be moving this drive"), std::string::npos) << errors_;
}

TEST_F(Hw, SdoReadsWritesAndSaysWhyNot) {
  ASSERT_EQ(run({"sdo", "embedded:arm", "3", "6065"}), 0) << errors_;
  EXPECT_EQ(output_, "8000 (0x00001F40)\n");
  EXPECT_EQ(run({"sdo", "embedded:arm", "3", "6065", "1234", "--type", "u32"}), 0) << errors_;
  ASSERT_EQ(run({"sdo", "embedded:arm", "3", "6065:00"}, true), 0) << errors_;
  EXPECT_EQ(json()["value"], 1234);
  EXPECT_EQ(run({"sdo", "embedded:arm", "3", "2000", "an axis with a name", "--type", "text"}), 0)
      << errors_;
  EXPECT_EQ(run({"sdo", "embedded:arm", "3", "2000"}), 0);
  EXPECT_EQ(output_, "an axis with a name\n");
  EXPECT_EQ(run({"sdo", "embedded:arm", "3", "6041", "1", "--type", "u16"}), 1);
  EXPECT_EQ(errors_, "node 3: 6041:00: object is read-only (0x06010002)\n");
  EXPECT_EQ(run({"sdo", "embedded:arm", "99", "1000", "--timeout", "0.1"}), 3);
  EXPECT_EQ(errors_, "node 99 did not answer within 0.1 s\n");
  EXPECT_EQ(run({"sdo", "embedded:arm", "3", "6065", "-1", "--type", "u32"}), 2);
  EXPECT_EQ(run({"sdo", "embedded:arm", "3", "xyz"}), 2);
  EXPECT_NE(errors_.find("expected hexadecimal 6041 or 607D:02"), std::string::npos) << errors_;
}

TEST_F(Hw, JogMovesOneJointAndSwitchesItOff) {
  ASSERT_EQ(run({"jog", file_, "A2", "--by", "0.05", "--speed", "0.2"}, true), 0) << errors_;
  EXPECT_NEAR(json()["to_rad"].get<double>() - json()["from_rad"].get<double>(), 0.05, 1e-3);
  ASSERT_EQ(run({"scan", "embedded:arm"}, true), 0);
  EXPECT_EQ(json()[1]["state"], "switch on disabled");
  EXPECT_EQ(run({"jog", file_, "A2", "--by", "9", "--speed", "0.2"}), 2);
  EXPECT_NE(errors_.find("its limits are -2.0944 and 2.0944"), std::string::npos) << errors_;
  EXPECT_EQ(run({"jog", file_, "A9", "--by", "0.1", "--speed", "0.2"}), 2);
  EXPECT_NE(errors_.find("JOINT 'A9': lwr4.yaml has A1, A2,"), std::string::npos) << errors_;
}

TEST_F(Hw, TriesTheModesOfADrive) {
  const auto moved = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"try", file_, "A4"});
    EXPECT_EQ(run(words, true), 0) << errors_;
    return json()["to_rad"].get<double>() - json()["from_rad"].get<double>();
  };
  EXPECT_NEAR(moved({"position", "1.3", "--speed", "1"}), 1.3 - 1.6, 2e-3);
  EXPECT_LT(moved({"velocity", "-0.2", "--for", "0.5"}), -0.02);
  EXPECT_GT(moved({"torque", "2", "--for", "0.5"}), 0.02);
  moved({"home", "--method", "35", "--speed", "0.1"});
  EXPECT_NEAR(json()["to_rad"].get<double>(), 0.0, 1e-3) << "zero is here";
  ASSERT_EQ(run({"scan", "embedded:arm"}, true), 0);
  EXPECT_EQ(json()[3]["state"], "switch on disabled");
  EXPECT_EQ(run({"try", file_, "A4", "home", "--method", "17", "--speed", "0.1"}), 1);
  EXPECT_NE(errors_.find("SDO 6098:00 (homing method): "), std::string::npos) << errors_;
  EXPECT_EQ(run({"try", file_, "A4", "position", "9", "--speed", "1"}), 2);
  EXPECT_EQ(run({"try", file_, "A4", "velocity", "0.2"}), 2);
  EXPECT_EQ(run({"try", file_, "A4", "velocity", "99", "--for", "1"}), 2);
}

TEST_F(Hw, FaultsAreMadeAndMonitored) {
  // A monitor that listens while a drive fails.
  testing::Process monitor(
      "mimesis", {"hw", "monitor", "embedded:arm", "--machine", file_, "--temperature", "2F10",
                  "--json", "--graph", graph_.name()});
  const auto axis = [&](int node) -> Json {
    std::string line, last;
    for (std::istringstream lines(monitor.output()); std::getline(lines, line);) last = line;
    const Json shown = Json::parse(last, nullptr, false);
    if (!shown.contains("axes")) return {};
    for (const Json& a : shown["axes"])
      if (a["node"] == node) return a;
    return {};
  };
  const auto until = [&](const auto& done) {
    for (MachineTime time; time.passed() < 60s;) {
      if (done()) return true;
      run({"sdo", "embedded:arm", "4", "1001"});  // something to see
    }
    return false;
  };
  ASSERT_TRUE(until([&] { return !axis(4).is_null(); })) << monitor.errors();
  EXPECT_EQ(axis(4)["name"], "A4");
  ASSERT_TRUE(until([&] { return axis(4)["temperature_c"] == 25.0; })) << monitor.output();
  // A simulated drive makes trouble by itself: 2F00h:01, over-temperature.
  ASSERT_EQ(run({"sdo", "embedded:arm", "4", "2F00:01", "4", "--type", "u8"}), 0) << errors_;
  ASSERT_TRUE(until([&] { return axis(4)["emergency"] == "drive too hot (0x4310)"; }))
      << monitor.output();
  EXPECT_TRUE(until([&] { return axis(4)["temperature_c"] == 105.0; })) << monitor.output();
  EXPECT_EQ(run({"sdo", "embedded:arm", "4", "6041"}), 0);
  EXPECT_EQ(output_.substr(0, 4), "536 ") << "0x0218: fault";
  ASSERT_EQ(run({"sdo", "embedded:arm", "4", "2F00:01", "5", "--type", "u8"}), 0) << errors_;
  EXPECT_EQ(run({"sdo", "embedded:arm", "4", "1000", "--timeout", "0.2"}), 3);
  monitor.signal(SIGINT);
  EXPECT_EQ(monitor.wait(60s), 0);
}

/// As candump writes them.
TEST_F(Hw, MonitorPrintsFrames) {
  testing::Process monitor("mimesis", {"hw", "monitor", "embedded:arm", "--frames", "--count", "20",
                                       "--graph", graph_.name()});
  for (int asked = 0; asked < 200 && !monitor.wait(1ms); ++asked)
    run({"sdo", "embedded:arm", "2", "1000"});
  const std::regex line(R"(\(\d+\.\d{6}\) arm [0-9A-F]{3}#[0-9A-F]*)");
  std::istringstream lines(monitor.output());
  int count = 0;
  for (std::string text; std::getline(lines, text); ++count)
    EXPECT_TRUE(std::regex_match(text, line)) << text;
  EXPECT_EQ(count, 20);
}

TEST_F(Hw, CheckSaysWhatFits) {
  ASSERT_EQ(run({"check", file_}, true), 0) << errors_;
  const Json checked = json();
  EXPECT_TRUE(checked["fits"].get<bool>());
  EXPECT_EQ(checked["fewest_buses"], 1);
  EXPECT_NEAR(checked["buses"][0]["load_worst"].get<double>(), 0.49947, 1e-4);
  EXPECT_EQ(run({"check", file_}), 0);
  EXPECT_NE(output_.find("7 axes at 200 Hz: fits"), std::string::npos) << output_;
  std::ofstream(file_, std::ios::app) << "more: 1\n";
  EXPECT_EQ(run({"check", file_}), 2);
  EXPECT_NE(errors_.find("more"), std::string::npos) << errors_;
}

/// A drive's description beside the machine file, and the drive itself.
TEST_F(Hw, CheckComparesDrivesWithTheirDescriptions) {
  using namespace hw::cia402;
  const std::string eds = graph_.directory() + "-drive.eds";
  std::vector<eds_text::Entry> entries = eds_text::whole_drive();
  const auto write = [&](const std::string& product) {
    for (eds_text::Entry& e : entries) {
      if (e.object == Object{0x1018, 2}) e.value = product;
      if (e.object == Object{0x1018, 1}) e.value = "0";
    }
    std::string text = eds_text::text_of(entries);
    text.replace(text.find("VendorNumber=0xFB"), 17, "VendorNumber=0");
    text.replace(text.find("RevisionNumber=0x01610000"), 25, "RevisionNumber=0");
    std::ofstream(eds) << text;
  };
  const std::string machine = [&] {
    std::ifstream in(file_);
    return std::string(std::istreambuf_iterator<char>(in), {});
  }();
  const auto check = [&](const std::string& of_a3, std::vector<std::string> more = {}) {
    std::string text = machine;
    text.replace(text.find("{name: A3,"), 10, "{name: A3, eds: " + eds + of_a3 + ",");
    std::ofstream(file_) << text;
    std::vector<std::string> words{"check", file_};
    words.insert(words.end(), more.begin(), more.end());
    return run(words, true);
  };
  write("1");
  ASSERT_EQ(check(""), 0) << errors_ << output_;
  ASSERT_EQ(json()["drives"].size(), 1u);
  EXPECT_EQ(json()["drives"][0]["name"], "A3");
  EXPECT_EQ(json()["drives"][0]["product"], "Drive");
  EXPECT_TRUE(json()["drives"][0]["found"].empty()) << output_;
  // The simulated drive is product 1 of nobody, and has all.
  ASSERT_EQ(check("", {"--drives", "--graph", graph_.name()}), 0) << errors_ << output_;
  write("0x65520000");
  ASSERT_EQ(check("", {"--drives", "--graph", graph_.name()}), 1) << errors_;
  EXPECT_EQ(json()["drives"][0]["found"][0]["what"],
            "1018:02 (product): the drive says 0x1, its file 0x65520000");
  ASSERT_EQ(check("", {"--drives", "--graph", graph_.name() + "-none", "--timeout", "0.1"}), 3);
  EXPECT_EQ(errors_, "node 3 did not answer within 0.1 s\n");
  // What it lacks by its description, and what its axis accepts.
  std::erase_if(entries, [](const eds_text::Entry& e) { return e.object.index == 0x6007; });
  write("1");
  ASSERT_EQ(check(""), 1) << errors_;
  EXPECT_EQ(json()["drives"][0]["found"][0]["accept"], "no_6007") << output_;
  EXPECT_EQ(check(", accept: [no_6007]"), 0) << errors_;
  EXPECT_EQ(json()["drives"][0]["found"][0]["kind"], "warning") << output_;
  EXPECT_EQ(run({"check", file_}), 0) << errors_;
  EXPECT_NE(output_.find("warning: 6007:00 (quick stop when the connection is lost): the drive "
                         "lacks it"),
            std::string::npos)
      << output_;
  std::ofstream(eds, std::ios::app) << "\nnonsense\n";
  EXPECT_EQ(check(""), 2);
  EXPECT_NE(errors_.find("expected [SECTION] or KEY=VALUE, found 'nonsense'"), std::string::npos)
      << errors_;
  std::filesystem::remove(eds);
  EXPECT_EQ(check(""), 2);
  EXPECT_NE(errors_.find("expected the file of: EDS or DCF of the drive"), std::string::npos)
      << errors_;
}

TEST(Candump, LinesOfEachKindOfFrame) {
  namespace can = hw::can;
  const hw::Time stamp = 1436509052s + 249713us;
  const auto line = [&stamp](const can::Frame& f) { return candump_line(f, stamp, "can0"); };
  can::Frame f{.id = 0x44, .length = 3, .data = {0x2A, 0x36, 0x6C}};
  EXPECT_EQ(line(f), "(1436509052.249713) can0 044#2A366C");
  f.id = 0x12345 | can::kExtendedFlag;
  EXPECT_EQ(line(f), "(1436509052.249713) can0 00012345#2A366C");
  f.id = 0x44 | can::kRemoteFlag;
  EXPECT_EQ(line(f), "(1436509052.249713) can0 044#R");
  f = {.id = can::kErrorFlag | can::kBusOff, .length = 8};
  EXPECT_EQ(line(f), "(1436509052.249713) can0 20000040#0000000000000000");
  f = {.id = 0x1, .length = 12, .flags = 1};
  EXPECT_EQ(line(f), "(1436509052.249713) can0 001##1000000000000000000000000");
  f = {.id = 0x1, .length = 2, .flags = can::kFd, .data = {0xAA, 0xBB}};
  EXPECT_EQ(line(f), "(1436509052.249713) can0 001##4AABB") << "a short one";
}

TEST(Watch, CountsRatesAndErrors) {
  namespace cia402 = hw::cia402;
  BusWatch watch;
  watch.observe(cia402::heartbeat(5, cia402::NmtState::operational));
  hw::can::Frame feedback = cia402::tpdo(1, 5), command = cia402::rpdo(1, 5);
  cia402::append(feedback, 0x1237, 2);
  cia402::append(feedback, 1000, 4);
  cia402::append(feedback, static_cast<std::uint32_t>(-25), 2);
  cia402::append(command, 0x0F, 2);
  cia402::append(command, 1010, 4);
  for (int k = 0; k < 100; ++k) {
    watch.observe(cia402::sync());
    watch.observe(command);
    watch.observe(feedback);
  }
  watch.observe({.id = hw::can::kErrorFlag | hw::can::kBusOff, .length = 8});
  watch.close_interval(0.5);
  const auto nodes = watch.nodes();
  ASSERT_EQ(nodes.size(), 1u);
  EXPECT_EQ(nodes[0].state, hw::DriveState::operation_enabled);
  EXPECT_EQ(nodes[0].nmt, 5);
  EXPECT_EQ(nodes[0].position, 1000);
  EXPECT_EQ(nodes[0].target, 1010);
  EXPECT_EQ(nodes[0].torque, -25);
  EXPECT_DOUBLE_EQ(nodes[0].frames_s, 202.0);
  EXPECT_DOUBLE_EQ(watch.syncs_s(), 200.0);
  EXPECT_DOUBLE_EQ(watch.bits_s(), 2.0 * (100 * (55 + 115 + 135) + 65));
  EXPECT_TRUE(watch.bus_off());
  EXPECT_EQ(watch.error_frames(), 1u);
}

}  // namespace
}  // namespace mimesis::tool
