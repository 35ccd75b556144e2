// `mimesis topic` and `mimesis node` on a graph with a real node.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "common/testing/process.h"

namespace mimesis::tool {
namespace {
using namespace std::chrono_literals;
using nlohmann::json;

class Topic : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(node_.wait_ready(graph_, "a")) << node_.errors(); }

  /// Output and exit code of `mimesis ARGUMENTS --graph G`.
  std::pair<std::string, int> run(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--graph", graph_.name()});
    testing::Process p("mimesis", arguments);
    const int code = p.wait().value_or(-1);
    errors_ = p.errors();
    return {p.output(), code};
  }

  testing::TestGraph graph_;
  testing::Process node_{graph_, MIMESIS_COUNTER, {"--name", "a", "--in", "a=other/out"}};
  std::string errors_;
};

TEST_F(Topic, ListNamesTypesAndEnds) {
  const auto [out, code] = run({"topic", "list", "--json"});
  EXPECT_EQ(code, 0);
  json found;
  for (const json& topic : json::parse(out)) found[topic["topic"].get<std::string>()] = topic;
  EXPECT_EQ(found["a/out"]["type"], "mimesis.v1.Publication");
  EXPECT_EQ(found["a/out"]["publishers"], json::array({"a"}));
  EXPECT_EQ(found["other/out"]["publishers"], json::array());
  EXPECT_EQ(found["other/out"]["subscribers"], json::array({"a"}));
  EXPECT_NE(run({"topic", "list"}).first.find("a/out"), std::string::npos);
}

TEST_F(Topic, NodeListKnowsTheProcess) {
  const json nodes = json::parse(run({"node", "list", "--json"}).first);
  ASSERT_EQ(nodes.size(), 1U);
  EXPECT_EQ(nodes[0]["name"], "a");
  EXPECT_EQ(nodes[0]["pid"], node_.pid());
  EXPECT_EQ(nodes[0]["ready"], true);
}

TEST_F(Topic, EchoPrintsOneJsonObjectPerMessage) {
  const auto [out, code] = run({"topic", "echo", "a/out", "-n", "3", "--json"});
  EXPECT_EQ(code, 0);
  std::istringstream lines(out);
  int count = 0;
  std::uint64_t last = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    const json message = json::parse(line);
    EXPECT_EQ(message["topic"], "a/out");
    EXPECT_EQ(message["source"], "a");
    EXPECT_EQ(message["message"]["topic"], "counter");
    EXPECT_GT(message["seq"].get<std::uint64_t>(), last);
    last = message["seq"];
  }
  EXPECT_EQ(count, 3);
}

TEST_F(Topic, EchoOfAField) {
  EXPECT_EQ(run({"topic", "echo", "a/out", "--once", "--field", "topic"}).first, "counter\n");
  EXPECT_EQ(run({"topic", "echo", "a/out", "--once", "--field", "tpic"}).second, 2);
  EXPECT_NE(errors_.find("did you mean 'topic'?"), std::string::npos) << errors_;
}

TEST_F(Topic, SaysWhatItWaitsForAndTimesOutWithThree) {
  const auto [out, code] = run({"topic", "echo", "a/uot", "--timeout", "0.1"});
  EXPECT_EQ(code, 3);
  EXPECT_EQ(out, "");
  EXPECT_NE(errors_.find("did you mean 'a/out'?"), std::string::npos) << errors_;
  EXPECT_EQ(run({"topic", "hz", "a/uot", "--timeout", "0.1"}).second, 3);
}

TEST_F(Topic, HzMeasuresTheRate) {  // rate of 100 Hz; generous, for machines under load
  const auto [out, code] = run({"topic", "hz", "a/out", "-n", "1", "--json"});
  EXPECT_EQ(code, 0);
  const double hz = json::parse(out)["rate_hz"];
  EXPECT_GT(hz, 60.0);
  EXPECT_LT(hz, 140.0);
}

TEST_F(Topic, AnEmptyGraphIsNoError) {
  const testing::TestGraph empty;
  testing::Process p("mimesis", {"topic", "list", "--json", "--graph", empty.name()});
  EXPECT_EQ(p.wait(), 0);
  EXPECT_EQ(p.output(), "[]\n");
}

}  // namespace
}  // namespace mimesis::tool
