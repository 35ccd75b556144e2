#include "tools/mimesis/log/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <set>

#include "common/runtime/suggest.h"
#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/log/arithmetic.h"
#include "tools/mimesis/log/log_progress.h"
#include "tools/mimesis/log/replay_launch.h"
#include "tools/mimesis/log/replay_report.h"

namespace mimesis::tool {
namespace {

constexpr int kNotInLog = 3, kTimedOut = 3;

std::vector<std::string> senders(const std::vector<OpenLog>& logs) {
  std::set<std::string> names;
  for (const OpenLog& log : logs) {
    for (const auto& [id, channel] : log.summary.channels) names.insert(sender_of(channel));
  }
  names.erase("");
  return {names.begin(), names.end()};
}

/// One line per node that was asked for and cannot be replayed; returns how many there are.
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

/// All runs of one life; the result that counts.
ReplayResult replay_repeatedly(const std::vector<OpenLog>& logs, const Life& life,
                               const ReplayOptions& options, const StopSignals& stop) {
  const std::string program = program_of(life, options);
  RunCount count;
  {
    LogProgress progress("replay " + life.node(), logs);
    count = repeat(options.repeat, [&] {
      return replay_life(logs, life, program, options, stop,
                         [&](std::uint64_t log_time) { progress.at(log_time); });
    });
  }
  if (!options.tolerance_note.empty()) count.shown.notes.push_back(options.tolerance_note);
  print_life(life, count, options.json);
  return count.shown.result;
}

int replay_nodes(const std::vector<OpenLog>& logs, const ReplayOptions& options,
                 const StopSignals& stop) {
  std::vector<Life> lives = find_lives(logs);
  const int absent = report_absent(logs, lives, options.nodes);
  std::erase_if(lives, [&](const Life& life) {
    return !options.nodes.empty() &&
           std::ranges::find(options.nodes, life.node()) == options.nodes.end();
  });
  std::set<std::string> names;
  for (const Life& life : lives) names.insert(life.node());
  if (names.size() > 1 && !options.sets.empty()) {
    throw ConfigError("mimesis log replay: --set is for one node: name it");
  }
  int exit_code = absent > 0 ? kNotInLog : 0;
  for (const Life& life : lives) {
    const ReplayResult result = replay_repeatedly(logs, life, options, stop);
    if (result == ReplayResult::interrupted) return 128 + stop.signal();
    exit_code = std::max(exit_code, exit_code_of(result));
  }
  return exit_code;
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

}  // namespace

RunCount repeat(std::uint64_t runs, const std::function<LifeReport()>& replay) {
  RunCount count;
  while (count.runs < runs && count.shown.result != ReplayResult::interrupted) {
    LifeReport report = replay();
    const bool all_equal = count.equal == count.runs;
    ++count.runs;
    if (report.result == ReplayResult::equal) ++count.equal;
    if (all_equal || report.result == ReplayResult::interrupted) count.shown = std::move(report);
  }
  return count;
}

int exit_code_of(ReplayResult result) {
  if (result == ReplayResult::timed_out) return kTimedOut;
  return result == ReplayResult::equal ? 0 : 1;
}

int log_replay(const ReplayOptions& asked) {
  const StopSignals stop;
  ReplayOptions options = asked;
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
                                : replay_launch(*logs, options, stop);
}

}  // namespace mimesis::tool
