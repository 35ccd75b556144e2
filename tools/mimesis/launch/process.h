#pragma once
#include <poll.h>
#include <sys/mman.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/machine_time.h"
#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/graph_file.h"

namespace mimesis::launch {

/// A file descriptor that closes itself.
class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) : fd_(fd) {}
  ~Fd() { reset(); }
  Fd(Fd&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  Fd& operator=(Fd&& other) noexcept {
    std::swap(fd_, other.fd_);  // the other one closes ours
    return *this;
  }
  int get() const { return fd_; }
  bool open() const { return fd_ >= 0; }
  void reset() {
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
  }

 private:
  int fd_ = -1;
};

/// Keeps a program from changing anything: for programs that a log names, with parameters that the
/// log holds. Files are read-only, but for those below one folder; there are no devices but
/// /dev/null, /dev/zero and /dev/urandom, no sockets but those that are open, no other process to
/// send signals to or to look into. By Landlock (files; Linux 5.13, in Debian 12 on by default) and
/// seccomp (sockets), because both need neither privileges nor a further program, which
/// bubblewrap is, and work in containers, where namespaces are often refused.
class Confinement {
 public:
  /// `writable`: a folder. @throws ConfigError if the kernel has no Landlock
  explicit Confinement(const std::string& writable);
  /// For the child, between fork and exec: async-signal-safe. False: errno says why.
  bool enter() const;

 private:
  Fd rules_;
};

struct Pipe {
  Fd read, write;
};

/// Closed in programs that are started. @throws std::runtime_error without descriptors.
Pipe make_pipe();

/// How a process ended.
struct Ending {
  int code = 0;           ///< exit code, if signal is 0
  int signal = 0;         ///< signal that killed it
  std::string lost = {};  ///< host that it was lost with: nobody knows how it ended
  bool good() const { return code == 0 && signal == 0 && lost.empty(); }
  std::string text() const;  ///< "ended with exit code 3", "was killed by SIGSEGV"
  int exit_code() const { return signal != 0 || !lost.empty() ? 1 : code; }
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
  int input = -1;   ///< its standard input
  const Confinement* confinement = nullptr;  ///< if it is to be confined
};

/// NAME=VALUE of this process with those of a command.
std::vector<std::string> environment(const Command& command);

/// Starts a program. Call from the main thread: the child gets a signal when that thread ends.
/// @throws std::runtime_error "NAME: why" if it cannot be started or scheduled as `sched` says.
Child spawn(const Command& command, const Sched& sched, const Shared& shared = {});

/// A program whose words are kept: what it writes to standard output and error. It is killed with
/// this object.
class OwnProcess {
 public:
  /// `kept`: a file descriptor that the program gets, too; -1: none. `confinement`: null: none.
  /// @throws std::runtime_error if it cannot be started.
  explicit OwnProcess(const Command& command, int kept = -1,
                      const Confinement* confinement = nullptr)
      : words_(memfd_create("output", MFD_CLOEXEC)),
        child_(spawn(
            command, {},
            {.kept = kept, .output = words_.get(), .input = -1, .confinement = confinement})) {}
  ~OwnProcess() { wait({}); }
  OwnProcess(const OwnProcess&) = delete;
  OwnProcess& operator=(const OwnProcess&) = delete;

  /// How it ended, once it has.
  const std::optional<Ending>& ending() {
    if (!ending_) ending_ = child_.reap();
    return ending_;
  }
  void send(int signal) const { child_.send(signal); }
  /// Waits for the end; false if it had to be killed after this time of a quiet machine.
  bool wait(std::chrono::milliseconds most) {
    MachineTime time;
    bool alone = true;
    while (!ending()) {
      alone = alone && time.passed() < most;
      if (!alone) send(SIGKILL);
      pollfd ended{child_.pidfd.get(), POLLIN, 0};
      poll(&ended, 1, 10);
    }
    return alone;
  }
  /// `most`: [bytes]
  std::string last_words(off_t most = 2000) const {
    const off_t size = lseek(words_.get(), 0, SEEK_END);
    std::string words(static_cast<std::size_t>(std::min(size, most)), '\0');
    const ssize_t n =
        pread(words_.get(), words.data(), words.size(), std::max<off_t>(0, size - most));
    words.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    while (words.ends_with('\n')) words.pop_back();
    return words;
  }

 private:
  Fd words_;
  Child child_;
  std::optional<Ending> ending_;
};

/// What the system did not grant a process of `sched`, in one line; empty: it has all. Policy,
/// priority and CPUs of each of its threads are read back, a CPU that a container withholds is
/// left out without an error. `locked`: whether memory must be locked by now.
std::string not_granted(pid_t pid, const Sched& sched, bool locked);

}  // namespace mimesis::launch
