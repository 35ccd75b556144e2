#include "tools/mimesis/log/disk_limits.h"

#include <fmt/format.h>
#include <sys/statvfs.h>

#include <filesystem>

#include "tools/mimesis/log/byte_size.h"

namespace mimesis::tool {

DiskSpace disk_space(const std::string& path) {
  struct statvfs info {};
  std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (folder.empty()) folder = ".";
  if (::statvfs(path.c_str(), &info) != 0 && ::statvfs(folder.c_str(), &info) != 0) return {};
  return {.free = std::uint64_t{info.f_bavail} * info.f_frsize,
          .size = std::uint64_t{info.f_blocks} * info.f_frsize};
}

std::string reached_limit(const DiskLimits& limits, std::uint64_t recorded, const DiskSpace& disk) {
  if (limits.max_size > 0 && recorded >= limits.max_size) {
    return fmt::format("the recording has reached --max-size {}", bytes_text(limits.max_size));
  }
  if (disk.size == 0) return {};
  const double percent = 100.0 * static_cast<double>(disk.free) / static_cast<double>(disk.size);
  if (disk.free < limits.min_free) {
    return fmt::format("{} are free on the disk, less than --min-free {}", bytes_text(disk.free),
                       bytes_text(limits.min_free));
  }
  if (percent < limits.min_free_percent) {
    return fmt::format("{:.1f} % of the disk are free, less than --min-free {}%", percent,
                       limits.min_free_percent);
  }
  return {};
}

void OwnFiles::set_size(std::uint64_t bytes) {
  total_ += bytes - files_.back().bytes;
  files_.back().bytes = bytes;
}

std::vector<std::string> OwnFiles::paths() const {
  std::vector<std::string> paths;
  for (const File& file : files_) paths.push_back(file.path);
  return paths;
}

std::string OwnFiles::take_oldest() {
  if (files_.size() < 2) return {};
  std::string path = std::move(files_.front().path);
  total_ -= files_.front().bytes;
  files_.pop_front();
  return path;
}

}  // namespace mimesis::tool
