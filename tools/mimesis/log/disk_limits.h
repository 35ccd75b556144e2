#pragma once
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace mimesis::tool {

/// What a recording may take. 0: no limit.
struct DiskLimits {
  std::uint64_t max_size = 0;     ///< of all files of the recording [bytes]
  std::uint64_t min_free = 0;     ///< on the disk [bytes]
  double min_free_percent = 0.0;  ///< of the disk's size [%]
  bool delete_oldest = false;     ///< when full: the recording's own oldest file; else stop

  bool any() const { return max_size > 0 || min_free > 0 || min_free_percent > 0.0; }
};

/// What is left for an unprivileged user on the disk that holds a file.
struct DiskSpace {
  std::uint64_t free = 0, size = 0;  ///< [bytes]
};
/// `path` or its folder must exist; all zero if the system does not tell.
DiskSpace disk_space(const std::string& path);

/// Which limit is reached, in words with its figures; empty if none is.
/// @param recorded  size of the recording once its open file is closed [bytes]
std::string reached_limit(const DiskLimits& limits, std::uint64_t recorded, const DiskSpace& disk);

/// The files of one recording, oldest first. The last may be open.
class OwnFiles {
 public:
  void add(std::string path) { files_.push_back({std::move(path), 0}); }
  /// Of the last [bytes].
  void set_size(std::uint64_t bytes);
  std::uint64_t total() const { return total_; }
  const std::string& last() const { return files_.back().path; }
  bool empty() const { return files_.empty(); }
  std::vector<std::string> paths() const;
  /// Takes the oldest out of the list; empty if that is the last, which is being written.
  std::string take_oldest();

 private:
  struct File {
    std::string path;
    std::uint64_t bytes;
  };
  std::deque<File> files_;
  std::uint64_t total_ = 0;
};

}  // namespace mimesis::tool
