#include "common/runtime/replay.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include "common/runtime/bus.h"
#include "common/runtime/ports.h"
#include "common/runtime/step_recorder.h"
#include "common/testing/loopback.h"

namespace mimesis::runtime {
namespace {

using testing::Loopback;

/// Adds its inputs, its readings from outside and its requests.
class Adder {
 public:
  explicit Adder(Bus& bus)
      : bus_(bus), in_(bus, "in"), out_(bus, "out"), ready_(bus, "ready", {.latched = true}) {
    bus.serve("add", v1::Publication::default_instance(), v1::Publication::default_instance(),
              [this](const std::string& request) -> tl::expected<std::string, Status> {
                v1::Publication p;
                if (!p.ParseFromString(request)) return tl::unexpected(Status{"no Publication"});
                sum_ += p.seq();
                p.set_seq(sum_);
                return p.SerializeAsString();
              });
    v1::Publication p;
    ready_.send(p, Time(0));
  }
  void step(Time now) {
    while (const auto m = in_.pop()) sum_ = 3 * sum_ + m->seq();
    sum_ += read_outside_value<std::uint64_t>(bus_, "dice", [] { return dice; });
    bus_.outside().written("lamp", sum_ % 2 == 0 ? "off" : "on");
    v1::Publication p;
    p.set_seq(sum_ + static_cast<std::uint64_t>(now.count()));
    out_.send(p, now);
  }
  static inline std::uint64_t dice = 0;

 private:
  Bus& bus_;
  std::uint64_t sum_ = 0;
  Reliable<v1::Publication> in_;
  Out<v1::Publication> out_, ready_;
};

std::string request(std::uint64_t seq) {
  v1::Publication p;
  p.set_seq(seq);
  return p.SerializeAsString();
}

struct Recording {
  v1::StepLog log;
  std::vector<std::string> outputs;  ///< in order
  std::vector<std::vector<v1::ReplayMessage>> inputs;
};

/// Three steps with messages, dice and a request before the second.
Recording record_adder() {
  Loopback loopback;
  StepRecorder recorder;
  RecordedBus bus(loopback, recorder, {{"in", "some/topic"}});
  Recording made;
  made.inputs.resize(5);
  recorder.begin(v1::STEP_KIND_CREATE, Time(0));
  Adder adder(bus);
  recorder.end();
  std::uint64_t seq = 0;
  for (int step = 1; step <= 3; ++step) {
    for (int i = 0; i < step; ++i) {
      v1::ReplayMessage m;
      m.set_port("in");
      m.set_payload(request(10 + ++seq));
      m.set_seq(seq);
      loopback.send_raw("in", m.payload(), Time(step));
      made.inputs[static_cast<std::size_t>(step)].push_back(m);
    }
    if (step == 2) {
      EXPECT_TRUE(loopback.call("test/add", request(100), {}));
    }
    Adder::dice = 7 * static_cast<std::uint64_t>(step);
    recorder.begin(v1::STEP_KIND_STEP, Time(step));
    adder.step(Time(step));
    recorder.end();
  }
  EXPECT_FALSE(recorder.due(Time(3)));
  EXPECT_TRUE(recorder.due(std::chrono::milliseconds(100)));
  made.log = recorder.take();
  EXPECT_TRUE(recorder.take().steps().empty()) << "no step is in a log twice";
  for (const char* port : {"ready", "out"}) {
    while (auto m = loopback.take<v1::Publication>(port))
      made.outputs.push_back(m->SerializeAsString());
  }
  return made;
}

v1::ReplayStep step_of(const Recording& recording, int index) {
  v1::ReplayStep step;
  *step.mutable_step() = recording.log.steps(index);
  for (const auto& m : recording.inputs[static_cast<std::size_t>(index)]) *step.add_inputs() = m;
  return step;
}

TEST(StepRecorder, HoldsWhatEveryStepConsumed) {
  const Recording recording = record_adder();
  const v1::StepLog& log = recording.log;
  ASSERT_EQ(log.steps_size(), 4);
  EXPECT_EQ(log.first(), 0U);
  EXPECT_EQ(log.steps(0).kind(), v1::STEP_KIND_CREATE);
  EXPECT_EQ(log.steps(0).published(), 1U);
  ASSERT_EQ(log.sources_size(), 1);
  EXPECT_EQ(log.sources(0).port(), "in");
  EXPECT_EQ(log.sources(0).topic(), "some/topic");
  const v1::StepRecord& third = log.steps(3);
  EXPECT_EQ(third.time_ns(), 3U);
  ASSERT_EQ(third.taken_size(), 3);
  EXPECT_EQ(third.taken(0).seq(), 4U);
  ASSERT_EQ(third.outside_size(), 2);
  EXPECT_EQ(third.outside(0).name(), "dice");
  EXPECT_FALSE(third.outside(0).written());
  EXPECT_EQ(third.outside(1).name(), "lamp");
  EXPECT_TRUE(third.outside(1).written());
  ASSERT_EQ(log.steps(2).requests_size(), 1);
  EXPECT_EQ(log.steps(2).requests(0).service(), "add");
}

TEST(ReplayBus, GivesTheSameOutputsAgain) {
  const Recording recording = record_adder();
  ReplayBus bus("test", true, {{"out", "far/away"}});
  Adder::dice = 1000;  // must not be thrown again
  std::unique_ptr<Adder> adder;
  std::vector<std::string> ready, out;
  for (int i = 0; i < recording.log.steps_size(); ++i) {
    const v1::ReplayStep step = step_of(recording, i);
    bus.begin(step);
    if (i == 0) {
      adder = std::make_unique<Adder>(bus);
    } else {
      adder->step(Time(i));
    }
    const v1::ReplayOutcome outcome = bus.end();
    EXPECT_EQ(outcome.problem(), "");
    EXPECT_EQ(outcome.outputs_size(), static_cast<int>(step.step().published()));
    for (const auto& m : outcome.outputs()) {
      EXPECT_TRUE(m.topic() == "far/away" || m.topic() == "test/ready");
      (m.topic() == "far/away" ? out : ready).push_back(m.payload());
    }
    if (i > 0) {
      ASSERT_EQ(outcome.written_size(), 1);
      EXPECT_EQ(outcome.written(0).data(), step.step().outside(1).data());
    }
    ASSERT_EQ(outcome.served_size(), i == 2 ? 1 : 0);
    if (i == 2) {
      EXPECT_EQ(outcome.served(0).response(), step.step().requests(0).response());
    }
  }
  ready.insert(ready.end(), out.begin(), out.end());
  // Loopback fills no header, as Publication has none: payloads are comparable.
  EXPECT_EQ(ready, recording.outputs);
}

TEST(ReplayBus, SaysWhatTheRecordedStepDidMore) {
  const Recording recording = record_adder();
  ReplayBus bus("test", true, {});
  bus.begin(step_of(recording, 0));
  Adder adder(bus);
  EXPECT_EQ(bus.end().problem(), "");
  bus.begin(step_of(recording, 3));  // no step runs
  EXPECT_NE(bus.end().problem().find("took 3 more message(s) from input 'in'"), std::string::npos);

  v1::ReplayStep other = step_of(recording, 3);
  other.mutable_step()->mutable_outside(0)->set_name("coin");
  bus.begin(other);
  adder.step(Time(3));
  EXPECT_EQ(bus.end().problem(), "the step reads 'dice' from outside, the log has 'coin' here");
}

/// Adapter of Adder like NodeAdapter; Adder has no parameters.
class AdderNode final : public AnyNode {
 public:
  void visit(ParamVisitor&) override {}
  void create(Bus& bus) override { adder_ = std::make_unique<Adder>(bus); }
  void step(Time now) override {
    if (now == Time(3)) throw std::runtime_error("three is too much");
    adder_->step(now);
  }
  void stop(Time) noexcept override { adder_.reset(); }
  double rate_hz() const override { return 1.0; }
  double offset_s() const override { return 0.0; }

 private:
  std::unique_ptr<Adder> adder_;
};

TEST(RunReplay, AnswersEveryStepAndEndsWithTheStream) {
  const Recording recording = record_adder();
  int fds[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, fds), 0);
  AdderNode node;
  BusOptions options;
  options.name = "test";
  int exit_code = -1;
  std::thread replayed([&] { exit_code = run_replay(options, fds[1], node); });
  std::vector<std::string> out;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(write_packet(fds[0], step_of(recording, i)));
    v1::ReplayOutcome outcome;
    ASSERT_TRUE(read_packet(fds[0], outcome));
    EXPECT_EQ(outcome.problem(), "");
    for (const auto& m : outcome.outputs()) out.push_back(m.payload());
  }
  ASSERT_GE(recording.outputs.size(), out.size());
  EXPECT_TRUE(std::equal(out.begin(), out.end(), recording.outputs.begin()));
  EXPECT_EQ(out.size(), 3U);
  ASSERT_TRUE(write_packet(fds[0], step_of(recording, 3)));
  v1::ReplayOutcome failed;
  ASSERT_TRUE(read_packet(fds[0], failed));
  EXPECT_TRUE(failed.failed());
  EXPECT_EQ(failed.problem(), "three is too much");
  ::close(fds[0]);
  replayed.join();
  EXPECT_EQ(exit_code, 1);
  ::close(fds[1]);
}

}  // namespace
}  // namespace mimesis::runtime
