#include "tools/mimesis/log/rewriting.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "tools/mimesis/log/byte_size.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {
namespace {

constexpr std::uint64_t kMostOverlap = 2ull << 30;  // held unpacked at once [bytes]
constexpr int kInterrupted = 130;
constexpr const char* kNodesName = "mimesis.nodes";  // name -> clock

/// Where a part stands in a split recording: void for what is made of several parts.
bool is_place(const std::string& name) {
  return name == "mimesis.split" || name == "mimesis.counts.whole";
}

/// Where in the work a log time is.
class Scale {
 public:
  Scale(const std::vector<OpenLog>& logs, const log::Selection& selection) : span_(span_of(logs)) {
    span_.start_ns = std::max(span_.start_ns, selection.start_time);
    span_.end_ns = std::min(span_.end_ns, selection.end_time);
    total_ = payload_bytes(logs, selection);
  }
  std::uint64_t total() const { return total_; }
  std::uint64_t at(std::uint64_t time) const {
    if (time <= span_.start_ns || span_.end_ns <= span_.start_ns) return 0;
    const double share = static_cast<double>(time - span_.start_ns) /
                         static_cast<double>(span_.end_ns - span_.start_ns);
    return static_cast<std::uint64_t>(std::min(share, 1.0) * static_cast<double>(total_));
  }

 private:
  Span span_;
  std::uint64_t total_ = 0;
};

}  // namespace

std::uint64_t overlap_bytes(const log::Summary& summary) {
  std::vector<std::pair<std::uint64_t, std::int64_t>> edges;  // at a time: so much more or less
  for (const log::Segment& s : summary.segments) {
    const auto size = static_cast<std::int64_t>(
        std::min<std::uint64_t>(s.index.uncompressed_size, log::ReaderLimits{}.chunk_size));
    edges.emplace_back(s.index.message_start_time, size);
    edges.emplace_back(s.index.message_end_time, -size);
  }
  // At equal times the larger first: what begins before what ends.
  std::ranges::sort(edges, [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second > b.second;
  });
  std::int64_t now = 0, most = 0;
  for (const auto& [time, change] : edges) most = std::max(most, now += change);
  return static_cast<std::uint64_t>(most);
}

Pass each_message(const std::string& what, const std::vector<OpenLog>& logs,
                  const log::Selection& selection,
                  const std::function<log::Result(const log::MergedReader::Item&)>& take,
                  const std::vector<std::int64_t>& offsets_ns) {
  Pass pass;
  for (const OpenLog& log : logs) {
    if (const auto bytes = overlap_bytes(log.summary); bytes > kMostOverlap) {
      throw ConfigError(
          fmt::format("{}: its messages are so far out of order that {} would be held "
                      "in memory: run 'mimesis log sort' first",
                      log.path, bytes_text(bytes)));
    }
    pass.damages += report_losses(log, log.summary.damages, log.summary.damage_count);
  }
  const StopSignals stop;
  const Scale scale(logs, selection);
  Progress progress(what, scale.total());
  auto reader = merged(logs, selection, offsets_ns);
  while (const log::MergedReader::Item* item = reader.next()) {
    if (stop.requested()) {
      pass.interrupted = true;
      return pass;
    }
    pass.done = take(*item);
    if (!pass.done) return pass;
    progress.at(scale.at(item->message->log_time));
  }
  for (std::size_t i = 0; i < logs.size(); ++i) {
    pass.damages += report_losses(logs[i], reader.damages(i), reader.damages(i).size());
  }
  return pass;
}

void copy_attachments(const std::vector<OpenLog>& logs, NewLog& out, Pass& pass) {
  for (const OpenLog& log : logs) {
    for (const log::AttachmentIndex& index : log.summary.attachments) {
      if (!pass.done || pass.interrupted) return;
      std::string data;
      if (const auto attachment = log::read_attachment(*log.source, index, data)) {
        pass.done = out.attach(*attachment);
      } else {
        std::cerr << log.path << ": " << attachment.error().reason << '\n';
        ++pass.damages;
      }
    }
  }
}

void copy_metadata(const std::vector<OpenLog>& logs, NewLog& out, Pass& pass,
                   const std::optional<LossCounts>& losses) {
  log::Metadata nodes{kNodesName, {}};
  const auto copy = [&](const log::Metadata& metadata) -> log::Result {
    if (losses && metadata.name == kCountsName) return {};
    if (logs.size() > 1 && is_place(metadata.name)) return {};
    if (metadata.name != kNodesName) return out.add_metadata(metadata);
    nodes.metadata.insert(metadata.metadata.begin(), metadata.metadata.end());
    return {};
  };
  for (const OpenLog& log : logs) {
    for (const log::MetadataIndex& index : log.summary.metadata) {
      if (!pass.done || pass.interrupted) return;
      if (const auto metadata = log::read_metadata(*log.source, index)) {
        pass.done = copy(*metadata);
      } else {
        std::cerr << log.path << ": " << metadata.error().reason << '\n';
        ++pass.damages;
      }
    }
  }
  if (pass.done && !nodes.metadata.empty()) pass.done = out.add_metadata(nodes);
  if (pass.done && losses) pass.done = out.add_metadata(losses_metadata(*losses));
}

std::uint64_t payload_bytes(const std::vector<OpenLog>& logs, const log::Selection& selection) {
  std::uint64_t total = 0;
  for (const OpenLog& log : logs) {
    for (const log::Segment& s : log.summary.segments) {
      const bool wanted = s.index.message_end_time >= selection.start_time &&
                          s.index.message_start_time < selection.end_time;
      total += wanted ? s.index.uncompressed_size : 0;
    }
  }
  return total;
}

std::string common_profile(const std::vector<OpenLog>& logs) {
  if (logs.empty()) return "";
  const std::string& first = logs.front().summary.header.profile;
  const bool same = std::ranges::all_of(
      logs, [&](const OpenLog& log) { return log.summary.header.profile == first; });
  return same ? first : "";
}

std::vector<std::string> paths_of(const std::vector<OpenLog>& logs) {
  std::vector<std::string> paths;
  for (const OpenLog& log : logs) paths.push_back(log.path);
  return paths;
}

std::uint64_t report_losses(const OpenLog& log, const std::vector<log::Damage>& damages,
                            std::uint64_t count) {
  report_damages(log.path, damages, count);
  const auto harmless = std::ranges::count_if(
      damages, [&](const log::Damage& d) { return d.offset >= log.source->size(); });
  return count - static_cast<std::uint64_t>(harmless);
}

int conclude(NewLog& out, Pass& pass, bool json, const nlohmann::ordered_json& more) {
  if (pass.interrupted) {
    std::cerr << "interrupted: '" << out.path() << "' was not written\n";
    return kInterrupted;
  }
  if (pass.done) pass.done = out.finish();
  if (!pass.done) {
    std::cerr << pass.done.error().reason << "; '" << out.path() << "' was not written\n";
    return 1;
  }
  std::cerr << out.line() << '\n';
  if (json) {
    auto object = out.json();
    object["damages"] = pass.damages;
    object.update(more);
    std::cout << object.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)
              << '\n';
  }
  return pass.damages == 0 ? 0 : 1;
}

}  // namespace mimesis::tool
