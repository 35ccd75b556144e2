#include "tools/mimesis/log/play_keys.h"

#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <optional>
#include <utility>

namespace mimesis::tool {
namespace {

// What kills without asking; SIGINT and SIGTERM are asked for first (StopSignal) and end the loop.
constexpr std::array kDeadly{SIGHUP, SIGQUIT, SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL};

termios before{}, during{};

void restore() { tcsetattr(STDIN_FILENO, TCSANOW, &before); }  // async-signal-safe, as POSIX says

void on_deadly(int signal) {
  restore();
  raise(signal);  // SA_RESETHAND: now it does what it does
}

void on_suspend(int) {
  restore();
  raise(SIGSTOP);
}

void on_continue(int) {
  if (tcgetpgrp(STDIN_FILENO) == getpgrp()) tcsetattr(STDIN_FILENO, TCSANOW, &during);
}

void handle(int signal, void (*handler)(int), int flags) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
}

std::optional<PlayKey> plain_key(char c) {
  switch (c) {
    case ' ':
      return PlayKey::pause;
    case 's':
      return PlayKey::step;
    case 'q':
      return PlayKey::quit;
    case '+':
      return PlayKey::faster;
    case '-':
      return PlayKey::slower;
    default:
      return std::nullopt;
  }
}

std::optional<PlayKey> arrow_key(char c) {
  switch (c) {
    case 'A':
      return PlayKey::faster;
    case 'B':
      return PlayKey::slower;
    case 'C':
      return PlayKey::forward;
    case 'D':
      return PlayKey::back;
    default:
      return std::nullopt;
  }
}

}  // namespace

std::vector<PlayKey> take_keys(std::string& typed) {
  constexpr char kEscape = '\x1b';
  std::vector<PlayKey> keys;
  std::size_t at = 0;
  while (at < typed.size()) {
    std::optional<PlayKey> key;
    if (typed[at] != kEscape) {
      key = plain_key(typed[at++]);
    } else if (at + 1 == typed.size()) {
      break;
    } else if (typed[at + 1] != '[' && typed[at + 1] != 'O') {
      ++at;  // the escape key itself
    } else {
      std::size_t end = at + 2;  // parameters, then one letter or '~'
      while (end < typed.size() && (typed[end] < '@' || typed[end] > '~')) ++end;
      if (end == typed.size()) break;
      if (end == at + 2) key = arrow_key(typed[end]);
      at = end + 1;
    }
    if (key) keys.push_back(*key);
  }
  typed.erase(0, at);
  return keys;
}

PlayKeys::PlayKeys() {
  if (isatty(STDIN_FILENO) != 1 || tcgetpgrp(STDIN_FILENO) != getpgrp() ||
      tcgetattr(STDIN_FILENO, &before) != 0) {
    return;
  }
  during = before;
  during.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  during.c_cc[VMIN] = 0;  // read() never blocks
  during.c_cc[VTIME] = 0;
  for (const int signal : kDeadly) handle(signal, on_deadly, SA_RESETHAND | SA_NODEFER);
  handle(SIGTSTP, on_suspend, SA_RESTART);
  handle(SIGCONT, on_continue, SA_RESTART);
  ours_ = tcsetattr(STDIN_FILENO, TCSANOW, &during) == 0;
}

PlayKeys::~PlayKeys() {
  if (!ours_) return;
  restore();
  for (const int signal : kDeadly) handle(signal, SIG_DFL, 0);
  handle(SIGTSTP, SIG_DFL, 0);
  handle(SIGCONT, SIG_DFL, 0);
}

int PlayKeys::fd() const {
  // In the background reading would stop the process.
  return ours_ && !gone_ && tcgetpgrp(STDIN_FILENO) == getpgrp() ? STDIN_FILENO : -1;
}

std::vector<PlayKey> PlayKeys::read() {
  pollfd item{fd(), POLLIN, 0};
  if (poll(&item, 1, 0) <= 0) return {};
  std::array<char, 64> bytes{};
  const ssize_t n = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  gone_ = n == 0 || (n < 0 && errno != EINTR && errno != EAGAIN);
  if (n > 0) typed_.append(bytes.data(), static_cast<std::size_t>(n));
  return take_keys(typed_);
}

}  // namespace mimesis::tool
