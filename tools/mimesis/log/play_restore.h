#pragma once
#include <condition_variable>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tools/mimesis/log/playback.h"
#include "tools/mimesis/log/rerun.h"

namespace mimesis::tool {

/// Computes elided payloads (elided_payload.h) again while their log is played, in a thread of its
/// own: what is looked at now first, what follows it next. A node is asked for single steps, with
/// the inputs of all that it leaves out; what it sends is held against the sum in the log, and if
/// that fails, all of its steps run from the first one on. Keeps them in a file without a name.
class PlayRestorer {
 public:
  /// `arrived` is called on the thread when something has been computed.
  PlayRestorer(const Playback& playback, std::function<void()> arrived);
  ~PlayRestorer();

  /// Computes messages of these topics from now on, those up to this log time first.
  void look_at(std::set<std::string> topics, std::uint64_t log_time_ns);
  /// The payload as it was sent; nothing if it is not computed yet.
  std::optional<std::string> whole(const Played& message);
  /// Of the topics that are looked at, the newest up to the log time, unless it was told already.
  std::vector<Played> fresh();
  bool elided(const std::string& topic) const { return topics_.contains(topic); }
  struct Progress {
    std::uint64_t computed = 0, all = 0;  ///< messages of the topics that are looked at
    std::string problem;                  ///< why there will be no more
  };
  Progress progress();

 private:
  struct Entry {
    std::uint64_t log_time_ns, publish_time_ns;
    std::string elided;
    std::uint64_t offset = 0, size = 0;  ///< in the file; size 0: not computed
  };
  struct Topic {
    const PlayedTopic* played = nullptr;
    std::size_t run = 0;            ///< index in runs_
    std::vector<Entry> entries;     ///< by time
    std::set<std::size_t> missing;  ///< of entries
    std::uint64_t told_ns = 0;      ///< publish time of the last one told
  };
  /// One run of a node.
  struct Run {
    NodeRun recorded;
    std::unique_ptr<NodeRerun> again;
    std::vector<v1::ReplayMessage> inputs;  ///< of the steps that were left out
    std::uint64_t time_ns = 0;              ///< of the last step read
    bool sent = false;                      ///< what it needs to begin has been there
    bool all_steps = false;                 ///< none may be left out
    bool answered = false;                  ///< the last step asked for was in the log
    std::string problem;
  };
  struct Target {
    Topic* topic;
    std::size_t entry;
  };

  void index();
  void work(const std::stop_token& stop);
  std::optional<Target> next();
  /// Runs steps up to that of the target. @return why it cannot be computed
  std::string compute(const Target& target, const std::stop_token& stop);
  void keep(const std::string& topic, const v1::ReplayMessage& output);
  std::string read(const Entry& entry) const;

  const Playback& playback_;
  const std::function<void()> arrived_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::uint64_t end_ = 0;  ///< of the file
  std::vector<Run> runs_;
  std::map<std::string, Topic> topics_;  ///< its keys stay

  std::mutex mutex_;  ///< of entries, and what follows
  std::condition_variable_any news_;
  std::set<std::string> looked_at_;
  std::uint64_t log_time_ns_ = 0;
  bool indexed_ = false;
  std::jthread thread_;
};

}  // namespace mimesis::tool
