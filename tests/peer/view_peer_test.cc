// `mimesis view` with Foxglove's own client (npm @foxglove/ws-protocol).
#include <thread>

#include "common/testing/process.h"
#include "tests/peer/foreign.h"

namespace mimesis::peer {
namespace {

TEST_F(Foreign, FoxglovesClientUnderstandsTheView) {
  if (!fs::exists(MIMESIS_BIN_DIR "/mimesis-view")) GTEST_SKIP() << "mimesis view is not built";
  const testing::TestGraph graph;
  testing::Process node(graph, MIMESIS_COUNTER, {"--name", "n", "--set", "salt=7"});
  ASSERT_TRUE(node.wait_ready(graph, "n")) << node.errors();
  testing::Process view("mimesis", {"view", "--graph", graph.name(), "--port", "0"});
  std::string url;
  for (int i = 0; i < 1000 && !url.ends_with('\n'); ++i) {
    url = view.output();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ASSERT_TRUE(url.starts_with("http://")) << view.errors();
  url.pop_back();
  const Ran ran = run_script("foxglove_client.js", "'ws" + url.substr(4) + "' n/out 20");
  ASSERT_EQ(ran.status, 0) << ran.output;
  const auto seen = nlohmann::json::parse(ran.output);
  EXPECT_EQ(seen["errors"].size(), 0U) << seen["errors"];
  EXPECT_EQ(seen["protocol"], "foxglove.sdk.v1");
  ASSERT_EQ(seen["messages"].size(), 20U);
  std::uint64_t last = 0;
  for (const auto& message : seen["messages"]) {
    const std::uint64_t seq = std::stoull(message["seq"].get<std::string>());
    EXPECT_GT(seq, last);
    last = seq;
  }
  EXPECT_EQ(seen["parameters"]["n.salt"], 7);
  const auto& published = seen["published"];
  EXPECT_NE(std::find(published.begin(), published.end(), "n/out"), published.end()) << published;
  EXPECT_GT(seen["answer"], 100) << "all parameters of the node";
}

}  // namespace
}  // namespace mimesis::peer
