#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "common/error.h"
#include "common/runtime/param_source.h"
#include "common/runtime/test/params_under_test.h"
#include "common/runtime/value_text.h"
#include "common/testing/refusal.h"

namespace mimesis::runtime {
namespace {

class Params : public ::testing::Test {
 protected:
  Params() { EXPECT_NE(mkdtemp(folder_.data()), nullptr); }
  ~Params() override { std::filesystem::remove_all(folder_); }

  CrowdParams read(const std::string& yaml, const std::vector<std::string>& sets = {},
                   const std::vector<std::string>& args = {}, const std::string& section = "") {
    std::ofstream(file_ = folder_ + "/crowd.yaml") << yaml;
    CrowdParams params;
    ParamSource(file_ + section, args, sets).read("crowd", [&](ParamVisitor& v) {
      params.visit(v);
    });
    return params;
  }

  std::string folder_ = (std::filesystem::temp_directory_path() / "params-XXXXXX").string();
  std::string file_;
};

TEST_F(Params, DefaultsStayWhereNothingIsGiven) {
  const CrowdParams p = read("# nothing\n");
  EXPECT_EQ(p.rate_hz, 50.0);
  EXPECT_EQ(p.balls.size(), 2U);
}

TEST_F(Params, ReadsEveryKind) {
  const CrowdParams p = read(
      "rate_hz: 1e2\nagents: +7\nlog: true\nbus: 010\ngraph: line\ngains: [4, 5.5, 6]\n"
      "names:\n  - no\n  - 'x y'\ndrive: {limit_rad_s: 0, enabled: false}\n"
      "balls:\n  - {radius_m: 0.3, name: one}\n  - radius_m: 0.4\n  - {}\n");
  EXPECT_EQ(p.rate_hz, 100.0);
  EXPECT_EQ(p.agents, 7);
  EXPECT_TRUE(p.log);
  EXPECT_EQ(p.bus, "010");  // text stays as it is written
  EXPECT_EQ(p.graph, "line");
  EXPECT_EQ(p.gains, (std::vector<double>{4, 5.5, 6}));
  EXPECT_EQ(p.names, (std::vector<std::string>{"no", "x y"}));
  EXPECT_EQ(p.drive.limit_rad_s, 0.0);
  EXPECT_FALSE(p.drive.enabled);
  ASSERT_EQ(p.balls.size(), 3U);
  EXPECT_EQ(p.balls[0].radius_m, 0.3);
  EXPECT_EQ(p.balls[0].name, "one");
  EXPECT_EQ(p.balls[2].radius_m, 0.1);
}

TEST_F(Params, TheLastSetWins) {
  const CrowdParams p = read("k_1_s: 1\ngains: [1, 1, 1]\n",
                             {"k_1_s=2", "k_1_s=3", "drive.enabled=false", "balls.1.radius_m=0.5",
                              "gains=[7, 8, 9]", "names=x,y", "bus=[not a list"});
  EXPECT_EQ(p.k_1_s, 3.0);
  EXPECT_FALSE(p.drive.enabled);
  EXPECT_EQ(p.balls[0].radius_m, 0.1);
  EXPECT_EQ(p.balls[1].radius_m, 0.5);
  EXPECT_EQ(p.gains, (std::vector<double>{7, 8, 9}));
  EXPECT_EQ(p.names, (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(p.bus, "[not a list");
}

TEST_F(Params, VariablesAreReplaced) {
  setenv("MIMESIS_TEST_BUS", "can0", 1);
  setenv("MIMESIS_RUN_LOG", "/logs/7", 1);
  const std::string yaml =
      "args:\n  speed: {type: number, default: 20}\n  where: {default: \"${run:log}/x\"}\n"
      "nodes:\n  crowd:\n    params:\n      rate_hz: ${arg:speed}\n"
      "      bus: \"$${arg:x} ${env:MIMESIS_TEST_BUS} ${arg:where}\"\n      names: "
      "\"${arg:where}\"\n";
  CrowdParams p = read(yaml, {}, {}, "#nodes.crowd.params");
  EXPECT_EQ(p.rate_hz, 20.0);
  EXPECT_EQ(p.bus, "${arg:x} can0 /logs/7/x");
  EXPECT_EQ(p.names, (std::vector<std::string>{"/logs/7/x"}));
  p = read(yaml, {}, {"speed=30", "where=a,b"}, "#nodes.crowd.params");
  EXPECT_EQ(p.rate_hz, 30.0);
  EXPECT_EQ(p.names, (std::vector<std::string>{"a", "b"}));  // a whole value may be a list
}

TEST_F(Params, AbsentLastKeyOfTheSectionMeansNoParameters) {
  EXPECT_EQ(read("nodes:\n  crowd:\n    exec: x\n", {"agents=9"}, {}, "#nodes.crowd.params").agents,
            9);
}

TEST_F(Params, NamesOfForAreArgumentsOfTheSectionsInIt) {
  const std::string yaml =
      "groups:\n  all:\n    for: {r: [5, 6]}\n    nodes:\n"
      "      a.${arg:r}.${arg:b}:\n        for: {b: [x]}\n"
      "        params: {rate_hz: \"${arg:r}\", bus: \"${arg:b} ${host:h}\"}\n"
      "hosts: {h: {address: 10.0.0.3}}\nnodes: {c: {params: {}}}\n";
  const std::string section = "#groups.all.nodes.a.${arg:r}.${arg:b}.params";
  const CrowdParams p = read(yaml, {}, {"r=6", "b=x"}, section);
  EXPECT_EQ(p.rate_hz, 6.0);
  EXPECT_EQ(p.bus, "x 10.0.0.3");
  EXPECT_THROW(read(yaml, {}, {"r=6", "k=x"}, section), ConfigError);
  EXPECT_THROW(read(yaml, {}, {"r=6"}, "#nodes.c.params"), ConfigError) << "not in that `for`";
}

TEST_F(Params, NothingChangesOnRefusedValues) {
  CrowdParams params;
  EXPECT_THROW(ParamSource("", {}, {"k_1_s=99", "gains=1,2,x"})
                   .read("c", [&](ParamVisitor& v) { params.visit(v); }),
               ConfigError);
  EXPECT_EQ(params.k_1_s, 0.5);
  EXPECT_EQ(params.gains, (std::vector<double>{1, 2, 3}));
}

TEST_F(Params, DumpReadsBackTheSame) {
  CrowdParams p = read(
      "rate_hz: 0.1e2\nbus: \"a \\\"quoted\\\" \\\\ text\"\nnames: [\"x, y\", z]\nballs: []\n");
  const auto visit = [&p](ParamVisitor& v) { p.visit(v); };
  const std::string dump = dump_params(visit);
  CrowdParams q = read(dump);
  EXPECT_EQ(dump_params([&q](ParamVisitor& v) { q.visit(v); }), dump);
  EXPECT_EQ(q.bus, "a \"quoted\" \\ text");
  EXPECT_EQ(q.names, (std::vector<std::string>{"x, y", "z"}));
  EXPECT_TRUE(q.balls.empty());
}

TEST_F(Params, FlatEntriesAreKeyAndValue) {
  CrowdParams p;
  const auto entries = flat_params([&p](ParamVisitor& v) { p.visit(v); });
  const auto has = [&](const char* entry) {
    return std::find(entries.begin(), entries.end(), entry) != entries.end();
  };
  EXPECT_TRUE(has("k_1_s=0.5"));
  EXPECT_TRUE(has("balls.1.radius_m=0.2"));
  p.k_1_s = 0.25;
  const auto changed = flat_params([&p](ParamVisitor& v) { p.visit(v); });
  ASSERT_EQ(changed.size(), entries.size());
  int differing = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) differing += entries[i] != changed[i] ? 1 : 0;
  EXPECT_EQ(differing, 1);
}

TEST_F(Params, DumpOfListsOfStructs) {
  CrowdParams p;
  const std::string dump = dump_params([&p](ParamVisitor& v) { p.visit(v); });
  EXPECT_NE(dump.find("balls:\n  - radius_m: 0.1\n    name: \"ball\"\n  - radius_m: 0.2\n"),
            std::string::npos)
      << dump;
}

TEST_F(Params, DescribesRangesAndChoices) {
  CrowdParams p;
  std::map<std::string, ParamInfo> by_key;
  for (const ParamInfo& info : param_infos([&p](ParamVisitor& v) { p.visit(v); }))
    by_key[info.key] = info;
  EXPECT_TRUE(by_key.contains("drive.limit_rad_s"));
  EXPECT_EQ(by_key["k_1_s"].allowed, "[0.001, 10]");
  EXPECT_EQ(by_key["k_1_s"].range, std::pair(0.001, 10.0));
  EXPECT_EQ(by_key["graph"].choices, (std::vector<std::string>{"ring", "line", "all_to_all"}));
  EXPECT_EQ(by_key["balls"].type, "list");
  EXPECT_EQ(by_key["balls.N.radius_m"].type, "number");
  p.balls.clear();
  const auto infos = param_infos([&p](ParamVisitor& v) { p.visit(v); });
  EXPECT_EQ(infos.back().key, "balls.N.name");  // the element was made for its keys alone
  EXPECT_TRUE(p.balls.empty());
}

TEST_F(Params, LoadParamsNamesThePlacesItSearched) {
  Ball ball;
  const std::string refused = testing::refusal(
      [&] { load_params("no_such_robot.yaml", [&](ParamVisitor& v) { ball.visit(v); }); });
  EXPECT_NE(refused.find(MIMESIS_SOURCE_DIR "/models"), std::string::npos) << refused;
  std::ofstream(folder_ + "/ball.yaml") << "radius_m: 0.7\n";
  load_params(folder_ + "/ball.yaml", [&](ParamVisitor& v) { ball.visit(v); });
  EXPECT_EQ(ball.radius_m, 0.7);
}

TEST_F(Params, AFileWithADotStandsBesideTheOneThatNamesIt) {
  std::ofstream(folder_ + "/mine.yaml") << "a: 1\n";
  std::ofstream(folder_ + "/node.yaml") << "robot: ./mine.yaml\narm: lwr4.yaml\n";
  std::ofstream(folder_ + "/lwr4.yaml") << "a: 1\n";
  std::string robot, arm;
  ParamSource(folder_ + "/node.yaml", {}, {}).read("node", [&](ParamVisitor& v) {
    v.file("robot", robot, "arm");
    v.file("arm", arm, "arm");
  });
  EXPECT_EQ(robot, folder_ + "/mine.yaml");
  EXPECT_EQ(arm, "lwr4.yaml") << "of models/";
}

TEST(Suggest, CountsSlips) {
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(edit_distance("rate_zh", "rate_hz"), 1U);  // neighbours swapped
  EXPECT_EQ(did_you_mean("lanch", {"log", "launch"}), ", did you mean 'launch'?");
  EXPECT_EQ(did_you_mean("middle", {"middle", "high"}), "");
  EXPECT_EQ(did_you_mean("frobnicate", {"log", "launch"}), "");
}

using namespace std::chrono_literals;

TEST(ValueText, Durations) {
  EXPECT_EQ(to_duration("2s"), 2s);
  EXPECT_EQ(to_duration("500ms"), 500ms);
  EXPECT_EQ(to_duration("1.5 min"), 90s);
  EXPECT_EQ(to_duration("0s"), 0s);
  for (const char* bad : {"2", "s", "-1s", "2 sec", "1e30h", "", "nans", "1..5s"}) {
    EXPECT_FALSE(to_duration(bad)) << bad;
  }
}

TEST(ValueText, Numbers) {
  EXPECT_EQ(to_double("-2.5e-3"), -2.5e-3);
  EXPECT_EQ(to_double("+1"), 1.0);
  EXPECT_EQ(to_int("-0"), 0);
  EXPECT_EQ(to_int("0"), 0);
  for (const char* bad : {"", " 1", "1 ", "0x1", "1_0", "+-1", "inf", "1e400"}) {
    EXPECT_FALSE(to_double(bad)) << bad;
  }
  for (const char* bad : {"", "010", "-010", "1.0", "1e3", "+"}) EXPECT_FALSE(to_int(bad)) << bad;
}
}  // namespace
}  // namespace mimesis::runtime
