#pragma once
#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/time.h"
#include "tools/mimesis/terminal_keys.h"

// Where a player is in the log, how late it is, and its side of the terminal: keys in, a line of
// progress out.
namespace mimesis::tool {

/// Where in the log a player is: t = t₀ + rate·(w − w₀) while it runs. Log times t [ns], wall times
/// w of the steady clock, which no one sets.
class PlayTimeline {
 public:
  using Wall = std::chrono::steady_clock::time_point;

  /// Stands at log time 0. `rate`: recorded seconds per second of wall time, above 0 [1]
  explicit PlayTimeline(double rate) : rate_(rate) {}

  bool running() const { return running_; }
  double rate() const { return rate_; }
  runtime::Time at(Wall now) const {
    if (!running_) return log_time_;
    return log_time_ +
           runtime::Time(std::llround(rate_ * static_cast<double>((now - wall_).count())));
  }
  /// When `log_time` is reached, as things are. Precondition: running.
  Wall due(runtime::Time log_time) const {
    constexpr double kFar_ns = 1e18;  // 31 years
    const double left_ns = static_cast<double>((log_time - log_time_).count()) / rate_;
    return wall_ + std::chrono::nanoseconds(std::llround(std::clamp(left_ns, -kFar_ns, kFar_ns)));
  }

  void jump(Wall now, runtime::Time log_time) {
    wall_ = now;
    log_time_ = log_time;
  }
  void run(Wall now) {
    jump(now, at(now));
    running_ = true;
  }
  void stand(Wall now) {
    jump(now, at(now));
    running_ = false;
  }
  void set_rate(Wall now, double rate) {
    jump(now, at(now));
    rate_ = rate;
  }

 private:
  double rate_;
  bool running_ = false;
  Wall wall_{};
  runtime::Time log_time_{};
};

/// How late messages were played: counts in bins whose width is 1/32 of their octave, so quantiles
/// are at most 3 % too high. Does not allocate.
class PlayLateness {
 public:
  void add(runtime::Time late) {  ///< too early counts as 0
    const auto ns = static_cast<std::uint64_t>(std::max<runtime::Time::rep>(late.count(), 0));
    // The leading bit chooses the octave, the five below it the bin.
    const auto octave =
        static_cast<std::size_t>(std::max(static_cast<int>(std::bit_width(ns)) - 6, 0));
    const std::size_t bin = octave * kPerOctave + (ns >> octave);
    ++bins_[std::min(bin, bins_.size() - 1)];
    ++count_;
    worst_ = std::max(worst_, late);
  }
  std::uint64_t count() const { return count_; }
  runtime::Time worst() const { return worst_; }
  /// Upper end of the bin below which `share` of all lie; 0 without any.
  runtime::Time quantile(double share) const {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
    std::uint64_t below = 0;
    for (std::size_t bin = 0; bin < bins_.size() && count_ > 0; ++bin) {
      below += bins_[bin];
      if (below < std::max<std::uint64_t>(wanted, 1)) continue;
      // Inverse of `add`: bins below 64 hold one value each.
      const std::size_t octave = bin < 2 * kPerOctave ? 0 : bin / kPerOctave - 1;
      const std::uint64_t low = bin - octave * kPerOctave;
      return std::min(worst_, runtime::Time(((low + 1) << octave) - 1));
    }
    return {};
  }

 private:
  static constexpr std::size_t kPerOctave = 32, kOctaves = 60;
  std::array<std::uint64_t, kPerOctave * kOctaves> bins_{};
  std::uint64_t count_ = 0;
  runtime::Time worst_{};
};

enum class PlayKey { pause, step, back, forward, faster, slower, quit };

/// Takes the keys off the front of a terminal's input; an unfinished escape sequence stays, unknown
/// keys are dropped.
inline std::vector<PlayKey> take_keys(std::string& typed) {
  using enum PlayKey;
  constexpr char kEscape = '\x1b';
  // `all` has a key for each letter, in their order.
  const auto key_of = [](char c, std::string_view letters, std::initializer_list<PlayKey> all) {
    const std::size_t at = letters.find(c);
    return at == letters.npos ? std::nullopt : std::optional(all.begin()[at]);
  };
  std::vector<PlayKey> keys;
  std::size_t at = 0;
  while (at < typed.size()) {
    std::optional<PlayKey> key;
    if (typed[at] != kEscape) {
      key = key_of(typed[at++], " sq+-", {pause, step, quit, faster, slower});
    } else if (at + 1 == typed.size()) {
      break;
    } else if (typed[at + 1] != '[' && typed[at + 1] != 'O') {
      ++at;  // the escape key itself
    } else {
      std::size_t end = at + 2;  // parameters, then one letter or '~'
      while (end < typed.size() && (typed[end] < '@' || typed[end] > '~')) ++end;
      if (end == typed.size()) break;
      if (end == at + 2) key = key_of(typed[end], "ABCD", {faster, slower, forward, back});
      at = end + 1;
    }
    if (key) keys.push_back(*key);
  }
  typed.erase(0, at);
  return keys;
}

/// The keys that are typed while one node_runs.
class PlayKeys {
 public:
  int fd() const { return terminal_.fd(); }
  std::vector<PlayKey> read() {
    typed_ += terminal_.read();
    return take_keys(typed_);
  }

 private:
  TerminalKeys terminal_;
  std::string typed_;
};

/// Contents of the progress line.
struct PlayState {
  double position_s = 0.0, end_s = 0.0;
  double rate = 1.0;  ///< [1]
  bool paused = false, holding = false;
  double mb_s = 0.0;     ///< played lately
  runtime::Time late{};  ///< worst one lately
};

/// "12.3 / 60.0 s  [####      ]  x1  203.1 MB/s  late 0.08 ms  PAUSED"
inline std::string play_line(const PlayState& state) {
  constexpr double kBarWidth = 20.0;
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

/// Draws the progress line on standard error if it is a terminal, ten times a second.
class PlayScreen {
 public:
  using Wall = std::chrono::steady_clock::time_point;

  PlayScreen() = default;
  ~PlayScreen() { clear(); }
  PlayScreen(const PlayScreen&) = delete;
  PlayScreen& operator=(const PlayScreen&) = delete;

  bool shown() const { return shown_; }
  Wall next() const { return next_; }  ///< time to draw again
  void count(runtime::Time late) { late_ = std::max(late_, late); }
  /// `bytes`: played since the start.
  void draw(Wall now, PlayState state, std::uint64_t bytes) {
    constexpr std::chrono::milliseconds kRedraw(100);
    constexpr double kRecent_s = 1.0;  // window of MB/s and lateness
    if (!shown_ || now < next_) return;
    next_ = now + kRedraw;
    const double window_s = to_seconds(now - since_);
    if (window_s >= kRecent_s) {
      mb_s_ = static_cast<double>(bytes - bytes_) * 1e-6 / window_s;
      worst_ = std::exchange(late_, {});
      since_ = now;
      bytes_ = bytes;
    }
    state.mb_s = mb_s_;
    state.late = std::max(worst_, late_);
    std::cerr << "\r\033[K" << play_line(state) << std::flush;
    drawn_ = true;
  }
  void clear() {
    if (std::exchange(drawn_, false)) std::cerr << "\r\033[K" << std::flush;
  }

 private:
  bool shown_ = isatty(STDERR_FILENO) == 1, drawn_ = false;
  Wall next_{}, since_{};
  std::uint64_t bytes_ = 0;  ///< at since_
  double mb_s_ = 0.0;
  runtime::Time late_{}, worst_{};
};

}  // namespace mimesis::tool
