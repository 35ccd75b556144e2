#pragma once
#include <gtest/gtest.h>
#include <stdlib.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/log/indexed_reader.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "proto/runtime.pb.h"

namespace mimesis::tool {

/// Recorders of a graph of the test's own, writing into a folder of its own.
class RecordProcess : public ::testing::Test {
 protected:
  using Process = testing::Process;
  void SetUp() override { setenv("MIMESIS_GRAPH", graph_.name().c_str(), 1); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// A recorder that is ready: nodes started now wait for it.
  std::unique_ptr<Process> record(std::vector<std::string> options,
                                  const std::string& output = "run.mcap") {
    options.insert(options.begin(), {"log", "record", "--json", "-o", path(output)});
    auto process = std::make_unique<Process>("mimesis", options);
    const std::string name = "tap-" + std::to_string(process->pid()) + "-1";
    EXPECT_TRUE(process->wait_ready(graph_, name)) << process->errors();
    return process;
  }

  testing::TestGraph graph_;
  testing::TemporaryFolder folder_;
};

/// Text that does not compress to nothing.
inline std::string noise(std::size_t size, std::uint64_t seed) {
  std::string text(size, ' ');
  for (char& c : text) {
    seed = seed * 6364136223846793005U + 1442695040888963407U;
    c = static_cast<char>('0' + (seed >> 58U));
  }
  return text;
}

/// Publishes a counter, and a latched value with the first message.
struct Sender {
  explicit Sender(const testing::TestGraph& graph)
      : node(graph, {}, {}, "sender"),
        count(node.bus(), "count"),
        state(node.bus(), "state", {.latched = true}) {
    node.open();
  }
  void send(std::uint64_t n, std::size_t size = 20) {
    v1::Publication m;
    for (std::uint64_t i = 0; i < n; ++i) {
      m.set_seq(++sent);
      m.set_topic(noise(size, sent));
      count.send(m, testing::TestNode::now());
      if (sent == 1) state.send(m, testing::TestNode::now());
    }
  }
  testing::TestNode node;
  runtime::Out<v1::Publication> count, state;
  std::uint64_t sent = 0;
};

/// Contents of a file.
struct LogContents {
  explicit LogContents(const std::string& path) {
    const auto source = log::open_file(path);
    if (!source) return;
    const auto summary = log::summarize(**source);
    if (!summary) return;
    opens = true;
    closed = summary->from_file;
    for (const auto& index : summary->metadata) {
      if (auto m = log::read_metadata(**source, index)) metadata[m->name] = m->metadata;
    }
    for (const auto& index : summary->attachments) attachments.push_back(index.name);
    log::IndexedReader reader(**source, *summary);
    while (const log::Message* m = reader.next()) {
      seqs[summary->channels.at(m->channel_id).topic].push_back(m->sequence);
    }
  }
  bool opens = false, closed = false;
  std::map<std::string, std::map<std::string, std::string>> metadata;
  std::vector<std::string> attachments;
  std::map<std::string, std::vector<std::uint32_t>> seqs;  ///< by topic, in the order of log time
};

}  // namespace mimesis::tool
