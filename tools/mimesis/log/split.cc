#include "tools/mimesis/log/split.h"

#include <fmt/format.h>

#include <filesystem>

namespace mimesis::tool {
namespace {

std::string name_of(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

}  // namespace

std::string split_path(const std::string& output, std::uint64_t index) {
  const std::filesystem::path path(output);
  const std::string name =
      fmt::format("{}_{:03}{}", path.stem().string(), index, path.extension().string());
  return (path.parent_path() / name).string();
}

void remove_if_empty(const std::string& path) {
  std::error_code gone;
  if (std::filesystem::file_size(path, gone) == 0 && !gone) std::filesystem::remove(path, gone);
}

SplitLog::SplitLog(std::string output, SplitOptions options, OpenRecordFile open)
    : output_(std::move(output)), options_(options), open_(std::move(open)) {}

log::Result SplitLog::start() {
  const std::string path = options_.on() ? split_path(output_, 0) : output_;
  auto file = open(path);
  if (!file) return tl::unexpected(file.error());
  file_ = std::move(*file);
  files_.add(path);
  return {};
}

std::map<std::string, std::string> SplitLog::place(std::uint64_t index) const {
  return {{"index", std::to_string(index)},
          {"previous", index == 0 ? "" : name_of(split_path(output_, index - 1))}};
}

tl::expected<SplitLog::File, Status> SplitLog::open(const std::string& path) {
  auto file = open_(path);
  if (!file || !options_.on()) return file;
  const auto done = (*file)->writer().add_metadata({"mimesis.split", place(index_)});
  if (!done) return tl::unexpected(done.error());
  return file;
}

log::Result SplitLog::write(const Recorded& message, WallTime now) {
  if (due(message)) {
    if (auto done = next(message, now); !done) return done;
  }
  ++messages_;
  if (options_.on() && message.latched) latched_[{message.topic, message.node}] = message;
  return file_->write(message, now);
}

bool SplitLog::due(const Recorded& message) {
  if (!options_.on()) return false;
  if (message.ordered && !graph_time_) {
    graph_time_ = true;
    first_time_ns_.reset();
  }
  const bool has_time = message.ordered == graph_time_;
  if (has_time && !first_time_ns_) first_time_ns_ = message.log_time_ns;
  if (file_->counts().total.received == 0) return false;
  if (options_.size > 0 && file_->size_if_closed(message.payload.size()) > options_.size) {
    return true;
  }
  return options_.duration.count() > 0 && has_time &&
         message.log_time_ns >=
             *first_time_ns_ + static_cast<std::uint64_t>(options_.duration.count());
}

log::Result SplitLog::next(const Recorded& first, WallTime now) {
  ++index_;
  const std::string path = split_path(output_, index_);
  auto file = open(path);
  if (!file) {
    remove_if_empty(path);
    return tl::unexpected(file.error());
  }
  log::Result done;
  for (const auto& [key, message] : latched_) {
    const bool replaced = key == std::pair(first.topic, first.node);
    if (done && !replaced) done = (*file)->repeat(message, first.log_time_ns, now);
  }
  if (done) done = (*file)->writer().flush();
  if (done) done = close(*file_, name_of(path));
  files_.add(path);
  file_ = std::move(*file);
  first_time_ns_.reset();
  if (first.ordered == graph_time_) first_time_ns_ = first.log_time_ns;
  return done;
}

log::Result SplitLog::close(RecordFile& file, const std::string& next_path) {
  whole_.add(file.counts());
  log::Result done;
  if (options_.on()) {
    // Unless this is the last, the next one is open already.
    auto metadata = place(next_path.empty() ? index_ : index_ - 1);
    metadata["next"] = next_path;
    done = file.writer().add_metadata({"mimesis.split", std::move(metadata)});
    if (done) done = file.writer().add_metadata({"mimesis.counts.whole", whole_.metadata()});
  }
  if (done) done = file.finish();
  files_.set_size(file.writer().bytes_written());
  return done;
}

OwnFiles& SplitLog::files() {
  files_.set_size(file_->size_if_closed());
  return files_;
}

}  // namespace mimesis::tool
