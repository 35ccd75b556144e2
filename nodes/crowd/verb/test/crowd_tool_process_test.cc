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
