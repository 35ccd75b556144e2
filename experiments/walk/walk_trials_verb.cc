#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <cmath>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_text.h"
#include "experiments/walk/drawer/drawer_trial.h"
#include "experiments/walk/trial/suites.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

constexpr const char* kDrawers = "drawers30";

struct Options {
  std::string suite = "steps30", engine = "dart", plant = "springs", robot = "biped",
              senses = "real", out;
  std::vector<std::string> set;
  std::uint64_t seed = 1;
  double ankle_n_m = 0.0, slope_forward = 0.0, slope_left = 0.0;
  int delay = 1, jobs = 1;
  bool json = false;
};

/// Sets one number of the stabilizer by its name.
class Setter {
 public:
  Setter(std::string key, double value) : key_(std::move(key)), value_(value) {}
  void operator()(const char* name, double& x, double low, double high) {
    if (key_ == name) put(x, low, high);
  }
  void operator()(const char* name, int& x, int low, int high) {
    double value = x;
    if (key_ != name) return;
    put(value, low, high);
    if (value != std::floor(value)) {
      throw ConfigError(fmt::format("--set {}: {} is no whole number", key_, value));
    }
    x = static_cast<int>(value);
  }
  void operator()(const char* name, bool& x) {
    int value = x;
    (*this)(name, value, 0, 1);
    x = value != 0;
  }
  bool found() const { return found_; }

 private:
  void put(double& x, double low, double high) {
    if (!(value_ >= low && value_ <= high)) {
      throw ConfigError(fmt::format("--set {}: {} is outside [{}, {}]", key_, value_, low, high));
    }
    x = value_;
    found_ = true;
  }
  std::string key_;
  double value_;
  bool found_ = false;
};

void set(walker::StabilizerSettings& settings, const std::string& word) {
  const std::size_t at = word.find('=');
  double value = 0.0;
  std::size_t used = 0;
  try {
    value = std::stod(at == std::string::npos ? "" : word.substr(at + 1), &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || at + 1 + used != word.size()) {
    throw ConfigError("--set: '" + word + "' is not KEY=NUMBER");
  }
  Setter setter(word.substr(0, at), value);
  settings.visit(setter);
  if (!setter.found()) {
    throw ConfigError("--set: the stabilizer has no '" + word.substr(0, at) + "'");
  }
}

walk::SuiteOptions suite_options(const Options& o) {
  walk::SuiteOptions suite(o.plant == "servo" ? hw::sim::Plant::servo : hw::sim::Plant::springs,
                           o.senses == "real");
  suite.engine = o.engine == "mujoco" ? walk::Engine::mujoco : walk::Engine::dart;
  suite.seed = o.seed;
  suite.body.ankle_pitch_n_m = o.ankle_n_m;
  suite.body.slope_rad = {-o.slope_forward, o.slope_left};  // + rises
  suite.delay_ticks = o.delay;
  suite.walker.stabilizer.delay_ticks = o.delay + 1;  // the control's own tick
  for (const std::string& word : o.set) set(suite.walker.stabilizer, word);
  return suite;
}

/// Walks the suite's trials and writes what came out. @return the summary
template <class Spec, class Result, class Run>
nlohmann::ordered_json walk_all(const Options& o, const std::vector<Spec>& trials,
                                const Run& run_all) {
  std::ofstream file;
  if (!o.out.empty()) {
    file.open(o.out);
    if (!file) throw ConfigError("--out: " + o.out + " cannot be written");
  }
  std::ostream& lines = o.out.empty() ? std::cout : file;
  const bool write = o.json || !o.out.empty();
  std::vector<Result> results;
  {
    Progress bar("walking", trials.size(), Progress::Unit::none);
    run_all(trials, o.jobs, [&](const Result& result) {
      results.push_back(result);
      if (write) lines << json_text(walk::to_json(result)) << std::endl;
      bar.at(results.size());
    });
  }
  nlohmann::ordered_json summary = walk::summary_json(results);
  summary["suite"] = o.suite;
  summary["engine"] = o.engine;
  summary["plant"] = o.plant;
  summary["robot"] = o.robot;
  summary["senses"] = o.senses;
  summary["seed"] = o.seed;
  if (write) lines << json_text(summary) << '\n';
  if (!o.json) {
    walk::print_table(results, std::cout, use_colour(1));
    std::cout << json_text(summary) << '\n';
  }
  lines.flush();
  if (!lines) throw std::runtime_error(o.out + ": cannot be written");
  return summary;
}

int run_drawers(const Options& o, const walk::Robot& robot) {
  const synthesizer::BipedDrawer actions = synthesizer::make_biped_drawer(robot.biped);
  const auto summary = walk_all<walk::DrawerTrialSpec, walk::DrawerResult>(
      o, walk::drawers30(robot, actions, suite_options(o)), walk::run_drawer_trials);
  return summary["falls"] == 0 && summary["silent"] == 0 ? 0 : 1;
}

int run(const Options& o) {
  const walk::Robot robot = walk::load_robot(o.robot);
  if (o.suite == kDrawers) {
    if (o.engine != "dart") throw ConfigError("--engine: drawers are in DART alone");
    return run_drawers(o, robot);
  }
  const auto summary = walk_all<walk::TrialSpec, walk::TrialResult>(
      o, walk::make_suite(o.suite, robot, suite_options(o)), walk::run_trials);
  return summary["falls"] == 0 ? 0 : 1;
}

std::vector<std::string> suites() {
  std::vector<std::string> names = walk::suite_names();
  names.emplace_back(kDrawers);
  return names;
}

}  // namespace

void add_walk_trials(CLI::App& program, int& exit_code) {
  auto o = std::make_shared<Options>();
  CLI::App* verb = program.add_subcommand(
      "walk-trials", "Walks of the biped in a physics world, many at once: falls, forces, errors");
  verb->add_option("--suite", o->suite, "Set of trials")
      ->check(CLI::IsMember(suites()))
      ->capture_default_str();
  verb->add_option("--engine", o->engine,
                   "Physics: dart, or mujoco from npm (cmake --build build --target peers)")
      ->check(CLI::IsMember({"dart", "mujoco"}))
      ->capture_default_str();
  verb->add_option("--plant", o->plant,
                   "How the joints follow: springs, or servos with soft ankles")
      ->check(CLI::IsMember({"springs", "servo"}))
      ->capture_default_str();
  verb->add_option("--senses", o->senses,
                   "Errors of the sensors, which the walker is told of: as in a lab, or none")
      ->check(CLI::IsMember({"real", "exact"}))
      ->capture_default_str();
  verb->add_option("--slope-forward", o->slope_forward,
                   "Slope of the ground, + rises forward [rad]")
      ->check(CLI::Range(-0.3, 0.3));
  verb->add_option("--slope-left", o->slope_left, "Slope of the ground, + rises to the left [rad]")
      ->check(CLI::Range(-0.3, 0.3));
  verb->add_option("--robot", o->robot, "biped, jvrc1, or a file like models/biped.yaml")
      ->capture_default_str();
  verb->add_option("--seed", o->seed, "Seed of all random numbers")
      ->check(number_not_below_zero)  // "-1" would count from the largest one
      ->capture_default_str();
  verb->add_option("--delay", o->delay, "Delay of the sensors, in ticks of 5 ms")
      ->check(CLI::Range(0, 7))
      ->capture_default_str();
  verb->add_option("--ankle", o->ankle_n_m,
                   "Limit of the ankles' pitch motors [N m]; 0: the robot's description")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  verb->add_option("--set", o->set, "A setting of the stabilizer")->type_name("KEY=NUMBER");
  verb->add_option("-j,--jobs", o->jobs, "Number of trials in parallel")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  verb->add_option("-o,--out", o->out, "Write JSON lines: one per trial, then a summary");
  verb->add_flag("--json", o->json, "JSON lines on standard output instead of a table");
  verb->footer(
      "Deterministic except for its times. Exit codes: 0 no fall, 1 a fall (or a drawer task that\n"
      "failed without a reason), 2 usage.\n"
      "Examples:\n"
      "  mimesis walk-trials --suite steps30 --plant servo --seed 7\n"
      "  mimesis walk-trials --suite steps30 --slope-forward 0.05 --set slope=1\n"
      "  mimesis walk-trials --suite drawers30 --delay 2 --set delay_ticks=4\n"
      "  mimesis walk-trials --suite pushes --out pushes.jsonl --set kd_1_s=3");
  verb->callback([o, &exit_code] { exit_code = run(*o); });
}

}  // namespace mimesis::tool
