#pragma once
#include <atomic>
#include <mutex>
#include <string>
#include <thread>

#include "common/runtime/raw.h"
#include "tools/mimesis/topic_filter.h"
#include "tools/mimesis/view/server.h"

namespace mimesis::view {

/// Shows a running graph: channels are its topics, of which only those are received that somebody
/// looks at; parameters and services are those of its nodes.
class LiveGraph {
 public:
  /// `topics`: those that are shown. `policy`: latest, so that no node waits for viewers; reliable
  /// of a player, whose messages come once
  LiveGraph(Server& server, std::string graph, tool::TopicFilter topics, runtime::Policy policy);
  ~LiveGraph();
  /// Passes on what comes within about 5 ms.
  void step();
  /// Nodes of the graph at the last look.
  std::size_t nodes() const { return infos_.size(); }

 private:
  void look();
  void choose();
  void announce();
  void serve();
  void handle(const Server::Asked& asked);
  void answer(std::uint64_t client, const GetParameters& get);
  void answer(std::uint64_t client, const SetParameters& set);
  void answer(std::uint64_t client, const CallService& call);
  std::vector<Parameter> parameters(const std::vector<v1::NodeInfo>& nodes,
                                    const std::vector<std::string>& names) const;

  Server& server_;
  const std::string graph_;
  const tool::TopicFilter topics_;
  runtime::GraphView view_;
  runtime::Tap tap_;
  std::vector<v1::NodeInfo> infos_;
  std::map<std::pair<std::string, std::uint64_t>, Channel> channels_;  ///< by topic and type hash
  std::mutex mutex_;                               ///< of services_, which the clerk reads
  std::map<std::string, std::uint32_t> services_;  ///< by name
  std::uint32_t next_id_ = 1;
  std::set<std::uint32_t> wanted_;
  std::chrono::steady_clock::time_point next_look_{};
  std::int64_t told_ns_ = 0;  ///< simulated time
  std::atomic<bool> end_{false};
  std::thread clerk_;  ///< asks nodes, which may take long
};

}  // namespace mimesis::view
