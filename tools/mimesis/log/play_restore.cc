#include "tools/mimesis/log/play_restore.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include "tools/mimesis/log/elided_payload.h"

namespace mimesis::tool {
namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;  // of the file

/// Of an input that a step takes from one port, the last: the others were replaced by it.
void keep_last(std::vector<v1::ReplayMessage>& inputs) {
  std::set<std::pair<std::string, std::string>> later;  // port, node
  std::vector<v1::ReplayMessage> kept;
  for (auto it = inputs.rbegin(); it != inputs.rend(); ++it) {
    if (later.emplace(it->port(), it->node()).second) kept.push_back(std::move(*it));
  }
  inputs.assign(std::make_move_iterator(kept.rbegin()), std::make_move_iterator(kept.rend()));
}

}  // namespace

PlayRestorer::PlayRestorer(const Playback& playback, std::function<void()> arrived)
    : playback_(playback), arrived_(std::move(arrived)), file_(std::tmpfile(), std::fclose) {
  if (file_ == nullptr) return;  // images stay as they are in the log
  for (const OpenChannel& c : channels_of(playback.logs())) {
    if (!is_elided(*c.channel)) continue;
    const auto played = std::ranges::find(playback.topics(), c.channel->topic, &PlayedTopic::topic);
    if (played != playback.topics().end()) topics_[c.channel->topic].played = &*played;
  }
  if (!topics_.empty()) thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

PlayRestorer::~PlayRestorer() = default;

void PlayRestorer::look_at(std::set<std::string> topics, std::uint64_t log_time_ns) {
  const std::lock_guard lock(mutex_);
  looked_at_ = std::move(topics);
  log_time_ns_ = log_time_ns;
  news_.notify_one();
}

std::optional<std::string> PlayRestorer::whole(const Played& message) {
  const auto topic = topics_.find(message.topic->topic);
  if (topic == topics_.end()) return std::nullopt;
  const std::lock_guard lock(mutex_);
  auto& [name, t] = *topic;
  const auto entry =
      std::ranges::lower_bound(t.entries, message.publish_time_ns, {}, &Entry::publish_time_ns);
  if (entry == t.entries.end() || entry->publish_time_ns != message.publish_time_ns ||
      entry->size == 0)
    return std::nullopt;
  t.told_ns = entry->publish_time_ns;
  return read(*entry);
}

std::vector<Played> PlayRestorer::fresh() {
  const std::lock_guard lock(mutex_);
  std::vector<Played> found;
  for (const std::string& name : looked_at_) {
    Topic& t = topics_.at(name);
    auto entry = std::ranges::upper_bound(t.entries, log_time_ns_, {}, &Entry::log_time_ns);
    constexpr int kBack = 16;  // images that are older would be a surprise
    for (int i = 0; i < kBack && entry != t.entries.begin(); ++i) {
      if ((--entry)->size == 0) continue;
      if (entry->publish_time_ns != t.told_ns)
        found.push_back({t.played, entry->log_time_ns, entry->publish_time_ns, read(*entry)});
      t.told_ns = entry->publish_time_ns;
      break;
    }
  }
  return found;
}

PlayRestorer::Progress PlayRestorer::progress() {
  const std::lock_guard lock(mutex_);
  Progress p;
  for (const std::string& name : looked_at_) {
    const Topic& t = topics_.at(name);
    p.all += t.entries.size();
    p.computed += t.entries.size() - t.missing.size();
    if (indexed_ && !runs_[t.run].problem.empty()) p.problem = runs_[t.run].problem;
  }
  return p;
}

/// What is elided, and who computes it.
void PlayRestorer::index() {
  std::vector<Run> runs;
  for (NodeRun& run : find_node_runs(playback_.logs()))
    runs.emplace_back().recorded = std::move(run);
  std::map<std::string, Topic> found;
  const auto reader = playback_.reader({is_elided, playback_.start_ns(), playback_.end_ns() + 1});
  while (const Item* item = reader->next()) {
    const auto run = std::ranges::find_if(runs, [&](const Run& r) {
      return r.recorded.node() == sender_of(*item->channel) &&
             r.recorded.start.start_id() == start_id_of(*item->channel);
    });
    if (run == runs.end() || !topics_.contains(item->channel->topic)) continue;
    Topic& t = found[item->channel->topic];
    t.run = static_cast<std::size_t>(run - runs.begin());
    t.missing.insert(t.entries.size());
    const log::Message& m = *item->message;
    t.entries.push_back({m.log_time, m.publish_time, std::string(m.data)});
  }
  const std::lock_guard lock(mutex_);
  runs_ = std::move(runs);
  for (auto& [name, topic] : found) {
    topic.played = topics_.at(name).played;
    topics_.at(name) = std::move(topic);
  }
  indexed_ = true;
}

void PlayRestorer::work(const std::stop_token& stop) {
  constexpr int kNice = 10;  // of this thread and the nodes that it starts: who looks goes before
  [[maybe_unused]] const int set = setpriority(PRIO_PROCESS, 0, kNice);
  index();
  while (!stop.stop_requested()) {
    std::optional<Target> target;
    {
      std::unique_lock lock(mutex_);
      if (!news_.wait(lock, stop, [&] { return (target = next()).has_value(); })) return;
    }
    Run& run = runs_[target->topic->run];
    std::string problem = compute(*target, stop);
    if (!problem.empty() && !run.all_steps && run.answered) {
      run.again.reset();  // it keeps something from step to step, then
      run.all_steps = true;
      problem = compute(*target, stop);
    }
    if (!problem.empty()) {
      const std::lock_guard lock(mutex_);
      target->topic->missing.erase(target->entry);  // never
      if (run.answered) run.problem = std::move(problem);
    }
    arrived_();
  }
}

/// The newest up to the present time; else the first that is missing behind it, else before it.
std::optional<PlayRestorer::Target> PlayRestorer::next() {
  std::optional<Target> later;
  for (const std::string& name : looked_at_) {
    Topic& t = topics_.at(name);
    if (t.missing.empty() || !runs_[t.run].problem.empty()) continue;
    const auto after = static_cast<std::size_t>(
        std::ranges::upper_bound(t.entries, log_time_ns_, {}, &Entry::log_time_ns) -
        t.entries.begin());
    if (after > 0 && t.missing.contains(after - 1)) return Target{&t, after - 1};
    if (later || end_ >= kMostBytes) continue;
    const auto behind = t.missing.lower_bound(after);
    later = Target{&t, behind == t.missing.end() ? *t.missing.begin() : *behind};
  }
  return later;
}

std::string PlayRestorer::compute(const Target& target, const std::stop_token& stop) {
  Run& run = runs_[target.topic->run];
  const std::uint64_t until_ns = target.topic->entries[target.entry].publish_time_ns;
  try {
    if (run.again == nullptr || (run.time_ns >= until_ns && run.all_steps)) {
      run.again = std::make_unique<NodeRerun>(playback_.logs(), run.recorded, false);
      run.inputs.clear(), run.time_ns = 0, run.sent = false;
    } else if (run.time_ns >= until_ns) {
      run.again->rewind();
      run.inputs.clear(), run.time_ns = 0;
    }
  } catch (const std::exception& error) {
    run.answered = run.all_steps = true;
    return error.what();
  }
  while (run.time_ns < until_ns && !stop.stop_requested()) {
    auto step = run.again->next();
    run.answered = step.has_value();
    if (!step) {  // the recorder ended between the message and the step, for instance
      run.again.reset();
      return step.error().reason;
    }
    const v1::StepRecord& record = step->step();
    const bool created = record.kind() == v1::STEP_KIND_CREATE;
    if (created && run.sent) continue;  // after a rewind
    run.time_ns = record.time_ns();
    for (v1::ReplayMessage& input : *step->mutable_inputs()) run.inputs.push_back(std::move(input));
    if (!run.all_steps) keep_last(run.inputs);
    const bool needed = run.all_steps || !run.sent || record.requests_size() > 0;
    if (!needed && run.time_ns < until_ns) continue;
    step->clear_inputs();
    for (v1::ReplayMessage& input : run.inputs) *step->add_inputs() = std::move(input);
    run.inputs.clear();
    auto outcome = run.again->run(*step);
    if (!outcome) return outcome.error().reason;
    const std::lock_guard lock(mutex_);
    for (const v1::ReplayMessage& output : outcome->outputs()) {
      run.sent = run.sent || topics_.contains(output.topic());
      keep(output.topic(), output);
    }
  }
  const std::lock_guard lock(mutex_);
  if (stop.stop_requested() || target.topic->entries[target.entry].size > 0) return {};
  return fmt::format(
      "{} is computed differently here than it was recorded: another version of the program, or "
      "another machine",
      target.topic->played->topic);
}

/// With the lock.
void PlayRestorer::keep(const std::string& topic, const v1::ReplayMessage& output) {
  const auto known = topics_.find(topic);
  if (known == topics_.end()) return;
  Topic& t = known->second;
  const auto entry =
      std::ranges::lower_bound(t.entries, output.stamp_ns(), {}, &Entry::publish_time_ns);
  if (entry == t.entries.end() || entry->publish_time_ns != output.stamp_ns() || entry->size > 0 ||
      elide(output.payload()) != entry->elided)
    return;
  const std::string& bytes = output.payload();
  const int file = fileno(file_.get());
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n =
        pwrite(file, bytes.data() + done, bytes.size() - done, static_cast<off_t>(end_ + done));
    if (n <= 0) {
      runs_[t.run].problem = "the temporary folder is full";
      return;
    }
    done += static_cast<std::size_t>(n);
  }
  entry->offset = end_;
  entry->size = bytes.size();
  end_ += bytes.size();
  t.missing.erase(static_cast<std::size_t>(entry - t.entries.begin()));
}

std::string PlayRestorer::read(const Entry& entry) const {
  std::string bytes(entry.size, '\0');
  const ssize_t n =
      pread(fileno(file_.get()), bytes.data(), bytes.size(), static_cast<off_t>(entry.offset));
  return n == static_cast<ssize_t>(bytes.size()) ? bytes : entry.elided;
}

}  // namespace mimesis::tool
