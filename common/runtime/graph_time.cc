#include "common/runtime/graph_time.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>

#include "common/error.h"

namespace mimesis::runtime {

Time system_offset() {
  return std::chrono::system_clock::now().time_since_epoch() -
         std::chrono::steady_clock::now().time_since_epoch();
}

GraphTime::GraphTime(const std::string& directory)
    : path_(directory + "/wall_clock"), system_(system_offset()) {
  const auto fail = [this](const std::string& what) {
    if (lock_ >= 0) close(lock_);
    throw ConfigError(path_ + ": " + what);
  };
  for (bool kept = false; !kept;) {  // the last of those before may remove the file meanwhile
    if (lock_ >= 0) close(lock_);
    lock_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600);
    if (lock_ < 0) fail(std::string("cannot open it: ") + std::strerror(errno));
    if (flock(lock_, LOCK_EX | LOCK_NB) == 0) {  // nobody else is alive
      const std::string text = std::to_string(system_offset().count()) + "\n";
      if (ftruncate(lock_, 0) != 0 ||
          pwrite(lock_, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size())) {
        fail(std::string("cannot write it: ") + std::strerror(errno));
      }
    }
    flock(lock_, LOCK_SH);
    struct stat held {
    }, named{};
    kept =
        fstat(lock_, &held) == 0 && stat(path_.c_str(), &named) == 0 && held.st_ino == named.st_ino;
  }
  // The first node wrote the line; the number behind it is missing if that was Python.
  Shared file{};
  const ssize_t n = pread(lock_, &file, sizeof file, 0);
  const auto end = std::from_chars(file.text, file.text + sizeof file.text, file.offset_ns);
  if (n < static_cast<ssize_t>(sizeof file)) {
    if (n <= 0 || end.ec != std::errc{})
      fail("expected a number of nanoseconds; remove it when no node runs");
    if (pwrite(lock_, &file, sizeof file, 0) != sizeof file)
      fail(std::string("cannot write it: ") + std::strerror(errno));
  }
  void* mapped = mmap(nullptr, sizeof file, PROT_READ | PROT_WRITE, MAP_SHARED, lock_, 0);
  if (mapped == MAP_FAILED) fail(std::string("cannot map it: ") + std::strerror(errno));
  shared_ = static_cast<Shared*>(mapped);
}

GraphTime::~GraphTime() {
  if (flock(lock_, LOCK_EX | LOCK_NB) == 0) unlink(path_.c_str());  // the last one
  close(lock_);
  munmap(shared_, sizeof *shared_);
}

Time GraphTime::system_ahead() const { return system_offset() - system_; }

void GraphTime::set_offset(Time offset) {
  constexpr Time kText = std::chrono::milliseconds(1);  // for whom the line is exact enough
  std::int64_t said = 0;
  std::from_chars(shared_->text, shared_->text + sizeof shared_->text, said);
  if (offset - Time(said) > kText || Time(said) - offset > kText) {
    std::array<char, sizeof shared_->text> line{};
    const std::string text = std::to_string(offset.count()) + "\n";
    std::copy(text.begin(), text.end(), line.begin());
    std::memcpy(shared_->text, line.data(), line.size());
  }
  __atomic_store_n(&shared_->offset_ns, offset.count(), __ATOMIC_RELAXED);
}

}  // namespace mimesis::runtime
