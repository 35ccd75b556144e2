#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/log/codec.h"

namespace mimesis::log {

/// Different payloads, to be written in turn; they compress like those of the reference's figures
/// [log-format.md 1.4]: 4 kB almost to nothing, the others have every second 16 bytes random.
std::vector<std::string> payloads(std::size_t size);

/// A file that is removed at the end of its life.
struct BenchFile {
  explicit BenchFile(const std::string& folder);
  ~BenchFile();
  BenchFile(const BenchFile&) = delete;
  BenchFile& operator=(const BenchFile&) = delete;

  /// Writes `count` messages of 20 channels with log times 0, 1, 2, ...; false if anything failed.
  bool write(const std::vector<std::string>& all, std::uint32_t count, Compression codec) const;
  std::uint64_t size() const;

  std::string path;
};

/// CPU time of this process so far, all threads [s].
double cpu_s();

}  // namespace mimesis::log
