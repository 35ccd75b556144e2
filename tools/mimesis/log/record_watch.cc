#include "tools/mimesis/log/record_watch.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <ostream>
#include <sstream>

#include "tools/mimesis/log/human.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {

void Drain::received(WallTime now, bool graph_time, std::uint64_t time_ns) {
  // Simulated time at the signal is unknown: messages right behind it are counted in.
  if (graph_time && now - begin_ < kQuiet) graph_ns_ = std::max(graph_ns_, time_ns);
  const bool unknown = !graph_time && time_ns == 0;
  if (!unknown && time_ns <= (graph_time ? graph_ns_ : wall_ns_)) last_old_ = now;
}

bool Drain::over(WallTime now) const {
  return now - last_old_ >= kQuiet || now - begin_ >= kAtMost;
}

std::vector<std::string> SilenceWatch::silent(const Counts& counts, const Now& now) {
  std::vector<std::string> topics;
  for (auto& [key, met] : met_) {
    if (met.settled || (met.graph_time ? now.graph : now.wall) < met.since + kPatience) continue;
    met.settled = true;
    if (!counts.topics.contains(key)) topics.push_back(key.first + " (" + key.second + ")");
  }
  return topics;
}

std::optional<TerminalSize> terminal_size() {
  struct winsize size {};
  if (isatty(STDERR_FILENO) != 1) return std::nullopt;
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0) return TerminalSize{};
  return TerminalSize{size.ws_row, size.ws_col};
}

void CountsDisplay::show(const RecordState& state, const std::optional<TerminalSize>& terminal,
                         WallTime now) {
  if (now < shown_ + (terminal ? kTablePeriod : kLinePeriod)) return;
  const double seconds = std::chrono::duration<double>(now - shown_).count();
  if (terminal) {
    const std::string text = table(state, *terminal, seconds);
    clear();
    out_ << text << std::flush;
    lines_ = static_cast<std::size_t>(std::ranges::count(text, '\n'));
  } else {
    out_ << line(state, seconds) << '\n' << std::flush;
  }
  shown_ = now;
  for (const auto& [key, count] : state.counts.topics) before_[key] = count.received;
  total_before_ = state.counts.total.received;
}

void CountsDisplay::clear() {
  if (lines_ > 0) out_ << fmt::format("\033[{}A\033[J", lines_) << std::flush;
  lines_ = 0;
}

std::string CountsDisplay::line(const RecordState& state, double seconds) const {
  const Count& total = state.counts.total;
  return fmt::format("{}: {} messages ({:.0f}/s), {} lost, {}, {} free", state.file, total.received,
                     static_cast<double>(total.received - total_before_) / seconds, total.lost,
                     bytes_text(state.bytes), bytes_text(state.free_bytes));
}

std::string CountsDisplay::table(const RecordState& state, const TerminalSize& size,
                                 double seconds) const {
  constexpr std::size_t kOtherLines = 4;  // heading, topics left out, total, cursor
  const std::size_t rows = size.rows > kOtherLines ? size.rows - kOtherLines : 0;
  Table cells({"TOPIC", "NODE", "RECEIVED", "LOST", "HZ"});
  std::size_t shown = 0;
  for (const auto& [key, count] : state.counts.topics) {
    if (shown++ == rows) break;
    const auto before = before_.find(key);
    const std::uint64_t fresh = count.received - (before == before_.end() ? 0 : before->second);
    cells.row({key.first, key.second, std::to_string(count.received), std::to_string(count.lost),
               fmt::format("{:.1f}", static_cast<double>(fresh) / seconds)});
  }
  std::ostringstream text;
  cells.print(text, false);
  if (const std::size_t topics = state.counts.topics.size(); topics > rows) {
    text << fmt::format("and {} more topics\n", topics - rows);
  }
  text << line(state, seconds) << '\n';
  // A line that the terminal breaks would be two when it is taken away.
  std::string cut;
  std::istringstream lines(text.str());
  for (std::string l; std::getline(lines, l);) cut += l.substr(0, size.columns - 1) + '\n';
  return cut;
}

}  // namespace mimesis::tool
