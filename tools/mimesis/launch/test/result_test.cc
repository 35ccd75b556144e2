#include "tools/mimesis/launch/result.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/testing/refusal.h"
#include "proto/cognition.pb.h"
#include "proto/motion.pb.h"
#include "proto/planner.pb.h"
#include "proto/world.pb.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/launch/test/graph_text.h"

namespace mimesis::launch {
namespace {
using namespace std::chrono_literals;

class Result : public ::testing::Test {
 protected:
  static ResultSpec spec(const std::string& fields) {
    return *read_text(
                "version: 1\nnodes: {world: {exec: x}}\nresult:\n  until: world/outcome\n"
                "  success: world/outcome.placed\n  fields: " +
                fields + "\n")
                .result;
  }
  static v1::Decision decision(v1::Grip grip) {
    v1::Decision m;
    m.set_grip(grip);
    return m;
  }
  static v1::TrialOutcome outcome(bool placed) {
    v1::TrialOutcome m;
    m.set_placed(placed);
    m.set_placement_error_m(0.0031459);
    m.set_collisions(2);
    return m;
  }
};

TEST_F(Result, CountsTheNewestBeforeTheEndWhateverTheOrderOfArrival) {
  ResultCollector c(spec("{grip: cognition/decision.grip, placed: world/outcome.placed}"));
  c.add("cognition/decision", 1s, decision(v1::GRIP_FULL));
  c.add("cognition/decision", 3s, decision(v1::GRIP_UNSPECIFIED));  // overtakes the outcome
  c.add("world/outcome", 2s, outcome(true));
  EXPECT_TRUE(c.complete());
  EXPECT_EQ(c.line("").dump(), R"({"grip":"full","placed":true})");

  ResultCollector d(spec("{grip: cognition/decision.grip, placed: world/outcome.placed}"));
  d.add("world/outcome", 2s, outcome(true));
  EXPECT_FALSE(d.complete());
  d.add("cognition/decision", 1s, decision(v1::GRIP_FULL));
  EXPECT_FALSE(d.complete());  // one of 2 s may still come
  d.add("cognition/decision", 2s, decision(v1::GRIP_PRECISION));
  d.add("cognition/decision", 3s, decision(v1::GRIP_FULL));
  EXPECT_TRUE(d.complete());
  EXPECT_EQ(d.line("")["grip"], "precision");
}

TEST_F(Result, OnlyTheFirstEndCounts) {
  ResultCollector c(spec("{placed: world/outcome.placed}"));
  c.add("world/outcome", 2s, outcome(false));
  c.add("world/outcome", 3s, outcome(true));
  EXPECT_FALSE(c.succeeded());
}

TEST_F(Result, FailureMakesSuccessFalseAndSaysWhy) {
  ResultCollector c(spec("{placed: world/outcome.placed, n: world/outcome.collisions}"));
  EXPECT_EQ(c.line("node 'arm' died").dump(),
            R"({"placed":false,"n":null,"reason":"node 'arm' died"})");
  EXPECT_FALSE(c.succeeded());
  c.add("world/outcome", 2s, outcome(true));
  EXPECT_EQ(c.line("late failure")["placed"], false);
}

TEST_F(Result, ScalesAndRounds) {
  ResultCollector c(
      spec("{e_mm: {from: world/outcome.placement_error_m, scale: 1000, digits: 1}}"));
  c.add("world/outcome", 2s, outcome(true));
  EXPECT_EQ(c.line("").dump(), R"({"e_mm":3.1,"success":true})");
}

TEST_F(Result, AValueThatMeansNoneIsNull) {
  ResultCollector c(spec("{e_mm: {from: world/outcome.placement_error_m, none: -1, scale: 1000}}"));
  v1::TrialOutcome failed = outcome(false);
  failed.set_placement_error_m(-1.0);
  c.add("world/outcome", 2s, failed);
  EXPECT_EQ(c.line("").dump(), R"({"e_mm":null,"success":false})");
}

TEST_F(Result, UnknownFieldIsAMistakeOfTheFile) {
  ResultCollector c(spec("{e: world/outcome.colisions}"));
  const std::string refused = testing::refusal([&] { c.add("world/outcome", 2s, outcome(true)); });
  EXPECT_NE(refused.find("g.yaml:6:15: mimesis.v1.TrialOutcome has no field 'colisions', "
                         "did you mean 'collisions'?"),
            std::string::npos)
      << refused;
}

TEST(MessageJson, HasEveryFieldByName) {
  v1::TaskStatus m;
  m.mutable_header()->set_stamp_ns(std::uint64_t{1} << 60);
  m.set_state(v1::TASK_STATE_DONE);
  m.set_path_length_rad(0.5);
  const auto json = tool::to_json(m);
  EXPECT_EQ(json["header"]["stamp_ns"], std::uint64_t{1} << 60);
  EXPECT_EQ(json["state"], "TASK_STATE_DONE");
  EXPECT_EQ(json["plan_succeeded"], false);
  EXPECT_EQ(tool::field_json(m, "state", true), "done");
  EXPECT_EQ(tool::field_json(m, "phase", true), nullptr);
  EXPECT_EQ(tool::field_json(m, "header.seq"), 0);
  EXPECT_THROW(tool::field_json(m, "state.x"), ConfigError);
}

TEST(MessageJson, AnOptionalFieldThatIsNotThereIsNull) {
  v1::GaitCommand m;
  EXPECT_EQ(tool::field_json(m, "phase_rad"), nullptr);
  m.set_phase_rad(0.0);
  EXPECT_EQ(tool::field_json(m, "phase_rad"), 0.0);
  EXPECT_EQ(tool::field_json(m, "character"), 0);
}

TEST(MessageJson, ReachesElements) {
  v1::Trajectory m;
  m.add_points()->add_position_rad(0.25);
  EXPECT_EQ(tool::field_json(m, "points.0.position_rad.0"), 0.25);
  EXPECT_EQ(tool::field_json(m, "points.1.position_rad.0"), nullptr);
  EXPECT_EQ(tool::field_json(m, "points").size(), 1U);
  EXPECT_THROW(tool::field_json(m, "points.x"), ConfigError);
}

foxglove::Log line(const std::string& node, const std::string& text, foxglove::Log::Level level) {
  foxglove::Log log;
  log.set_name(node);
  log.set_message(text);
  log.set_level(level);
  return log;
}

TEST(Causes, TheFirstComplaintStandsBeforeWhatFollowed) {
  using std::chrono::milliseconds;
  Causes causes;
  EXPECT_EQ(causes.before("late", false), "late");
  causes.add(line("a", "fine", foxglove::Log::INFO), milliseconds(100));
  causes.add(line("b", "later", foxglove::Log::WARNING), milliseconds(5000));
  causes.add(line("c", "no feedback", foxglove::Log::WARNING), milliseconds(4210));
  EXPECT_EQ(causes.before("late", false), "c: no feedback (at 4.21 s); late");
  EXPECT_EQ(causes.before("it has no feedback", false), "it has no feedback");
  EXPECT_EQ(causes.before("feedback", false), "feedback");
  causes.add(line("d", "broken", foxglove::Log::ERROR), milliseconds(6000));
  causes.add(line("e", "earlier, but not grave", foxglove::Log::WARNING), milliseconds(1));
  EXPECT_EQ(causes.before("late", false), "d: broken (at 6.00 s); late");
}

}  // namespace
}  // namespace mimesis::launch
