#include "common/log/test/outcome.h"

#include "common/log/indexed_reader.h"
#include "common/log/test/sample_log.h"

namespace mimesis::log {
namespace {

void add(const Message& message, Outcome& outcome) {
  const std::uint32_t i = 2 * (message.sequence - 1) + (message.channel_id - 1u);
  outcome.messages.push_back(i);
  outcome.altered += sample(message) != sample_message(i);
}

std::string text(const Attachment& a) {
  return a.name + "|" + a.media_type + "|" + std::to_string(a.log_time) + "|" +
         std::to_string(a.create_time) + "|" + std::string(a.data);
}

std::string text(const Metadata& m) {
  std::string all = m.name;
  for (const auto& [key, value] : m.metadata) all += "|" + key + "=" + value;
  return all;
}

}  // namespace

Outcome read_streamed(const std::string& file, const ReaderLimits& limits) {
  const MemorySource source(file);
  StreamReader reader(source, limits);
  Outcome outcome;
  while (const Record* record = reader.next()) {
    if (const auto* m = std::get_if<Message>(record)) add(*m, outcome);
    if (const auto* a = std::get_if<Attachment>(record)) outcome.attachments.push_back(text(*a));
    if (const auto* m = std::get_if<Metadata>(record)) outcome.metadata.push_back(text(*m));
  }
  outcome.damages = reader.damages();
  return outcome;
}

Outcome read_indexed(const std::string& file) {
  const MemorySource source(file);
  Outcome outcome;
  const auto summary = summarize(source);
  if (!summary) {
    outcome.damages.push_back({0, summary.error().reason});
    return outcome;
  }
  outcome.damages = summary->damages;
  IndexedReader reader(source, *summary);
  while (const Message* m = reader.next()) add(*m, outcome);
  outcome.damages.insert(outcome.damages.end(), reader.damages().begin(), reader.damages().end());
  for (const AttachmentIndex& index : summary->attachments) {
    std::string data;
    if (const auto a = read_attachment(source, index, data)) {
      outcome.attachments.push_back(text(*a));
    } else {
      outcome.damages.push_back({index.offset, a.error().reason});
    }
  }
  return outcome;
}

}  // namespace mimesis::log
