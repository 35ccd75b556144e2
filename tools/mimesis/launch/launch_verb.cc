// `mimesis launch`: checks, shows or runs a launch file.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>

#include "common/error.h"
#include "common/json_text.h"
#include "common/runtime/graph_time.h"
#include "common/runtime/raw.h"
#include "common/runtime/registry.h"
#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/export.h"
#include "tools/mimesis/launch/graph_file.h"
#include "tools/mimesis/launch/result.h"
#include "tools/mimesis/launch/subreaper.h"
#include "tools/mimesis/launch/supervisor.h"
#include "tools/mimesis/log_folder.h"
#include "tools/mimesis/machine_state.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::launch {
namespace {

/// Options of `mimesis launch`.
struct Options {
  std::string file;
  std::vector<std::string> args;  ///< NAME=VALUE
  std::vector<std::string> sets;  ///< NODE.KEY=VALUE
  std::string graph;              ///< empty: the environment's
  std::string name;               ///< name of the run; empty: made from the time
  bool check = false, dry_run = false, json = false;
  bool help = false, schema = false;
  bool keep_running = false;  ///< the result does not end the run
  bool verbose = false;
  double timeout_s = 0.0;                     ///< of the run; 0: none
  std::uint64_t log_limit = tool::kLogLimit;  ///< of older runs [bytes]
  std::string export_to, host;                ///< `export`: folder, host whose nodes
};

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

/// A reason may hold what a node said, in any bytes.
void print(const Json& json) { fmt::print("{}\n", json_text(json)); }

std::string after_text(const NodeSpec& node) {
  std::string names;
  for (const Text& before : node.after) names += (names.empty() ? "" : ", ") + before.text;
  return names.empty() ? "" : "  after " + names;
}

Run make_run(const Options& options) {
  Run run;
  run.graph = options.graph.empty() ? runtime::graph_name() : options.graph;
  run.log =
      (tool::log_root() / (options.name.empty() ? tool::new_run_name(options.file) : options.name))
          .string();
  run.verbose = options.verbose;
  run.timeout_s = options.timeout_s;
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

/// The part of a line between these two; null if there is no `from`.
Json between(const std::string& text, std::string_view from, std::string_view to) {
  const std::size_t begin = text.rfind(from);
  if (begin == std::string::npos) return nullptr;
  const std::size_t at = begin + from.size();
  return text.substr(at, text.find(to, at) - at);
}

/// All messages have one form, whoever makes them: "PLACE: what, expected what, found 'what', did
/// you mean 'what'?"; or "what is outside [0, 1]".
Json to_json(const Mistake& mistake) {
  static const std::regex kPlaced(R"(^(.*?):(\d+):(\d+): ([^]*)$)");
  std::smatch part;
  const bool placed = std::regex_match(mistake.text, part, kPlaced);
  const std::string what = placed ? part.str(4) : mistake.text;
  const std::size_t suggested = what.rfind(", did you mean '");
  Json expected = between(what.substr(0, suggested), "expected ", ", found ");
  if (expected.is_null()) expected = between(what.substr(0, suggested), " is outside ", "\n");
  const bool option = mistake.text.starts_with("--");  // --set, --arg: in no file
  return {{"file", placed   ? Json(part.str(1))
                   : option ? Json(nullptr)
                            : Json(mistake.near.file)},
          {"line", placed ? Json(std::stoi(part.str(2))) : Json(nullptr)},
          {"column", placed ? Json(std::stoi(part.str(3))) : Json(nullptr)},
          {"message", what},
          {"expected", expected},
          {"suggestion", between(what, ", did you mean '", "'?")},
          {"severity", mistake.warning ? "warning" : "error"}};
}

/// Prints mistakes to standard error, or with `json` as an array to standard output.
void report_mistakes(const std::string& file, const Mistakes& mistakes, bool json) {
  Json all = Json::array();
  for (const Mistake& mistake : mistakes.sorted()) {
    all.push_back(to_json(mistake));
    if (!json)
      fmt::print(stderr, "{}{}\n", mistake.warning ? "warning: " : "", printable(mistake.text));
  }
  if (json) return print(all);
  if (mistakes.empty()) fmt::print(stderr, "{}: no mistakes\n", file);
}

/// Prints the commands in order of start and the order of stopping.
void print_plan(const GraphFile& graph, const Run& run, bool json) {
  const auto stop = stop_order(graph);
  if (!json) {
    for (const NodeSpec& node : graph.nodes) {
      fmt::print("# {}{}\n{}\n", node.name.text, after_text(node),
                 shell_line(command_from_here(graph, node, run)));
    }
    fmt::print("# stop:");
    for (const auto& group : stop) fmt::print(" [{}]", fmt::join(group, " "));
    fmt::print("\n");
    return;
  }
  Json start = Json::array();
  for (const NodeSpec& node : graph.nodes) {
    const Command c = command_from_here(graph, node, run);
    Json after = Json::array(), env = Json::object();
    for (const Text& before : node.after) after.push_back(before.text);
    for (const auto& [name, value] : c.env) env[name] = value;
    start.push_back({{"name", node.name.text}, {"after", after}, {"argv", c.argv}, {"env", env}});
  }
  print({{"graph", run.graph},
         {"clock", graph.clock},
         {"log", run.log},
         {"start", start},
         {"stop", stop}});
}

/// Prints how the run and its nodes ended.
void print_summary(const Outcome& outcome, const Run& run) {
  Json nodes = Json::array();
  for (const NodeOutcome& node : outcome.nodes) {
    nodes.push_back({{"name", node.name},
                     {"exit_code", node.exit_code},
                     {"restarts", node.restarts},
                     {"killed", node.killed}});
  }
  print({{"exit_code", outcome.exit_code},
         {"reason", outcome.reason},
         {"graph", run.graph},
         {"log", run.log},
         {"nodes", nodes}});
}

std::uint64_t folder_size(const std::string& folder) {
  std::uint64_t bytes = 0;
  std::error_code ignored;
  for (const auto& file : fs::recursive_directory_iterator(folder, ignored)) {
    const std::uint64_t size = file.is_regular_file(ignored) ? file.file_size(ignored) : 0;
    if (!ignored) bytes += size;
  }
  return bytes;
}

int run_graph(const GraphFile& graph, const Run& run, bool json, Fd life) {
  if (graph.clock == "wall") {
    const auto machine = tool::measure_machine(std::chrono::milliseconds(100));
    if (machine.busy()) say("this machine may be too busy for the wall clock: {}", machine.text());
  }
  const runtime::GraphTime time(runtime::graph_directory(run.graph));  // one offset for all the run
  const auto start = std::chrono::steady_clock::now();
  std::unique_ptr<ResultWatcher> watcher;
  if (graph.result) {
    const auto epoch = graph.clock == "wall" ? time.now() : std::chrono::nanoseconds(0);
    watcher = std::make_unique<ResultWatcher>(*graph.result, run.graph, epoch);
  }
  const News news = [&] {
    return watcher ? fmt::format("{:.1f} s of graph time", watcher->graph_now_s()) : "";
  };
  Outcome outcome = supervise(graph, run, watcher ? watcher->fd() : -1, std::move(life), news);
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  Json result;
  if (watcher != nullptr) {
    watcher->stop();
    if (const std::string& failure = watcher->failure(); !failure.empty()) {
      outcome.reason = failure + (outcome.reason.empty() ? "" : "; " + outcome.reason);
    }
    if (outcome.reason.empty() && !watcher->collector().end()) outcome.reason = "all nodes ended";
    if (watcher->misconfigured()) outcome.exit_code = 2;
    result = watcher->collector().line(outcome.reason);
    result["wall_s"] = std::round(wall.count() * 1e3) / 1e3;
    result["graph_s"] = watcher->graph_s();
    result["log"] = run.log;
    const bool succeeded = outcome.reason.empty() && watcher->collector().succeeded();
    if (!succeeded && outcome.exit_code == 0) outcome.exit_code = 1;
    if (!succeeded && outcome.exit_code < 128) {  // not interrupted: what came first
      const auto told = result.find("reason");
      const std::string reason =
          told != result.end() && told->is_string() ? told->get<std::string>() : outcome.reason;
      result["reason"] = watcher->causes().before(reason, graph.clock == "wall");
    }
  }
  if (json) print_summary(outcome, run);
  if (!result.is_null()) print(result);
  fmt::print(stderr, "mimesis: logs in {} ({})\n", run.log, tool::bytes_text(folder_size(run.log)));
  return outcome.exit_code;
}

/// Logs of older runs make room for this one's.
void limit_logs(std::uint64_t limit) {
  for (const tool::RunFolder& old : tool::beyond(tool::run_folders(), {.bytes = limit})) {
    const std::string failure = tool::remove_run(old);
    fmt::print(stderr, "mimesis: {}\n",
               failure.empty()
                   ? fmt::format("removed the log of {} ({}): older logs take at most {}", old.name,
                                 tool::bytes_text(old.bytes), tool::bytes_text(limit))
                   : failure);
  }
}

/// In place of `run_graph`, which was killed.
void report_killed(const GraphFile& graph, const Run& run, const std::string& why, bool json) {
  if (json) print_summary({.exit_code = 1, .reason = why, .nodes = {}}, run);
  if (graph.result) {
    Json result = ResultCollector(*graph.result).line(why);
    result["log"] = run.log;
    print(result);
  }
  std::fflush(stdout);
  clean_folder(runtime::graph_directory(run.graph));
}

/// Returns the exit code. @throws ConfigError
int export_units(const Options& options) {
  Run run = make_run(options);
  run.log = boot_log(run.graph);
  Mistakes mistakes;
  GraphFile file = read_graph_file(options.file, options.args, run.log, mistakes);
  check_graph(file, run, false, mistakes);
  if (!mistakes.empty()) {
    report_mistakes(options.file, mistakes, options.json);
    return 2;
  }
  GraphFile graph = with_clock(std::move(file));
  sort_by_start(graph);
  const BootUnits units = boot_units(graph, run, options.host);
  const auto removed = write_units(options.export_to, run.graph, units);
  Json names = Json::array();
  for (const auto& [name, text] : units.files) names.push_back(name);
  if (options.json) {
    print({{"folder", options.export_to},
           {"graph", run.graph},
           {"units", names},
           {"removed", removed},
           {"notes", units.notes}});
    return 0;
  }
  for (const Json& name : names)
    fmt::print("{}\n", (fs::path(options.export_to) / name.get<std::string>()).string());
  for (const std::string& name : removed)
    fmt::print(stderr, "mimesis: removed {} of an earlier export\n", name);
  for (const std::string& note : units.notes) fmt::print(stderr, "mimesis: {}\n", note);
  return 0;
}

/// The lines with # before the first one without.
std::string head_comment(const std::string& file) {
  std::ifstream in(file);
  std::string text;
  for (std::string line; std::getline(in, line) && line.starts_with('#');)
    text += line.substr(line.starts_with("# ") ? 2 : 1) + "\n";
  return text;
}

/// Variables stay as they are written: they have other values in each run.
Json argument(const runtime::Yaml::Entry& declared) {
  const auto text = [&](const char* key) {
    const runtime::Yaml* value = declared.value.find(key);
    return value != nullptr && value->kind == runtime::Yaml::Kind::scalar ? Json(value->text)
                                                                          : Json(nullptr);
  };
  Json implies = Json::object();
  if (const runtime::Yaml* implied = declared.value.find("implies")) {
    for (const auto& entry : implied->entries) implies[entry.key] = entry.value.text;
  }
  const Json type = text("type");
  return {{"name", declared.key},
          {"type", type.is_null() ? Json("string") : type},
          {"default", text("default")},
          {"help", text("help")},
          {"implies", implies}};
}

Json node_json(const NodeSpec& node, bool enabled) {
  return {{"name", node.name.text},
          {"exec", node.exec.text},
          {"host", node.host ? Json(node.host->text) : Json(nullptr)},
          {"enabled", enabled},
          {"file", node.name.place.file}};
}

std::string shown_default(const Json& arg) {
  return arg["default"].is_null() ? "(needed)" : arg["default"].get<std::string>();
}

/// One line each; the help of those with a long default is out of its column.
std::string argument_lines(const Json& args) {
  constexpr std::size_t kWidest = 24;
  std::size_t name = 0, fallback = 0;
  for (const Json& arg : args) {
    name = std::max(name, std::min(kWidest, arg["name"].get<std::string>().size()));
    fallback = std::max(fallback, std::min(kWidest, shown_default(arg).size()));
  }
  std::string text;
  for (const Json& arg : args) {
    std::string line =
        fmt::format("  {:<{}}  {:<8}  {:<{}}  {}", arg["name"].get<std::string>(), name,
                    arg["type"].get<std::string>(), shown_default(arg), fallback,
                    arg["help"].is_null() ? "" : arg["help"].get<std::string>());
    std::string implied;
    for (const auto& [other, value] : arg["implies"].items())
      implied += fmt::format(" {}={}", other, value.get<std::string>());
    if (!implied.empty())
      line += fmt::format("\n{:<{}}true implies{}", "", name + fallback + 16, implied);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

/// `mimesis launch FILE --help`: the comment at the head of the file, its arguments and its nodes.
/// As text for people, or one line of JSON. @throws ConfigError if it is no YAML.
std::string file_help(const std::string& file, const std::vector<std::string>& args, bool json) {
  const runtime::Yaml document = runtime::read_yaml(file);
  Mistakes ignored;  // --check is for them
  const GraphFile graph = read_graph_file(file, args, "${run:log}", ignored);
  Json help{{"file", file},
            {"about", head_comment(file)},
            {"args", Json::array()},
            {"nodes", Json::array()}};
  if (const runtime::Yaml* declared = document.find("args")) {
    for (const auto& entry : declared->entries) help["args"].push_back(argument(entry));
  }
  for (const NodeSpec& node : graph.nodes) help["nodes"].push_back(node_json(node, true));
  for (const NodeSpec& node : graph.disabled) help["nodes"].push_back(node_json(node, false));
  if (json) return json_text(help) + "\n";

  std::string text = fmt::format("{}\n{}", file, help["about"].get<std::string>());
  if (!help["args"].empty()) text += "\nArguments (--arg NAME=VALUE; type, default):\n";
  text += argument_lines(help["args"]);
  text += "\nNodes:\n";
  for (const Json& node : help["nodes"]) {
    text += fmt::format("  {:<22} {}", node["name"].get<std::string>(),
                        node["exec"].get<std::string>());
    if (!node["host"].is_null()) text += " on " + node["host"].get<std::string>();
    text += node["enabled"] ? "\n" : " (switched off)\n";
  }
  return text + "\nOptions of every launch: mimesis launch --help\n";
}

/// Returns the exit code. @throws ConfigError, CLI::Error
int check_show_or_run(const Options& options) {
  if (options.help && options.file.empty()) throw CLI::CallForHelp();
  if (options.help || options.schema) {
    fmt::print("{}", options.help
                         ? printable(file_help(options.file, options.args, options.json), "\n")
                         : kSchema);
    return 0;
  }
  if (options.file.empty()) throw CLI::RequiredError("file");
  const Run run = make_run(options);
  Mistakes mistakes;
  GraphFile file;
  try {
    file = read_graph_file(options.file, options.args, run.log, mistakes);
  } catch (const ConfigError& e) {  // no YAML
    mistakes.add_line({options.file}, e.what());
    report_mistakes(options.file, mistakes, options.json);
    return 2;
  }
  // In a plain launch the nodes find themselves what shows only when all of them is made.
  check_graph(file, run, options.check, mistakes);
  GraphFile graph = with_clock(file);
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
  const tool::RunLock running(run.log);
  limit_logs(options.log_limit);
  return run_below_subreaper(
      [&](Fd life) { return run_graph(graph, run, options.json, std::move(life)); },
      [&](const std::string& why) { report_killed(graph, run, why, options.json); });
}

}  // namespace
}  // namespace mimesis::launch

namespace mimesis::tool {

void add_launch(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("launch");
  auto options = std::make_shared<launch::Options>();
  verb->set_help_flag();
  verb->add_option("file", options->file, "Launch file (YAML, see launch/README.md)");
  verb->add_flag("-h,--help", options->help,
                 "Print this; behind a file: what it is, its arguments and its nodes");
  verb->add_flag("--schema", options->schema, "Print the JSON Schema of launch files, for editors");
  verb->add_flag("--check", options->check,
                 "Report all mistakes of the file with line and column; start nothing");
  verb->add_flag("--dry-run", options->dry_run,
                 "Print the commands in order of start; start nothing");
  const auto add_common = [&options](CLI::App* to) {
    to->add_option("--arg", options->args, "Value of an argument the file declares")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    to->add_option("--set", options->sets, "Parameter of a node, the last wins")
        ->type_name("NODE.KEY=VALUE")
        ->allow_extra_args(false);
    to->add_option("--graph", options->graph,
                   "Name of the graph (default: MIMESIS_GRAPH, or default)");
    to->add_flag("--json", options->json, "Machine-readable output (tools/mimesis/README.md)");
  };
  add_common(verb);
  verb->add_option("--name", options->name,
                   "Name of the run and its log folder (default: date and time)");
  verb->add_flag("--keep-running", options->keep_running,
                 "Run until stopped, even if `result:` of the file is reached");
  verb->add_option("--timeout", options->timeout_s,
                   "Longest run [s] of wall time; then it is stopped in order, with exit code 3")
      ->check(tool::number_above_zero);
  verb->add_option_function<std::string>(
          "--log-limit",
          [options](const std::string& text) { options->log_limit = *tool::to_bytes(text); },
          "Logs of older runs beyond this size are removed first, the oldest first (default: " +
              tool::bytes_text(tool::kLogLimit) + ")")
      ->envname("MIMESIS_LOG_LIMIT")
      ->check([](const std::string& text) {
        return tool::to_bytes(text) ? "" : "expected a size such as 500MB, found '" + text + "'";
      });
  verb->add_flag("-v,--verbose", options->verbose,
                 "Show all that nodes print, not warnings alone (their .log files have all)");
  CLI::App* exports = verb->add_subcommand(
      "export", "Writes units of systemd with which a host boots its nodes, without the launcher");
  exports->set_help_flag("-h,--help", "Print this help message and exit");
  exports->add_option("file", options->file, "Launch file")->required();
  exports->add_option("--systemd", options->export_to, "Folder for the units")
      ->required()
      ->type_name("DIR");
  exports->add_option("--host", options->host, "Host of the file (default: this machine)");
  add_common(exports);
  exports->footer(
      "Examples:\n"
      "  sudo mimesis launch export /etc/mimesis/arm.yaml --graph arm --systemd "
      "/etc/systemd/system\n"
      "  sudo systemctl daemon-reload && sudo systemctl enable --now mimesis-arm.target");
  exports->callback([options, &exit_code] { exit_code = launch::export_units(*options); });
  verb->footer(
      "Examples:\n"
      "  mimesis launch launch/imitation.yaml --arg teacher=full,below,low\n"
      "  mimesis launch launch/imitation.yaml --set planner.rate_hz=100\n"
      "  mimesis launch launch/imitation.yaml --check\n"
      "  mimesis launch launch/imitation.yaml --help");
  verb->callback([options, &exit_code, verb] {
    if (verb->get_subcommands().empty()) exit_code = launch::check_show_or_run(*options);
  });
}

}  // namespace mimesis::tool
