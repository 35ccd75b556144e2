// One coordinator between messages.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <vector>

#include "common/error.h"
#include "common/testing/refusal.h"
#include "nodes/crowd/scenario_file/scenario_file.h"
#include "nodes/crowd/test/alone.h"

namespace mimesis::crowd {
namespace {

using namespace testing;

TEST(CrowdNode, SaysWhoIsWho) {
  Alone crowd(kGuests);
  crowd.step();
  const auto info = crowd.bus.take<v1::CrowdInfo>("info");
  ASSERT_TRUE(info.has_value());
  EXPECT_EQ(info->scenario(), "guests");
  EXPECT_EQ(info->agents(), 4u);
  ASSERT_EQ(info->external_ids_size(), 2);
  EXPECT_EQ(info->external_ids(0), kRobot);
  EXPECT_EQ(info->external_names(1), "synthesizer/1");
  EXPECT_EQ(info->gaits(1), "brisk");
}

TEST(CrowdNode, PublishesAllStatesEveryStep) {
  Alone crowd(kFormation);
  crowd.until(11.0);
  EXPECT_EQ(crowd.states.id_size(), 16);
  EXPECT_EQ(crowd.states.position_in_world_m_size(), 32);
}

/// A node that was stopped makes the steps that it missed, half a second of them at once, and says
/// how far it is behind; its run is then the same as one that never paused.
TEST(CrowdNode, RunTimeIsTheClocks) {
  for (const double stopped_s : {0.1, 0.4, 3.0}) {
    Alone crowd(kFormation), never(kFormation);
    crowd.until(12.0);
    crowd.now += runtime::from_seconds(stopped_s);
    crowd.step();
    const bool far = stopped_s > 0.5;
    EXPECT_EQ(crowd.status.reason().find("behind the clock") != std::string::npos, far)
        << crowd.status.reason();
    crowd.until(16.0);
    never.until(16.0);
    EXPECT_EQ(crowd.states.time_s(), never.states.time_s());
    EXPECT_NEAR(crowd.states.time_s(), 6.0, 1e-9);
    for (int i = 0; i < 32; ++i) {
      EXPECT_EQ(crowd.states.position_in_world_m(i), never.states.position_in_world_m(i));
    }
    EXPECT_EQ(crowd.status.reason(), "");
  }
}

/// The first certificate of the node is that of `mimesis crowd certify`.
TEST(CrowdNode, CertifiesAsTheToolDoes) {
  int certified = 0;
  for (unsigned seed = 0; seed < 150; ++seed) {
    std::mt19937 random(seed);
    const auto in = [&](double a, double b) {
      return std::uniform_real_distribution<double>(a, b)(random);
    };
    const char* graphs[] = {"chain", "ring", "star", "all_to_all"};
    const char* kinds[] = {"keep", "lane", "consensus", "coupled"};
    const auto graph = [&] { return graphs[static_cast<int>(in(0.0, 3.999))]; };
    const std::string kind = kinds[static_cast<int>(in(0.0, 3.999))];
    std::string text = fmt::format(
        "name: drawn\nuntil_s: 9\ngroups:\n  - name: g\n    count: {}\n    gait: walk\n"
        "    spread_rad_s: {}\n    formation: {{shape: grid}}\n    rules:\n",
        static_cast<int>(in(2.0, 20.0)), in(0.0, 1.0) < 0.7 ? 0.0 : in(0.0, 0.4));
    if (in(0.0, 1.0) < 0.7)
      text += fmt::format("      phase: {{graph: {}, gain_1_s: {}}}\n", graph(), in(-0.01, 0.5));
    if (in(0.0, 1.0) < 0.6)
      text += fmt::format("      length: {{graph: {}, gain_1_m: {}}}\n", graph(), in(0.0, 0.3));
    if (in(0.0, 1.0) < 0.2)
      text +=
          fmt::format("      frequency: {{graph: {}, gain_rad_m_s: {}}}\n", graph(), in(0.0, 0.3));
    text += fmt::format("      heading: {{kind: {}, gain: {}, graph: {}}}\n", kind, in(0.1, 1.0),
                        kind == "coupled" ? graph() : "none");
    const ScenarioFile file(text);
    std::vector<Stage> stages;
    std::unique_ptr<Alone> crowd;
    try {
      stages = certify(read_scenario(file.path(), {}));
      crowd = std::make_unique<Alone>(text);
    } catch (const ConfigError&) {
      continue;  // against theory, or too fast for the engine's steps
    }
    ++certified;
    for (int k = 0; k < 60 && crowd->certificate.guarantees_size() == 0; ++k) crowd->step();
    const Certificate& c = stages.at(0).certificate;
    const std::map<v1::CrowdRule, const RuleCertificate*> rules = {
        {v1::CROWD_RULE_FREQUENCY, &c.frequency},
        {v1::CROWD_RULE_LENGTH, &c.length},
        {v1::CROWD_RULE_PHASE, &c.phase},
        {v1::CROWD_RULE_TRACKING, &c.tracking},
        {v1::CROWD_RULE_HEADING, &c.heading}};
    for (const v1::CrowdGuarantee& said : crowd->certificate.guarantees()) {
      const RuleCertificate& tool = *rules.at(said.rule());
      EXPECT_EQ(said.guaranteed(), tool.guarantee == Guarantee::contracting) << text;
      EXPECT_EQ(said.guaranteed_rate_1_s(), tool.guaranteed_1_s) << text;
      EXPECT_EQ(said.why(), tool.why);
    }
  }
  EXPECT_GT(certified, 75);
}

TEST(CrowdNode, CertifiesOnceASecond) {
  Alone crowd(kFormation);
  crowd.until(13.0);
  ASSERT_EQ(crowd.certificate.guarantees_size(), 3);
  EXPECT_EQ(crowd.certificate.number(), 1u);
  EXPECT_EQ(crowd.certificate.voided(), "");
  for (const v1::CrowdGuarantee& g : crowd.certificate.guarantees()) {
    EXPECT_EQ(g.agents(), 16u);
    EXPECT_EQ(g.guests(), 0u);
    EXPECT_EQ(g.in_the_end(), g.rule() != v1::CROWD_RULE_PHASE);
    EXPECT_FALSE(g.why().empty());
    if (g.rule() == v1::CROWD_RULE_PHASE) {
      EXPECT_TRUE(g.guaranteed());
      EXPECT_NEAR(g.expected_rate_1_s(), 16 * 0.06, 1e-9);
    }
  }
  crowd.until(30.0);
  for (const v1::CrowdGuarantee& g : crowd.certificate.guarantees()) {
    if (g.rule() == v1::CROWD_RULE_PHASE) {
      EXPECT_NEAR(g.measured_rate_1_s(), 0.96, 0.02);
    }
  }
}

TEST(CrowdNode, TellsOnceHowTheRunEnded) {
  Alone crowd(kFormation, 50.0);
  crowd.until(61.0);
  const auto outcome = crowd.bus.take<v1::CrowdOutcome>("outcome");
  ASSERT_TRUE(outcome.has_value());
  EXPECT_TRUE(outcome->success()) << outcome->reason();
  EXPECT_EQ(outcome->agents(), 16u);
  EXPECT_GT(outcome->formation_s(), 1.0);
  EXPECT_LT(outcome->formation_s(), 50.0);
  EXPECT_LT(outcome->place_error_m(), 0.01);
  EXPECT_GT(outcome->measured_rate_1_s(), 0.99 * outcome->guaranteed_rate_1_s());
  EXPECT_GT(outcome->least_distance_m(), 0.3);
  EXPECT_FALSE(crowd.bus.take<v1::CrowdOutcome>("outcome").has_value());
}

TEST(CrowdNode, ARunThatIsTooShortIsAFailureWithAReason) {
  Alone crowd(kFormation, 2.0);
  crowd.until(13.0);
  const auto outcome = crowd.bus.take<v1::CrowdOutcome>("outcome");
  ASSERT_TRUE(outcome.has_value());
  EXPECT_FALSE(outcome->success());
  EXPECT_NE(outcome->reason().find("not in order: square: phases"), std::string::npos)
      << outcome->reason();
}

TEST(CrowdNode, PaintsTheScene) {
  Alone crowd(kFormation);
  crowd.until(11.0);
  int pictures = 0;
  foxglove::SceneUpdate last;
  while (const auto picture = crowd.bus.take<foxglove::SceneUpdate>("scene")) {
    ++pictures;
    last = *picture;
  }
  EXPECT_NEAR(pictures, 10, 1);
  ASSERT_EQ(last.entities_size(), 2);
  EXPECT_EQ(last.entities(1).id(), "group/square");
  EXPECT_EQ(last.entities(1).lines(0).points_size(), 32);
}

TEST(CrowdNode, RefusesAScenarioAgainstTheory) {
  const ScenarioFile file(kFormation);
  CrowdParams params = file.params();
  Loopback bus;
  params.set = {"groups.0.rules.phase.gain_1_s=-1"};
  const std::string refused = mimesis::testing::refusal([&] { CrowdNode node(params, bus); });
  EXPECT_NE(refused.find("phase.gain_1_s"), std::string::npos) << refused;
}

}  // namespace
}  // namespace mimesis::crowd
