#include "tools/mimesis/launch/capture.h"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {
namespace {

constexpr std::size_t kMaxText = 65536;

/// Reads what is there; closes at the end of the stream.
void drain(Fd& fd, std::string& into) {
  std::array<char, 4096> buffer;
  while (fd.open()) {
    const ssize_t n = read(fd.get(), buffer.data(), buffer.size());
    if (n < 0) return;
    if (n == 0) return fd.reset();
    if (into.size() < kMaxText) into.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

}  // namespace

Captured capture(const Command& command, std::chrono::milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  Captured captured;
  std::string ignored;
  Child child = spawn(command, {});
  const auto deadline = Clock::now() + timeout;
  while (true) {
    std::array<pollfd, 3> fds = {pollfd{child.out.get(), POLLIN, 0},
                                 pollfd{child.err.get(), POLLIN, 0},
                                 pollfd{child.pidfd.get(), POLLIN, 0}};
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) {
      child.send(SIGKILL);
      captured.err += "no answer within " + std::to_string(timeout.count()) + " ms\n";
    }
    poll(fds.data(), fds.size(), static_cast<int>(std::max<long>(left.count(), 100)));
    drain(child.out, ignored);
    drain(child.err, captured.err);
    if (const auto ending = child.reap()) {
      drain(child.err, captured.err);
      captured.exit_code = ending->signal != 0 ? 128 + ending->signal : ending->code;
      if (ending->signal != 0) captured.err += command.argv[0] + ": " + ending->text() + "\n";
      return captured;
    }
  }
}

}  // namespace mimesis::launch
