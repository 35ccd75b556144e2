#include "tools/mimesis/log/play_bell.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include "common/error.h"

namespace mimesis::tool {

PlayBell::PlayBell() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) { MIMESIS_ASSERT(fd_ >= 0); }
PlayBell::~PlayBell() { close(fd_); }
// Both fail only if there is nothing to do: it rings already, or does not.
void PlayBell::ring() { [[maybe_unused]] const auto done = eventfd_write(fd_, 1); }
void PlayBell::clear() {
  eventfd_t count = 0;
  [[maybe_unused]] const auto done = eventfd_read(fd_, &count);
}

}  // namespace mimesis::tool
