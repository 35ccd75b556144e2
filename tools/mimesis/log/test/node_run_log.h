#pragma once
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/log/writer.h"
#include "common/runtime/raw.h"
#include "proto/runtime.pb.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/replay_log.h"

namespace mimesis::tool {

constexpr std::uint64_t kSecond = 1'000'000'000;

/// In a step: which messages of source 0 it took, and how many it published.
inline v1::StepRecord step_record(v1::StepKind kind, std::uint64_t time_ns,
                                  const std::vector<std::uint64_t>& taken = {},
                                  std::uint32_t published = 0) {
  v1::StepRecord step;
  step.set_kind(kind);
  step.set_time_ns(time_ns);
  for (const std::uint64_t seq : taken) step.add_taken()->set_seq(seq);
  step.set_published(published);
  return step;
}

/// The log of one run of node "n", made by hand: it hears "p/out" of node "p" and publishes
/// "n/out".
class NodeRunLog {
 public:
  static constexpr std::uint64_t kStart = 7, kPeer = 3;  ///< start_id of n and p

  /// @param policy  of the input
  explicit NodeRunLog(const std::string& policy = "reliable") {
    v1::NodeStart start;
    start.set_node("n");
    start.set_start_id(kStart);
    start.set_clock("lockstep");
    v1::TopicInfo& in = *start.add_inputs();
    in.set_port("in");
    in.set_topic("p/out");
    in.set_policy(policy);
    send("n/start", "n", kStart, 1, 0, start);
  }

  static v1::InputSource source() {
    v1::InputSource source;
    source.set_port("in");
    source.set_topic("p/out");
    source.set_node("p");
    source.set_start_id(kPeer);
    return source;
  }
  static v1::StepLog step_log(std::uint64_t first, const std::vector<v1::StepRecord>& steps) {
    v1::StepLog log;
    log.set_first(first);
    *log.add_sources() = source();
    for (const v1::StepRecord& step : steps) *log.add_steps() = step;
    return log;
  }
  static std::string payload(std::uint64_t seq) {
    v1::Publication m;
    m.set_seq(seq);
    return m.SerializeAsString();
  }

  NodeRunLog& input(std::uint32_t seq, std::uint64_t time_ns, std::uint64_t peer = kPeer,
                    std::size_t size = 0) {
    v1::Publication m;
    m.set_seq(seq);
    m.set_topic(std::string(size, 'x'));
    return send("p/out", "p", peer, seq, time_ns, m);
  }
  NodeRunLog& output(std::uint32_t seq, std::uint64_t time_ns) {
    v1::Publication m;
    m.set_seq(seq);
    return send("n/out", "n", kStart, seq, time_ns, m);
  }
  NodeRunLog& steps(std::uint64_t time_ns, const v1::StepLog& log, std::uint64_t start = kStart) {
    return send("n/steps", "n", start, ++step_logs_, time_ns, log);
  }
  NodeRunLog& steps(std::uint64_t time_ns, std::uint64_t first,
                    const std::vector<v1::StepRecord>& steps_in_it) {
    return steps(time_ns, step_log(first, steps_in_it));
  }
  NodeRunLog& step_bytes(std::uint64_t time_ns, const std::string& bytes) {
    const std::uint16_t id = channel("n/steps", "n", kStart, *v1::StepLog::descriptor());
    EXPECT_TRUE(writer_.write({id, ++step_logs_, time_ns, time_ns, bytes}));
    return *this;
  }

  /// The log is complete; valid as long as this object.
  const std::vector<OpenLog>& logs() {
    if (logs_.empty()) {
      EXPECT_TRUE(writer_.finish());
      auto opened = std::make_unique<log::MemorySource>(bytes_);
      auto summary = log::summarize(*opened).value();
      logs_.push_back({"node_run.mcap", std::move(opened), std::move(summary)});
    }
    return logs_;
  }
  /// The only one.
  NodeRun node_run() {
    const auto node_runs = find_node_runs(logs());
    EXPECT_EQ(node_runs.size(), 1U);
    return node_runs.at(0);
  }

 private:
  /// `start` 0: an older recorder, which did not tell.
  std::uint16_t channel(const std::string& topic, const std::string& node, std::uint64_t start,
                        const google::protobuf::Descriptor& type) {
    std::uint16_t& id = channels_[{topic, start}];
    if (id != 0) return id;
    const auto schema =
        writer_.add_schema(type.full_name(), "protobuf", runtime::descriptor_set(type));
    std::map<std::string, std::string> metadata{{"node", node}};
    if (start != 0) metadata["start_id"] = std::to_string(start);
    return id = writer_.add_channel(*schema, topic, "protobuf", metadata).value();
  }
  template <class M>
  NodeRunLog& send(const std::string& topic, const std::string& node, std::uint64_t start,
                   std::uint32_t seq, std::uint64_t time_ns, const M& message) {
    const std::uint16_t id = channel(topic, node, start, *M::descriptor());
    const std::string bytes = message.SerializeAsString();
    EXPECT_TRUE(writer_.write({id, seq, time_ns, time_ns, bytes}));
    return *this;
  }

  std::string bytes_;
  log::MemorySink sink_{bytes_};
  log::Writer writer_{sink_, {.background = false}};
  std::map<std::pair<std::string, std::uint64_t>, std::uint16_t> channels_;
  std::uint32_t step_logs_ = 0;
  std::vector<OpenLog> logs_;
};

}  // namespace mimesis::tool
