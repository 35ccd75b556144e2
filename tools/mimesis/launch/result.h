#pragma once
#include <google/protobuf/message.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/runtime/raw.h"
#include "tools/mimesis/launch/graph_file.h"
#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// Puts the result of a run together from messages. The result is taken at time T, the stamp of the
/// first message on `until`: of every other topic the newest with a stamp not after T counts, so
/// that it does not matter in which order messages of different publishers arrive.
class ResultCollector {
 public:
  explicit ResultCollector(const ResultSpec& spec);

  bool wants(const std::string& topic) const { return paths_.contains(topic); }
  /// @throws ConfigError "file:line:col: ..." if the type lacks a field of the launch file.
  void add(const std::string& topic, std::chrono::nanoseconds stamp,
           const google::protobuf::Message& message);
  /// T, once it is known.
  std::optional<std::chrono::nanoseconds> end() const { return end_; }
  /// T is known and no message before it can still be on its way.
  bool complete() const;

  /// The fields in the order of the file; the success field is false, and `reason` says why, if the
  /// run failed or did not come to its end.
  nlohmann::ordered_json line(const std::string& failure) const;
  bool succeeded() const;

 private:
  using Stamp = std::chrono::nanoseconds;
  struct Sample {
    Stamp stamp;
    std::map<std::string, nlohmann::ordered_json> values;  // by field path
  };

  nlohmann::ordered_json value(const FieldPath& path) const;
  std::string success_name() const;

  ResultSpec spec_;
  std::map<std::string, std::vector<FieldPath>> paths_;  // by topic
  std::map<std::string, std::deque<Sample>> samples_;    // by topic, newest last
  std::optional<Stamp> end_;
};

/// Follows the topics of `result:` on a thread of its own and ends the run when the result is
/// complete, the graph's time is up, or the guard of wall time is.
class ResultWatcher {
 public:
  /// Create before the nodes start: publishers hold back for reliable subscribers that exist.
  /// @param epoch graph time at which the run starts: 0 on a simulated clock
  ResultWatcher(const ResultSpec& spec, const std::string& graph, std::chrono::nanoseconds epoch);
  ~ResultWatcher();

  /// Readable when the run shall end.
  int fd() const { return event_.get(); }
  /// Ends the thread; after this the rest may be asked.
  void stop();
  const ResultCollector& collector() const { return collector_; }
  const std::string& failure() const { return failure_; }  ///< why there is no result, or empty
  bool misconfigured() const { return misconfigured_; }    ///< the failure is the launch file's
  double graph_s() const;  ///< time from the start to the result, or to the newest message seen [s]

 private:
  void follow();
  void take(const runtime::Tapped& tapped);

  ResultSpec spec_;
  std::chrono::nanoseconds epoch_, newest_;
  ResultCollector collector_;
  runtime::TypePool types_;
  runtime::Tap tap_;
  Fd event_;
  std::string failure_;
  bool misconfigured_ = false;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace mimesis::launch
