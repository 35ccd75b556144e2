#include "tools/mimesis/log/play_screen.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <utility>

namespace mimesis::tool {
namespace {
constexpr std::chrono::milliseconds kPeriod(100);
constexpr double kWindow_s = 1.0;  // of MB/s and lateness
constexpr double kWidth = 20.0;
}  // namespace

std::string play_line(const PlayState& state) {
  const double share =
      state.end_s > 0.0 ? std::clamp(state.position_s / state.end_s, 0.0, 1.0) : 1.0;
  const auto full = static_cast<std::size_t>(share * kWidth);
  return fmt::format("{:.1f} / {:.1f} s  [{}{}]  x{:.3g}  {:.1f} MB/s  late {:.2f} ms{}{}",
                     state.position_s, state.end_s, std::string(full, '#'),
                     std::string(static_cast<std::size_t>(kWidth) - full, ' '), state.rate,
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
  next_ = now + kPeriod;
  const double window_s = std::chrono::duration<double>(now - since_).count();
  if (window_s >= kWindow_s) {
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
