#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "tools/mimesis/launch/result.h"

namespace mimesis::launch {
namespace {

constexpr double kBusy = 1.5;     // tasks that want to run, a processor: if cycles were missed
constexpr double kFull = 3.0;     // the same in any case
constexpr double kStolen = 0.05;  // share of the machine's time

}  // namespace

void Causes::add(const foxglove::Log& line, std::chrono::nanoseconds at) {
  if (line.level() < foxglove::Log::WARNING) return;
  const bool graver =
      first_ && line.level() >= foxglove::Log::ERROR && first_->level < foxglove::Log::ERROR;
  const bool earlier = first_ && at < first_->at && line.level() >= first_->level;
  if (!first_ || graver || earlier) first_ = {line.name(), line.message(), at, line.level()};
}

std::array<double, 2> Causes::machine_time() {
  std::ifstream stat("/proc/stat");
  std::string word;
  std::array<double, 2> found{};
  double ticks = 0.0;
  stat >> word;
  for (int column = 0; column < 8 && stat >> ticks; ++column) {
    if (column == 7) found[0] = ticks;
    found[1] += ticks;
  }
  return found;
}

std::string Causes::machine() const {
  const auto now = machine_time();
  const double whole = now[1] - began_[1];
  const double stolen = whole > 0.0 ? (now[0] - began_[0]) / whole : 0.0;
  double load = 0.0;
  std::ifstream("/proc/loadavg") >> load;
  const auto processors = static_cast<double>(sysconf(_SC_NPROCESSORS_ONLN));
  const bool missed =
      std::ranges::any_of(missed_, [](const auto& node) { return node.second > 0; });
  if (load < (missed ? kBusy : kFull) * processors && stolen < kStolen) return {};
  std::string text =
      fmt::format("the machine was busy: load {:.1f} on {:.0f} processors", load, processors);
  if (stolen >= kStolen) text += fmt::format(", {:.0f} % of its time was stolen", 100.0 * stolen);
  for (const auto& [node, cycles] : missed_) {
    if (cycles > 0) text += fmt::format(", {} missed {} cycles", node, cycles);
  }
  return text;
}

std::string Causes::before(const std::string& reason, bool on_wall_clock) const {
  std::string text;
  // A node may have told the same in both ways.
  const bool told =
      first_ && !reason.empty() &&
      (reason.find(first_->text) != reason.npos || first_->text.find(reason) != reason.npos);
  if (first_ && !told)
    text =
        fmt::format("{}: {} (at {:.2f} s); ", first_->node, first_->text, to_seconds(first_->at));
  if (const std::string busy = on_wall_clock ? machine() : ""; !busy.empty()) text += busy + "; ";
  return text + reason;
}

}  // namespace mimesis::launch
