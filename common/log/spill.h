#pragma once
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <string_view>

#include "common/log/io.h"

namespace mimesis::log {

/// Bytes appended now and read back once at the end: in memory up to `limit`, beyond it in a file
/// without a name, so that what grows with a recording takes no memory.
class Spill {
 public:
  /// @param folder  on the disk to use; empty: memory only
  explicit Spill(std::string folder, std::size_t limit = 1024 * 1024)
      : folder_(std::move(folder)), limit_(limit) {}
  ~Spill() {
    if (fd_ >= 0) ::close(fd_);
  }
  Spill(const Spill&) = delete;
  Spill& operator=(const Spill&) = delete;

  /// Never fails: data that the disk does not take stays in memory.
  void append(std::string_view bytes) {
    memory_.append(bytes);
    if (memory_.size() >= limit_ && !folder_.empty()) move_to_disk();
  }
  std::uint64_t size() const { return on_disk_ + memory_.size(); }
  std::size_t in_memory() const { return memory_.size(); }
  /// Everything in its order, piece by piece, until one is not taken.
  [[nodiscard]] Result read(const std::function<Result(std::string_view)>& take) const {
    std::string piece;
    for (std::uint64_t at = 0; at < on_disk_;) {
      piece.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kSpillPiece, on_disk_ - at)));
      const ssize_t n = ::pread(fd_, piece.data(), piece.size(), static_cast<off_t>(at));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) {
        return tl::unexpected(
            Status{fmt::format("cannot read the index back: {}", std::strerror(errno))});
      }
      piece.resize(static_cast<std::size_t>(n));
      at += piece.size();
      if (auto done = take(piece); !done) return done;
    }
    return memory_.empty() ? Result{} : take(memory_);
  }

 private:
  static constexpr std::size_t kSpillPiece = 256 * 1024;

  void move_to_disk() {
    if (fd_ < 0) fd_ = ::open(folder_.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    std::size_t done = 0;
    while (fd_ >= 0 && done < memory_.size()) {
      const ssize_t n = ::pwrite(fd_, memory_.data() + done, memory_.size() - done,
                                 static_cast<off_t>(on_disk_ + done));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) break;
      done += static_cast<std::size_t>(n);
    }
    if (done < memory_.size()) {  // no such files here, or the disk is full: not asked again
      folder_.clear();
      memory_.erase(0, done);
    } else {
      memory_.clear();
    }
    on_disk_ += done;
  }

  std::string folder_;
  std::size_t limit_;
  int fd_ = -1;
  std::uint64_t on_disk_ = 0;
  std::string memory_;  ///< data that follows the part on the disk
};

}  // namespace mimesis::log
