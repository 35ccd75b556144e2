#pragma once
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <iostream>
#include <string>

#include "common/time.h"

namespace mimesis::tool {

/// A bar on standard error for long work: "recover  [#####     ]  47 %  310 MB/s". Only on a
/// terminal, ten times a second at most, and gone when the work is done.
class Progress {
 public:
  enum class Unit { bytes, none };
  /// @param total  of the work; 0: unknown. A rate is shown for bytes only.
  Progress(std::string what, std::uint64_t total, Unit unit = Unit::bytes)
      : what_(std::move(what)), total_(total), unit_(unit), shown_(isatty(STDERR_FILENO) == 1) {}
  ~Progress() {
    if (drawn_) std::cerr << "\r\033[K" << std::flush;
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void at(std::uint64_t done) {
    if (!shown_) return;
    const auto now = Clock::now();
    if (now < next_) return;
    next_ = now + kPeriod;
    const auto amount = static_cast<double>(done);
    std::string line = what_;
    if (total_ > 0) {
      const double share = std::clamp(amount / static_cast<double>(total_), 0.0, 1.0);
      const auto full = static_cast<std::size_t>(share * kWidth);
      line += fmt::format("  [{}{}]  {:.0f} %", std::string(full, '#'),
                          std::string(kWidth - full, ' '), 100.0 * share);
    } else if (unit_ == Unit::bytes) {
      line += fmt::format("  {} MB", done / 1'000'000);
    }
    if (unit_ == Unit::bytes) {
      const double seconds = std::max(1e-3, to_seconds(now - started_));
      line += fmt::format("  {:.0f} MB/s", amount / seconds * 1e-6);
    }
    std::cerr << "\r\033[K" << line << std::flush;
    drawn_ = true;
  }

 private:
  static constexpr std::size_t kWidth = 30;
  static constexpr std::chrono::milliseconds kPeriod{100};
  using Clock = std::chrono::steady_clock;
  std::string what_;
  std::uint64_t total_;
  Unit unit_;
  bool shown_;
  Clock::time_point started_ = Clock::now(), next_ = started_;
  bool drawn_ = false;
};

/// One line on standard error about something that goes on: in place on a terminal, else now and
/// then. Clear it before other lines.
class StatusLine {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::chrono::milliseconds kInPlace{200}, kLines{10'000};

  /// False if it is not yet time.
  bool show(const std::string& text, Clock::time_point now) {
    if (now < next_) return false;
    next_ = now + (terminal_ ? kInPlace : kLines);
    if (!terminal_) {
      std::cerr << "mimesis: " + text + "\n" << std::flush;
    } else {
      std::cerr << "\r\033[K" + text.substr(0, columns() - 1) << std::flush;
      drawn_ = true;
    }
    return true;
  }
  void clear() {
    if (drawn_) std::cerr << "\r\033[K" << std::flush;
    drawn_ = false;
  }

 private:
  static std::size_t columns() {
    struct winsize size {};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col : 80;
  }
  bool terminal_ = isatty(STDERR_FILENO) == 1, drawn_ = false;
  Clock::time_point next_ = Clock::now() + (terminal_ ? kInPlace : kLines);
};

}  // namespace mimesis::tool
