#pragma once
#include <google/protobuf/message.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/mimesis/launch/graph_file.h"
#include "tools/mimesis/launch/supervisor.h"

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

}  // namespace mimesis::launch
