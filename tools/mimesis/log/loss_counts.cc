#include "tools/mimesis/log/loss_counts.h"

#include <fmt/format.h>

#include <cinttypes>
#include <cstdio>

namespace mimesis::tool {
namespace {

constexpr const char* kTotal = "total";

std::optional<LossCount> parse(const std::string& text) {
  LossCount count;
  int used = 0;
  if (std::sscanf(text.c_str(), "received=%" SCNu64 " lost=%" SCNu64 "%n", &count.received,
                  &count.lost, &used) != 2 ||
      static_cast<std::size_t>(used) != text.size()) {
    return std::nullopt;
  }
  return count;
}

std::string text(const LossCount& count) {
  return fmt::format("received={} lost={}", count.received, count.lost);
}

}  // namespace

std::string loss_key(const log::Channel& channel) {
  return fmt::format("{} ({})", channel.topic, sender_of(channel));
}

void add_losses(const std::map<std::string, std::string>& metadata, LossCounts& counts) {
  for (const auto& [key, value] : metadata) {
    const auto count = parse(value);
    if (!count || key == kTotal) continue;
    counts[key].received += count->received;
    counts[key].lost += count->lost;
  }
}

std::optional<LossCounts> read_losses(const std::vector<OpenLog>& logs) {
  LossCounts counts;
  bool any = false;
  for (const OpenLog& log : logs) {
    for (const log::MetadataIndex& index : log.summary.metadata) {
      if (index.name != kCountsName) continue;
      const auto metadata = log::read_metadata(*log.source, index);
      if (!metadata) continue;
      any = true;
      add_losses(metadata->metadata, counts);
    }
  }
  if (!any) return std::nullopt;
  return counts;
}

log::Metadata losses_metadata(const LossCounts& counts) {
  log::Metadata metadata{kCountsName, {}};
  LossCount total;
  for (const auto& [key, count] : counts) {
    metadata.metadata[key] = text(count);
    total.received += count.received;
    total.lost += count.lost;
  }
  metadata.metadata[kTotal] = text(total);
  return metadata;
}

}  // namespace mimesis::tool
