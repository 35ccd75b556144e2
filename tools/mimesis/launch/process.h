#pragma once
#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>

#include "tools/mimesis/launch/command.h"

namespace mimesis::launch {

/// A file descriptor that closes itself.
class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) : fd_(fd) {}
  ~Fd() { reset(); }
  Fd(Fd&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  Fd& operator=(Fd&& other) noexcept;
  int get() const { return fd_; }
  bool open() const { return fd_ >= 0; }
  void reset();

 private:
  int fd_ = -1;
};

/// How a process ended.
struct Ending {
  int code = 0;    ///< exit code, if signal is 0
  int signal = 0;  ///< signal that killed it
  bool good() const { return code == 0 && signal == 0; }
  std::string text() const;  ///< "ended with exit code 3", "was killed by SIGSEGV"
  int exit_code() const { return signal != 0 ? 1 : code; }
};

/// A running child in a session of its own, which gets SIGTERM if this process dies.
struct Child {
  pid_t pid = -1;
  Fd pidfd;     ///< readable when it has ended
  Fd out, err;  ///< its standard output and error, non-blocking

  /// To its whole process group; nothing if it has been reaped.
  void send(int signal) const;
  /// Its ending if it has ended; reaps it and kills the rest of its process group.
  std::optional<Ending> reap();
};

/// File descriptors of this process that a child gets; -1: none.
struct Shared {
  int kept = -1;    ///< open in the child, under the same number
  int output = -1;  ///< for its standard output and error, instead of the pipes of `Child`
};

/// Starts a program. Call from the main thread: the child gets a signal when that thread ends.
/// @throws std::runtime_error "NAME: why" if it cannot be started or scheduled as `sched` says.
Child spawn(const Command& command, const Sched& sched, const Shared& shared = {});

/// Exit code and words of a program that ran to its end.
struct Captured {
  int exit_code = 1;
  std::string err;  ///< standard error, at most 64 KiB
};

/// Runs `command`; kills it after `timeout`.
Captured capture(const Command& command, std::chrono::milliseconds timeout);

}  // namespace mimesis::launch
