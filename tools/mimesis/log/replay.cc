// `mimesis log replay`: chooses what is replayed, repeats it, and reports.
#include "tools/mimesis/log/replay.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "common/runtime/value_text.h"
#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/provenance.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/number_check.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

constexpr int kNotInLog = 3, kReplayTimedOut = 3;
constexpr std::size_t kFieldsShown = 20;

/// Several replays of the same recording.
struct RunCount {
  std::uint64_t runs = 0, equal = 0;
  ReplayReport shown;  ///< the first that was not equal, else the last one
};

/// Replays until `options.repeat` runs were made or one was interrupted.
RunCount repeat(const std::string& what, const std::vector<OpenLog>& logs,
                const ReplayOptions& options,
                const std::function<ReplayReport(const ReplayProgress&)>& replay) {
  LogProgress progress(what, logs);
  RunCount count;
  while (count.runs < options.repeat && count.shown.result != ReplayResult::kInterrupted) {
    ReplayReport report = replay([&](std::uint64_t log_time) { progress.at(log_time); });
    const bool all_equal = count.equal == count.runs;
    ++count.runs;
    if (report.result == ReplayResult::kEqual) ++count.equal;
    if (all_equal || report.result == ReplayResult::kInterrupted) count.shown = std::move(report);
  }
  if (!options.tolerance_note.empty()) count.shown.notes.push_back(options.tolerance_note);
  return count;
}

int exit_code_of(ReplayResult result) {
  if (result == ReplayResult::kTimedOut) return kReplayTimedOut;
  return result == ReplayResult::kEqual ? 0 : 1;
}

std::string_view word_of(ReplayResult result) {
  constexpr std::array<std::string_view, 5> kWords{"equal", "different", "incomplete", "timed out",
                                                   "interrupted"};
  return kWords.at(static_cast<std::size_t>(result));
}

ordered_json difference_json(const ReplayDifference& d) {
  ordered_json out = ordered_json::object();
  if (d.step) out["step"] = *d.step;
  out["time_s"] = d.time_s;
  out["what"] = d.what;
  if (!d.topic.empty()) {
    out["topic"] = d.topic;
    out["seq"] = d.seq;
  }
  out["field_count"] = d.fields.count;
  out["fields"] = ordered_json::array();
  for (const FieldDifference& f : d.fields.fields) {
    out["fields"].push_back({{"field", f.path}, {"recorded", f.a}, {"replayed", f.b}});
  }
  return out;
}

/// One object: `head`, the result, `figures`, the differences.
void print_json(ordered_json head, const RunCount& count, const ordered_json& figures) {
  const ReplayReport& r = count.shown;
  head["result"] = word_of(r.result);
  head["runs"] = count.runs;
  head["equal"] = count.equal;
  head.update(figures);
  head["difference_count"] = r.difference_count;
  head["differences"] = ordered_json::array();
  for (const ReplayDifference& d : r.differences) head["differences"].push_back(difference_json(d));
  head["problem"] = r.problem;
  head["notes"] = r.notes;
  head["tolerated"] = ordered_json::array();
  for (const auto& [key, worst] : r.tolerated) {
    head["tolerated"].push_back({{"topic", key.first}, {"field", key.second}, {"worst", worst}});
  }
  std::cout << head.dump() << std::endl;
}

void print_difference(const std::string& name, const ReplayDifference& d) {
  std::cout << fmt::format("{}: {}at {:.6f} s: {}\n", name,
                           d.step ? fmt::format("step {} ", *d.step) : "", d.time_s, d.what);
  const auto& fields = d.fields.fields;
  if (fields.empty()) return;
  Table table({"  FIELD", "RECORDED", "REPLAYED"});
  for (std::size_t i = 0; i < std::min(fields.size(), kFieldsShown); ++i) {
    table.row(
        {"  " + (fields[i].path.empty() ? "(message)" : fields[i].path), fields[i].a, fields[i].b});
  }
  table.print(std::cout, use_colour(1));
  if (d.fields.count > kFieldsShown) {
    std::cout << fmt::format("  and {} more\n", d.fields.count - kFieldsShown);
  }
}

void print_text(const std::string& name, const RunCount& count, const std::string& figures) {
  const ReplayReport& r = count.shown;
  for (const ReplayDifference& d : r.differences) print_difference(name, d);
  if (!r.problem.empty()) std::cout << name << ": " << r.problem << '\n';
  const std::string result = count.runs == 1
                                 ? std::string(word_of(r.result))
                                 : fmt::format("{} of {} equal", count.equal, count.runs);
  std::cout << fmt::format("{}: {}: {}{:.1f} MB in {:.2f} s", name, result, figures,
                           static_cast<double>(r.counts.bytes) * 1e-6, r.wall_s);
  if (r.wall_s > 0.0) std::cout << fmt::format(" ({:.1f} x real time)", r.graph_s / r.wall_s);
  std::cout << '\n';
  if (r.difference_count > r.differences.size()) {
    std::cout << fmt::format("  {} differences, {} shown\n", r.difference_count,
                             r.differences.size());
  }
  for (const auto& [key, worst] : r.tolerated) {
    std::cout << fmt::format("  tolerated: {} {}: {:.3g} at most\n", key.first, key.second, worst);
  }
  for (const std::string& note : r.notes) std::cout << "  " << note << '\n';
  std::cout << std::flush;
}

std::vector<std::string> senders(const std::vector<OpenLog>& logs) {
  std::set<std::string> names;
  for (const OpenLog& log : logs) {
    for (const auto& [id, channel] : log.summary.channels) names.insert(sender_of(channel));
  }
  names.erase("");
  return {names.begin(), names.end()};
}

/// Prints one line per node that was asked for and cannot be replayed; returns their number.
int report_absent(const std::vector<OpenLog>& logs, const std::vector<Life>& lives,
                  const std::vector<std::string>& wanted) {
  const std::string& file = logs.front().path;
  if (wanted.empty() && lives.empty()) {
    std::cerr << fmt::format(
        "{}: no node can be replayed: the log holds no NODE/start (an older recording, or these "
        "topics were left out)\n",
        file);
    return 1;
  }
  const std::vector<std::string> known = senders(logs);
  int absent = 0;
  for (const std::string& node : wanted) {
    if (std::ranges::any_of(lives, [&](const Life& life) { return life.node() == node; })) continue;
    ++absent;
    if (std::ranges::find(known, node) != known.end()) {
      std::cerr << fmt::format(
          "{}: node '{}' cannot be replayed: the log holds no {}/start (an older recording, or the "
          "topic was left out)\n",
          file, node, node);
    } else {
      std::cerr << fmt::format("{}: there is no node '{}' in it{}; there are: {}\n", file, node,
                               runtime::did_you_mean(node, known), fmt::join(known, ", "));
    }
  }
  return absent;
}

std::string program_of(const Life& life, const ReplayOptions& options) {
  std::string wanted = options.program.empty() ? life.start.executable() : options.program;
  if (std::error_code ignored; std::filesystem::is_directory(wanted, ignored)) {
    wanted += "/" + life.start.executable();
  }
  const std::string path = launch::find_executable(wanted);
  if (path.empty()) {
    throw ConfigError(fmt::format(
        "node '{}': there is no program '{}' beside this one or on PATH; --exec PATH names another",
        life.node(), wanted));
  }
  return path;
}

int replay_nodes(const std::vector<OpenLog>& logs, const ReplayOptions& options,
                 const StopSignals& stop) {
  std::vector<Life> lives = find_lives(logs);
  const int absent = report_absent(logs, lives, options.nodes);
  std::set<std::string> names;
  std::erase_if(lives, [&](const Life& life) {
    const bool wanted = options.nodes.empty() ||
                        std::ranges::find(options.nodes, life.node()) != options.nodes.end();
    if (wanted) names.insert(life.node());
    return !wanted;
  });
  if (names.size() > 1 && !options.sets.empty()) {
    throw ConfigError("mimesis log replay: --set is for one node: name it");
  }
  int exit_code = absent > 0 ? kNotInLog : 0;
  for (const Life& life : lives) {
    const std::string program = program_of(life, options);
    const RunCount count =
        repeat("replay " + life.node(), logs, options, [&](const ReplayProgress& progress) {
          return replay_life(logs, life, program, options, stop, progress);
        });
    const ReplayReport& r = count.shown;
    if (options.json) {
      print_json({{"node", life.node()},
                  {"start_id", life.start.start_id()},
                  {"clock", life.start.clock()}},
                 count,
                 {{"steps", r.counts.steps},
                  {"graph_s", r.graph_s},
                  {"wall_s", r.wall_s},
                  {"inputs", r.counts.inputs},
                  {"outputs", r.counts.outputs},
                  {"writes", r.counts.writes},
                  {"responses", r.counts.responses},
                  {"bytes", r.counts.bytes}});
    } else {
      std::string figures =
          fmt::format("{} steps, {:.2f} s of graph time, {} inputs, {} outputs, ", r.counts.steps,
                      r.graph_s, r.counts.inputs, r.counts.outputs);
      if (r.counts.writes > 0) figures += fmt::format("{} packets written, ", r.counts.writes);
      if (r.counts.responses > 0) figures += fmt::format("{} responses, ", r.counts.responses);
      print_text(life.node(), count, figures);
    }
    if (r.result == ReplayResult::kInterrupted) return 128 + stop.signal();
    exit_code = std::max(exit_code, exit_code_of(r.result));
  }
  return exit_code;
}

int replay_graph(const std::vector<OpenLog>& logs, const ReplayOptions& options,
                 const StopSignals& stop) {
  const LaunchPlan plan = plan_launch(logs, options);
  const std::string name = std::filesystem::path(plan.file).filename().string();
  const RunCount count =
      repeat("replay " + name, logs, options, [&](const ReplayProgress& progress) {
        return replay_launch(logs, plan, options, stop, progress);
      });
  const ReplayReport& r = count.shown;
  if (options.json) {
    ordered_json head = ordered_json::object();
    head["launch"] = plan.file;
    print_json(std::move(head), count,
               {{"graph_s", r.graph_s},
                {"wall_s", r.wall_s},
                {"messages", r.counts.outputs},
                {"bytes", r.counts.bytes}});
  } else {
    print_text(plan.file, count,
               fmt::format("{} messages, {:.2f} s of graph time, ", r.counts.outputs, r.graph_s));
  }
  if (r.result == ReplayResult::kInterrupted) return 128 + stop.signal();
  return exit_code_of(r.result);
}

/// Which tolerance counts here, and why.
void choose_tolerance(const std::vector<OpenLog>& logs, ReplayOptions& options) {
  if (!options.tolerance_elsewhere) return;
  const std::string there = recorded_arithmetic(logs), here = arithmetic();
  if (there == here) {
    options.tolerance_note = "compared exactly: recorded where it computes alike: " + here;
    return;
  }
  options.tolerance = *options.tolerance_elsewhere;
  options.tolerance_note =
      fmt::format("compared with tolerance {}: recorded on {}; here: {}", options.tolerance,
                  there.empty() ? "an unknown machine" : there, here);
}

/// Returns the exit code.
int log_replay(ReplayOptions& options) {
  const StopSignals stop;
  const auto logs = open_logs(options.logs);
  if (!logs) {
    std::cerr << logs.error().line << '\n';
    return logs.error().exit_code;
  }
  for (const OpenLog& log : *logs) {
    report_damages(log.path, log.summary.damages, log.summary.damage_count);
  }
  choose_tolerance(*logs, options);
  return options.launch.empty() ? replay_nodes(*logs, options, stop)
                                : replay_graph(*logs, options, stop);
}

constexpr const char* kReplayAbout =
    "Runs recorded nodes again, step by step, and compares all they do";
constexpr const char* kReplayFooter =
    "Each step gets exactly the messages, the time and the bytes from outside that the recorded "
    "one had.\n"
    "Not compared: NODE/health, NODE/log, NODE/steps, NODE/start. With a launch file the whole "
    "graph\n"
    "runs again (lock-step only), with the arguments of the recorded run.\n"
    "Exit codes: 0 equal, 1 different or not complete, 3 the node is not in the log or timed out.\n"
    "Examples:\n"
    "  mimesis log replay run.mcap\n"
    "  mimesis log replay planner run.mcap --repeat 100\n"
    "  mimesis log replay planner run.mcap --exec build-asan/bin/mimesis_planner --tolerance 1e-9\n"
    "  mimesis log replay launch/imitation.yaml run.mcap";

bool is_launch_file(const std::string& word) {
  return word.ends_with(".yaml") || word.ends_with(".yml");
}

bool is_log(const std::string& word) {
  std::error_code ignored;
  return word.ends_with(".mcap") || word.find('/') != std::string::npos ||
         std::filesystem::is_regular_file(word, ignored);
}

/// [NODE ...] LOG... or LAUNCH_FILE LOG...
void sort_words(const std::vector<std::string>& words, ReplayOptions& options) {
  for (const std::string& word : words) {
    if (is_launch_file(word)) {
      if (!options.launch.empty())
        throw ConfigError("mimesis log replay: one launch file, not two");
      options.launch = word;
    } else {
      (is_log(word) ? options.logs : options.nodes).push_back(word);
    }
  }
  if (options.logs.empty()) {
    throw ConfigError("mimesis log replay: which log? There is no file '" + words.back() + "'");
  }
  if (!options.launch.empty() && !(options.nodes.empty() && options.program.empty())) {
    throw ConfigError("mimesis log replay: a launch file runs all its nodes: no NODE, no --exec");
  }
  if (options.launch.empty() && !options.args.empty()) {
    throw ConfigError("mimesis log replay: --arg is for a launch file");
  }
}

}  // namespace

void add_replay(CLI::App& log, int& exit_code) {
  CLI::App* verb = log.add_subcommand("replay", kReplayAbout);
  struct Options {
    ReplayOptions replay;
    std::vector<std::string> words;
    std::uint64_t keep_going = 0;  ///< 0: to the end
  };
  auto o = std::make_shared<Options>();
  verb->add_option("WORDS", o->words,
                   "Nodes (default: all that the log tells enough of) or a launch file, then logs")
      ->required()
      ->type_name("[NODE ...|LAUNCH_FILE] LOG ...");
  verb->add_option("--exec", o->replay.program,
                   "Program of the node, or a folder of programs: another build")
      ->type_name("PATH");
  verb->add_option("--set", o->replay.sets,
                   "Sets a parameter otherwise than recorded (repeatable); NODE.KEY=VALUE with a "
                   "launch file")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  verb->add_option("--arg", o->replay.args, "Argument of the launch file, otherwise than recorded")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  verb->add_option("--tolerance", o->replay.tolerance,
                   "Floating-point fields may differ by X, absolute or relative")
      ->type_name("X")
      ->check(number_not_below_zero);
  verb->add_option("--tolerance-elsewhere", o->replay.tolerance_elsewhere,
                   "The same, but only if this machine does not compute as the one that recorded "
                   "(CPU, libm, compiler)")
      ->type_name("X")
      ->check(number_not_below_zero)
      ->excludes("--tolerance");
  verb->add_option("--timeout", o->replay.timeout_s,
                   "Give up when a step takes longer (with a launch file: when no message comes)")
      ->type_name("SECONDS")
      ->check(number_above_zero)
      ->capture_default_str();
  CLI::Option* keep_going =
      verb->add_flag("--keep-going{0}", o->keep_going,
                     "Do not stop at the first difference but after N (--keep-going=N)")
          ->type_name("N");
  verb->add_option("--repeat", o->replay.repeat, "Replay so many times: n of N are equal")
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  verb->add_flag("--json", o->replay.json, "One JSON object per node (tools/mimesis/README.md)");
  verb->footer(kReplayFooter);
  verb->callback([o, keep_going, &exit_code] {
    if (keep_going->count() > 0) {
      o->replay.differences =
          o->keep_going > 0 ? o->keep_going : std::numeric_limits<std::uint64_t>::max();
    }
    sort_words(o->words, o->replay);
    exit_code = log_replay(o->replay);
  });
}

}  // namespace mimesis::tool
