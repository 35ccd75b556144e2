#pragma once
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "tools/mimesis/log/provenance.h"
#include "tools/mimesis/log/record_file.h"

namespace mimesis::tool {

/// What every file of a recording begins with: attachments and where it comes from.
class RecordHead {
 public:
  struct Options {
    log::WriterOptions writer;
    std::chrono::nanoseconds sync{0};
    RecordFile::Descriptors descriptors;
  };

  /// Reads the files to attach; the launch file of `provenance` may be missing (it is on another
  /// host). @throws ConfigError if another one cannot be read.
  RecordHead(const std::vector<std::string>& attach, Provenance provenance, Options options);

  /// A new file with this head, written through: a disk that is full already is told.
  tl::expected<std::unique_ptr<RecordFile>, Status> open(const std::string& path) const;

 private:
  struct Attached {
    std::string name, data;
  };
  bool attach(const std::string& path);

  Provenance provenance_;
  Options options_;
  std::vector<Attached> attached_;
};

}  // namespace mimesis::tool
