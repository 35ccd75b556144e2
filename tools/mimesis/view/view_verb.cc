// `mimesis view`: a page, and a server for Foxglove and Lichtblick, on a running graph or a log.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <random>
#include <sstream>

#include "common/error.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/stop_signals.h"
#include "tools/mimesis/verb.h"
#include "tools/mimesis/view/film.h"
#include "tools/mimesis/view/live_graph.h"

namespace mimesis::view {
namespace {

struct Options : tool::GraphOptions {
  FilmOptions film;
  ServerOptions server;
  std::string topics;  ///< regular expression; empty: all
  double rate = 1.0;
  bool paused = false;
  bool images = false;
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
        {launch::find_executable("mimesis"), "log", "play", "--stay", "--for-viewers",
         "--all-topics", "--paused", "--rate", fmt::format("{}", options.rate)},
        {{"MIMESIS_GRAPH", graph_}}};
    if (options.images) command.argv.push_back("--restore-all");
    command.argv.insert(command.argv.end(), options.film.logs.begin(), options.film.logs.end());
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
  ServerOptions& server = options.server;
  const bool films = !options.film.film.empty() || !options.film.png.empty();
  if (films) server.port = 0;
  std::optional<Player> player;
  if (!options.film.logs.empty() && !films) player.emplace(options);
  const std::string graph = films ? "" : player ? player->graph() : tool::chosen_graph(options);
  server.name = "mimesis " + (options.film.logs.empty() ? graph : options.film.logs.front());
  server.metadata = {{"graph", graph},
                     {"log", options.film.logs.empty() ? "" : options.film.logs.front()}};
  // Beside the program, and nowhere else: an index.html of the folder somebody is in is no page.
  std::error_code none;
  server.page = std::filesystem::read_symlink("/proc/self/exe", none).parent_path().parent_path() /
                "share/mimesis/page";
  if (!std::filesystem::exists(server.page / "index.html", none)) server.page.clear();
  if (server.key.empty()) server.key = new_key();
  if (films) {
    if (server.page.empty())
      throw ConfigError(
          "a film needs the page, which is not built: tools/setup viewer, then cmake --build build "
          "--target page");
    options.film.speed = options.rate;
    make_film(options.film, server);
    return 0;
  }
  const tool::TopicFilter shown({}, options.topics, "", "--topics");
  const tool::StopSignals stop;
  Server serving(server);
  std::cout << serving.url() << std::endl;
  std::cerr << fmt::format("graph '{}'; Foxglove and Lichtblick: ws://{}:{}; Ctrl-C ends\n", graph,
                           server.address, serving.port());
  LiveGraph live(serving, graph, shown,
                 player ? runtime::Policy::reliable : runtime::Policy::latest);
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
  verb->add_option("log", o->film.logs,
                   "Logs to show instead of a running graph (MCAP; parts of one)")
      ->check(CLI::ExistingFile);
  verb->add_option("--graph", o->graph,
                   "Name of the graph (default: MIMESIS_GRAPH, or the only one that runs)");
  verb->add_option("--address", o->server.address, "Address to listen on")->capture_default_str();
  verb->add_option("--port", o->server.port, "Port; 0: any that is free")->capture_default_str();
  verb->add_option("--key", o->server.key, "Key of the address (default: a new one)");
  verb->add_option("--origin", o->server.origins,
                   "A page of elsewhere that may look, as https://app.foxglove.dev (repeatable)")
      ->take_all();
  verb->add_option("--topics", o->topics,
                   "Show only topics that this regular expression matches as a whole");
  verb->add_option("--rate", o->rate, "Of a log and a film: recorded seconds per second")
      ->check(CLI::Range(0.001, 1000.0))
      ->capture_default_str();
  verb->add_flag("--paused", o->paused, "Of a log: begin at rest");
  verb->add_flag(
      "--images", o->images,
      "Of a log: compute all its elided images again, not only those that are looked at");
  view::FilmOptions& f = o->film;
  auto* film = verb->add_option("--film", f.film, "Write a film of a log's scene: mp4, webm, gif");
  auto* png = verb->add_option("--png", f.png, "Write a picture of a log's scene");
  film->excludes(png)->needs("log");
  png->needs("log");
  verb->add_option("--from", f.from_s, "Where the film begins, or the picture is [s of the log]")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--to", f.to_s, "Where the film ends [s of the log] (default: at its end)")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--fps", f.rate_hz, "Pictures a second of the film")
      ->check(CLI::Range(1.0, 120.0))
      ->capture_default_str();
  verb->add_option(
          "--camera", f.camera,
          "Eye and what it looks at, as X,Y,Z,X,Y,Z [m] (default: of the layout that fits)")
      ->check([](const std::string& text) {
        std::istringstream in(text + ',');
        double value = 0.0;
        char comma = 0;
        int numbers = 0;
        while (in >> value >> comma && comma == ',') ++numbers;
        return numbers == 6 && in.eof() ? std::string() : "expected six numbers X,Y,Z,X,Y,Z";
      });
  verb->add_option("--width", f.width_px, "Of film and picture [px]")
      ->check(CLI::Range(16, 7680))
      ->capture_default_str();
  verb->add_option("--height", f.height_px, "Of film and picture [px]")
      ->check(CLI::Range(16, 4320))
      ->capture_default_str();
  verb->add_option("--browser", f.browser, "Program that draws films (default: chromium)");
  verb->footer(
      "Prints the address of the page. Who has its key may change parameters and call services;\n"
      "others on this computer may look, others elsewhere nothing. Listening on an address that\n"
      "other computers reach is not encrypted: ssh -L 8765:localhost:8765 HOST is.\n"
      "Examples:\n"
      "  mimesis view                        # the graph that runs\n"
      "  mimesis view run.mcap --rate 0.5    # a log, with a time line\n"
      "  mimesis view run.mcap --film run.mp4 --camera 1.5,-1.5,1,0.3,0,0.2");
  verb->callback([o, &exit_code] { exit_code = view::run(*o); });
}

}  // namespace mimesis::tool
