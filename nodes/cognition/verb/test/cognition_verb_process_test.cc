// `mimesis cognition explain` as people call it, on the recorded run of tests/replay.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "common/testing/process.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const std::string kLogs = std::string(MIMESIS_SOURCE_DIR) + "/tests/replay/logs/";

struct Call {
  int code;
  std::string out, err;
};
Call call(std::string verb, std::vector<std::string> words) {
  words.insert(words.begin(), {"cognition", std::move(verb)});
  testing::Process process("mimesis", words);
  const int code = process.wait(std::chrono::seconds(60)).value_or(-1);
  return {code, process.output(), process.errors()};
}

Call explain(std::vector<std::string> words) { return call("explain", std::move(words)); }

// Files alone, no C++: a chain that is learned.
TEST(Run, LearnsAChain) {
  Call run = call("run", {"sequence_fields.yaml", "--train", "10", "--input", "event:A@0-0.06",
                          "--input", "event:B@0.16-0.22", "--input", "event:C@0.32-0.38",
                          "--recall", "event:A@0-0.06", "--json"});
  ASSERT_EQ(run.code, 0) << run.err;
  const json all = json::parse(run.out);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_GT(all[1]["active_s"], all[0]["active_s"]);
  EXPECT_GT(all[2]["active_s"], all[1]["active_s"]);
  EXPECT_EQ(all[2]["peaks"], 0) << "its activity does not end";

  run = call("run", {"bar_fields.yaml", "--input", "vision:STSg=PX@0-0.6"});
  EXPECT_EQ(run.code, 2);
  EXPECT_NE(run.err.find("'PX' is no site of STSg"), std::string::npos) << run.err;
  run = call("run", {"nowhere.yaml"});
  EXPECT_EQ(run.code, 2);
  EXPECT_NE(run.err.find("nowhere.yaml"), std::string::npos) << run.err;
}

TEST(Explain, SaysWhatCarriedEachFieldOverItsThreshold) {
  const Call call = explain({kLogs + "cognition.mcap", "--json"});
  ASSERT_EQ(call.code, 0) << call.err;
  const json all = json::parse(call.out);
  ASSERT_EQ(all.size(), 1U);
  const json& why = all[0];
  EXPECT_EQ(why["decision"]["grip"], "GRIP_PRECISION");
  EXPECT_GT(why["confidence"], 0.2);
  EXPECT_GT(why["deciding_s"], 0.5);  // of the window alone
  std::map<std::string, json> fields;
  double before_s = 0.0;
  for (const json& f : why["fields"]) {
    EXPECT_GE(f["onset_s"], before_s) << "not in the order of time";
    before_s = f["onset_s"];
    fields[f["field"]] = f;
  }
  EXPECT_EQ(fields.at("PF")["site"], "PG-AT");
  EXPECT_EQ(fields.at("PFC")["influences"][0]["from"], "vision");
  EXPECT_EQ(fields.at("F5g")["influences"][0]["from"], "PF->F5g");
  EXPECT_LT(fields.at("PFC")["onset_s"], fields.at("F5g")["onset_s"]);
  for (const auto& [name, f] : fields) {
    double sum = 0.0;
    for (const json& i : f["influences"]) sum += i["input"].get<double>();
    EXPECT_GT(sum, 2.0) << name;  // a field at rest ignites above 2.2; preshape lasts a little
  }
}

TEST(Explain, DrawsTheActivityOverTime) {
  const fs::path png = fs::temp_directory_path() / fmt::format("mimesis-why-{}.png", ::getpid());
  const Call call = explain({kLogs + "cognition.mcap", "--plot", png.string()});
  EXPECT_EQ(call.code, 0) << call.err;
  EXPECT_NE(
      call.out.find("seen precision, above, high, light; decided precision, above, high after"),
      std::string::npos)
      << call.out;
  EXPECT_GT(fs::file_size(png), 5000U);
  fs::remove(png);
}

TEST(Explain, NamesWhatIsMissing) {
  EXPECT_EQ(explain({"/nowhere.mcap"}).code, 3);
  const Call none = explain({kLogs + "planner.mcap"});
  EXPECT_EQ(none.code, 3);
  EXPECT_NE(none.err.find("holds no decision of cognition"), std::string::npos) << none.err;
  EXPECT_EQ(explain({kLogs + "cognition.mcap", "--number", "7"}).code, 2);
}

}  // namespace
}  // namespace mimesis::tool
