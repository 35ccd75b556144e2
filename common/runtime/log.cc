#include "common/runtime/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <array>
#include <deque>
#include <mutex>

#include "common/error.h"

namespace mimesis::runtime {
namespace {

constexpr std::size_t kKeptLines = 256;

struct Kept {
  std::mutex mutex;
  std::deque<LogLine> lines;
};

Kept& kept() {
  static Kept k;
  return k;
}

std::shared_ptr<spdlog::logger>& logger() {
  static std::shared_ptr<spdlog::logger> l = [] {
    auto made = std::make_shared<spdlog::logger>("mimesis",
                                                 std::make_shared<spdlog::sinks::stderr_sink_mt>());
    made->set_pattern("[%H:%M:%S.%e] [%n] %l: %v");
    made->flush_on(spdlog::level::debug);
    return made;
  }();
  return l;
}

spdlog::level::level_enum to_spdlog(Level level) {
  constexpr std::array kLevels{spdlog::level::debug, spdlog::level::info, spdlog::level::warn,
                               spdlog::level::err};
  return kLevels.at(static_cast<std::size_t>(level));
}

/// For take_log_lines.
void keep(Level level, std::string_view line) {
  Kept& k = kept();
  const std::scoped_lock lock(k.mutex);
  k.lines.push_back({level, std::string(line)});
  if (k.lines.size() > kKeptLines) k.lines.pop_front();
}

}  // namespace

void log(Level level, std::string_view text) {
  const std::string line = printable(text, "\n\t");  // others' names may be in it
  logger()->log(to_spdlog(level), line);
  if (logger()->should_log(to_spdlog(level))) keep(level, line);
}

void set_log_level(Level least) { logger()->set_level(to_spdlog(least)); }

void record(std::string_view line) { keep(Level::debug, line); }

void set_log_name(std::string_view name) { logger() = logger()->clone(std::string(name)); }

std::vector<LogLine> take_log_lines() {
  Kept& k = kept();
  const std::scoped_lock lock(k.mutex);
  std::vector<LogLine> lines(std::make_move_iterator(k.lines.begin()),
                             std::make_move_iterator(k.lines.end()));
  k.lines.clear();
  return lines;
}

bool Throttle::pass() {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) {
    ++counting_;
    return false;
  }
  next_ = now + period_;
  held_back_ = counting_;
  counting_ = 0;
  return true;
}

}  // namespace mimesis::runtime
