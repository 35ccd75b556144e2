// Any bytes as a log: all readers must survive them, within bounds.
//   cmake --preset fuzz && ninja -C build-fuzz log_fuzz
//   cp -r tests/replay/logs CORPUS && build-fuzz/bin/log_fuzz -rss_limit_mb=512 CORPUS
#include <cstdint>

#include "common/error.h"
#include "common/log/indexed_reader.h"

namespace {

using namespace mimesis::log;

std::uint64_t sum_of(std::string_view bytes) {  // touches every byte, for AddressSanitizer
  std::uint64_t sum = 0;
  for (const char c : bytes) sum += static_cast<unsigned char>(c);
  return sum;
}

void read(const Source& source) {
  StreamReader reader(source);
  std::uint64_t sum = 0;
  while (const Record* record = reader.next()) {
    if (const auto* m = std::get_if<Message>(record)) sum += sum_of(m->data);
    if (const auto* a = std::get_if<Attachment>(record)) sum += sum_of(a->data);
  }
  MIMESIS_ASSERT(reader.complete() || reader.damage_count() > 0);
  static_cast<void>(sum);
}

void seek(const Source& source) {
  const auto summary = summarize(source);
  if (!summary) return;
  IndexedReader reader(source, *summary);
  std::uint64_t sum = 0;
  while (const Message* m = reader.next()) sum += sum_of(m->data);
  std::string data;
  for (const AttachmentIndex& index : summary->attachments) {
    if (read_attachment(source, index, data)) sum += sum_of(data);
  }
  for (const MetadataIndex& index : summary->metadata) sum += read_metadata(source, index) ? 1 : 0;
  static_cast<void>(sum);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const MemorySource source({reinterpret_cast<const char*>(data), size});
  read(source);
  seek(source);
  return 0;
}
