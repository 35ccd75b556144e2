#include "tools/mimesis/launch/line_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "tools/mimesis/launch/say.h"
#include "tools/mimesis/table.h"

namespace mimesis::launch {
namespace {

constexpr std::size_t kMaxFile = std::size_t{64} << 20;
constexpr std::size_t kMostShown = 500;  // lines a second

void write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
}

/// "info: ready" of a node's log line "[20:29:56.316] [vision] info: ready"; empty for other lines.
std::string_view log_words(std::string_view line) {
  constexpr std::size_t kTime = 13;  // "[20:29:56.316"
  if (!line.starts_with('[') || line.size() < kTime || line.substr(kTime, 3) != "] [") return {};
  const std::size_t end = line.find("] ", kTime + 3);
  return end == std::string_view::npos ? std::string_view() : line.substr(end + 2);
}

}  // namespace

LineLog::LineLog(const std::string& name, const std::string& file, Shown shown)
    : prefix_("[" + name + "] "),
      shown_(shown),
      file_(open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
  if (!file_.open()) throw std::runtime_error(file + ": " + std::strerror(errno));
}

void LineLog::take(const std::string& text, bool error) {
  if (error && text.find("] info: ") == std::string::npos) last_error_ = text;
  show(text);
  if (written_ > kMaxFile) return;
  written_ += text.size() + 1;
  write_all(file_.get(), text + "\n");
  if (written_ > kMaxFile) write_all(file_.get(), "(64 MiB written: the rest is not kept)\n");
}

bool LineLog::too_many() {
  if (const auto now = std::chrono::steady_clock::now(); now >= second_) {
    tell_held();
    second_ = now + std::chrono::seconds(1);
    shown_in_second_ = 0;
  }
  if (++shown_in_second_ <= kMostShown) return false;
  ++held_;
  return true;
}

void LineLog::tell_held() {
  if (held_ == 0) return;
  status_line().clear();
  write_all(STDERR_FILENO, prefix_ + "(" + std::to_string(std::exchange(held_, 0)) +
                               " lines more: see its .log)\n");
}

void LineLog::show(std::string_view text) {
  const std::string_view words = log_words(text);
  const bool information = words.starts_with("info: ") || words.starts_with("debug: ");
  if (shown_ == Shown::none || (information && shown_ != Shown::all) || too_many()) return;
  status_line().clear();
  // The name stands in front already.
  const std::string time = words.empty() ? "" : std::string(text.substr(1, 12)) + " ";
  write_all(STDERR_FILENO, prefix_ + time + printable(words.empty() ? text : words, "\t") + "\n");
}

}  // namespace mimesis::launch
