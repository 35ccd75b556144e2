#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/runtime/own_topics.h"
#include "common/runtime/value_text.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/open_log.h"

// The recorded steps of a node.
namespace mimesis::tool {

// The names that older versions gave to ports, services, parameters and model files, so that their
// logs can be replayed.

/// Gives a recorded start of a node the names of this version.
/// @return what was renamed or is left out, one line each
std::vector<std::string> rename_former(v1::NodeStart& start);

/// The same for recorded steps of a node. @param program  its NodeStart.executable
void rename_former(std::string_view program, v1::StepLog& steps);

/// How much later than the step that took it a message may have reached the recorder [ns of log
/// time]. In lock-step there is no such delay; between hosts a second was never seen.
constexpr std::uint64_t kLate = 5'000'000'000;

/// Largest size of untaken inputs [bytes]: minutes of images that no step takes.
constexpr std::size_t kMostInputBytes = 256'000'000;

/// A message that waits for the step that took or made it.
struct KeptMessage {
  std::string payload;
  std::uint64_t seq = 0;
  std::uint64_t publish_time_ns = 0, log_time_ns = 0;
  const log::Schema* schema = nullptr;  ///< schema of the log

  explicit KeptMessage(const Item& item)
      : payload(item.message->data),
        seq(item.message->sequence),
        publish_time_ns(item.message->publish_time),
        log_time_ns(item.message->log_time),
        schema(item.schema) {}
  std::size_t size() const { return payload.size() + sizeof(KeptMessage); }  ///< [bytes]
};

/// Logs keep the lower half of the sequence number.
constexpr std::uint64_t logged_seq(std::uint64_t seq) { return seq & 0xFFFF'FFFFu; }

/// A node from its start to its end, from the logs. A restarted node has several node_runs.
struct NodeRun {
  v1::NodeStart start;
  std::uint64_t log_time_ns = 0;  ///< log time of its first message
  std::uint64_t step_logs = 0;    ///< messages on NODE/steps [1]
  std::uint64_t other_steps = 0;  ///< messages on this topic of unknown starts: in old logs [1]
  std::vector<std::string> renamed{};  ///< what an older version called otherwise: for people

  const std::string& node() const { return start.node(); }
  std::string steps_topic() const { return node() + "/" + std::string(runtime::kStepsPort); }
  /// Graph time for people [s]: on the wall clock since the node's start.
  double seconds(std::uint64_t time_ns) const {
    const std::uint64_t epoch = start.clock() == "wall" ? start.header().stamp_ns() : 0;
    return static_cast<double>(static_cast<std::int64_t>(time_ns - epoch)) * 1e-9;
  }
};

/// `start_of` as a number; 0 in older logs.
inline std::uint64_t start_id_of(const log::Channel& channel) {
  return runtime::to_whole<std::uint64_t>(start_of(channel)).value_or(0);
}

/// Every run in the logs that left a NODE/start, in order of time.
inline std::vector<NodeRun> find_node_runs(const std::vector<OpenLog>& logs) {
  std::vector<NodeRun> node_runs;
  auto reader = merged(logs, {.channel = [](const log::Channel& channel) {
                         return runtime::is_own_topic(channel.topic, runtime::kStartPort);
                       }});
  const std::string type = v1::NodeStart::descriptor()->full_name();
  while (const Item* item = reader.next()) {
    NodeRun node_run;
    if (item->schema == nullptr || item->schema->name != type || !parse(*item, node_run.start))
      continue;
    const bool known = std::ranges::any_of(node_runs, [&](const NodeRun& other) {
      return other.node() == node_run.node() && other.start.start_id() == node_run.start.start_id();
    });
    if (known) continue;  // repeated at the head of a split
    node_run.renamed = rename_former(node_run.start);
    node_run.log_time_ns = item->message->log_time;
    for (const OpenChannel& c : channels_of(logs)) {
      const auto& counts = c.log->summary.statistics.channel_message_counts;
      const auto count = counts.find(c.channel->id);
      if (c.channel->topic != node_run.steps_topic() || count == counts.end()) continue;
      const std::uint64_t start = start_id_of(*c.channel);
      if (start == node_run.start.start_id()) {
        node_run.step_logs += count->second;
      } else if (start == 0) {
        node_run.other_steps += count->second;
      }
    }
    node_runs.push_back(std::move(node_run));
  }
  return node_runs;
}

/// One step with all that belongs to it.
struct RecordedStep {
  std::uint64_t number = 0;  ///< 0: the constructor
  v1::StepRecord record;
  std::vector<v1::InputSource> sources;  ///< sources of record.taken
};

/// Reads the steps of one run, front to back in one pass. Holds only the data that later steps may
/// need: outputs until they are asked for; an input that keeps the latest message until a newer one
/// has replaced it; queues may lag behind without limit, so bytes limit the kept inputs; discarded
/// ones are known. Messages may stand some seconds behind the step they belong to: others received
/// them first.
class NodeRunReader {
 public:
  /// Both outlive the reader.
  NodeRunReader(const std::vector<OpenLog>& logs, const NodeRun& node_run,
                std::size_t most_input_bytes = kMostInputBytes)
      : run_(node_run), most_bytes_(most_input_bytes), reader_(merged(logs, selection(logs))) {}

  /// Next step; nothing at the end of what can be replayed: see `problem`.
  std::optional<RecordedStep> next() {
    if (!problem_.empty()) return std::nullopt;
    while (next_step_ >= step_log_.steps_size()) {
      forget();
      if (!next_step_log()) return std::nullopt;
    }
    if (!makes_sense(step_log_.steps(next_step_))) return std::nullopt;
    return RecordedStep{next_number_++,
                        step_log_.steps(next_step_++),
                        {step_log_.sources().begin(), step_log_.sources().end()}};
  }
  /// Why there are no more steps though there should be; empty at the end of the run.
  const std::string& problem() const { return problem_; }

  /// A message that the step just returned took, or null if it is not in the log. In the order of
  /// `taken`; valid until the next call.
  const KeptMessage* input(const v1::InputSource& source, std::uint64_t seq) {
    const auto track = tracks_.find(key(source));
    return track == tracks_.end() ? nullptr : take(track->second, logged_seq(seq));
  }
  /// An output of the run, or null; valid until the next call. Earlier ones of the topic are let
  /// go then.
  const KeptMessage* output(const std::string& topic, std::uint64_t seq) {
    const auto track = tracks_.find(output_key(topic));
    if (track == tracks_.end() || logged_seq(seq) == 0) return nullptr;
    return take(track->second, logged_seq(seq));
  }
  /// The log holds this topic as one of this run; messages of it may be missing all the same.
  bool has_output(const std::string& topic) const { return tracks_.contains(output_key(topic)); }
  bool has_input(const v1::InputSource& source) const { return tracks_.contains(key(source)); }
  /// The input was in the log, but too many bytes of inputs waited for a step.
  bool was_let_go(const v1::InputSource& source, std::uint64_t seq) const {
    const auto it = tracks_.find(key(source));
    return it != tracks_.end() && logged_seq(seq) > it->second.done &&
           logged_seq(seq) <= it->second.let_go;
  }
  /// The first recorded output that no step has read so far, if it is not later than the step just
  /// returned; null if there is none.
  const KeptMessage* unclaimed(std::string& topic) const {
    const KeptMessage* first = nullptr;
    for (const auto& [key, track] : tracks_) {
      const auto it = track.messages.upper_bound(track.asked);
      if (track.role != Role::output || it == track.messages.end()) continue;
      if (it->second.log_time_ns > step_log_time_ns_) continue;
      if (first != nullptr && first->log_time_ns <= it->second.log_time_ns) continue;
      first = &it->second;
      topic = std::get<0>(key);
    }
    return first;
  }

  std::uint64_t log_time_ns() const { return log_time_ns_; }  ///< read so far

 private:
  enum class Role { output, latest, queue };  ///< the latter two: inputs
  /// Messages that one start of a node published on one topic: an output, or for one input.
  struct Track {
    Role role = Role::output;
    std::map<std::uint64_t, KeptMessage> messages;  ///< by seq
    std::size_t bytes = 0;
    std::uint64_t asked = 0;   ///< no output up to this seq is needed any more
    std::uint64_t done = 0;    ///< `asked` before this step log: nothing of it is kept
    std::uint64_t let_go = 0;  ///< up to this seq nothing is kept, needed or not
  };
  using Key = std::tuple<std::string, std::uint64_t, std::string>;  ///< topic, start, input port
  /// Where messages of a channel go.
  struct Use {
    bool steps = false;  ///< it is NODE/steps of this run
    std::vector<Track*> tracks;
  };

  static Key key(const v1::InputSource& source) {
    return {source.topic(), source.start_id(), source.port()};
  }
  Key output_key(const std::string& topic) const { return {topic, run_.start.start_id(), ""}; }

  /// Also makes the tracks, so that missing topics differ from missing messages.
  log::Selection selection(const std::vector<OpenLog>& logs) {
    for (const OpenChannel& c : channels_of(logs)) {
      const log::Channel& channel = *c.channel;
      const std::uint64_t start = start_id_of(channel);
      const bool own = sender_of(channel) == run_.node() && start == run_.start.start_id();
      Use use{own && channel.topic == run_.steps_topic(), {}};
      const auto feed = [&](const Key& key, Role role) {
        use.tracks.push_back(&tracks_[key]);
        use.tracks.back()->role = role;
      };
      if (own && !runtime::is_own_topic(channel.topic))
        feed(output_key(channel.topic), Role::output);
      for (const v1::TopicInfo& input : run_.start.inputs()) {
        if (input.topic() != channel.topic || input.port().starts_with('.')) continue;  // runtime's
        feed({channel.topic, start, input.port()},
             input.policy() == "latest" ? Role::latest : Role::queue);
      }
      if (use.steps || !use.tracks.empty()) uses_[&channel] = std::move(use);
    }
    return {.channel = [this](const log::Channel& channel) { return uses_.contains(&channel); }};
  }

  /// Takes one message of the log; false at its end.
  bool read() {
    const Item* item = reader_.next();
    if (item == nullptr) return false;
    log_time_ns_ = item->message->log_time;
    const Use& use = uses_.at(item->channel);
    if (use.steps) {
      read_step_log(*item);
      return true;
    }
    const bool before_run = log_time_ns_ + kLate < run_.log_time_ns && !is_latched(*item->channel);
    for (Track* track : use.tracks) {
      if (track->role == Role::output || !before_run) keep(*track, *item);
    }
    return true;
  }
  void keep(Track& track, const Item& item) {
    const std::uint64_t seq = item.message->sequence;
    if (seq <= std::max(track.done, track.let_go)) return;  // repeated at the head of a split
    const auto [kept, is_new] = track.messages.try_emplace(seq, item);
    if (!is_new || track.role == Role::output) return;
    track.bytes += kept->second.size();
    bytes_ += kept->second.size();
    while (bytes_ > most_bytes_ && let_go_one()) {
    }
  }
  void drop_first(Track& track) {
    const auto first = track.messages.begin();
    if (track.role != Role::output) {
      track.bytes -= first->second.size();
      bytes_ -= first->second.size();
    }
    track.messages.erase(first);
  }
  /// The input that holds most loses its oldest; never its newest, which is the likeliest to be
  /// taken.
  bool let_go_one() {
    Track* largest = nullptr;
    for (auto& [key, track] : tracks_) {
      if (track.role == Role::output || track.messages.size() < 2) continue;
      if (largest == nullptr || track.bytes > largest->bytes) largest = &track;
    }
    if (largest == nullptr) return false;
    largest->let_go = largest->messages.begin()->first;
    drop_first(*largest);
    return true;
  }
  /// Reads on until `seq` is there, as far as it may stand behind the step.
  const KeptMessage* take(Track& track, std::uint64_t seq) {
    auto& messages = track.messages;
    if (track.role == Role::output) messages.erase(messages.begin(), messages.lower_bound(seq));
    track.asked = std::max(track.asked, seq);
    for (;;) {
      if (const auto it = messages.find(seq); it != messages.end()) return &it->second;
      if (log_time_ns_ > step_log_time_ns_ + kLate || !read()) return nullptr;
    }
  }
  /// The next steps were received later than `step_log_time_ns_`: drops inputs that no step can
  /// take.
  void forget() {
    for (auto& [key, track] : tracks_) {
      const auto late = [this](const auto& kept) {
        return kept->second.log_time_ns + kLate < step_log_time_ns_;
      };
      track.done = std::max(track.done, track.asked);
      const auto& messages = track.messages;
      while (!messages.empty() && (messages.begin()->first <= track.done ||
                                   (track.role == Role::output && late(messages.begin())))) {
        drop_first(track);
      }
      // An input that keeps the latest never saw a message that was replaced before the step.
      while (track.role == Role::latest && messages.size() > 1 &&
             late(std::next(messages.begin()))) {
        drop_first(track);
      }
    }
  }

  void read_step_log(const Item& item) {
    ++step_logs_read_;
    if (item.message->sequence <= last_step_log_seq_) return;  // two recorders received it
    last_step_log_seq_ = item.message->sequence;
    v1::StepLog log;
    if (parse(item, log)) {
      rename_former(run_.start.executable(), log);
      waiting_.emplace_back(item.message->log_time, std::move(log));
    } else {
      ++step_logs_unreadable_;
    }
  }
  bool next_step_log() {
    while (waiting_.empty() && step_logs_read_ < run_.step_logs && read()) {
    }
    if (waiting_.empty()) {
      problem_ = no_step_log();
      return false;
    }
    std::tie(step_log_time_ns_, step_log_) = std::move(waiting_.front());
    waiting_.pop_front();
    next_step_ = 0;
    if (step_log_.first() != next_number_) problem_ = wrong_number();
    return problem_.empty();
  }
  /// Why there is no further one; empty if these were all.
  std::string no_step_log() const {
    const std::string topic = run_.steps_topic();
    if (run_.step_logs == 0 && run_.other_steps > 0) {
      return fmt::format(
          "the {} messages on {} do not tell which start of the node they are of (no start_id: an "
          "older recording, or converted)",
          run_.other_steps, topic);
    }
    if (run_.step_logs == 0) return fmt::format("there is no message on {} in the log", topic);
    const std::uint64_t unread =
        run_.step_logs - std::min(run_.step_logs, step_logs_read_) + step_logs_unreadable_;
    if (unread > 0) {
      return fmt::format("{} of the {} messages on {} cannot be read", unread, run_.step_logs,
                         topic);
    }
    return next_number_ == 0 ? fmt::format("the messages on {} hold no step", topic) : "";
  }
  /// The steps in `step_log_` are not those that come next.
  std::string wrong_number() const {
    const std::uint64_t first = step_log_.first();
    if (first < next_number_) return fmt::format("step {} is in the log twice", first);
    if (next_number_ > 0) {
      return fmt::format("steps {} to {} are not in the log: lost", next_number_, first - 1);
    }
    return fmt::format(
        "steps 0 to {} are not in the log: the log was begun after the node, and a replay needs "
        "the node from its constructor on",
        first - 1);
  }
  /// A constructor, steps, perhaps a stop: a node can do nothing else.
  bool makes_sense(const v1::StepRecord& step) {
    const bool is_first = next_number_ == 0;
    if (!v1::StepKind_IsValid(step.kind()) || step.kind() == v1::STEP_KIND_UNSPECIFIED) {
      problem_ = fmt::format("step {} is of an unknown kind ({})", next_number_,
                             static_cast<int>(step.kind()));
    } else if (is_first != (step.kind() == v1::STEP_KIND_CREATE)) {
      problem_ = is_first ? "step 0 is not the node's constructor"
                          : fmt::format("step {} is a second constructor", next_number_);
    } else if (last_kind_ == v1::STEP_KIND_STOP) {
      problem_ = fmt::format("step {} comes after the node's stop", next_number_);
    }
    last_kind_ = step.kind();
    return problem_.empty();
  }

  const NodeRun& run_;
  std::size_t most_bytes_, bytes_ = 0;  ///< bytes of the inputs
  std::map<Key, Track> tracks_;
  std::unordered_map<const log::Channel*, Use> uses_;
  std::deque<std::pair<std::uint64_t, v1::StepLog>> waiting_;  ///< read ahead, with log times
  /// step log whose steps are being returned
  v1::StepLog step_log_;
  std::uint64_t step_log_time_ns_ = 0;  ///< when it was received
  int next_step_ = 0;                   ///< in it
  std::uint64_t next_number_ = 0;
  std::uint64_t step_logs_read_ = 0, step_logs_unreadable_ = 0;
  std::uint64_t last_step_log_seq_ = 0;
  v1::StepKind last_kind_ = v1::STEP_KIND_UNSPECIFIED;
  std::uint64_t log_time_ns_ = 0;
  std::string problem_;
  log::MergedReader reader_;
};

}  // namespace mimesis::tool
