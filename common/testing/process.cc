#include "common/testing/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>

#include "common/error.h"
#include "common/machine_time.h"

namespace mimesis::testing {
namespace {

/// Milliseconds to wait before the next look at the machine's time.
int left_ms(std::chrono::milliseconds left) {
  return static_cast<int>(std::clamp(left, 0ms, 100ms).count());
}

/// A nameless file: unlike a pipe it never fills up and can be read at any time.
int capture_file() {
  std::string path = (std::filesystem::temp_directory_path() / "mimesis-capture-XXXXXX").string();
  const int fd = mkostemp(path.data(), O_CLOEXEC | O_APPEND);
  MIMESIS_ASSERT(fd >= 0);
  unlink(path.c_str());
  return fd;
}

std::string read_all(int fd) {
  std::string text;
  char buffer[4096];
  for (;;) {
    const ssize_t n = pread(fd, buffer, sizeof buffer, static_cast<off_t>(text.size()));
    if (n <= 0) return text;
    text.append(buffer, static_cast<std::size_t>(n));
  }
}

/// Test programs are in build/test, the others in build/bin.
std::string find_program(const std::string& program) {
  if (program.find('/') != std::string::npos) return program;
  const auto here = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  return (here.parent_path() / "bin" / program).string();
}

std::vector<std::string> with_graph(const TestGraph& graph, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"--graph", graph.name()});
  return arguments;
}

}  // namespace

TestGraph::TestGraph() {
  static std::atomic<int> count{0};
  name_ = "test-" + std::to_string(getpid()) + "-" + std::to_string(++count);
  directory_ = runtime::graph_directory(name_);
}

TestGraph::~TestGraph() {
  std::error_code ignored;
  std::filesystem::remove_all(directory_, ignored);
}

Process::Process(const std::string& program, const std::vector<std::string>& arguments)
    : out_(capture_file()), err_(capture_file()) {
  const std::string path = find_program(program);
  std::vector<char*> argv{const_cast<char*>(path.c_str())};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  pid_ = fork();
  MIMESIS_ASSERT(pid_ >= 0);
  if (pid_ == 0) {  // only async-signal-safe calls: the test may have threads
    dup2(out_, STDOUT_FILENO);
    dup2(err_, STDERR_FILENO);
    execv(path.c_str(), argv.data());
    static constexpr char kLine[] = "cannot execute the program under test\n";
    [[maybe_unused]] const auto written = write(STDERR_FILENO, kLine, sizeof kLine - 1);
    _exit(127);
  }
  pidfd_ = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));
  MIMESIS_ASSERT(pidfd_ >= 0);
}

Process::Process(const TestGraph& graph, const std::string& program,
                 std::vector<std::string> arguments)
    : Process(program, with_graph(graph, std::move(arguments))) {}

Process::~Process() {
  if (!status_) {
    signal(SIGKILL);
    wait();
  }
  for (const int fd : {pidfd_, out_, err_}) close(fd);
}

void Process::signal(int number) const {
  if (!status_) kill(pid_, number);
}

std::optional<int> Process::wait(std::chrono::milliseconds timeout) {
  if (status_) return status_;
  pollfd item{pidfd_, POLLIN, 0};
  MachineTime time;
  for (auto left = timeout; poll(&item, 1, left_ms(left)) <= 0;) {
    left = timeout - std::chrono::duration_cast<std::chrono::milliseconds>(time.passed());
    if (left <= 0ms) return std::nullopt;
  }
  int raw = 0;
  MIMESIS_ASSERT(waitpid(pid_, &raw, 0) == pid_);
  constexpr int kKilled = 128;
  status_ = WIFEXITED(raw) ? WEXITSTATUS(raw) : kKilled + WTERMSIG(raw);
  return status_;
}

std::optional<int> Process::terminate() {
  signal(SIGTERM);
  return wait();
}

bool Process::wait_ready(const TestGraph& graph, const std::string& name,
                         std::chrono::milliseconds timeout) {
  runtime::GraphView view(graph.name());
  MachineTime time;
  for (;;) {
    for (const v1::NodeInfo& node : view.nodes()) {
      if (node.name() == name && node.ready() && node.pid() == static_cast<std::uint32_t>(pid_))
        return true;
    }
    if (wait(0ms) || time.passed() >= timeout) return false;
    view.wait(20ms);
  }
}

std::string Process::output() const { return read_all(out_); }
std::string Process::errors() const { return read_all(err_); }

TestNode::TestNode(const TestGraph& graph, Wiring in, Wiring out, std::string name,
                   runtime::ClockKind clock) {
  runtime::BusOptions options{.name = std::move(name),
                              .graph = graph.name(),
                              .clock = clock,
                              .in = std::move(in),
                              .out = std::move(out),
                              .bind = {}};
  for (const auto& [port, topic] : options.out) options.into_live.insert(topic);  // also as a rival
  bus_ = std::make_unique<runtime::ZmqBus>(std::move(options));
}

void TestNode::open_lockstep(double rate_hz, double offset_s) {
  MIMESIS_ASSERT(bus_->lockstep());
  bus_->ready();
  clock_ = runtime::make_clock(runtime::ClockKind::lockstep, *bus_, rate_hz, offset_s, -1);
}

bool TestNode::until_in_lockstep(const std::function<bool()>& done, runtime::Time timeout) {
  std::optional<runtime::Time> deadline;
  while (const auto now = clock_->wait()) {
    const bool is_done = done();
    clock_->done();
    if (is_done) return true;
    if (!deadline) deadline = *now + timeout;
    if (*now >= *deadline) return false;
  }
  return false;  // time has ended
}

bool TestNode::until(const std::function<bool()>& done, std::chrono::milliseconds timeout) {
  if (clock_) return until_in_lockstep(done, timeout);
  MachineTime time;
  for (;;) {
    bus_->drain();
    if (done()) return true;
    if (time.passed() >= timeout) return false;
    bus_->wait_message(std::chrono::steady_clock::now() + 2ms);
  }
}

runtime::Time TestNode::now() { return std::chrono::system_clock::now().time_since_epoch(); }
runtime::Time TestNode::graph_time() const { return clock_ ? clock_->now() : now(); }

}  // namespace mimesis::testing
