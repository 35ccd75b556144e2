// `mimesis view`: a page, and a server for Foxglove and Lichtblick, on a running graph or a log.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <random>

#include "common/error.h"
#include "common/runtime/param_source.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/stop_signals.h"
#include "tools/mimesis/verb.h"
#include "tools/mimesis/view/live_graph.h"

namespace mimesis::view {
namespace {

struct Options : tool::GraphOptions {
  std::vector<std::string> logs;
  ServerOptions server;
  double rate = 1.0;
  bool paused = false;
};

std::string new_key() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

/// A graph of this view's own with a player of the logs, which rests at first and at the end.
class Player {
 public:
  explicit Player(const Options& options) : graph_("view-" + std::to_string(getpid())) {
    launch::Command command{
        {launch::find_executable("mimesis"), "log", "play", "--stay", "--all-topics", "--no-keys",
         "--paused", "--rate", fmt::format("{}", options.rate)},
        {{"MIMESIS_GRAPH", graph_}}};
    command.argv.insert(command.argv.end(), options.logs.begin(), options.logs.end());
    process_.emplace(command);
  }
  ~Player() {
    process_->send(SIGINT);
    process_->wait(std::chrono::seconds(3));
    process_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(runtime::graph_directory(graph_), ignored);
  }
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  const std::string& graph() const { return graph_; }
  void resume() const {
    tool::call_service(runtime::GraphView(graph_).nodes(), "player/resume", "",
                       std::chrono::seconds(1));
  }
  /// @throws ConfigError with its words if it has failed
  void check() {
    if (process_->ending() && !process_->ending()->good())
      throw ConfigError(process_->last_words());
  }

 private:
  std::string graph_;
  std::optional<launch::OwnProcess> process_;
};

int run(Options& options) {
  std::optional<Player> player;
  if (!options.logs.empty()) player.emplace(options);
  const std::string graph = player ? player->graph() : tool::chosen_graph(options);
  ServerOptions& server = options.server;
  server.name = "mimesis " + (player ? options.logs.front() : graph);
  server.metadata = {{"graph", graph}, {"log", player ? options.logs.front() : ""}};
  try {
    server.page =
        std::filesystem::path(runtime::find_project_file("page", "index.html")).parent_path();
  } catch (const ConfigError&) {  // not built: the server says so to whoever asks for it
  }
  if (server.key.empty()) server.key = new_key();
  Server serving(server);
  std::cout << serving.url() << std::endl;
  std::cerr << fmt::format("graph '{}'; Foxglove and Lichtblick: ws://{}:{}; Ctrl-C ends\n", graph,
                           server.address, serving.port());
  const tool::StopSignals stop;
  LiveGraph live(serving, graph);
  bool waits = player && !options.paused;  // until somebody looks
  while (!stop.requested()) {
    live.step();
    if (player) player->check();
    if (!waits || serving.wanted().empty()) continue;
    waits = false;
    player->resume();
  }
  return 0;
}

}  // namespace
}  // namespace mimesis::view

namespace mimesis::tool {

void add_view(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("view");
  auto o = std::make_shared<view::Options>();
  verb->add_option("log", o->logs, "Logs to show instead of a running graph (MCAP; parts of one)")
      ->check(CLI::ExistingFile);
  verb->add_option("--graph", o->graph,
                   "Name of the graph (default: MIMESIS_GRAPH, or the only one that runs)");
  verb->add_option("--address", o->server.address, "Address to listen on")->capture_default_str();
  verb->add_option("--port", o->server.port, "Port; 0: any that is free")->capture_default_str();
  verb->add_option("--key", o->server.key, "Key of the address (default: a new one)");
  verb->add_option("--origin", o->server.origins,
                   "A page of elsewhere that may look, as https://app.foxglove.dev (repeatable)")
      ->take_all();
  verb->add_option("--rate", o->rate, "Of a log: recorded seconds per second")
      ->check(CLI::Range(0.001, 1000.0))
      ->capture_default_str();
  verb->add_flag("--paused", o->paused, "Of a log: begin at rest");
  verb->footer(
      "Prints the address of the page. Who has its key may change parameters and call services;\n"
      "others on this computer may look, others elsewhere nothing. Listening on an address that\n"
      "other computers reach is not encrypted: ssh -L 8765:localhost:8765 HOST is.\n"
      "Examples:\n"
      "  mimesis view                        # the graph that runs\n"
      "  mimesis view run.mcap --rate 0.5    # a log, with a time line");
  verb->callback([o, &exit_code] { exit_code = view::run(*o); });
}

}  // namespace mimesis::tool
