#pragma once
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <string>
#include <vector>

#include "common/machine_time.h"

namespace mimesis::testing {

/// A program on a terminal of its own.
class OnTerminal {
 public:
  /// @param words  path of the program and its arguments
  explicit OnTerminal(std::vector<std::string> words) {
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    pid_ = forkpty(&terminal_, nullptr, nullptr, nullptr);
    if (pid_ == 0) {
      execv(argv[0], argv.data());
      _exit(127);
    }
  }
  ~OnTerminal() {
    if (!ended_) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    close(terminal_);
  }
  OnTerminal(const OnTerminal&) = delete;
  OnTerminal& operator=(const OnTerminal&) = delete;

  void type(const std::string& keys) const {
    ASSERT_EQ(write(terminal_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  /// Waits until the screen shows `text` after the text seen before; returns the screen if not.
  ::testing::AssertionResult shows(const std::string& text) {
    MachineTime time;
    for (;;) {
      if (const std::size_t at = screen_.find(text); at != std::string::npos) {
        screen_.erase(0, at + text.size());
        return ::testing::AssertionSuccess();
      }
      pollfd item{terminal_, POLLIN, 0};
      char bytes[4096];
      ssize_t n = -1;
      if (poll(&item, 1, 100) > 0) n = read(terminal_, bytes, sizeof bytes);
      if (n > 0) screen_.append(bytes, static_cast<std::size_t>(n));
      if (time.passed() > std::chrono::seconds(10)) {
        return ::testing::AssertionFailure() << "no '" << text << "' in: " << screen_;
      }
    }
  }
  /// Line by line with echo: as a shell expects it.
  bool cooked() const {
    termios now{};
    EXPECT_EQ(tcgetattr(terminal_, &now), 0);
    return (now.c_lflag & ICANON) != 0 && (now.c_lflag & ECHO) != 0;
  }
  void signal(int number) const { kill(pid_, number); }
  int wait() {
    int raw = 0;
    waitpid(pid_, &raw, 0);
    ended_ = true;
    return WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
  }
  bool stopped() const {
    int raw = 0;
    return waitpid(pid_, &raw, WUNTRACED) == pid_ && WIFSTOPPED(raw);
  }

 private:
  int terminal_ = -1;
  pid_t pid_ = -1;
  bool ended_ = false;
  std::string screen_;
};

}  // namespace mimesis::testing
