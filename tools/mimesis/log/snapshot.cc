#include "tools/mimesis/log/snapshot.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "tools/mimesis/log/human.h"

namespace mimesis::tool {
namespace {

constexpr std::uint64_t kSlice = 4'000'000;  // some 20 ms of compression [bytes]

std::uint64_t size_of(const Recorded& m) {
  return sizeof(Recorded) + sizeof(SnapshotRing::Kept) + m.topic.size() + m.type.size() +
         m.node.size() + m.payload.size();
}

}  // namespace

void SnapshotRing::add(Message message, WallTime now) {
  bytes_ += size_of(*message);
  kept_.push_back({std::move(message), now});
  while (bytes_ > limit_ && kept_.size() > 1) drop_oldest();
}

void SnapshotRing::forget(WallTime now) {
  while (!kept_.empty() && kept_.front().received + duration_ < now) drop_oldest();
}

void SnapshotRing::drop_oldest() {
  Message message = std::move(kept_.front().message);
  kept_.pop_front();
  bytes_ -= size_of(*message);
  if (!message->latched) return;
  std::pair key{message->topic, message->node};
  latched_[std::move(key)] = std::move(message);
}

Snapshots::Snapshots(SnapshotOptions options, std::string output, OpenRecordFile open,
                     std::function<std::string()> stamp,
                     std::function<void(const std::string&)> report)
    : options_(std::move(options)),
      output_(std::move(output)),
      open_(std::move(open)),
      stamp_(std::move(stamp)),
      report_(std::move(report)),
      ring_(options_.duration, options_.size) {}

log::Result Snapshots::write(Recorded message, WallTime now) {
  const auto kept = std::make_shared<const Recorded>(std::move(message));
  ring_.add(kept, now);
  if (file_ != nullptr && now <= until_) wait(kept);
  if (std::ranges::find(options_.topics, kept->topic) == options_.topics.end()) return {};
  // A topic that goes on and on would write the same again and again.
  const auto last = triggered_.find(kept->topic);
  if (last != triggered_.end() && now < last->second + options_.duration) return {};
  triggered_[kept->topic] = now;
  return trigger("a message on " + kept->topic, now);
}

log::Result Snapshots::trigger(const std::string& why, WallTime now) {
  if (file_ == nullptr) return begin(why, now);
  if (now > until_) next_ = why;
  return {};
}

std::string Snapshots::new_path() const {
  const std::filesystem::path path(output_);
  const std::string stem = fmt::format("{}_{}", path.stem().string(), stamp_());
  const std::vector<std::string> own = files_.paths();
  std::string name = (path.parent_path() / (stem + path.extension().string())).string();
  for (int n = 2; std::filesystem::exists(name) || std::ranges::find(own, name) != own.end(); ++n) {
    name =
        (path.parent_path() / fmt::format("{}-{}{}", stem, n, path.extension().string())).string();
  }
  return name;
}

log::Result Snapshots::begin(const std::string& why, WallTime now) {
  ring_.forget(now);
  const std::string path = new_path();
  auto file = open_(path);
  if (!file) return tl::unexpected(file.error());
  file_ = std::move(*file);
  files_.add(path);
  why_ = why;
  until_ = now + std::max<std::chrono::nanoseconds>(options_.after, kTail);
  if (auto done = file_->writer().add_metadata({"mimesis.snapshot", {{"trigger", why}}}); !done) {
    return done;
  }
  for (const auto& [key, message] : ring_.latched()) {
    const std::uint64_t time = ring_.messages().empty()
                                   ? message->log_time_ns
                                   : ring_.messages().front().message->log_time_ns;
    if (auto done = file_->repeat(*message, time, now); !done) return done;
  }
  for (const auto& kept : ring_.messages()) wait(kept.message);
  return {};
}

void Snapshots::wait(SnapshotRing::Message message) {
  waiting_bytes_ += size_of(*message);
  waiting_.push_back(std::move(message));
}

log::Result Snapshots::write_waiting(std::uint64_t at_least, WallTime now) {
  for (std::uint64_t written = 0; written < at_least && !waiting_.empty(); waiting_.pop_front()) {
    const std::uint64_t size = size_of(*waiting_.front());
    if (auto done = file_->write(*waiting_.front(), now); !done) return done;
    written += size;
    waiting_bytes_ -= size;
    ++messages_;
  }
  return {};
}

log::Result Snapshots::advance(WallTime now) {
  ring_.forget(now);
  if (file_ == nullptr) return {};
  // Never more in memory than twice what was asked for, however slow the disk.
  const std::uint64_t excess = waiting_bytes_ - std::min(waiting_bytes_, options_.size);
  if (auto done = write_waiting(std::max(excess, kSlice), now); !done) return done;
  if (auto done = file_->advance(now); !done) return done;
  if (!waiting_.empty() || now <= until_) return {};
  return complete(now);
}

log::Result Snapshots::complete(WallTime now) {
  if (auto done = file_->finish(); !done) return done;
  report_(fmt::format("{}: {} messages, {} ({})", files_.last(), file_->messages(),
                      bytes_text(file_->writer().bytes_written()), why_));
  files_.set_size(file_->writer().bytes_written());
  file_.reset();
  return next_.empty() ? log::Result{} : begin(std::exchange(next_, {}), now);
}

log::Result Snapshots::finish(WallTime now) {
  while (file_ != nullptr) {
    if (auto done = write_waiting(waiting_bytes_, now); !done) return done;
    if (auto done = complete(now); !done) return done;
  }
  return {};
}

OwnFiles& Snapshots::files() {
  if (file_ != nullptr) files_.set_size(file_->size_if_closed());
  return files_;
}

}  // namespace mimesis::tool
