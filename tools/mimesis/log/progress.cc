#include "tools/mimesis/log/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

namespace mimesis::tool {
namespace {
constexpr std::size_t kWidth = 30;
constexpr std::chrono::milliseconds kPeriod(100);
}  // namespace

Progress::Progress(std::string what, std::uint64_t total)
    : what_(std::move(what)), total_(total), shown_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (drawn_) std::cerr << "\r\033[K" << std::flush;
}

void Progress::at(std::uint64_t done) {
  if (!shown_) return;
  const auto now = Clock::now();
  if (now < next_) return;
  next_ = now + kPeriod;
  const double seconds = std::max(1e-3, std::chrono::duration<double>(now - started_).count());
  const double rate_mb_s = static_cast<double>(done) / seconds * 1e-6;
  const double share =
      total_ == 0 ? 0.0
                  : std::clamp(static_cast<double>(done) / static_cast<double>(total_), 0.0, 1.0);
  const auto full = static_cast<std::size_t>(share * kWidth);
  std::cerr << (total_ == 0 ? fmt::format("\r\033[K{}  {} MB  {:.0f} MB/s", what_, done / 1'000'000,
                                          rate_mb_s)
                            : fmt::format("\r\033[K{}  [{}{}]  {:.0f} %  {:.0f} MB/s", what_,
                                          std::string(full, '#'), std::string(kWidth - full, ' '),
                                          100.0 * share, rate_mb_s))
            << std::flush;
  drawn_ = true;
}

}  // namespace mimesis::tool
