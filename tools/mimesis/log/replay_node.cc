#include "tools/mimesis/log/replay_node.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "common/runtime/own_topics.h"
#include "common/runtime/replay.h"

extern char** environ;

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

constexpr int kSocketInChild = 3;
constexpr off_t kLastWords = 2000;  // of what a node wrote before it died [bytes]

std::vector<std::string> command_line(const std::string& program, const Life& life,
                                      const std::string& parameters,
                                      const std::vector<std::string>& sets) {
  std::vector<std::string> argv{program,
                                "--replay",
                                std::to_string(kSocketInChild),
                                "--name",
                                life.node(),
                                "--clock",
                                life.start.clock(),
                                "--params",
                                parameters};
  for (const std::string& set : sets) argv.insert(argv.end(), {"--set", set});
  const auto wire = [&argv](const char* option, const auto& topics) {
    for (const v1::TopicInfo& t : topics) {
      const bool of_the_runtime = t.port().starts_with('.') || runtime::is_own_topic(t.topic());
      if (of_the_runtime) continue;
      argv.insert(argv.end(), {option, t.port() + "=" + t.topic()});
    }
  };
  wire("--in", life.start.inputs());
  wire("--out", life.start.outputs());
  return argv;
}

/// In a process group of its own: Ctrl-C asks this program to stop, which ends the node.
pid_t start(std::vector<std::string> words, int socket, int output) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files, output, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, output, STDERR_FILENO);
  posix_spawn_file_actions_adddup2(&files, socket, kSocketInChild);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t pid = -1;
  const int error = posix_spawn(&pid, argv[0], &files, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) throw std::runtime_error(words[0] + ": " + std::strerror(error));
  return pid;
}

std::chrono::milliseconds in_milliseconds(double s) {
  constexpr double kLongest_s = 1e6;  // poll takes an int
  return std::chrono::milliseconds(std::llround(std::min(s, kLongest_s) * 1e3));
}

/// For a node that hangs between the first and the last byte of a packet.
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

ReplayNode::ReplayNode(const std::string& program, const Life& life,
                       const std::vector<std::string>& sets, double timeout_s)
    : words_(memfd_create("output", MFD_CLOEXEC)), timeout_(in_milliseconds(timeout_s)) {
  const std::string parameters =
      folder_.path() + "/" + fs::path(life.node()).filename().string() + ".yaml";
  std::ofstream(parameters) << life.start.parameters();
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::runtime_error(std::string("socketpair: ") + std::strerror(errno));
  }
  socket_ = launch::Fd(ends[0]);
  const launch::Fd other(ends[1]);
  limit_waiting(socket_.get(), timeout_);
  pid_ = start(command_line(program, life, parameters, sets), other.get(), words_.get());
  pidfd_ = launch::Fd(static_cast<int>(syscall(SYS_pidfd_open, pid_, 0)));
  if (!pidfd_.open()) throw std::runtime_error(std::string("pidfd_open: ") + std::strerror(errno));
}

ReplayNode::~ReplayNode() {
  socket_.reset();  // the node ends
  if (pid_ > 0) {
    kill(pid_, SIGKILL);  // nothing of it is needed any more, not even in the middle of a step
    waitpid(pid_, nullptr, 0);
  }
}

tl::expected<v1::ReplayOutcome, Status> ReplayNode::run(const v1::ReplayStep& step,
                                                        const StopSignals& stop) {
  v1::ReplayOutcome outcome;
  errno = 0;
  const bool answered = runtime::write_packet(socket_.get(), step) && wait_for_outcome(stop) &&
                        runtime::read_packet(socket_.get(), outcome);
  if (answered) {
    answered_ = true;
    return outcome;
  }
  if (stop.requested()) return tl::unexpected(Status{});
  timed_out_ = timed_out_ || errno == EAGAIN;
  return tl::unexpected(Status{timed_out_ ? too_long("the step") : ending()});
}

/// False if a stop was requested or it took too long.
bool ReplayNode::wait_for_outcome(const StopSignals& stop) {
  const auto deadline = std::chrono::steady_clock::now() + timeout_;
  pollfd readable{socket_.get(), POLLIN, 0};
  while (!poll_until(readable, deadline)) {
    if (stop.requested()) return false;
    timed_out_ = std::chrono::steady_clock::now() >= deadline;
    if (timed_out_) return false;
  }
  return true;
}

std::string ReplayNode::finish() {
  const launch::Ending how = wait();
  if (timed_out_) return too_long("the node's end");
  return how.good() ? "" : describe(how);
}

std::string ReplayNode::ending() {
  const launch::Ending how = wait();
  if (timed_out_) return too_long("the node's end");
  if (!answered_ && how.code == 2) throw ConfigError(last_words());
  return describe(how);
}

std::string ReplayNode::too_long(std::string_view what) const {
  return fmt::format("{} took longer than {} s (--timeout): the node was killed", what,
                     std::chrono::duration<double>(timeout_).count());
}

std::string ReplayNode::describe(const launch::Ending& how) const {
  const std::string words = last_words();
  return "the node " + how.text() + (words.empty() ? "" : ":\n" + words);
}

launch::Ending ReplayNode::wait() {
  socket_.reset();
  const auto deadline = std::chrono::steady_clock::now() + timeout_;
  pollfd ended{pidfd_.get(), POLLIN, 0};
  while (!timed_out_ && !poll_until(ended, deadline)) {
    timed_out_ = std::chrono::steady_clock::now() >= deadline;
  }
  if (timed_out_) kill(pid_, SIGKILL);
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = -1;
  if (WIFSIGNALED(status)) return {.signal = WTERMSIG(status)};
  return {.code = WEXITSTATUS(status)};
}

std::string ReplayNode::last_words() const {
  const off_t size = lseek(words_.get(), 0, SEEK_END);
  std::string words(static_cast<std::size_t>(std::min(size, kLastWords)), '\0');
  const ssize_t n =
      pread(words_.get(), words.data(), words.size(), std::max<off_t>(0, size - kLastWords));
  words.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  while (words.ends_with('\n')) words.pop_back();
  return words;
}

}  // namespace mimesis::tool
