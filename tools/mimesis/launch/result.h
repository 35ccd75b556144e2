#pragma once
#include <fmt/format.h>
#include <google/protobuf/message.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/runtime/own_topics.h"
#include "common/runtime/raw.h"
#include "common/time.h"
#include "proto/foxglove/log.pb.h"
#include "proto/runtime.pb.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/launch/graph_file.h"
#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

using Json = nlohmann::ordered_json;

/// Puts the result of a run together from messages. The result is taken at time T, the stamp of the
/// first message on `until`: of every other topic the newest with a stamp not after T counts, so
/// that it does not matter in which order messages of different publishers arrive.
class ResultCollector {
 public:
  explicit ResultCollector(const ResultSpec& spec) : spec_(spec) {
    paths_[spec.until.text];
    if (spec.success) paths_[spec.success->topic].push_back(*spec.success);
    for (const ResultField& field : spec.fields) paths_[field.from.topic].push_back(field.from);
  }

  bool wants(const std::string& topic) const { return paths_.contains(topic); }
  /// @throws ConfigError "file:line:col: ..." if the type lacks a field of the launch file.
  void add(const std::string& topic, std::chrono::nanoseconds stamp,
           const google::protobuf::Message& message) {
    Sample sample{stamp, {}};
    for (const FieldPath& path : paths_.at(topic)) {
      try {
        sample.values[path.field] = tool::field_json(message, path.field, /*words=*/true);
      } catch (const ConfigError& e) {
        throw ConfigError(to_string(path.place) + ": " + e.what());
      }
    }
    std::deque<Sample>& kept = samples_[topic];
    kept.push_back(std::move(sample));
    if (kept.size() > kKept) kept.pop_front();
    if (topic == spec_.until.text && !end_) end_ = stamp;
  }
  /// T, once it is known.
  std::optional<std::chrono::nanoseconds> end() const { return end_; }
  /// T is known and no message before it can still be on its way.
  bool complete() const {
    if (!end_) return false;
    return std::all_of(paths_.begin(), paths_.end(), [&](const auto& entry) {
      if (entry.first == spec_.until.text) return true;
      const auto it = samples_.find(entry.first);
      return it != samples_.end() && it->second.back().stamp > *end_;
    });
  }

  /// The fields in the order of the file; the success field is false, and `reason` says why, if the
  /// run failed or did not come to its end.
  Json line(const std::string& failure) const {
    Json line = Json::object();
    for (const ResultField& field : spec_.fields)
      line[field.name] = scaled(value(field.from), field);
    line[success_name()] = failure.empty() && succeeded();
    if (!failure.empty()) line["reason"] = failure;
    return line;
  }
  bool succeeded() const {
    return end_.has_value() && (!spec_.success || value(*spec_.success) == Json(true));
  }

 private:
  // Samples kept per topic: T is known soon after it has passed, this is seconds of a fast topic.
  static constexpr std::size_t kKept = 4096;
  static Json scaled(const Json& value, const ResultField& field) {
    if (field.none && value == Json(*field.none)) return nullptr;
    if (!value.is_number() || (!field.scale && !field.digits)) return value;
    double number = value.get<double>() * field.scale.value_or(1.0);
    if (field.digits) {
      const double unit = std::pow(10.0, *field.digits);
      number = std::round(number * unit) / unit;
    }
    return number;
  }

  using Stamp = std::chrono::nanoseconds;
  struct Sample {
    Stamp stamp;
    std::map<std::string, Json> values;  // by field path
  };

  Json value(const FieldPath& path) const {
    const auto it = samples_.find(path.topic);
    if (it == samples_.end()) return nullptr;
    for (auto sample = it->second.rbegin(); sample != it->second.rend(); ++sample) {
      if (!end_ || sample->stamp <= *end_) return sample->values.at(path.field);
    }
    return nullptr;
  }
  std::string success_name() const {
    for (const ResultField& field : spec_.fields) {
      if (spec_.success && field.from.topic == spec_.success->topic &&
          field.from.field == spec_.success->field) {
        return field.name;
      }
    }
    return "success";
  }

  ResultSpec spec_;
  std::map<std::string, std::vector<FieldPath>> paths_;  // by topic
  std::map<std::string, std::deque<Sample>> samples_;    // by topic, newest last
  std::optional<Stamp> end_;
};

/// What may have made a run fail: the first complaint of a node, and what the machine did
/// meanwhile.
class Causes {
 public:
  /// A line that a node logged, at a time since the start of the run.
  void add(const foxglove::Log& line, std::chrono::nanoseconds at);
  void add(const v1::Health& health) { missed_[health.node()] = health.overruns(); }
  /// Puts them before what followed: "bridge: A1: no feedback for 0.1 s (at 4.21 s); the machine
  /// was busy: load 9.8 on 2 processors, bridge missed 41 cycles; REASON".
  /// @param on_wall_clock  else a busy machine only takes longer
  std::string before(const std::string& reason, bool on_wall_clock) const;

 private:
  struct Complaint {
    std::string node, text;
    std::chrono::nanoseconds at;
    foxglove::Log::Level level;
  };
  std::string machine() const;

  std::optional<Complaint> first_;                ///< an error if there is one, else a warning
  std::map<std::string, std::uint64_t> missed_;   ///< cycles, by node
  std::array<double, 2> began_ = machine_time();  ///< stolen, whole

  /// Time of all processors since boot that was stolen, and all of it, in ticks.
  static std::array<double, 2> machine_time();
};

/// Follows the topics of `result:` on a thread of its own and ends the run when the result is
/// complete, the graph's time is up, or the guard of wall time is.
class ResultWatcher {
 public:
  /// Create before the nodes start: publishers hold back for reliable subscribers that exist.
  /// @param epoch graph time at which the run starts: 0 on a simulated clock
  ResultWatcher(const ResultSpec& spec, const std::string& graph, std::chrono::nanoseconds epoch)
      : spec_(spec),
        epoch_(epoch),
        newest_(epoch),
        collector_(spec),
        tap_(
            std::in_place, graph,
            // Every node says once a second that it lives: this shows graph time though nothing
            // else happens.
            [this](const std::string& topic) {
              return collector_.wants(topic) ||
                     runtime::is_own_topic(topic, runtime::kHealthPort) ||
                     runtime::is_own_topic(topic, runtime::kLogPort);
            },
            runtime::Policy::reliable),
        event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (!event_.open()) throw std::runtime_error("eventfd failed");
    thread_ = std::thread([this] { follow(); });
  }
  ~ResultWatcher() { stop(); }

  /// Readable when the run shall end.
  int fd() const { return event_.get(); }
  /// Ends the thread; after this the rest may be asked.
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  const ResultCollector& collector() const { return collector_; }
  const std::string& failure() const { return failure_; }  ///< why there is no result, or empty
  bool misconfigured() const { return misconfigured_; }    ///< the failure is the launch file's
  const Causes& causes() const { return causes_; }
  /// Time from the start to the newest message seen [s]. From any thread.
  double graph_now_s() const { return to_seconds(newest_.load() - epoch_); }
  /// Time from the start to the result, or to the newest message seen [s].
  double graph_s() const { return to_seconds(collector_.end().value_or(newest_.load()) - epoch_); }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kTurn{50};
  // A rare topic need not speak again after the end: this long, messages from before it may still
  // arrive.
  static constexpr std::chrono::milliseconds kLastMessages{300};

  void follow() {
    const auto give_up = Clock::now() + spec_.wall_timeout;
    auto last_messages = Clock::time_point::max();
    while (!stop_ && failure_.empty() && !collector_.complete() && Clock::now() < last_messages) {
      try {
        if (const auto tapped = tap_->next(kTurn)) take(*tapped);
      } catch (const ConfigError& e) {
        failure_ = e.what();
        misconfigured_ = true;
      } catch (const std::exception& e) {  // Protobuf's, of types that a stranger announced
        failure_ = fmt::format("the result cannot be read: {}", e.what());
      }
      if (collector_.end()) {
        last_messages = std::min(last_messages, Clock::now() + kLastMessages);
      } else if (newest_.load() - epoch_ > spec_.timeout) {
        failure_ = fmt::format("nothing on {} within {:g} s of graph time", spec_.until.text,
                               to_seconds(spec_.timeout));
      } else if (Clock::now() > give_up) {
        failure_ = fmt::format("nothing on {} within {:g} s of wall time", spec_.until.text,
                               to_seconds(spec_.wall_timeout));
      }
    }
    tap_.reset();  // publishers wait for a reliable subscriber that takes nothing
    const std::uint64_t one = 1;
    if (write(event_.get(), &one, sizeof one) != sizeof one) failure_ = "eventfd failed";
  }
  void note_cause(const runtime::Tapped& tapped) {
    foxglove::Log line;
    v1::Health health;
    const std::string& bytes = tapped.message.payload;
    if (tapped.type == line.GetTypeName() && line.ParseFromString(bytes)) {
      causes_.add(line, tapped.message.stamp - epoch_);
    } else if (tapped.type == health.GetTypeName() && health.ParseFromString(bytes)) {
      causes_.add(health);
    }
  }
  void take(const runtime::Tapped& tapped) {
    newest_ = std::max(newest_.load(), tapped.message.stamp);
    note_cause(tapped);
    if (!collector_.wants(tapped.topic)) return;
    const auto message = types_.make(tapped.type, tap_->descriptors(tapped.type_hash));
    if (message == nullptr || !message->ParseFromString(tapped.message.payload)) {
      failure_ = fmt::format("a message on {} cannot be read as {}", tapped.topic, tapped.type);
      return;
    }
    collector_.add(tapped.topic, tapped.message.stamp, *message);
  }

  ResultSpec spec_;
  std::chrono::nanoseconds epoch_;
  std::atomic<std::chrono::nanoseconds> newest_;
  ResultCollector collector_;
  runtime::TypePool types_;
  std::optional<runtime::Tap> tap_;  ///< while the result is not complete
  Fd event_;
  std::string failure_;
  bool misconfigured_ = false;
  Causes causes_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace mimesis::launch
