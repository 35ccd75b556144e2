// Steps of a node in a log, and missing ones.
#include <random>

#include "tools/mimesis/log/replay_log.h"
#include "tools/mimesis/log/test/node_run_log.h"

namespace mimesis::tool {
namespace {

constexpr v1::StepKind kCreate = v1::STEP_KIND_CREATE, kStep = v1::STEP_KIND_STEP,
                       kStop = v1::STEP_KIND_STOP;
constexpr std::uint64_t kMs = 1'000'000;

/// Seqs of the inputs that every step took, as found in the log; 0: not there.
struct Reading {
  std::vector<std::vector<std::uint64_t>> inputs;
  std::string problem;
};

Reading read_all(NodeRunLog& log, std::size_t most_input_bytes = kMostInputBytes) {
  const NodeRun node_run = log.node_run();
  NodeRunReader reader(log.logs(), node_run, most_input_bytes);
  Reading found;
  while (const auto step = reader.next()) {
    EXPECT_EQ(step->number, found.inputs.size());
    auto& inputs = found.inputs.emplace_back();
    for (const v1::TakenMessage& taken : step->record.taken()) {
      if (taken.source() >= step->sources.size()) continue;
      const KeptMessage* m = reader.input(step->sources[taken.source()], taken.seq());
      inputs.push_back(m == nullptr ? 0 : m->seq);
      if (m == nullptr || m->payload.size() > 10) continue;
      EXPECT_EQ(m->payload, NodeRunLog::payload(m->seq));
    }
  }
  found.problem = reader.problem();
  return found;
}

using Inputs = std::vector<std::vector<std::uint64_t>>;

TEST(NodeRunReader, GivesEveryStepWhatItTook) {
  NodeRunLog log;
  log.input(1, 5).input(2, 6).steps(10, 0,
                                    {step_record(kCreate, 0), step_record(kStep, 8, {1, 2})});
  log.input(3, 15).steps(20, 2, {step_record(kStep, 18, {3}), step_record(kStop, 19)});
  const Reading found = read_all(log);
  EXPECT_EQ(found.inputs, (Inputs{{}, {1, 2}, {3}, {}}));
  EXPECT_EQ(found.problem, "");
}

TEST(NodeRunReader, FindsWhatReachedTheRecorderAfterTheStep) {
  NodeRunLog log;
  log.steps(10, 0, {step_record(kCreate, 0), step_record(kStep, 8, {1}, 1)});
  log.input(1, 10 + kSecond).output(1, 10 + 2 * kSecond);
  const NodeRun node_run = log.node_run();
  NodeRunReader reader(log.logs(), node_run);
  ASSERT_TRUE(reader.next());
  ASSERT_TRUE(reader.next());
  ASSERT_NE(reader.input(NodeRunLog::source(), 1), nullptr);
  const KeptMessage* output = reader.output("n/out", 1);
  ASSERT_NE(output, nullptr);
  EXPECT_EQ(output->payload, NodeRunLog::payload(1));
  std::string topic;
  EXPECT_EQ(reader.unclaimed(topic), nullptr);
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(reader.problem(), "");
}

TEST(NodeRunReader, WhatIsNotInTheLogIsNotInvented) {
  NodeRunLog log;
  log.input(1, 1).input(3, 3).output(1, 4).output(3, 6);
  log.steps(10, 0, {step_record(kCreate, 0), step_record(kStep, 8, {1, 2, 3}, 3)});
  log.output(4, 11 + kLate).input(2, 12 + kLate);  // no queue waits so long
  EXPECT_EQ(read_all(log).inputs, (Inputs{{}, {1, 0, 3}}));
  const NodeRun node_run = log.node_run();
  NodeRunReader reader(log.logs(), node_run);
  while (reader.next()) {
  }
  std::string topic;
  EXPECT_EQ(reader.unclaimed(topic)->seq, 1U);
  EXPECT_EQ(topic, "n/out");
  EXPECT_NE(reader.output("n/out", 1), nullptr);
  EXPECT_EQ(reader.output("n/out", 2), nullptr);
  EXPECT_EQ(reader.unclaimed(topic)->seq, 3U);
  EXPECT_NE(reader.output("n/out", 3), nullptr);
  EXPECT_EQ(reader.output("n/out", 1), nullptr) << "let go";
  EXPECT_EQ(reader.output("n/other", 1), nullptr);
  EXPECT_EQ(reader.output("n/out", 0), nullptr);
}

TEST(NodeRunReader, ALatchedRepeatIsTheSameMessage) {
  NodeRunLog log("latest");
  log.input(1, 1).steps(10, 0, {step_record(kCreate, 0), step_record(kStep, 8, {1})});
  log.input(1, 20).input(2, 21).input(1, 22).output(1, 23).output(1, 24);
  log.steps(30, 2, {step_record(kStep, 28, {2}, 1)});
  EXPECT_EQ(read_all(log).inputs, (Inputs{{}, {1}, {2}}));
  const NodeRun node_run = log.node_run();
  NodeRunReader reader(log.logs(), node_run);
  while (reader.next()) {
  }
  EXPECT_NE(reader.output("n/out", 1), nullptr);
  std::string topic;
  EXPECT_EQ(reader.unclaimed(topic), nullptr);
}

TEST(NodeRunReader, TheSameNumberOfAnotherStartIsAnotherMessage) {
  NodeRunLog log;
  log.input(1, 1, 99).steps(10, 0, {step_record(kCreate, 0), step_record(kStep, 8, {1})});
  EXPECT_EQ(read_all(log).inputs, (Inputs{{}, {0}}));
}

TEST(NodeRunReader, GapsAreNamed) {
  const auto problem_of = [](const std::vector<v1::StepLog>& step_logs) {
    NodeRunLog log;
    for (std::size_t i = 0; i < step_logs.size(); ++i) log.steps(10 + i, step_logs[i]);
    return read_all(log).problem;
  };
  const auto create = NodeRunLog::step_log(0, {step_record(kCreate, 0)});
  const auto at = [](std::uint64_t first) {
    return NodeRunLog::step_log(first, {step_record(kStep, 1), step_record(kStep, 2)});
  };
  EXPECT_EQ(problem_of({create, at(1), at(3)}), "");  // killed: no stop
  EXPECT_EQ(problem_of({create, at(2)}), "steps 1 to 1 are not in the log: lost");
  EXPECT_EQ(problem_of({create, at(1), at(4)}), "steps 3 to 3 are not in the log: lost");
  EXPECT_EQ(problem_of({create, at(1), at(1)}), "step 1 is in the log twice");
  EXPECT_EQ(problem_of({create, at(1), at(2)}), "step 2 is in the log twice");
  EXPECT_EQ(problem_of({at(4), at(6)}),
            "steps 0 to 3 are not in the log: the log was begun after the node, and a replay needs "
            "the node from its constructor on");
  EXPECT_EQ(problem_of({}), "there is no message on n/steps in the log");
  EXPECT_EQ(problem_of({NodeRunLog::step_log(0, {})}), "the messages on n/steps hold no step");
}

TEST(NodeRunReader, StepsThatNoNodeMakesAreRefused) {
  const auto problem_of = [](const std::vector<v1::StepRecord>& steps) {
    NodeRunLog log;
    log.steps(10, 0, steps);
    return read_all(log).problem;
  };
  const auto create = step_record(kCreate, 0), step = step_record(kStep, 1);
  EXPECT_EQ(problem_of({step}), "step 0 is not the node's constructor");
  EXPECT_EQ(problem_of({create, step, create}), "step 2 is a second constructor");
  EXPECT_EQ(problem_of({create, step_record(kStop, 1), step}),
            "step 2 comes after the node's stop");
  EXPECT_EQ(problem_of({create, step_record(static_cast<v1::StepKind>(9), 1)}),
            "step 1 is of an unknown kind (9)");
  EXPECT_EQ(problem_of({create, step_record({}, 1)}), "step 1 is of an unknown kind (0)");
}

TEST(NodeRunReader, WithoutStartIdsThereIsNothingToReplay) {
  NodeRunLog log;
  log.steps(10, NodeRunLog::step_log(0, {step_record(kCreate, 0), step_record(kStep, 1)}), 0);
  const Reading found = read_all(log);
  EXPECT_TRUE(found.inputs.empty());
  EXPECT_EQ(found.problem,
            "the 1 messages on n/steps do not tell which start of the node they are of (no "
            "start_id: an older recording, or converted)");
}

TEST(NodeRunReader, StepLogsThatAreNoneAreCounted) {
  NodeRunLog log;
  log.steps(10, 0, {step_record(kCreate, 0)}).step_bytes(11, "\xff\xff nonsense");
  const Reading found = read_all(log);
  EXPECT_EQ(found.inputs.size(), 1U);
  EXPECT_EQ(found.problem, "1 of the 2 messages on n/steps cannot be read");
}

TEST(NodeRunReader, TwoRecordersOfTheSameRunAreOne) {
  NodeRunLog log, again;
  for (NodeRunLog* one : {&log, &again}) {
    one->input(1, 1).steps(10, 0, {step_record(kCreate, 0), step_record(kStep, 8, {1})});
  }
  std::vector<OpenLog> both;
  for (NodeRunLog* one : {&log, &again}) {
    auto& opened = const_cast<OpenLog&>(one->logs().front());
    both.push_back(std::move(opened));
  }
  const auto node_runs = find_node_runs(both);
  ASSERT_EQ(node_runs.size(), 1U);
  NodeRunReader reader(both, node_runs.front());
  EXPECT_TRUE(reader.next());
  EXPECT_TRUE(reader.next());
  EXPECT_NE(reader.input(NodeRunLog::source(), 1), nullptr);
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(reader.problem(), "");
}

TEST(NodeRunReader, AQueueMayLagBehindAndALatestInputMayNot) {
  for (const std::string policy : {"reliable", "latest"}) {
    NodeRunLog log(policy);
    log.input(1, 1).input(2, 2).steps(10, 0, {step_record(kCreate, 0)});
    log.steps(20 + 2 * kLate, 1, {step_record(kStep, 8)});
    log.steps(30 + 2 * kLate, 2, {step_record(kStep, 8, {1})});
    EXPECT_EQ(read_all(log).inputs, (Inputs{{}, {}, {policy == "reliable" ? 1U : 0U}})) << policy;
  }
}

TEST(NodeRunReader, TooManyBytesThatNobodyTakesAreLetGo) {
  NodeRunLog log;
  for (std::uint32_t seq = 1; seq <= 100; ++seq) log.input(seq, seq, NodeRunLog::kPeer, 1000);
  log.steps(200, 0, {step_record(kCreate, 0), step_record(kStep, 8, {100})});
  EXPECT_EQ(read_all(log, 10'000).inputs, (Inputs{{}, {100}}));
  NodeRunLog lagging;
  for (std::uint32_t seq = 1; seq <= 100; ++seq) lagging.input(seq, seq, NodeRunLog::kPeer, 1000);
  lagging.steps(200, 0, {step_record(kCreate, 0), step_record(kStep, 8, {1, 99})});
  const NodeRun node_run = lagging.node_run();
  NodeRunReader reader(lagging.logs(), node_run, 10'000);
  while (reader.next()) {
  }
  EXPECT_EQ(reader.input(NodeRunLog::source(), 1), nullptr);
  EXPECT_TRUE(reader.was_let_go(NodeRunLog::source(), 1));
  EXPECT_NE(reader.input(NodeRunLog::source(), 99), nullptr);
  EXPECT_FALSE(reader.was_let_go(NodeRunLog::source(), 99));
  EXPECT_FALSE(reader.was_let_go(NodeRunLog::source(), 101)) << "it never was in the log";
}

TEST(NodeRunReader, NonsenseIsReadToItsEndOrRefused) {
  google::protobuf::LogSilencer quiet;
  std::mt19937 random(1);
  const auto below = [&](std::size_t n) { return random() % n; };
  v1::StepLog good = NodeRunLog::step_log(
      0, {step_record(kCreate, 0), step_record(kStep, 10 * kMs, {1, 2}, 1),
          step_record(kStep, 20 * kMs, {3}, 1), step_record(kStop, 30 * kMs, {}, 1)});
  int read = 0, refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string bytes = good.SerializeAsString();
    for (std::size_t k = 1 + below(4); k > 0; --k) {
      const std::size_t at = below(bytes.size());
      switch (below(3)) {
        case 0:
          bytes[at] = static_cast<char>(below(256));
          break;
        case 1:
          bytes.erase(at, 1 + below(3));
          break;
        default:
          bytes.insert(at, 1 + below(9), static_cast<char>(below(2) == 0 ? 0xff : below(256)));
      }
    }
    NodeRunLog log;
    log.input(1, 1).input(2, 2).output(1, 3).step_bytes(30, bytes).input(3, 31).output(2, 32);
    const Reading found = read_all(log);
    EXPECT_LE(found.inputs.size(), bytes.size());
    EXPECT_TRUE(!found.inputs.empty() || !found.problem.empty()) << "equal: 0 steps";
    ++(found.problem.empty() ? read : refused);
  }
  EXPECT_GT(read, 30);
  EXPECT_GT(refused, 300);
}

TEST(NodeRunReader, TimesAndNumbersMayBeAsLargeAsTheyLike) {
  NodeRunLog log;
  const std::uint64_t most = ~0ull, late = most - 1;  // readers end before the last time
  v1::StepRecord wild = step_record(kStep, most, {most, most - 1, 0x1'0000'0001ull}, ~0u);
  wild.mutable_taken(1)->set_source(~0u);
  log.input(1, late - 1).steps(late, 0, {step_record(kCreate, most), wild, step_record(kStep, 0)});
  log.steps(late, most, {step_record(kStep, 1)});
  const Reading found = read_all(log);
  // Logs keep the lower half of a seq: 2³² + 1 is 1 there.
  EXPECT_EQ(found.inputs, (Inputs{{}, {0, 1}, {}}));
  EXPECT_EQ(found.problem, "steps 3 to 18446744073709551614 are not in the log: lost");
}

}  // namespace
}  // namespace mimesis::tool
