#include "common/log/spill.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace mimesis::log {
namespace {
constexpr std::size_t kSpillPiece = 256 * 1024;
}

Spill::Spill(std::string folder, std::size_t limit) : folder_(std::move(folder)), limit_(limit) {}

Spill::~Spill() {
  if (fd_ >= 0) ::close(fd_);
}

void Spill::append(std::string_view bytes) {
  memory_.append(bytes);
  if (memory_.size() >= limit_ && !folder_.empty()) move_to_disk();
}

void Spill::move_to_disk() {
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

Result Spill::read(const std::function<Result(std::string_view)>& take) const {
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

}  // namespace mimesis::log
