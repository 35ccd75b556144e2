// `mimesis log diff|export|convert|plot` as processes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/testing/process.h"
#include "proto/bridge.pb.h"
#include "proto/foxglove/image.pb.h"
#include "tools/mimesis/log/test/log_builder.h"

namespace mimesis::tool {
namespace {

using nlohmann::json;
using testing::Process;

class LogTools : public ::testing::Test {
 protected:
  /// Positions 0, 1, 2 ... of one joint at 10 Hz, the one of message `odd` larger by `by`.
  std::string log(const std::string& name, int odd = -1, double by = 0.0) {
    LogBuilder builder;
    for (int i = 0; i < 20; ++i) {
      v1::JointState m;
      m.mutable_header()->set_seq(static_cast<std::uint64_t>(i) + 1);
      m.add_position_rad(i + (i == odd ? by : 0.0));
      builder.add("x/arm", static_cast<std::uint64_t>(i) * 100'000'000, m);
    }
    v1::JointState health;
    health.set_fault(name);  // reason from the runtime: differs between runs
    builder.add("x/health", 2'000'000'000, health);
    foxglove::RawImage image;
    image.set_encoding("mono8");
    image.set_width(2);
    image.set_height(1);
    image.set_data("ab");
    builder.add("x/image", 2'100'000'000, image);
    return folder_.write(name, builder.finish());
  }
  struct Run {
    int code;
    std::string output, errors;
  };
  static Run run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "log");
    Process process("mimesis", arguments);
    const int code = process.wait().value_or(-1);
    return {code, process.output(), process.errors()};
  }
  TestFolder folder_;
};

TEST_F(LogTools, DiffSaysWhichFieldOfWhichMessage) {
  const std::string a = log("a.mcap"), b = log("b.mcap"), c = log("c.mcap", 7, 0.25);
  EXPECT_EQ(run({"diff", a, b}).code, 0);
  EXPECT_EQ(run({"diff", a, b, "--all-topics"}).code, 1);
  const Run different = run({"diff", a, c, "--json"});
  EXPECT_EQ(different.code, 1) << different.errors;
  const json report = json::parse(different.output);
  EXPECT_EQ(report["equal"], false);
  ASSERT_EQ(report["topics"].size(), 2u);
  const json& arm = report["topics"][0];
  EXPECT_EQ(arm["topic"], "x/arm");
  EXPECT_EQ(arm["equal"], 19);
  EXPECT_EQ(arm["differing"], 1);
  EXPECT_EQ(arm["first"]["seq"], 8);
  EXPECT_EQ(arm["first"]["fields"][0],
            json({{"path", "position_rad.0"}, {"a", "7"}, {"b", "7.25"}}));
  EXPECT_EQ(arm["worst"][0]["difference"], 0.25);
  EXPECT_EQ(run({"diff", a, c, "--tolerance", "0.25"}).code, 0);
  EXPECT_EQ(run({"diff", a, c, "--ignore", "x/arm.position_rad"}).code, 0);
  EXPECT_EQ(run({"diff", a, c, "--exclude", "x/arm"}).code, 0);
  EXPECT_EQ(run({"diff", a, folder_.file("none.mcap")}).code, 3);
  EXPECT_EQ(run({"diff", a, folder_.write("text", "no log")}).code, 1);
  EXPECT_EQ(run({"diff", a, b, "--topic", "x/none"}).code, 3);
  const Run typo = run({"diff", a, b, "--ignore", "x/arm.positon_rad"});
  EXPECT_EQ(typo.code, 2);
  EXPECT_NE(typo.errors.find("did you mean 'position_rad'?"), std::string::npos);
}

TEST_F(LogTools, ExportOfFieldsAndImages) {
  const std::string a = log("a.mcap");
  const Run csv = run({"export", a, "--csv", "x/arm.position_rad[*],header.seq", "--end", "0.2"});
  EXPECT_EQ(csv.code, 0) << csv.errors;
  EXPECT_EQ(csv.output,
            "log_time_s,publish_time_s,position_rad[0],header.seq\n"
            "0.000000000,0.000000000,0,1\n0.100000000,0.099999999,1,2\n");
  const Run images = run({"export", a, "--images", "x/image", "-o", folder_.file("i"), "--json"});
  EXPECT_EQ(images.code, 0) << images.errors;
  EXPECT_EQ(json::parse(images.output)["items"], 1);
  EXPECT_TRUE(folder_.read("i/000001_2.100000000.png").starts_with("\x89PNG"));
  EXPECT_EQ(run({"export", a}).code, 2);
  EXPECT_EQ(run({"export", a, "--csv", "x/arm.nothing"}).code, 2);
  EXPECT_EQ(run({"export", a, "--csv", "x/arm", "-o", "/no/folder/x.csv"}).code, 2);
  EXPECT_EQ(run({"export", folder_.file("none.mcap"), "--csv", "x/arm"}).code, 3);
}

TEST_F(LogTools, ConvertsCandumpThereAndBack) {
  const std::string text = "(1436509052.249713) vcan0 044#2A366C2BBA\n";
  const std::string in = folder_.write("candump.log", text), out = folder_.file("can.mcap");
  const Run there = run({"convert", in, out, "--json"});
  EXPECT_EQ(there.code, 0) << there.errors;
  EXPECT_EQ(json::parse(there.output)["messages"], 1);
  EXPECT_EQ(run({"convert", in, out}).code, 2);  // exists
  const Run back = run({"convert", out, "-"});
  EXPECT_EQ(back.code, 0) << back.errors;
  EXPECT_EQ(back.output, text);
  const Run damaged =
      run({"convert", folder_.write("bad.log", text + "(1.0) can0 12#\n"), out, "--force"});
  EXPECT_EQ(damaged.code, 1);
  EXPECT_NE(damaged.errors.find("bad.log:2: '12' is no identifier"), std::string::npos);
  const Run bag = run({"convert", folder_.write("x.db3", "SQLite format 3\0"), out, "--force"});
  EXPECT_EQ(bag.code, 2);
  EXPECT_NE(bag.errors.find("ros2 bag convert"), std::string::npos);
  EXPECT_EQ(run({"convert", folder_.file("none"), out}).code, 3);
}

TEST_F(LogTools, PlotsOrSaysWhatIsMissing) {
  const std::string a = log("a.mcap");
  setenv("LC_ALL", "C", 1);  // as without any locale
  const Run plot = run({"plot", a, "x/arm.position_rad[*]", "-o", folder_.file("x.svg"), "--json"});
  if (plot.code == 1 && plot.errors.find("gnuplot is not installed") != std::string::npos) {
    GTEST_SKIP() << "gnuplot is not installed";
  }
  EXPECT_EQ(plot.code, 0) << plot.errors;
  EXPECT_EQ(plot.errors, "");
  EXPECT_EQ(json::parse(plot.output)["curves"][0], json({{"field", "x/arm.position_rad[0]"},
                                                         {"unit", "rad"},
                                                         {"samples", 20},
                                                         {"min", 0.0},
                                                         {"max", 19.0}}));
  EXPECT_NE(folder_.read("x.svg").find("position [rad]"), std::string::npos);
  EXPECT_EQ(run({"plot", a, "x/arm.position_rad", "-o", "x.pdf"}).code, 2);
  EXPECT_EQ(run({"plot", a, "-o", "x.png"}).code, 2);
  EXPECT_EQ(run({"plot", a, "x/arm.fault", "-o", "x.png"}).code, 2);
  EXPECT_EQ(run({"plot", a, "x/arm.position_rad", "--start", "99", "-o", "x.png"}).code, 3);
}

}  // namespace
}  // namespace mimesis::tool
