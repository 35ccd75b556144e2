#pragma once
#include <sys/stat.h>

#include <chrono>
#include <string>

namespace mimesis::runtime {

/// Tells by a folder's time of change whether entries may have come or gone: one system call a
/// look. inotify would tell births at once, but closing one waits for the kernel (Linux 6.18: 8 ms
/// on an idle machine, up to 10 s on a busy one), and with it the end of every process.
class FolderChanges {
 public:
  using Clock = std::chrono::steady_clock;

  /// True from a change on for 30 ms, since times of change within a tick of the kernel's clock are
  /// equal; the first look counts as one.
  bool look(const std::string& folder, Clock::time_point now) {
    struct stat st {};
    const bool there = stat(folder.c_str(), &st) == 0;
    const std::int64_t at_ns = st.st_mtim.tv_sec * 1'000'000'000 + st.st_mtim.tv_nsec;
    if (there && (st.st_ino != inode_ || at_ns != at_ns_)) {
      inode_ = st.st_ino;
      at_ns_ = at_ns;
      changed_ = now;
    }
    return now < changed_ + kTick;
  }
  Clock::time_point changed() const { return changed_; }  ///< when the last change was seen

 private:
  static constexpr std::chrono::milliseconds kTick{30};
  ino_t inode_ = 0;
  std::int64_t at_ns_ = 0;
  Clock::time_point changed_{};
};

}  // namespace mimesis::runtime
