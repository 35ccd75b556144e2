#pragma once
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <string>

namespace mimesis::tool {

/// While one lives, the terminal on standard input gives single keys without echo. It is restored
/// however the process ends, and while it is suspended. One per process.
class TerminalKeys {
 public:
  TerminalKeys() {
    if (isatty(STDIN_FILENO) != 1 || tcgetpgrp(STDIN_FILENO) != getpgrp() ||
        tcgetattr(STDIN_FILENO, &before_) != 0) {
      return;
    }
    during_ = before_;
    during_.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    during_.c_cc[VMIN] = 0;  // read() never blocks
    during_.c_cc[VTIME] = 0;
    const auto on_deadly = [](int signal) {
      restore();
      raise(signal);  // SA_RESETHAND: now it has its default effect
    };
    for (const int signal : kDeadly) handle(signal, on_deadly, SA_RESETHAND | SA_NODEFER);
    const auto on_suspend = [](int) {
      restore();
      raise(SIGSTOP);
    };
    handle(SIGTSTP, on_suspend, SA_RESTART);
    const auto on_continue = [](int) {
      if (tcgetpgrp(STDIN_FILENO) == getpgrp()) tcsetattr(STDIN_FILENO, TCSANOW, &during_);
    };
    handle(SIGCONT, on_continue, SA_RESTART);
    ours_ = tcsetattr(STDIN_FILENO, TCSANOW, &during_) == 0;
  }
  ~TerminalKeys() {
    if (!ours_) return;
    restore();
    for (const int signal : kDeadly) handle(signal, SIG_DFL, 0);
    handle(SIGTSTP, SIG_DFL, 0);
    handle(SIGCONT, SIG_DFL, 0);
  }
  TerminalKeys(const TerminalKeys&) = delete;
  TerminalKeys& operator=(const TerminalKeys&) = delete;

  /// Standard input; -1 if it is no terminal, belongs to another job now, or is at its end.
  int fd() const {
    // In the background reading would stop the process.
    return ours_ && !gone_ && tcgetpgrp(STDIN_FILENO) == getpgrp() ? STDIN_FILENO : -1;
  }
  /// What was typed since the last call.
  std::string read() {
    pollfd item{fd(), POLLIN, 0};
    if (poll(&item, 1, 0) <= 0) return {};
    std::array<char, 64> bytes{};
    const ssize_t n = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    gone_ = n == 0 || (n < 0 && errno != EINTR && errno != EAGAIN);
    return {bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(0, n))};
  }

 private:
  // Signals that kill at once. SIGINT and SIGTERM only end the loop (StopSignal).
  static constexpr std::array kDeadly{SIGHUP, SIGQUIT, SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL};

  // Async-signal-safe [POSIX].
  static void restore() { tcsetattr(STDIN_FILENO, TCSANOW, &before_); }
  static void handle(int signal, void (*handler)(int), int flags) {
    struct sigaction action {};
    action.sa_handler = handler;
    action.sa_flags = flags;
    sigemptyset(&action.sa_mask);
    sigaction(signal, &action, nullptr);
  }

  static inline termios before_{}, during_{};
  bool ours_ = false, gone_ = false;
};

}  // namespace mimesis::tool
