#include "tools/mimesis/launch/launch.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/launch/check.h"
#include "tools/mimesis/launch/keeper.h"
#include "tools/mimesis/launch/order.h"
#include "tools/mimesis/launch/report.h"
#include "tools/mimesis/launch/result_watcher.h"

namespace mimesis::launch {
namespace {

namespace fs = std::filesystem;

/// $XDG_STATE_HOME/mimesis/log/RUN
fs::path log_folder(const std::string& run) {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path base = state != nullptr && *state != '\0' ? fs::path(state)
                  : home != nullptr && *home != '\0' ? fs::path(home) / ".local/state"
                                                     : fs::temp_directory_path();
  return base / "mimesis/log" / run;
}

/// The process id makes it unique among runs that start in the same second.
std::string run_name(const Options& options) {
  if (!options.name.empty()) return options.name;
  return fmt::format("{:%Y%m%d-%H%M%S}-{}-{}", fmt::localtime(std::time(nullptr)),
                     fs::path(options.file).stem().string(), getpid());
}

Run make_run(const Options& options) {
  Run run;
  run.graph = options.graph.empty() ? runtime::graph_name() : options.graph;
  run.log = log_folder(run_name(options)).string();
  for (const std::string& set : options.sets) {
    const std::size_t dot = set.find('.');
    if (dot == std::string::npos || dot == 0 || set.find('=') == std::string::npos ||
        set.find('=') < dot) {
      throw ConfigError("--set: '" + set + "' is not NODE.KEY=VALUE");
    }
    run.sets.emplace_back(set.substr(0, dot), set.substr(dot + 1));
  }
  return run;
}

int supervise(const GraphFile& graph, const Run& run, bool json) {
  const auto start = std::chrono::steady_clock::now();
  std::unique_ptr<ResultWatcher> watcher;
  if (graph.result) {
    const auto epoch = graph.clock == "wall" ? std::chrono::system_clock::now().time_since_epoch()
                                             : std::chrono::nanoseconds(0);
    watcher = std::make_unique<ResultWatcher>(*graph.result, run.graph, epoch);
  }
  Outcome outcome = Supervisor(graph, run, watcher.get()).run();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  nlohmann::ordered_json result;
  if (watcher != nullptr) {
    watcher->stop();
    if (outcome.reason.empty()) outcome.reason = watcher->failure();
    if (outcome.reason.empty() && !watcher->collector().end()) outcome.reason = "all nodes ended";
    if (watcher->misconfigured()) outcome.exit_code = 2;
    result = watcher->collector().line(outcome.reason);
    result["wall_s"] = std::round(wall.count() * 1e3) / 1e3;
    result["graph_s"] = watcher->graph_s();
    result["log"] = run.log;
    const bool succeeded = outcome.reason.empty() && watcher->collector().succeeded();
    if (!succeeded && outcome.exit_code == 0) outcome.exit_code = 1;
  }
  if (json) std::printf("%s\n", summary_json(outcome, run).c_str());
  if (!result.is_null()) std::printf("%s\n", result.dump().c_str());
  std::fprintf(stderr, "mimesis: logs in %s\n", run.log.c_str());
  return outcome.exit_code;
}

}  // namespace

int launch(const Options& options) {
  const Run run = make_run(options);
  Mistakes mistakes;
  const GraphFile file = read_graph_file(options.file, options.args, run.log, mistakes);
  check_graph(file, run, mistakes);
  // Nodes read their own parameters, so in a plain launch they find their mistakes themselves.
  GraphFile graph = with_clock(file);
  if (options.check && mistakes.empty()) check_parameters(graph, run, mistakes);
  if (options.check || !mistakes.empty()) {
    report_mistakes(options.file, mistakes, options.json);
    return mistakes.empty() ? 0 : 2;
  }
  if (options.keep_running) graph.result.reset();
  sort_by_start(graph);
  if (options.dry_run) {
    print_plan(graph, run, options.json);
    return 0;
  }
  std::error_code error;
  fs::create_directories(run.log, error);
  if (error) throw ConfigError(run.log + ": " + error.message());
  return keep([&] { return supervise(graph, run, options.json); });
}

}  // namespace mimesis::launch
