#include "tools/mimesis/log/packet_process.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "common/runtime/replay.h"

namespace mimesis::tool {
namespace {

constexpr off_t kKeptWords = 2000;  // of what the program wrote before it ended [bytes]

std::chrono::milliseconds in_milliseconds(double s) {
  constexpr double kLongest_s = 1e6;  // poll takes an int
  return std::chrono::milliseconds(std::llround(std::min(s, kLongest_s) * 1e3));
}

/// Limits each read and write, for a program that hangs in the middle of a packet.
void limit_waiting(int socket, std::chrono::milliseconds time) {
  const auto us = std::max<std::int64_t>(1000, time.count() * 1000);
  const timeval limit{us / 1'000'000, us % 1'000'000};
  setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
}

/// False after a signal or at the deadline.
bool poll_until(pollfd& one, std::chrono::steady_clock::time_point deadline) {
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  return poll(&one, 1, static_cast<int>(std::max<std::int64_t>(0, left.count()))) > 0;
}

}  // namespace

PacketProcess::PacketProcess(std::string name,
                             const std::function<launch::Command(int fd)>& command,
                             double timeout_s)
    : name_(std::move(name)),
      words_(memfd_create("output", MFD_CLOEXEC)),
      timeout_(in_milliseconds(timeout_s)) {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::runtime_error(std::string("socketpair: ") + std::strerror(errno));
  }
  socket_ = launch::Fd(ends[0]);
  const launch::Fd other(ends[1]);
  limit_waiting(socket_.get(), timeout_);
  child_ = launch::spawn(command(other.get()), {}, {.kept = other.get(), .output = words_.get()});
}

PacketProcess::~PacketProcess() {
  child_.send(SIGKILL);  // its work is not needed any more, not even in the middle of a packet
  while (child_.pid > 0 && !child_.reap()) usleep(1000);
}

tl::expected<void, Status> PacketProcess::ask(const google::protobuf::MessageLite& request,
                                              google::protobuf::MessageLite& answer,
                                              const StopSignals* stop) {
  errno = 0;
  if (runtime::write_packet(socket_.get(), request) && wait_for_answer(stop) &&
      runtime::read_packet(socket_.get(), answer)) {
    answered_ = true;
    return {};
  }
  if (stop != nullptr && stop->requested()) return tl::unexpected(Status{});
  timed_out_ = timed_out_ || errno == EAGAIN;
  if (timed_out_) return tl::unexpected(Status{too_long("the step")});
  const launch::Ending how = wait();
  if (timed_out_) return tl::unexpected(Status{too_long(name_ + "'s end")});
  if (!answered_ && how.code == 2) throw ConfigError(last_words());
  return tl::unexpected(Status{describe(how)});
}

/// False if a stop was requested or it took too long.
bool PacketProcess::wait_for_answer(const StopSignals* stop) {
  const auto deadline = std::chrono::steady_clock::now() + timeout_;
  pollfd readable{socket_.get(), POLLIN, 0};
  while (!poll_until(readable, deadline)) {
    if (stop != nullptr && stop->requested()) return false;
    timed_out_ = std::chrono::steady_clock::now() >= deadline;
    if (timed_out_) return false;
  }
  return true;
}

std::string PacketProcess::finish() {
  const launch::Ending how = wait();
  if (timed_out_) return too_long(name_ + "'s end");
  return how.good() ? "" : describe(how);
}

launch::Ending PacketProcess::wait() {
  socket_.reset();
  const auto deadline = std::chrono::steady_clock::now() + timeout_;
  pollfd ended{child_.pidfd.get(), POLLIN, 0};
  while (!timed_out_ && !poll_until(ended, deadline)) {
    timed_out_ = std::chrono::steady_clock::now() >= deadline;
  }
  if (timed_out_) child_.send(SIGKILL);
  for (;;) {
    if (const auto how = child_.reap()) return *how;
    usleep(1000);
  }
}

std::string PacketProcess::too_long(std::string_view what) const {
  return fmt::format("{} took longer than {} s (--timeout): {} was killed", what,
                     std::chrono::duration<double>(timeout_).count(), name_);
}

std::string PacketProcess::describe(const launch::Ending& how) const {
  const std::string words = last_words();
  return name_ + " " + how.text() + (words.empty() ? "" : ":\n" + words);
}

std::string PacketProcess::last_words() const {
  const off_t size = lseek(words_.get(), 0, SEEK_END);
  std::string words(static_cast<std::size_t>(std::min(size, kKeptWords)), '\0');
  const ssize_t n =
      pread(words_.get(), words.data(), words.size(), std::max<off_t>(0, size - kKeptWords));
  words.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  while (words.ends_with('\n')) words.pop_back();
  return words;
}

}  // namespace mimesis::tool
