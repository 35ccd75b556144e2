#include "tools/mimesis/log/replay_graph.h"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr std::size_t kLastWords = 2000;  // of what the launch wrote [bytes]
constexpr auto kStopAtMost = 20s;         // the launcher itself kills its nodes after some seconds

std::string graph_of_its_own() {
  static std::atomic<int> count{0};
  return "replay-" + std::to_string(getpid()) + "-" + std::to_string(++count);
}

launch::Command command(const std::string& file, const std::vector<std::string>& args,
                        const std::vector<std::string>& sets, const std::string& graph,
                        const std::string& folder) {
  launch::Command c;
  c.argv = {fs::read_symlink("/proc/self/exe").string(),
            "launch",
            file,
            "--graph",
            graph,
            "--name",
            "replay"};
  for (const std::string& arg : args) c.argv.insert(c.argv.end(), {"--arg", arg});
  for (const std::string& set : sets) c.argv.insert(c.argv.end(), {"--set", set});
  c.env = {{"XDG_STATE_HOME", folder}};  // the run leaves nothing behind
  return c;
}

}  // namespace

ReplayGraph::ReplayGraph(const std::string& launch_file, const std::vector<std::string>& args,
                         const std::vector<std::string>& sets, bool takes_log,
                         std::function<bool(const std::string& topic)> accept)
    : graph_(graph_of_its_own()),
      directory_(runtime::graph_directory(graph_)),
      // Before the first node: publishers wait for a reliable subscriber that is there.
      tap_(std::make_unique<runtime::Tap>(graph_, std::move(accept), runtime::Policy::reliable)) {
  std::vector<std::string> all = args;
  if (takes_log) all.push_back("log=" + folder_.path() + "/run.mcap");
  child_ = launch::spawn(command(launch_file, all, sets, graph_, folder_.path()), {});
}

ReplayGraph::~ReplayGraph() {
  tap_.reset();  // nobody waits for it any more
  child_.send(SIGINT);
  const auto deadline = std::chrono::steady_clock::now() + kStopAtMost;
  while (!ending() && std::chrono::steady_clock::now() < deadline) {
    pollfd ended[] = {{child_.pidfd.get(), POLLIN, 0},
                      {child_.out.get(), POLLIN, 0},
                      {child_.err.get(), POLLIN, 0}};
    poll(ended, 3, 100);
  }
  if (!ending()) {
    child_.send(SIGKILL);
    while (!ending()) usleep(1000);
  }
  std::error_code ignored;
  fs::remove_all(directory_, ignored);
}

std::optional<runtime::Tapped> ReplayGraph::next(std::chrono::milliseconds timeout) {
  read_words();
  return tap_->next(timeout);
}

const std::optional<launch::Ending>& ReplayGraph::ending() {
  read_words();
  if (!ending_) ending_ = child_.reap();
  return ending_;
}

/// Its pipes must not fill up.
void ReplayGraph::read_words() {
  char buffer[4096];
  for (const launch::Fd* from : {&child_.out, &child_.err}) {
    for (ssize_t n; from->open() && (n = read(from->get(), buffer, sizeof buffer)) > 0;) {
      words_.append(buffer, static_cast<std::size_t>(n));
    }
  }
  if (words_.size() > kLastWords) words_.erase(0, words_.size() - kLastWords);
}

}  // namespace mimesis::tool
