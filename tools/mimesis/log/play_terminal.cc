#include "tools/mimesis/log/play_terminal.h"

#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <iostream>
#include <optional>
#include <utility>

namespace mimesis::tool {
namespace {

// Signals that kill at once. SIGINT and SIGTERM only end the loop (StopSignal).
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

constexpr std::chrono::milliseconds kRedraw(100);
constexpr double kRecent_s = 1.0;  // window of MB/s and lateness
constexpr double kBarWidth = 20.0;

/// The key of `c`: as many keys as letters, in their order.
std::optional<PlayKey> key_of(char c, std::string_view letters,
                              std::initializer_list<PlayKey> keys) {
  const std::size_t at = letters.find(c);
  return at == std::string_view::npos ? std::nullopt : std::optional(keys.begin()[at]);
}

}  // namespace

std::vector<PlayKey> take_keys(std::string& typed) {
  using enum PlayKey;
  constexpr char kEscape = '\x1b';
  std::vector<PlayKey> keys;
  std::size_t at = 0;
  while (at < typed.size()) {
    std::optional<PlayKey> key;
    if (typed[at] != kEscape) {
      key = key_of(typed[at++], " sq+-", {kPause, kStep, kQuit, kFaster, kSlower});
    } else if (at + 1 == typed.size()) {
      break;
    } else if (typed[at + 1] != '[' && typed[at + 1] != 'O') {
      ++at;  // the escape key itself
    } else {
      std::size_t end = at + 2;  // parameters, then one letter or '~'
      while (end < typed.size() && (typed[end] < '@' || typed[end] > '~')) ++end;
      if (end == typed.size()) break;
      if (end == at + 2) key = key_of(typed[end], "ABCD", {kFaster, kSlower, kForward, kBack});
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

std::string play_line(const PlayState& state) {
  const double share =
      state.end_s > 0.0 ? std::clamp(state.position_s / state.end_s, 0.0, 1.0) : 1.0;
  const auto full = static_cast<std::size_t>(share * kBarWidth);
  return fmt::format("{:.1f} / {:.1f} s  [{}{}]  x{:.3g}  {:.1f} MB/s  late {:.2f} ms{}{}",
                     state.position_s, state.end_s, std::string(full, '#'),
                     std::string(static_cast<std::size_t>(kBarWidth) - full, ' '), state.rate,
                     state.mb_s, runtime::to_seconds(state.late) * 1e3,
                     state.paused ? "  PAUSED" : "",
                     state.holding ? "  waits for subscribers" : "");
}

PlayScreen::PlayScreen() : shown_(isatty(STDERR_FILENO) == 1) {}

PlayScreen::~PlayScreen() { clear(); }

void PlayScreen::clear() {
  if (drawn_) std::cerr << "\r\033[K" << std::flush;
  drawn_ = false;
}

void PlayScreen::draw(Wall now, PlayState state, std::uint64_t bytes) {
  if (!shown_ || now < next_) return;
  next_ = now + kRedraw;
  const double window_s = std::chrono::duration<double>(now - since_).count();
  if (window_s >= kRecent_s) {
    mb_s_ = static_cast<double>(bytes - bytes_) * 1e-6 / window_s;
    worst_ = std::exchange(late_, runtime::Time(0));
    since_ = now;
    bytes_ = bytes;
  }
  state.mb_s = mb_s_;
  state.late = std::max(worst_, late_);
  std::cerr << "\r\033[K" << play_line(state) << std::flush;
  drawn_ = true;
}

}  // namespace mimesis::tool
