// `mimesis log clean` on a folder of runs.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <nlohmann/json.hpp>

#include "common/testing/process.h"
#include "tools/mimesis/log/test/log_builder.h"
#include "tools/mimesis/log_folder.h"

namespace mimesis::tool {
namespace {

using nlohmann::json;
using testing::Process;

TEST(LogClean, KeepsTheNewestAndThoseThatRun) {
  const TestFolder folder;
  setenv("XDG_STATE_HOME", folder.path().c_str(), 1);
  const std::vector<std::string> names{"20260101-000000-a-1", "20260102-000000-a-2",
                                       "20260103-000000-a-3", "kept"};
  for (const std::string& name : names) {
    std::filesystem::create_directories(log_root() / name);
    std::ofstream(log_root() / name / "a.log") << std::string(1000, 'x');
  }
  const RunLock first(log_root() / names[0]);
  const auto clean = [](std::vector<std::string> options) {
    options.insert(options.begin(), {"log", "clean"});
    Process p("mimesis", options);
    EXPECT_EQ(p.wait(), 0) << p.errors();
    return p.output();
  };
  const json plan = json::parse(clean({"--keep", "1", "--dry-run", "--json"}));
  EXPECT_EQ(plan["removed"].size(), 2U);
  EXPECT_EQ(plan["runs"], 2);
  EXPECT_EQ(run_folders().size(), 4U) << "a dry run removes nothing";
  EXPECT_EQ(clean({"--max-size", "3500B"}),
            "removed " + names[1] + " (1.0 kB)\n" + log_root().string() + ": 3 runs, 3.0 kB\n");
  EXPECT_EQ(json::parse(clean({"--json"}))["removed"].size(), 0U) << "below the default limit";
  Process wrong("mimesis", {"log", "clean", "--max-size", "much"});
  EXPECT_EQ(wrong.wait(), 2);
}

}  // namespace
}  // namespace mimesis::tool
