// `mimesis crowd`: the real program on the scenarios of launch/crowd and on files made here.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::tool {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

const std::string kScenarios = std::string(MIMESIS_SOURCE_DIR) + "/launch/crowd";

class Crowd : public testing::VerbTest {
 protected:
  int run(std::vector<std::string> words) {
    words.insert(words.begin(), "crowd");
    return call(words);
  }
  std::string written(const std::string& text) const {
    std::ofstream(folder_ / "made.yaml") << text;
    return (folder_ / "made.yaml").string();
  }

  testing::TemporaryFolder folder_;
};

const std::string kRing = R"(gaits:
  - {name: walk, eigenfrequency_rad_s: 5, mean_m_rad: 0.2, sine_m_rad: [0, 0.0666667]}
groups:
  - name: crowd
    count: 18
    gait: walk
    formation: {shape: line}
    rules:
      frequency: {graph: ring, gain_rad_m_s: 0.5}
)";

TEST_F(Crowd, CertifiesWhatARingAllows) {  // beta = .5: rings of up to 18 (reference/crowd.md)
  const std::string file = written(kRing);
  ASSERT_EQ(run({"certify", file, "--json"}), 0) << errors_;
  json report = json::parse(output_);
  EXPECT_EQ(report["file"], file);
  EXPECT_TRUE(report["holds"]);
  json rule = report["stages"][0]["rules"][0];
  EXPECT_EQ(rule["guarantee"], "contracting");
  EXPECT_EQ(rule["largest_agents"], 18);
  EXPECT_LT(rule["theorem6"], 1.0);
  EXPECT_EQ(rule["change"].size(), 0U);
  EXPECT_EQ(report["largest_agents"][0]["theorem6"]["chain"], 9);
  EXPECT_EQ(report["largest_agents"][0]["theorem6"]["star"], 33);
  EXPECT_TRUE(report["largest_agents"][0]["theorem6"]["all_to_all"].is_null());
  EXPECT_EQ(report["largest_agents"][0]["weak"]["ring"], 5);

  ASSERT_EQ(run({"certify", file, "--set", "groups.0.count=19", "--json"}), 0) << errors_;
  report = json::parse(output_);
  rule = report["stages"][0]["rules"][0];
  EXPECT_GT(rule["theorem6"], 1.0);
  EXPECT_GT(rule["overshoot"], 1.0);
  EXPECT_NE(rule["change"][0].get<std::string>().find("at most N = 18"), std::string::npos);
}

TEST_F(Crowd, SaysInWordsWhatToChange) {
  ASSERT_EQ(run({"certify", written(kRing), "--set", "groups.0.count=19"}), 0) << errors_;
  EXPECT_NE(output_.find("I frequency: change: at most N = 18"), std::string::npos) << output_;
  EXPECT_NE(output_.find("every rule in force is guaranteed"), std::string::npos);
}

TEST_F(Crowd, FailsWhereNothingIsGuaranteed) {
  EXPECT_EQ(run({"certify", written(kRing), "--set", "groups.0.rules.frequency.low_pass_rad_s=0.05",
                 "--json"}),
            1);
  EXPECT_FALSE(json::parse(output_)["holds"]);
}

TEST_F(Crowd, RefusesWithPlaceAndTheory) {
  std::string text = kRing;
  text.replace(text.find("gain_rad_m_s: 0.5"), 17, "gain_rad_m_s: -0.5");
  EXPECT_EQ(run({"certify", written(text)}), 2);
  EXPECT_NE(errors_.find("made.yaml:9:46: groups.0.rules.frequency.gain_rad_m_s: m_d = -0.5 < 0"),
            std::string::npos)
      << errors_;
  EXPECT_TRUE(output_.empty());
  EXPECT_EQ(run({"certify", "no_such_scenario"}), 2);
  EXPECT_NE(errors_.find("there is no 'no_such_scenario', expected characters, circle"),
            std::string::npos)
      << errors_;
}

TEST_F(Crowd, EveryScenarioIsGuaranteed) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(kScenarios)) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string name = entry.path().stem().string();
    EXPECT_EQ(run({"certify", name, "--json"}), 0) << name << ": " << errors_ << output_;
    EXPECT_EQ(json::parse(output_)["name"], name);
    ++count;
  }
  EXPECT_GE(count, 6);
}

/// Every scenario of ours, with gaits that sway as those of our model do.
TEST_F(Crowd, EveryScenarioIsGuaranteedWithTheSwayOfAMeasuredGait) {
  ASSERT_EQ(run({"gait", "walk.motion.json", "--style", "walk", "--json"}), 0) << errors_;
  const json gait = json::parse(output_)["gaits"][0];
  for (const auto& entry : fs::directory_iterator(kScenarios)) {
    if (entry.path().extension() != ".yaml") continue;
    std::vector<std::string> words{"certify", entry.path().string(), "--json"};
    std::ifstream text(entry.path());
    int gaits = 0;
    for (std::string line; std::getline(text, line);) {
      gaits += line.find("eigenfrequency_rad_s") != std::string::npos ? 1 : 0;
    }
    ASSERT_GT(gaits, 0);
    for (int i = 0; i < gaits; ++i) {
      for (const char* key : {"sway_cosine", "sway_sine"}) {
        words.insert(words.end(),
                     {"--set", "gaits." + std::to_string(i) + "." + key + "=" + gait[key].dump()});
      }
    }
    EXPECT_EQ(run(words), 0) << entry.path() << ": " << errors_ << output_;
  }
}

const std::string kUneven = R"(gaits: [{name: walk, eigenfrequency_rad_s: 5.5, mean_m_rad: 0.2}]
groups:
  - name: g
    count: 8
    gait: walk
    spread_rad_s: 0.2
    start: {arrangement: grid, columns: 2}
    rules:
      phase: {graph: all_to_all, gain_1_s: 0.4, leader_gain_1_s: 0.03}
)";

/// The others agree with each other, and slip past a leader whose pace is not theirs; a gain that
/// holds them says how far they lock beside it.
TEST_F(Crowd, SaysWhatALeaderOfAnotherPaceHolds) {
  const auto leader = [&] { return json::parse(output_)["stages"][0]["rules"][1]; };
  EXPECT_EQ(run({"certify", written(kUneven), "--json"}), 1);
  EXPECT_EQ(leader()["rule"], "III leader");
  EXPECT_EQ(leader()["guarantee"], "none");
  std::string held = kUneven;
  held.replace(held.find("leader_gain_1_s: 0.03"), 21, "leader_gain_1_s: 2.0");
  EXPECT_EQ(run({"certify", written(held), "--json"}), 0) << output_;
  const double root = 0.2087;  // e cos e = 0.4/2.0
  EXPECT_GE(leader()["remains"].get<double>(), root);
  EXPECT_LE(leader()["remains"].get<double>(), 1.15 * root);
  held.replace(held.find("leader_gain_1_s: 2.0"), 20, "leader_gain_1_s: 0.0");
  held.replace(held.find("    rules:"), 10, "    beat_gain_1_s: 1.0\n    rules:");
  for (const auto& [rate, code] : {std::pair("5.4", 0), std::pair("5.9", 1)}) {
    EXPECT_EQ(run({"certify", written(held + "beat: {rate_rad_s: " + rate + "}\n"), "--json"}),
              code)
        << output_;
  }
}

/// Headings of an earlier stage are kept where they point; walls hold up who avoids them.
TEST_F(Crowd, SaysWhereDistancesAreNotKept) {
  const std::string turned = R"(gaits: [{name: walk, eigenfrequency_rad_s: 5.5, mean_m_rad: 0.2}]
groups:
  - name: g
    count: 5
    gait: walk
    start: {arrangement: row, across_m: 3}
    formation: {shape: row, across_m: 3}
    goals: {aim: places, position_m: [-50, 0]}
    rules: {heading: {kind: goal, gain: 1}}
schedule:
  - {at_s: 9, group: g, rules: {length: {graph: all_to_all, gain_1_m: 0.1}}}
)";
  EXPECT_EQ(run({"certify", written(turned), "--json"}), 1);
  EXPECT_EQ(json::parse(output_)["stages"][1]["rules"][0]["guarantee"], "none");
  const std::string walled = R"(gaits: [{name: walk, eigenfrequency_rad_s: 5.5, mean_m_rad: 0.2}]
groups:
  - name: g
    count: 5
    gait: walk
    formation: {shape: row}
    rules:
      length: {graph: all_to_all, gain_1_m: 0.1}
      phase: {graph: all_to_all, gain_1_s: 0.1}
      heading: {kind: lane, gain: 0.6, ahead_m: 2, avoid: true}
walls: [{from_x_m: 9, from_y_m: 0, to_x_m: 9, to_y_m: 6}]
)";
  EXPECT_EQ(run({"certify", written(walled)}), 0);
  EXPECT_NE(output_.find("nothing is said while others, walls or pillars are near"),
            std::string::npos);
  EXPECT_EQ(run({"certify", written(walled), "--json"}), 0);
  for (const json& rule : json::parse(output_)["stages"][0]["rules"]) {
    EXPECT_EQ(rule["while_free"], rule["rule"] != "III phase");
  }
}

TEST_F(Crowd, GaitOfAModelIsAScenariosGait) {
  ASSERT_EQ(run({"gait", "walk.motion.json"}), 0) << errors_;
  const std::string gaits = output_;
  ASSERT_EQ(run({"gait", "walk.motion.json", "--json"}), 0) << errors_;
  const json report = json::parse(output_);
  ASSERT_GT(report["gaits"].size(), 0U);
  const json g = report["gaits"][0];
  EXPECT_GT(g["least_m_rad"], 0.0);
  // a walking man: about a metre a second
  const double speed = g["mean_m_rad"].get<double>() * g["eigenfrequency_rad_s"].get<double>();
  EXPECT_GT(speed, 0.5);
  EXPECT_LT(speed, 2.0);
  // steps left and right: the second harmonic
  const double second = std::hypot(g["cosine_m_rad"][1].get<double>(), g["sine_m_rad"][1]);
  EXPECT_GT(second, g["rms_m_rad"]);

  std::string text = kRing;
  text.replace(0, text.find("groups:"), gaits);
  text.replace(text.find("gait: walk"), 10, "gait: " + g["name"].get<std::string>());
  ASSERT_EQ(run({"certify", written(text), "--json"}), 0) << errors_;
  EXPECT_NEAR(json::parse(output_)["largest_agents"][0]["beta"],
              g["least_m_rad"].get<double>() / g["most_m_rad"].get<double>(), 1e-3);

  EXPECT_EQ(run({"gait", "walk.motion.json", "--style", "moonwalk"}), 2);
  EXPECT_NE(errors_.find("the model has: "), std::string::npos) << errors_;
}

}  // namespace
}  // namespace mimesis::tool
