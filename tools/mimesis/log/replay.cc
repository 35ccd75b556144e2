// `mimesis log replay`: chooses nodes, runs them again, repeats that, and reports.
#include "tools/mimesis/log/replay.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "common/json_text.h"
#include "common/runtime/value_text.h"
#include "common/time.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/provenance.h"
#include "tools/mimesis/log/replay_step.h"
#include "tools/mimesis/log/restore.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

constexpr int kNotInLog = 3, kReplayTimedOut = 3;
constexpr std::size_t kFieldsShown = 20;

/// One run of a node, run again step by step: the program steps with the recorded inputs, and all
/// outputs are compared.
class NodeReplay {
 public:
  NodeReplay(const std::vector<OpenLog>& logs, const NodeRun& node_run,
             const ReplayOptions& options, const StopSignals& stop)
      : run_(node_run),
        options_(options),
        stop_(stop),
        reader_(logs, node_run),
        messages_(options.tolerance),
        comparison_(node_run, reader_, messages_) {}

  ReplayReport run(const std::string& program, const ReplayProgress& progress) {
    const auto started = std::chrono::steady_clock::now();
    PacketProcess node(
        "the node",
        [&](int socket) {
          return replay_command(program, run_, folder_.path(), options_.sets, socket);
        },
        options_.timeout_s, options_.unconfined ? "" : folder_.path());
    report_.notes = run_.renamed;
    while (advance(node)) progress(reader_.log_time_ns());
    finish(node);
    report_.wall_s = to_seconds(std::chrono::steady_clock::now() - started);
    return std::move(report_);
  }

 private:
  /// One step; false if it was the last one.
  bool advance(PacketProcess& node) {
    if (stop_.requested()) return interrupted();
    auto step = reader_.next();
    if (!step) return false;
    v1::ReplayStep message;
    report_.problem = fill_step(reader_, *step, message);
    if (!report_.problem.empty()) return false;
    for (const v1::ReplayMessage& input : message.inputs()) {
      ++comparison_.counts().inputs;
      comparison_.counts().bytes += input.payload().size();
    }
    if (failed_) return throws_no_more(*step);
    v1::ReplayOutcome outcome;
    try {
      if (!node.ask(message, outcome, &stop_)) return interrupted();
    } catch (const PacketProcess::Gone& gone) {
      report_.problem = fmt::format("step {}: {}", step->number, gone.what());
      return false;
    }
    follow_time(*step);
    last_ = step->record.kind();
    auto found = comparison_.compare(*step, outcome);
    if (outcome.failed()) {
      failed_ = outcome.problem();
      if (!found.empty()) found.insert(found.begin(), only_replay_failed());
    }
    return keep(found);
  }

  bool interrupted() {
    report_.result = ReplayResult::interrupted;
    return false;
  }
  /// The node threw in the step before this one, like the recorded one if it was stopped then.
  bool throws_no_more(const RecordedStep& step) {
    if (step.record.kind() != v1::STEP_KIND_STOP) keep({only_replay_failed()});
    return false;
  }

  ReplayDifference only_replay_failed() {
    ReplayDifference d;
    d.step = comparison_.counts().steps - 1;
    d.time_s = end_s_;
    d.what = "the replayed step failed, the recorded one did not: " + *failed_;
    return d;
  }

  void follow_time(const RecordedStep& step) {
    if (step.record.kind() == v1::STEP_KIND_CREATE) return;  // before the clock is known
    end_s_ = run_.seconds(step.record.time_ns());
    if (comparison_.counts().steps == 1) begin_s_ = end_s_;
  }

  /// False if these were enough.
  bool keep(const std::vector<ReplayDifference>& found) {
    for (const ReplayDifference& d : found) {
      ++report_.difference_count;
      if (report_.differences.size() < options_.differences) report_.differences.push_back(d);
      if (report_.difference_count >= options_.differences) return false;
    }
    return true;
  }

  void finish(PacketProcess& node) {
    report_.counts = comparison_.counts();
    report_.graph_s = end_s_ - begin_s_;
    report_.tolerated = messages_.tolerated();
    if (report_.result == ReplayResult::interrupted) return;
    const bool stopped_early = report_.difference_count > 0 || !report_.problem.empty();
    if (!stopped_early && !failed_) report_.problem = node.finish();
    if (node.timed_out()) report_.result = ReplayResult::timed_out;
    if (report_.problem.empty() && !stopped_early) report_.problem = reader_.problem();
    note_missing();
    if (!stopped_early && reader_.problem().empty()) note_end();
    if (!messages_.older().empty()) {
      report_.notes.push_back(fmt::format("of another version, compared by the fields of both: {}",
                                          fmt::join(messages_.older(), ", ")));
    }
    if (report_.result == ReplayResult::equal && !report_.problem.empty()) {
      report_.result = ReplayResult::incomplete;
    }
    if (report_.difference_count > 0) report_.result = ReplayResult::different;
  }

  void note_missing() {
    for (const auto& [topic, count] : comparison_.missing()) {
      if (!reader_.has_output(topic)) {
        report_.notes.push_back(
            fmt::format("{} is not in the log: {} messages were not compared", topic, count));
      } else if (report_.problem.empty()) {
        report_.problem = fmt::format("{} message{} on {} {} not in the log: lost", count,
                                      count == 1 ? "" : "s", topic, count == 1 ? "is" : "are");
      }
    }
  }

  void note_end() {
    if (failed_) {
      report_.notes.push_back("the last step failed, as recorded: " + *failed_);
    } else if (last_ != v1::STEP_KIND_STOP) {
      report_.notes.push_back(
          "the log ends before the node's end: it was killed, or the recording ended first");
    }
  }

  const NodeRun& run_;
  const ReplayOptions& options_;
  const StopSignals& stop_;
  NodeRunReader reader_;
  ReplayCompare messages_;
  StepComparison comparison_;
  TemporaryFolder folder_;  ///< holds the parameters
  ReplayReport report_;
  std::optional<std::string> failed_;  ///< the node threw: what
  v1::StepKind last_ = v1::STEP_KIND_UNSPECIFIED;
  double begin_s_ = 0.0, end_s_ = 0.0;
};

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
  while (count.runs < options.repeat && count.shown.result != ReplayResult::interrupted) {
    ReplayReport report = replay([&](std::uint64_t log_time) { progress.at(log_time); });
    const bool all_equal = count.equal == count.runs;
    ++count.runs;
    if (report.result == ReplayResult::equal) ++count.equal;
    if (all_equal || report.result == ReplayResult::interrupted) count.shown = std::move(report);
  }
  if (!options.tolerance_note.empty()) count.shown.notes.push_back(options.tolerance_note);
  return count;
}

std::string_view word_of(ReplayResult result) {
  constexpr std::array<std::string_view, 5> kWords{"equal", "different", "incomplete", "timed out",
                                                   "interrupted"};
  return kWords.at(static_cast<std::size_t>(result));
}

ordered_json difference_json(const ReplayDifference& d) {
  ordered_json out = ordered_json::object();
  out["step"] = d.step;
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

void print_difference(const std::string& name, const ReplayDifference& d) {
  std::cout << fmt::format("{}: step {} at {:.6f} s: {}\n", name, d.step, d.time_s, d.what);
  const auto& fields = d.fields.fields;
  if (fields.empty()) return;
  TextTable table({"  FIELD", "RECORDED", "REPLAYED"});
  for (std::size_t i = 0; i < std::min(fields.size(), kFieldsShown); ++i) {
    table.row(
        {"  " + (fields[i].path.empty() ? "(message)" : fields[i].path), fields[i].a, fields[i].b});
  }
  table.print(std::cout, use_colour(1));
  if (d.fields.count > kFieldsShown) {
    std::cout << fmt::format("  and {} more\n", d.fields.count - kFieldsShown);
  }
}

/// Name and figures of a replay in its report.
struct ReportHead {
  std::string name;
  ordered_json json, figures;  ///< first members, and those behind the result
  std::string words;           ///< the figures for people
};

void print_text(const ReportHead& head, const RunCount& count) {
  const ReplayReport& r = count.shown;
  for (const ReplayDifference& d : r.differences) print_difference(head.name, d);
  if (!r.problem.empty()) std::cout << head.name << ": " << r.problem << '\n';
  const std::string result = count.runs == 1
                                 ? std::string(word_of(r.result))
                                 : fmt::format("{} of {} equal", count.equal, count.runs);
  std::cout << fmt::format("{}: {}: {}{:.1f} MB in {:.2f} s", head.name, result, head.words,
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

/// One line on standard output; returns the exit code.
int report(ReportHead head, const RunCount& count, bool json, const StopSignals& stop) {
  const ReplayReport& r = count.shown;
  if (json) {
    head.json["result"] = word_of(r.result);
    head.json["runs"] = count.runs;
    head.json["equal"] = count.equal;
    head.json.update(head.figures);
    head.json["difference_count"] = r.difference_count;
    auto& differences = head.json["differences"] = ordered_json::array();
    for (const ReplayDifference& d : r.differences) differences.push_back(difference_json(d));
    head.json["problem"] = r.problem;
    head.json["notes"] = r.notes;
    auto& tolerated = head.json["tolerated"] = ordered_json::array();
    for (const auto& [key, worst] : r.tolerated) {
      tolerated.push_back({{"topic", key.first}, {"field", key.second}, {"worst", worst}});
    }
    std::cout << json_text(head.json) << std::endl;
  } else {
    print_text(head, count);
  }
  if (r.result == ReplayResult::interrupted) return 128 + stop.signal();
  if (r.result == ReplayResult::timed_out) return kReplayTimedOut;
  return r.result == ReplayResult::equal ? 0 : 1;
}

/// Prints one line per node that was asked for and cannot be replayed; returns their number.
int report_absent(const std::vector<OpenLog>& logs, const std::vector<NodeRun>& node_runs,
                  const std::vector<std::string>& wanted) {
  const std::string& file = logs.front().path;
  if (wanted.empty() && node_runs.empty()) {
    std::cerr << fmt::format(
        "{}: no node can be replayed: the log holds no NODE/start (an older recording, or these "
        "topics were left out)\n",
        file);
    return 1;
  }
  std::set<std::string> senders;
  for (const OpenChannel& c : channels_of(logs)) senders.insert(sender_of(*c.channel));
  senders.erase("");
  const std::vector<std::string> known(senders.begin(), senders.end());
  int absent = 0;
  for (const std::string& node : wanted) {
    if (std::ranges::any_of(node_runs,
                            [&](const NodeRun& node_run) { return node_run.node() == node; }))
      continue;
    ++absent;
    if (senders.contains(node)) {
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

int replay_nodes(const std::vector<OpenLog>& logs, const ReplayOptions& options,
                 const StopSignals& stop) {
  std::vector<NodeRun> node_runs = find_node_runs(logs);
  const int absent = report_absent(logs, node_runs, options.nodes);
  std::set<std::string> names;
  std::erase_if(node_runs, [&](const NodeRun& node_run) {
    const bool wanted = options.nodes.empty() ||
                        std::ranges::find(options.nodes, node_run.node()) != options.nodes.end();
    if (wanted) names.insert(node_run.node());
    return !wanted;
  });
  if (names.size() > 1 && !options.sets.empty()) {
    throw ConfigError("mimesis log replay: --set is for one node: name it");
  }
  std::vector<std::string> programs;  // all, before any of them starts
  for (const NodeRun& node_run : node_runs) {
    programs.push_back(program_of(node_run, options.program));
  }
  int exit_code = absent > 0 ? kNotInLog : 0;
  for (std::size_t i = 0; i < node_runs.size(); ++i) {
    const NodeRun& node_run = node_runs[i];
    const std::string& program = programs[i];
    const RunCount count =
        repeat("replay " + node_run.node(), logs, options, [&](const ReplayProgress& progress) {
          return NodeReplay(logs, node_run, options, stop).run(program, progress);
        });
    const ReplayReport& r = count.shown;
    const ReplayCounts& n = r.counts;
    std::string words = fmt::format("{} steps, {:.2f} s of graph time, {} inputs, {} outputs, ",
                                    n.steps, r.graph_s, n.inputs, n.outputs);
    if (n.writes > 0) words += fmt::format("{} packets written, ", n.writes);
    if (n.responses > 0) words += fmt::format("{} responses, ", n.responses);
    const ReportHead head{.name = node_run.node(),
                          .json = {{"node", node_run.node()},
                                   {"start_id", node_run.start.start_id()},
                                   {"clock", node_run.start.clock()}},
                          .figures = {{"steps", n.steps},
                                      {"graph_s", r.graph_s},
                                      {"wall_s", r.wall_s},
                                      {"inputs", n.inputs},
                                      {"outputs", n.outputs},
                                      {"writes", n.writes},
                                      {"responses", n.responses},
                                      {"bytes", n.bytes}},
                          .words = words};
    const int code = report(head, count, options.json, stop);
    if (r.result == ReplayResult::interrupted) return code;
    exit_code = std::max(exit_code, code);
  }
  return exit_code;
}

/// Which tolerance counts here, and why.
void choose_tolerance(const std::vector<OpenLog>& logs, ReplayOptions& options) {
  if (!options.tolerance_elsewhere) return;
  // The machine that recorded: nothing if the logs do not tell (older ones) or do not agree.
  std::set<std::string> told;
  const auto add = [&](const log::Metadata& run) {
    const auto it = run.metadata.find("arithmetic");
    told.insert(it == run.metadata.end() ? "" : it->second);
  };
  each_metadata(logs, "mimesis.run", add, /*silent=*/true);
  const std::string there = told.size() == 1 ? *told.begin() : "", here = arithmetic();
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
  std::set<std::string> used;  // topics that the nodes take or send
  for (const NodeRun& run : find_node_runs(open_logs(options.logs))) {
    if (!options.nodes.empty() &&
        std::ranges::find(options.nodes, run.node()) == options.nodes.end())
      continue;
    for (const auto* topics : {&run.start.inputs(), &run.start.outputs()})
      for (const v1::TopicInfo& t : *topics) used.insert(t.topic());
  }
  const std::vector<OpenLog> logs =
      open_whole_logs(options.logs, options.unconfined,
                      [&](const std::string& topic) { return used.contains(topic); });
  for (const OpenLog& log : logs) report_damages(log, {});
  choose_tolerance(logs, options);
  return replay_nodes(logs, options, stop);
}

constexpr const char* kReplayFooter =
    "A node's program is that of the recorded name beside this one, or that of --exec; it runs "
    "without\n"
    "network and devices, and files are read-only for it.\n"
    "Each step gets exactly the messages, the time and the bytes from outside that the recorded "
    "one had.\n"
    "Not compared: NODE/health, NODE/log, NODE/steps, NODE/start. For a whole graph in lock-step,\n"
    "launch it again and compare the logs: mimesis log diff A B.\n"
    "Exit codes: 0 equal, 1 different or not complete, 3 the node is not in the log or timed out.\n"
    "Examples:\n"
    "  mimesis log replay run.mcap\n"
    "  mimesis log replay planner run.mcap --repeat 100\n"
    "  mimesis log replay planner run.mcap --exec build-asan/bin/mimesis_planner --tolerance 1e-9";

bool is_log(const std::string& word) {
  std::error_code ignored;
  return word.ends_with(".mcap") || word.find('/') != std::string::npos ||
         std::filesystem::is_regular_file(word, ignored);
}

/// [NODE ...] LOG...
void sort_words(const std::vector<std::string>& words, ReplayOptions& options) {
  for (const std::string& word : words) {
    (is_log(word) ? options.logs : options.nodes).push_back(word);
  }
  if (options.logs.empty()) {
    throw ConfigError("mimesis log replay: which log? There is no file '" + words.back() + "'");
  }
}

}  // namespace

void add_replay(CLI::App& log, int& exit_code) {
  CLI::App* verb = log.add_subcommand(
      "replay", "Runs recorded nodes again, step by step, and compares their outputs");
  struct Options {
    ReplayOptions replay;
    std::vector<std::string> words;
    std::uint64_t keep_going = 0;  ///< 0: to the end
  };
  auto o = std::make_shared<Options>();
  verb->add_option("WORDS", o->words, "Nodes (default: all with complete records), then logs")
      ->required()
      ->type_name("[NODE ...] LOG ...");
  verb->add_option("--exec", o->replay.program,
                   "Program of the node, or a folder of programs: another build")
      ->type_name("PATH");
  verb->add_flag("--unconfined", o->replay.unconfined,
                 "Let programs write files and open devices and sockets");
  verb->add_option("--set", o->replay.sets, "Replaces a recorded parameter (repeatable)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  verb->add_option("--tolerance", o->replay.tolerance,
                   "Floating-point fields may differ by X, absolute or relative")
      ->type_name("X")
      ->check(number_not_below_zero);
  verb->add_option("--tolerance-elsewhere", o->replay.tolerance_elsewhere,
                   "Tolerance only if this machine computes differently from the recording one "
                   "(CPU, libm, compiler)")
      ->type_name("X")
      ->check(number_not_below_zero)
      ->excludes("--tolerance");
  verb->add_option("--timeout", o->replay.timeout_s, "Give up when a step takes longer")
      ->type_name("SECONDS")
      ->check(number_above_zero)
      ->capture_default_str();
  CLI::Option* keep_going =
      verb->add_flag("--keep-going{0}", o->keep_going,
                     "Stop after N differences instead of the first (--keep-going=N)")
          ->type_name("N");
  verb->add_option("--repeat", o->replay.repeat, "Number of replays: n of N are equal")
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  verb->add_flag("--json", o->replay.json, "One JSON object per node (tools/mimesis/README.md)");
  verb->footer(kReplayFooter);
  on_run(*verb, exit_code, [o, keep_going] {
    if (keep_going->count() > 0) {
      o->replay.differences =
          o->keep_going > 0 ? o->keep_going : std::numeric_limits<std::uint64_t>::max();
    }
    sort_words(o->words, o->replay);
    return log_replay(o->replay);
  });
}

}  // namespace mimesis::tool
