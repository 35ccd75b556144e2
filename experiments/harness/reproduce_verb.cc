#include <fmt/core.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <future>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "common/runtime/value_text.h"
#include "common/time.h"
#include "experiments/crowd/figures.h"
#include "experiments/fields/figures.h"
#include "experiments/harness/figure.h"
#include "experiments/motion/figures.h"
#include "experiments/planning/figures.h"
#include "experiments/sight/figures.h"
#include "experiments/walk/figures.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using reproduce::Figure;
using reproduce::Report;
using reproduce::Row;
using reproduce::to_text;
using Json = nlohmann::ordered_json;

constexpr int kFailed = 1, kUsage = 2, kNotFound = 3;

/// All reproductions. A folder with figures of its own adds one line here.
std::vector<Figure> all_figures() {
  std::vector<Figure> all;
  std::ranges::move(cognition::figures(), std::back_inserter(all));
  std::ranges::move(planner::figures(), std::back_inserter(all));
  std::ranges::move(synthesizer::figures(), std::back_inserter(all));
  std::ranges::move(crowd::figures(), std::back_inserter(all));
  std::ranges::move(walk::figures(), std::back_inserter(all));
  std::ranges::move(sight::figures(), std::back_inserter(all));
  return all;
}

struct Options {
  std::vector<std::string> names;
  bool list = false, json = false;
  std::string plot_dir;
  double timeout_s = 0.0;
};

std::string number(double v) { return std::isnan(v) ? "-" : fmt::format("{:.5g}", v); }

std::string origin_name(const Row& row) {
  return reproduce::kOriginNames[static_cast<std::size_t>(row.reference.origin)];
}

Json to_json(const Row& row) {
  // JSON has no NaN: a quantity that never came about is null
  const auto value = [](double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); };
  Json out = {{"what", row.what},
              {"ours", value(row.ours)},
              {"reference", value(row.reference.value)},
              {"origin", origin_name(row)},
              {"where", row.reference.where},
              {"tolerance", value(row.tolerance)},
              {"unit", row.unit},
              {"passed", row.passed}};
  if (!row.why.empty()) out["why"] = row.why;
  return out;
}

void print_json(const Figure& figure, const Report& report, double seconds) {
  Json rows = Json::array(), plots = Json::array();
  for (const Row& row : report.rows) rows.push_back(to_json(row));
  for (const auto& plot : report.plots) plots.push_back(plot.string());
  Json out = {{"name", figure.name}, {"source", figure.source}, {"passed", report.passed()},
              {"rows", rows},        {"plots", plots},          {"seconds", seconds}};
  std::cout << json_text(out) << std::endl;  // figures may take minutes, and be interrupted
}

void print_text(const Figure& figure, const Report& report, double seconds) {
  std::cout << figure.name << " [" << figure.source << "]: " << figure.title << '\n';
  TextTable table({"", "what", "ours", "reference", "tolerance", "unit", "origin", "note"});
  std::vector<std::string> notes;  // notes of several rows appear once
  for (const Row& row : report.rows) {
    std::string note;
    if (!row.why.empty()) {
      const auto at = std::ranges::find(notes, row.why) - notes.begin();
      if (at == std::ssize(notes)) notes.push_back(row.why);
      note = std::to_string(at + 1);
    }
    const std::string& where = row.reference.where;
    table.row({row.passed ? "ok" : "FAILED", row.what, number(row.ours),
               number(row.reference.value), number(row.tolerance), row.unit,
               origin_name(row) + (where.empty() ? "" : ": " + where), note});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  for (std::size_t i = 0; i < notes.size(); ++i) {
    std::cout << "note " << i + 1 << ": " << notes[i] << '\n';
  }
  for (const auto& plot : report.plots) std::cout << "plot: " << plot.string() << '\n';
  std::cout << (report.passed() ? "passed" : "FAILED") << ", " << number(seconds) << " s\n";
}

void print_list(const std::vector<Figure>& all, bool json) {
  if (json) {
    Json out = Json::array();
    for (const Figure& f : all) {
      Json rows;
      for (std::size_t i = 0; i < reproduce::kOriginNames.size(); ++i) {
        rows[reproduce::kOriginNames[i]] = f.rows.counts()[i];
      }
      out.push_back({{"name", f.name},
                     {"source", f.source},
                     {"cpu_minutes", f.cpu_minutes},
                     {"rows", rows},
                     {"title", f.title}});
    }
    std::cout << json_text(out) << '\n';
    return;
  }
  TextTable table({"name", "source", "CPU min", "title", "rows"});
  reproduce::RowCounts rows{};
  for (const Figure& f : all) {
    table.row({f.name, f.source, f.cpu_minutes > 0.0 ? number(f.cpu_minutes) : "<1", f.title,
               to_text(f.rows.counts())});
    std::ranges::transform(rows, f.rows.counts(), rows.begin(), std::plus{});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  std::cout << all.size() << " figures, rows: " << to_text(rows) << '\n';
}

/// Ten minutes, or the time of a figure on one thread of a busy machine.
double patience_s(const Figure& figure, const Options& options) {
  if (options.timeout_s > 0.0) return options.timeout_s;
  return std::max(600.0, 10.0 * 60.0 * figure.cpu_minutes);
}

/// Runs one figure; the process ends with code 3 if that takes longer than allowed.
Report run_within(const Figure& figure, const Options& options) {
  std::optional<std::filesystem::path> dir;
  if (!options.plot_dir.empty()) dir = options.plot_dir;
  auto report = std::async(std::launch::async, [&] { return figure.run(dir); });
  const double patience = patience_s(figure, options);
  if (report.wait_for(std::chrono::duration<double>(patience)) != std::future_status::ready) {
    std::cerr << "reproduce: " << figure.name << " took longer than " << number(patience) << " s\n";
    std::cout.flush();
    std::_Exit(kNotFound);  // a pure computation cannot be asked to stop
  }
  return report.get();
}

int reproduce_all(const Options& options) {
  const std::vector<Figure> all = all_figures();
  if (options.list) {
    print_list(all, options.json);
    return 0;
  }
  if (options.names.empty()) {
    std::cerr << "reproduce: which one? `mimesis reproduce --list` names them\n";
    return kUsage;
  }
  std::vector<const Figure*> chosen;
  for (const std::string& name : options.names) {
    const auto it = std::ranges::find(all, name, &Figure::name);
    if (it == all.end()) {
      std::vector<std::string> known;
      for (const Figure& f : all) known.push_back(f.name);
      std::cerr << "reproduce: no figure '" << name << "'" << runtime::did_you_mean(name, known)
                << "; `mimesis reproduce --list` names all\n";
      return kNotFound;
    }
    chosen.push_back(&*it);
  }
  bool passed = true;
  for (const Figure* figure : chosen) {
    const auto start = std::chrono::steady_clock::now();
    const Report report = run_within(*figure, options);
    const double seconds = to_seconds(std::chrono::steady_clock::now() - start);
    options.json ? print_json(*figure, report, seconds) : print_text(*figure, report, seconds);
    passed = passed && report.passed();
  }
  return passed ? 0 : kFailed;
}

}  // namespace

void add_reproduce(CLI::App& program, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* verb = program.add_subcommand(
      "reproduce", "Recomputes a published figure and compares it with its reference");
  verb->add_option("NAME", options->names, "fig-CHAPTER.NUMBER, table-CHAPTER.NUMBER or a word");
  verb->add_flag("--list", options->list, "Name all reproductions");
  verb->add_option("--plot", options->plot_dir,
                   "Write PNG plots of printed figures into this folder (needs gnuplot)")
      ->type_name("DIR");
  verb->add_flag("--json", options->json,
                 "One object per figure and line: name, source, passed, rows, plots, seconds");
  verb->add_option("--timeout", options->timeout_s,
                   "Time limit of a figure in seconds (exit code 3) [600, or ten times the time "
                   "in --list]")
      ->check(number_above_zero);
  verb->footer(
      "Exit codes: 0 all rows within tolerance, 1 a row or a plot failed, 2 usage, 3 no such "
      "figure or timed out.\nFigures that walk the biped take minutes (--list); those that are "
      "asked for together share their walks.\nExamples:\n  mimesis reproduce --list\n  mimesis "
      "reproduce fig-2.21 --plot "
      "/tmp/plots\n"
      "  mimesis reproduce fig-2.19 --json");
  verb->callback([options, &exit_code] { exit_code = reproduce_all(*options); });
}

}  // namespace mimesis::tool
