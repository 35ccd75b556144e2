#pragma once
#include <map>
#include <string>
#include <vector>

#include "common/log/indexed_reader.h"
#include "tools/mimesis/log/record_file.h"

namespace mimesis::tool {

/// A recording whose files are strings.
struct MemoryFiles {
  std::map<std::string, std::string> files;  ///< by path

  OpenRecordFile open() {
    return [this](const std::string& path) {
      if (path == refused) throw WriteFailure("no room for " + path);
      files[path].clear();
      return std::make_unique<RecordFile>(
          std::make_unique<log::MemorySink>(files[path]),
          RecordFile::Options{
              .writer = {.compression = log::Compression::none, .background = false},
              .descriptors = [](std::uint64_t hash) { return "set of " + std::to_string(hash); }});
    };
  }
  std::string refused;  ///< this one cannot be opened
};

/// Contents of a file.
struct Contents {
  explicit Contents(const std::string& bytes) {
    const log::MemorySource source(bytes);
    const auto summary = log::summarize(source);
    if (!summary) return;
    closed = summary->from_file;
    for (const auto& index : summary->metadata) {
      if (auto m = log::read_metadata(source, index)) metadata[m->name] = m->metadata;  // the last
    }
    schemas = summary->schemas.size();
    log::IndexedReader reader(source, *summary);
    while (const log::Message* m = reader.next()) {
      messages.push_back(summary->channels.at(m->channel_id).topic + " " +
                         std::to_string(m->sequence));
      times.push_back(m->log_time);
    }
  }
  bool closed = false;
  std::size_t schemas = 0;
  std::map<std::string, std::map<std::string, std::string>> metadata;
  std::vector<std::string> messages;  ///< "TOPIC SEQ"
  std::vector<std::uint64_t> times;   ///< their log times
};

}  // namespace mimesis::tool
