#include "tools/mimesis/launch/line_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace mimesis::launch {
namespace {

constexpr std::size_t kMaxLine = 4096;
constexpr std::size_t kMaxFile = std::size_t{64} << 20;
constexpr int kReadsPerTurn = 16;

/// Gives up silently: a log on a full disk or a closed terminal must not stop the robot's launcher.
void write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
}

}  // namespace

LineLog::LineLog(const std::string& name, const std::string& file)
    : prefix_("[" + name + "] "),
      file_(open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
  if (!file_.open()) throw std::runtime_error(file + ": " + std::strerror(errno));
}

void LineLog::line(std::string_view text) {
  write_all(STDERR_FILENO, prefix_ + std::string(text) + "\n");
  if (written_ > kMaxFile) return;
  written_ += text.size() + 1;
  write_all(file_.get(), std::string(text) + "\n");
  if (written_ > kMaxFile) write_all(file_.get(), "(64 MiB written: the rest is not kept)\n");
}

void LineLog::take(std::string& partial) {
  line(partial);
  if (&partial == &err_) last_error_ = partial;
  partial.clear();
}

void LineLog::pump(Fd& from, std::string& partial) {
  std::array<char, 16384> buffer;
  for (int turn = 0; turn < kReadsPerTurn && from.open(); ++turn) {
    const ssize_t n = read(from.get(), buffer.data(), buffer.size());
    if (n < 0) return;
    if (n == 0) return from.reset();
    std::string_view bytes(buffer.data(), static_cast<std::size_t>(n));
    while (!bytes.empty()) {
      const std::size_t room = kMaxLine - partial.size();
      const std::size_t end = std::min({bytes.find('\n'), bytes.size(), room});
      partial.append(bytes.substr(0, end));
      const bool newline = end < bytes.size() && bytes[end] == '\n';
      bytes.remove_prefix(newline ? end + 1 : end);
      if (newline || partial.size() == kMaxLine) take(partial);
    }
  }
}

void LineLog::pump(Child& child) {
  pump(child.out, out_);
  pump(child.err, err_);
}

void LineLog::flush() {
  for (std::string* partial : {&out_, &err_}) {
    if (!partial->empty()) take(*partial);
  }
}

}  // namespace mimesis::launch
