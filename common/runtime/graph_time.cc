#include "common/runtime/graph_time.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>

#include "common/error.h"

namespace mimesis::runtime {
namespace {

Time system_offset() {
  return std::chrono::system_clock::now().time_since_epoch() -
         std::chrono::steady_clock::now().time_since_epoch();
}

}  // namespace

GraphTime::GraphTime(const std::string& directory) {
  const std::string path = directory + "/wall_clock";
  lock_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600);
  if (lock_ < 0) throw ConfigError("cannot open " + path + ": " + std::strerror(errno));
  if (flock(lock_, LOCK_EX | LOCK_NB) == 0) {  // nobody else is alive
    const std::string text = std::to_string(system_offset().count()) + "\n";
    const bool written = ftruncate(lock_, 0) == 0 &&
                         pwrite(lock_, text.data(), text.size(), 0) == ssize_t(text.size());
    if (!written) {
      const std::string why = std::strerror(errno);
      close(lock_);
      throw ConfigError("cannot write " + path + ": " + why);
    }
  }
  flock(lock_, LOCK_SH);
  std::array<char, 32> text{};
  const ssize_t n = pread(lock_, text.data(), text.size(), 0);
  std::int64_t offset_ns = 0;
  const auto end = std::from_chars(text.data(), text.data() + std::max<ssize_t>(n, 0), offset_ns);
  if (end.ec != std::errc{}) {
    close(lock_);
    throw ConfigError(path + ": expected a number of nanoseconds; remove it when no node runs");
  }
  offset_ = Time(offset_ns);
}

GraphTime::~GraphTime() { close(lock_); }

Time GraphTime::system_ahead() const { return system_offset() - offset_; }

}  // namespace mimesis::runtime
