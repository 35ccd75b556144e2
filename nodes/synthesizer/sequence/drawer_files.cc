#include "nodes/synthesizer/sequence/drawer_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "common/error.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;

constexpr std::size_t kLeastTrials = 4;
constexpr double kMostAngle_rad = 2.0 * std::numbers::pi;
constexpr double kMostOff_m = 0.05;  // distances are measured apart from lengths

constexpr std::array kDrawerColumns = {"handle_height_m", "handle_lateral_m", "object_height_m",
                                       "pull_m"};

/// One file of the folder.
class ActionFile {
 public:
  ActionFile(mocap::Trials& set, std::string path) : set_(set), path_(std::move(path)) {}

  [[noreturn]] void fail(const std::string& what) const { throw ConfigError(path_ + ": " + what); }
  [[noreturn]] void fail(std::size_t trial, const std::string& what) const {
    fail(fmt::format("{}, cycle {}: {}", set_.trials[trial].clip, set_.trials[trial].cycle, what));
  }

  void check_rows(const std::vector<std::string>& rows) const {
    const auto [ours, wanted] = std::ranges::mismatch(set_.rows, rows);
    if (ours == set_.rows.end() && wanted == rows.end()) return;
    fail(fmt::format("row {} of a trial is {}, expected {}", ours - set_.rows.begin() + 1,
                     ours == set_.rows.end() ? "missing" : *ours,
                     wanted == rows.end() ? "no more" : *wanted));
  }

  void check_values() const {
    Index row = 0, sample = 0;
    if (set_.samples.cwiseAbs().maxCoeff(&row, &sample) <= kMostAngle_rad) return;
    const Index rows = set_.rows_per_trial();
    fail(static_cast<std::size_t>(row / rows),
         fmt::format("{} at t{} is {}, expected rad, m or m/s within 2 pi",
                     set_.rows[static_cast<std::size_t>(row % rows)], sample,
                     set_.samples(row, sample)));
  }

  void check_same_trials(const ActionFile& first) const {
    const auto& ours = set_.trials;
    const auto& theirs = first.set_.trials;
    if (set_.samples.cols() != first.set_.samples.cols()) {
      fail(fmt::format("{} samples a row, expected {} as in {}", set_.samples.cols(),
                       first.set_.samples.cols(), first.path_));
    }
    for (std::size_t i = 0; i < std::min(ours.size(), theirs.size()); ++i) {
      if (ours[i].clip == theirs[i].clip && ours[i].cycle == theirs[i].cycle) continue;
      fail(i, fmt::format("trial {}, expected {}, cycle {} as in {}", i + 1, theirs[i].clip,
                          theirs[i].cycle, first.path_));
    }
    if (ours.size() != theirs.size()) {
      fail(fmt::format("{} trials, expected {} as in {}", ours.size(), theirs.size(), first.path_));
    }
  }

  void check_lengths() const {
    double least = INFINITY, most = 0.0;
    for (std::size_t i = 0; i < set_.trials.size(); ++i) {
      const double length = set_.trials[i].step_length_m;
      if (!(length > 0.0)) fail(i, fmt::format("step_length_m {}, expected more than 0", length));
      least = std::min(least, length);
      most = std::max(most, length);
    }
    if (most - least < 1e-3) {
      fail(fmt::format("step_length_m is {} in all trials, expected lengths that differ", most));
    }
  }

  double task(std::size_t trial, const char* column) const {
    const auto found = std::ranges::find(set_.task_names, column);
    if (found == set_.task_names.end()) fail(fmt::format("no column '{}', expected one", column));
    return set_.trials[trial].task[static_cast<std::size_t>(found - set_.task_names.begin())];
  }

  Drawer drawer(std::size_t trial) const {
    return {.handle_height_m = task(trial, kDrawerColumns[0]),
            .handle_lateral_m = task(trial, kDrawerColumns[1]),
            .object_height_m = task(trial, kDrawerColumns[2]),
            .pull_m = task(trial, kDrawerColumns[3])};
  }

  void check_drawer(const Drawer& wanted) const {
    for (std::size_t i = 0; i < set_.trials.size(); ++i) {
      if (drawer(i) != wanted) fail(i, "another drawer, expected that of the first trial");
    }
  }

  /// Only the columns that learning uses, in its order.
  void keep_task() const {
    for (std::size_t i = 0; i < set_.trials.size(); ++i) {
      std::vector<double> kept;
      for (const char* name : kTaskNames) kept.push_back(task(i, name));
      set_.trials[i].task = kept;
    }
    set_.task_names.assign(kTaskNames.begin(), kTaskNames.end());
  }

 private:
  mocap::Trials& set_;
  std::string path_;
};

}  // namespace

std::vector<std::string> drawer_rows() {
  std::vector<std::string> rows;
  for (int row = 0; row < mocap::kBodyRows; ++row) rows.push_back(mocap::body_row_name(row));
  for (const char* row : {"pelvis.x", "pelvis.y", "pelvis.z"}) rows.emplace_back(row);
  return rows;
}

DrawerData join_actions(std::array<mocap::Trials, kActions> sets,
                        const std::vector<std::string>& rows, const mocap::Body& body,
                        const std::string& folder) {
  std::vector<ActionFile> files;
  for (std::size_t a = 0; a < kActions; ++a) {
    files.emplace_back(sets[a], folder + "/" + kActionFiles[a]);
    files[a].check_rows(rows);
    files[a].check_values();
    files[a].check_same_trials(files[0]);
  }
  const std::size_t trials = sets[0].trials.size();
  if (trials < kLeastTrials) {
    files[0].fail(fmt::format("{} trials, expected at least {}", trials, kLeastTrials));
  }
  files[kNormalStep].check_lengths();
  files[kReachingStep].check_lengths();
  const Drawer drawer = files[0].drawer(0);
  for (std::size_t i = 0; i < trials; ++i) {
    const double stands = files[kStanding].task(i, kTaskNames[1]);
    double distance = stands;
    for (const Action a : {kStanding, kReachingStep, kNormalStep}) {
      if (a != kStanding) distance += sets[a].trials[i].step_length_m;
      const double told = files[a].task(i, kTaskNames[0]), end = files[a].task(i, kTaskNames[1]);
      if (std::abs(told - distance) <= kMostOff_m && std::abs(end - stands) <= kMostOff_m) continue;
      files[a].fail(i, fmt::format("distance_m {} and final_distance_m {}, expected about {} and {}"
                                   " as lengths and the last distance have it",
                                   told, end, distance, stands));
    }
  }
  for (ActionFile& file : files) {
    file.check_drawer(drawer);
    file.keep_task();
  }
  return {.body = body, .drawer = drawer, .action = std::move(sets)};
}

std::array<mocap::Trials, kActions> split_actions(const DrawerData& data) {
  std::array<mocap::Trials, kActions> sets = data.action;
  const Drawer& d = data.drawer;
  for (mocap::Trials& set : sets) {
    set.task_names.insert(set.task_names.end(), kDrawerColumns.begin(), kDrawerColumns.end());
    std::map<std::string, int> cycles;
    for (mocap::Trial& trial : set.trials) {
      trial.cycle = cycles[trial.clip]++;
      trial.task.insert(trial.task.end(),
                        {d.handle_height_m, d.handle_lateral_m, d.object_height_m, d.pull_m});
    }
  }
  return sets;
}

}  // namespace mimesis::synthesizer
