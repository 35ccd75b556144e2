#pragma once
#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/graph_time.h"
#include "common/runtime/registry.h"
#include "proto/hosts.pb.h"
#include "tools/mimesis/launch/host_link.h"
#include "tools/mimesis/launch/node_host.h"

namespace mimesis::launch {

/// How a host's monotonic time relates to the graph's: from the exchange of four stamps with the
/// shortest round trip of the last 16.
class ClockOffset {
 public:
  struct Sample {
    Time graph_minus_there{}, delay{};
  };
  /// @param sent, back  graph time here
  /// @param received, answered  monotonic time there
  void add(Time sent, Time received, Time answered, Time back) {
    samples_.push_back(
        {((sent - received) + (back - answered)) / 2, (back - sent) - (answered - received)});
    if (samples_.size() > kKept) samples_.pop_front();
  }
  std::size_t size() const { return samples_.size(); }
  /// Precondition: size() > 0.
  const Sample& best() const { return *std::ranges::min_element(samples_, {}, &Sample::delay); }

 private:
  static constexpr std::size_t kKept = 16;
  std::deque<Sample> samples_;
};

/// Another host: `mimesis-host` runs there as the command of one ssh connection, starts nodes,
/// tells what they do, and ends them when the connection ends or nothing has come by it for longer
/// than `lost_after`. Its graph time follows ours.
class FarHost final : public NodeHost {
 public:
  /// Connects at once. @param graph  name of the graph
  FarHost(Host spec, std::string graph, const runtime::GraphTime& time);

  bool up() const override { return up_; }
  void start(const std::string& node, const Start& start) override;
  void send(const std::string& node, int signal) override;
  std::vector<HostEvent> poll() override;
  void watch(std::vector<pollfd>& fds) const override;
  pid_t pid(const std::string& node) const override;

  const std::string& name() const { return spec_.name.text; }
  const std::string& address() const { return spec_.address; }
  /// Connects again if the connection has ended; at most once a second.
  void reconnect();
  /// Ends the connection, which ends what is left there. False: call again, ssh is not gone yet.
  bool disconnect(bool in_time);
  /// Why the first connection failed; empty: it has not.
  const std::string& failure() const { return failure_; }
  /// First report of the present connection: keys. Null before it.
  const v1::HostReport* hello() const { return hello_ ? &*hello_ : nullptr; }
  /// Shows it a node of another host, or takes one away.
  void show(const v1::NodeInfo& node);
  void hide(const std::string& node, std::uint64_t start_id);
  /// What its own nodes did in the graph since the last call, as others see them.
  std::vector<runtime::RegistryChange> news() { return std::exchange(news_, {}); }
  v1::HostStatus status() const;

 private:
  void connect();
  void take(const v1::HostReport& report, std::vector<HostEvent>& events);
  void measure(const v1::HostReport& report);
  /// The connection is over: all its nodes are lost.
  void close(const std::string& why, std::vector<HostEvent>& events);
  void follow_silence(WallTime now);
  void forget(const std::string& node);

  Host spec_;
  std::string graph_;
  const runtime::GraphTime& time_;
  Child ssh_;
  HostLink link_;
  std::string errors_, last_error_;  ///< of ssh and the program there
  std::optional<v1::HostReport> hello_;
  bool greeted_ = false, up_ = false, was_up_ = false, silent_ = false, abandoned_ = false;
  bool pinged_ = false;  ///< and not answered yet
  std::string failure_;
  WallTime heard_{}, next_ping_{}, connected_{};
  std::optional<WallTime> closed_;  // last time that its output was open
  std::map<std::string, pid_t> running_;
  std::map<std::string, v1::NodeInfo> nodes_;  ///< its own in the graph
  std::vector<runtime::RegistryChange> news_;
  std::map<std::string, v1::NodeInfo> shown_;  ///< to it, again when it is back
  ClockOffset offset_;
  Time system_ahead_{}, graph_ahead_{};
  bool clock_named_ = false;
};

}  // namespace mimesis::launch
