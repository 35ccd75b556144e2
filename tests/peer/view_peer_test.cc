// `mimesis view` with Foxglove's own client (npm @foxglove/ws-protocol), and its page in a browser
// (npm playwright-core and axe-core).
#include <nlohmann/json.hpp>
#include <thread>

#include "common/testing/process.h"
#include "tests/peer/foreign.h"

namespace mimesis::peer {
namespace {

/// The address that a view says.
std::string address(const testing::Process& view) {
  std::string url;
  for (int i = 0; i < 1000 && !url.ends_with('\n'); ++i) {
    url = view.output();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (url.ends_with('\n')) url.pop_back();
  return url;
}

TEST_F(Foreign, ThePageWorksInABrowserAndForEverybody) {
  if (!fs::exists(MIMESIS_BIN_DIR "/../share/mimesis/page/index.html"))
    GTEST_SKIP() << "the page is not built (cmake --build build --target page)";
  if (!fs::exists("/usr/bin/chromium")) GTEST_SKIP() << "chromium is not installed";
  if (run("node -e 'require.resolve(\"playwright-core\"); require.resolve(\"axe-core\")' 2>&1")
          .status != 0)
    GTEST_SKIP() << "npm playwright-core and axe-core are not there";
  testing::Process view("mimesis", {"view", MIMESIS_LOGS "/world.mcap", "--port", "0"});
  const std::string url = address(view);
  ASSERT_TRUE(url.starts_with("http://")) << view.errors();
  const fs::path picture = fs::path(MIMESIS_BIN_DIR) / "../page.png";
  const Ran ran =
      run_script("page.js", "'" + url + "' /usr/bin/chromium '" + picture.string() + "'");
  ASSERT_EQ(ran.status, 0) << ran.output;
  const auto seen = nlohmann::json::parse(ran.output);
  std::cout << "interactive after " << seen["interactive_ms"] << " ms; " << picture.string()
            << "\n";
  EXPECT_EQ(seen["errors"].size(), 0U) << seen["errors"];
  EXPECT_EQ(seen["violations"].size(), 0U) << seen["violations"];
  EXPECT_EQ(seen["tabs"].size(), 3U * 8U);
  for (const auto& pixels : seen["wide"]) EXPECT_LE(pixels.get<int>(), 0) << "scrolls sideways";
  EXPECT_GT(seen["drawn"], 3) << "entities of the scene";
  EXPECT_EQ(seen["layout"], "Any") << "none that is made for a world alone";
}

TEST_F(Foreign, FoxglovesClientUnderstandsTheView) {
  if (!fs::exists(MIMESIS_BIN_DIR "/mimesis-view")) GTEST_SKIP() << "mimesis view is not built";
  const testing::TestGraph graph;
  testing::Process node(graph, MIMESIS_COUNTER, {"--name", "n", "--set", "salt=7"});
  ASSERT_TRUE(node.wait_ready(graph, "n")) << node.errors();
  testing::Process view("mimesis", {"view", "--graph", graph.name(), "--port", "0"});
  const std::string url = address(view);
  ASSERT_TRUE(url.starts_with("http://")) << view.errors();
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
