#include "nodes/crowd/scenario_file/scenario_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/error.h"
#include "common/runtime/param_source.h"
#include "common/testing/refusal.h"

namespace mimesis::crowd {
namespace {

using ::testing::TempDir;

constexpr const char* kSoldiers = R"(name: soldiers
gaits:
  - {name: march, eigenfrequency_rad_s: 5.0, mean_m_rad: 0.2, cosine_m_rad: [0.0, 0.05]}
groups:
  - name: platoon
    count: 9
    gait: march
    start: {arrangement: grid, columns: 3, spacing_m: 1.5, phase: random}
    formation: {shape: grid, columns: 3}
    rules:
      frequency: {graph: all_to_all, gain_rad_m_s: 0.4, saturation_m: 2}
      length: {graph: ring, gain_1_m: 0.1, limit: 0.4}
      phase: {edges: [{i: 0, j: 1}, {i: 1, j: 2, weight: 2}, {i: 2, j: 3}, {i: 3, j: 4}, {i: 4, j: 5},
        {i: 5, j: 6}, {i: 6, j: 7}, {i: 7, j: 8}], gain_1_s: 1.5}
      heading: {kind: lane, gain: 0.7}
schedule:
  - {at_s: 20, group: platoon, rules: {phase: {graph: star, gain_1_s: 2}}}
)";

std::string written(const std::string& text) {
  const std::string file = TempDir() + "crowd_scenario_" + std::to_string(::getpid()) + ".yaml";
  std::ofstream(file) << text;
  return file;
}

/// The first `from` of kSoldiers replaced.
std::string soldiers_with(const std::string& from, const std::string& to) {
  std::string text = kSoldiers;
  text.replace(text.find(from), from.size(), to);
  return text;
}

std::string refusal(const std::string& text, const std::vector<std::string>& sets = {}) {
  const std::string file = written(text);
  try {
    (void)read_scenario(file, sets);
  } catch (const ConfigError& e) {
    std::string what = e.what();
    for (std::size_t at; (at = what.find(file)) != std::string::npos;) {
      what.replace(at, file.size(), "F");
    }
    return what;
  }
  return {};
}

TEST(ScenarioFile, BecomesTheStruct) {
  const Scenario s = read_scenario(written(kSoldiers));
  EXPECT_EQ(s.name, "soldiers");
  ASSERT_EQ(s.groups.size(), 1U);
  const Group& group = s.groups[0];
  EXPECT_EQ(group.count, 9);
  EXPECT_EQ(group.start.arrangement, Arrangement::grid);
  EXPECT_EQ(group.formation.shape, Shape::grid);
  EXPECT_EQ(group.rules.frequency.graph.topology, Topology::all_to_all);
  EXPECT_DOUBLE_EQ(group.rules.frequency.gain_rad_m_s, 0.4);
  EXPECT_DOUBLE_EQ(group.rules.frequency.saturation_m, 2.0);
  EXPECT_EQ(group.rules.length.graph.topology, Topology::ring);
  EXPECT_DOUBLE_EQ(group.rules.length.limit, 0.4);
  EXPECT_EQ(group.rules.phase.graph.topology, Topology::weighted);
  ASSERT_EQ(group.rules.phase.graph.edges.size(), 8U);
  EXPECT_DOUBLE_EQ(group.rules.phase.graph.edges[1].weight, 2.0);
  EXPECT_EQ(group.rules.heading.kind, HeadingKind::lane);
  ASSERT_EQ(s.schedule.size(), 1U);
  EXPECT_EQ(s.schedule[0].rules.phase.graph.topology, Topology::star);
  ASSERT_NE(s.gait("march"), nullptr);
  EXPECT_NEAR(s.gait("march")->speed().least(), 0.15, 1e-12);
}

TEST(ScenarioFile, SetReplacesAValue) {
  const Scenario s = read_scenario(written(kSoldiers), {"groups.0.rules.frequency.gain_rad_m_s=2"});
  EXPECT_DOUBLE_EQ(s.groups[0].rules.frequency.gain_rad_m_s, 2.0);
  EXPECT_TRUE(refusal(kSoldiers, {"groups.0.count=0"}).starts_with("--set: groups.0.count: N = 0"));
}

TEST(ScenarioFile, AnUnknownNameIsAnsweredWithThoseThereAre) {
  EXPECT_TRUE(find_scenario("dance").ends_with("launch/crowd/dance.yaml"));
  EXPECT_TRUE(find_scenario("crowd/dance.yaml").ends_with("launch/crowd/dance.yaml"));
  const std::string what = mimesis::testing::refusal([&] { (void)find_scenario("danse"); });
  EXPECT_NE(what.find("there is no 'danse'"), std::string::npos) << what;
  EXPECT_NE(what.find("characters, "), std::string::npos) << what;
  EXPECT_NE(what.find("dance, fleet, formation, "), std::string::npos) << what;
  EXPECT_EQ(what.find('/'), std::string::npos) << "names, no folders: " << what;
}

TEST(ScenarioFile, MistakesOfWritingNameThePlace) {
  EXPECT_EQ(refusal(soldiers_with("count: 9", "cuont: 9")),
            "F:6:5: groups.0.cuont: unknown parameter, did you mean 'count'?");
  EXPECT_NE(refusal(soldiers_with("graph: ring", "graph: rings")).find("F:12:23: "),
            std::string::npos);
  EXPECT_NE(refusal(soldiers_with("gain_1_m: 0.1", "gain_1_m: .nan")).find("expected a number"),
            std::string::npos);
}

struct Refused {
  const char* from;
  const char* to;
  const char* place;
  const char* why;
};

void PrintTo(const Refused& r, std::ostream* out) { *out << r.to << " for " << r.from; }

class ScenarioRefused : public ::testing::TestWithParam<Refused> {};

TEST_P(ScenarioRefused, InTheTermsOfTheory) {
  const Refused& r = GetParam();
  const std::string what = refusal(soldiers_with(r.from, r.to));
  EXPECT_TRUE(what.starts_with(r.place)) << what;
  EXPECT_NE(what.find(r.why), std::string::npos) << what;
}

INSTANTIATE_TEST_SUITE_P(
    Faults, ScenarioRefused,
    ::testing::Values(
        Refused{"count: 9", "count: 0", "F:6:12: groups.0.count", "N = 0"},
        Refused{"count: 9", "count: 1", "F:11:18: groups.0.rules.frequency",
                "Laplacian of one agent is 0"},
        Refused{"gain_rad_m_s: 0.4", "gain_rad_m_s: -0.4",
                "F:11:52: groups.0.rules.frequency.gain_rad_m_s", "contraction needs m_d > 0"},
        Refused{"gain_1_m: 0.1", "gain_1_m: -0.1", "F:12:39: groups.0.rules.length.gain_1_m",
                "contraction needs m_z > 0"},
        Refused{"gain_1_s: 1.5", "gain_1_s: -1.5", "F:14:", "contraction needs k > 0"},
        Refused{"{i: 2, j: 3}, ", "", "F:13:", "algebraic connectivity lambda_2 is 0"},
        Refused{"weight: 2}", "weight: -2}", "F:13:", "must be finite and not negative"},
        Refused{"{i: 2, j: 3}", "{i: 2, j: 9}", "F:13:", "nodes are 0 to 8"},
        Refused{"phase: {edges", "phase: {graph: ring, edges", "F:13:", "one of graph and edges"},
        Refused{"graph: ring", "graph: none", "F:12:15: groups.0.rules.length", "would do nothing"},
        Refused{"cosine_m_rad: [0.0, 0.05]", "cosine_m_rad: [0.2]", "F:3:", "g > 0"},
        Refused{"formation: {shape: grid, columns: 3}", "formation: {}",
                "F:11:18: groups.0.rules.frequency", "has no formation"},
        Refused{"limit: 0.4", "limit: 1", "F:12:", "1 + mu > 0"},
        Refused{"group: platoon", "group: plato", "F:17:", "there are: platoon"},
        Refused{"shape: grid, columns: 3",
                "shape: distances, distances: [{i: 0, j: 1, ahead_m: 1}, {i: 1, j: 2, ahead_m: 1}, "
                "{i: 0, j: 2, ahead_m: 1.5}]",
                "F:9:", "inconsistent"},
        Refused{"shape: grid, columns: 3",
                "shape: distances, distances: [{i: 0, j: 1, ahead_m: 1}]",
                "F:9:", "agent 2 has none"}));

TEST(ScenarioFile, DumpIsAScenarioFileOfTheSameScenario) {
  const auto dump = [](Scenario s) {
    return runtime::dump_params([&](runtime::ParamVisitor& v) { visit(v, s); });
  };
  const std::string first = dump(read_scenario(written(kSoldiers)));
  const Scenario again = read_scenario(written(first));
  EXPECT_EQ(dump(again), first);
  EXPECT_EQ(again.groups.at(0).rules.phase.graph.edges.size(), 8U);
  EXPECT_EQ(again.schedule.at(0).rules.phase.graph.topology, Topology::star);
}

}  // namespace
}  // namespace mimesis::crowd
