#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "common/model/files.h"
#include "experiments/fields/figures.h"
#include "nodes/cognition/architecture_node.h"
#include "nodes/cognition/trial.h"
#include "nodes/planner/task_plan.h"

// Motor primitives from the planner's own motions [M18 2.3.1]: bundles of planned transports are
// clustered without labels, F5 is linked with the bundle that its decision brought about by
// eq. 2.3, gated by the plan's success, and later a decision in F5 pre-selects the postures of its
// bundle.
namespace mimesis::cognition {
namespace {

using reproduce::at_least;
using reproduce::goal;
using reproduce::holds;
using reproduce::Report;
using PlotDir = std::optional<std::filesystem::path>;

constexpr int kPoints = 12;        // postures that stand for one motion, evenly along its length
constexpr double kNear_rad = 0.8;  // of a bundle's postures: pre-selected

using Motion = std::vector<Eigen::VectorXd>;

/// The carried part of a plan from above the object to above the goal.
Motion carried(const planner::TaskPlan& plan) {
  std::vector<const planner::PlannedMotion*> parts;
  for (const auto& m : plan.motions) {
    if (m.phase == planner::Phase::transport) parts.push_back(&m);
  }
  const Eigen::MatrixXd& q = parts.at(1)->trajectory.position;  // after the lift
  std::vector<double> length{0.0};
  for (Eigen::Index k = 1; k < q.cols(); ++k) {
    length.push_back(length.back() + (q.col(k) - q.col(k - 1)).norm());
  }
  Motion motion;
  for (int i = 0; i < kPoints; ++i) {
    const double at = length.back() * i / (kPoints - 1);
    const auto k = std::ranges::lower_bound(length, at - 1e-12) - length.begin();
    motion.emplace_back(q.col(std::min(static_cast<Eigen::Index>(k), q.cols() - 1)));
  }
  return motion;
}

/// Mean distance of corresponding postures [rad].
double apart(const Motion& a, const Motion& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]).norm();
  return sum / static_cast<double>(a.size());
}

/// Bundles by average linkage, cut where the distance of what is joined grows most.
std::vector<std::size_t> bundles(const std::vector<Motion>& motions) {
  std::vector<std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < motions.size(); ++i) groups.push_back({i});
  const auto between = [&](const auto& a, const auto& b) {
    double sum = 0.0;
    for (const std::size_t i : a) {
      for (const std::size_t j : b) sum += apart(motions[i], motions[j]);
    }
    return sum / static_cast<double>(a.size() * b.size());
  };
  std::vector<double> heights;
  std::vector<std::vector<std::vector<std::size_t>>> states{groups};
  while (groups.size() > 1) {
    std::size_t first = 0, second = 1;
    double least = 1e9;
    for (std::size_t i = 0; i < groups.size(); ++i) {
      for (std::size_t j = i + 1; j < groups.size(); ++j) {
        const double d = between(groups[i], groups[j]);
        if (d < least) least = d, first = i, second = j;
      }
    }
    groups[first].insert(groups[first].end(), groups[second].begin(), groups[second].end());
    groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(second));
    heights.push_back(least);
    states.push_back(groups);
  }
  std::size_t cut = 0;  // at least two bundles, of more than one motion on average
  double widest = 0.0;
  for (std::size_t k = motions.size() / 2; k < heights.size(); ++k) {
    const double step = heights[k] / heights[k - 1];
    if (step > widest) widest = step, cut = k;
  }
  std::vector<std::size_t> of(motions.size());
  for (std::size_t g = 0; g < states[cut].size(); ++g) {
    for (const std::size_t i : states[cut][g]) of[i] = g;
  }
  return of;
}

/// The demo's table with object and goals elsewhere.
kin::Table moved(kin::Table table, unsigned seed) {
  std::mt19937 random(seed);
  const auto shift = [&] {
    constexpr double kMost_m = 0.015;
    return kMost_m * (static_cast<double>(random()) / 2147483648.0 - 1.0);
  };
  table.object += Eigen::Vector3d(shift(), shift(), 0.0);
  return table;
}

struct Sample {
  planner::Task task;
  Motion motion;
};

/// The sequences that the robot practises; other means have no free posture beside the demo's bar.
struct Known {
  planner::Task task;
  const char* sequence;
};
const std::array<Known, 2> kKnown = {
    {{{planner::Grip::precision, planner::Transport::above, "high"}, "precision,above,high"},
     {{planner::Grip::full, planner::Transport::below, "low"}, "full,below,low"}}};

/// Links certified until a path stood, and its length [rad].
struct Effort {
  double links = 0.0, length_rad = 0.0;
};

class Study {
 public:
  Study() {
    for (unsigned seed = 1; seed <= 8; ++seed) {
      for (const Known& known : kKnown) {
        const Motion motion = transport(known.task, seed);
        if (!motion.empty()) samples_.push_back({known.task, motion});
      }
    }
    std::vector<Motion> motions;
    for (const Sample& s : samples_) motions.push_back(s.motion);
    bundle_ = bundles(motions);
    count_ = *std::ranges::max_element(bundle_) + 1;
  }

  std::size_t samples() const { return samples_.size(); }
  std::size_t count() const { return count_; }
  std::size_t bundle(std::size_t sample) const { return bundle_[sample]; }
  const planner::Task& task(std::size_t sample) const { return samples_[sample].task; }
  /// Share of motions whose bundle holds mostly such means.
  template <class Label>
  double purity(const Label& label) const {
    std::map<std::size_t, std::map<int, int>> counts;
    for (std::size_t i = 0; i < samples_.size(); ++i) ++counts[bundle_[i]][label(samples_[i].task)];
    int most = 0;
    for (const auto& [bundle, of] : counts) {
      most += std::ranges::max_element(of, {}, [](const auto& c) { return c.second; })->second;
    }
    return static_cast<double>(most) / static_cast<double>(samples_.size());
  }

  /// A transport with these means in another scene; empty without a plan.
  Motion transport(const planner::Task& task, unsigned seed) const {
    const auto plan =
        planner::plan_task(arm_, moved(table_, seed), roadmap_, arm_.home, task, settings_);
    return plan ? carried(*plan) : Motion{};
  }

  /// Effort of the search between the ends of a transport, with the postures of `bundle` in the
  /// roadmap and cheap, unless it is negative. Empty if it fails.
  std::optional<Effort> effort(const planner::Task& task, const Motion& known, unsigned seed,
                               int bundle) const {
    const kin::Table table = moved(table_, seed);
    planner::CollisionChecker checker(
        arm_, {table.balls, planner::closed_passages(table, task.transport), {}, table.boxes},
        settings_.margin_m);
    std::vector<Eigen::VectorXd> selected;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (static_cast<int>(bundle_[i]) != bundle) continue;
      selected.insert(selected.end(), samples_[i].motion.begin(), samples_[i].motion.end());
    }
    planner::Roadmap roadmap = roadmap_;
    const Eigen::Index first = roadmap.nodes.cols();
    roadmap.nodes.conservativeResize(Eigen::NoChange,
                                     first + static_cast<Eigen::Index>(selected.size()));
    for (std::size_t i = 0; i < selected.size(); ++i) {
      roadmap.nodes.col(first + static_cast<Eigen::Index>(i)) = selected[i];
    }
    roadmap.links = planner::connect(roadmap.nodes, settings_.search.neighbours);
    const planner::PostureCost cost = [&](const Eigen::VectorXd& q) {
      const bool near = std::ranges::any_of(
          selected, [&](const Eigen::VectorXd& p) { return (p - q).norm() < kNear_rad; });
      return near ? settings_.preference : 1.0;
    };
    const std::array goals{known.back()};
    planner::SearchSettings search = settings_.search;
    search.shortcuts = 0;  // what the search itself costs
    const auto path = planner::find_path(roadmap, checker, known.front(), goals, cost, search);
    if (!path) return std::nullopt;
    return Effort{static_cast<double>(path->links_checked), planner::path_length(path->waypoints)};
  }

 private:
  kin::ArmModel arm_ = model::load_arm("lwr4.yaml");
  kin::Table table_ = model::load_table("bridge_table.yaml");
  planner::TaskSettings settings_;
  planner::Roadmap roadmap_ = planner::prepare_roadmap(arm_, table_, settings_);
  std::vector<Sample> samples_;
  std::vector<std::size_t> bundle_;
  std::size_t count_ = 0;
};

/// The shipped ladder with a field of bundles behind F5, linked by success.
Architecture with_bundles(std::size_t count) {
  Architecture a = load_architecture();
  FieldSpec field;
  field.name = "BUN";
  field.params = a.fields[index(Layer::f5_transport)].params;
  for (std::size_t b = 0; b < count; ++b) field.sites.push_back("b" + std::to_string(b));
  field.params.neurons = static_cast<int>(32 * count);
  a.fields.push_back(field);
  for (const char* from : {"F5g", "F5t"}) {
    LinkSpec link;
    link.from = from;
    link.to = "BUN";
    link.gain = 1.6;  // one preshapes, both ignite
    link.learns = "success";
    a.links.push_back(link);
  }
  a.inputs.push_back({"bundle", "BUN", 6.0, {}});
  return a;
}

/// Site of BUN after the demonstration; -1 without a single one. `executed`: the bundle of the
/// motion that was planned with success, which the links learn.
int bundle_of(Ladder<float>& ladder, const char* sequence, int executed) {
  const std::size_t field = kLayers;
  const Architecture& a = ladder.architecture();
  run_trial(ladder, {.shown = parse_sequence(sequence), .task = {.means = 0.0}});
  if (executed >= 0) {
    Stimulus seen = task_stimulus(a, {.means = 0.0});
    const Stimulus task = seen;
    add_input(a, "bundle", field, executed, 1.0, seen);
    for (int k = 0; k < 600; ++k) ladder.step(seen);
    for (int k = 0; k < 2000; ++k) ladder.step(task, true);
  }
  const Peaks peaks = read_peaks(ladder, field);
  ladder.reset();
  return peaks.count == 1 ? peaks.site : -1;
}

Report learned_bundles(const PlotDir&) {
  Report report;
  const Study study;
  report.rows.push_back(at_least("planned transports", static_cast<double>(study.samples()), 8.0,
                                 "1", "two sequences, eight places of the object"));
  report.rows.push_back(reproduce::near("bundles found", static_cast<double>(study.count()),
                                        goal(4.0), 2.0, "1",
                                        "one a sequence at least, more where the elbow differs"));
  report.rows.push_back(
      at_least("motions in a bundle of their side of the bar",
               study.purity([](const planner::Task& t) { return static_cast<int>(t.transport); }),
               0.9, "1", "nobody told the clustering"));
  report.rows.push_back(
      at_least("motions in a bundle of their grip",
               study.purity([](const planner::Task& t) { return static_cast<int>(t.grip); }), 0.9,
               "1", "nobody told the clustering"));

  Ladder<float> ladder(with_bundles(study.count()));
  std::map<std::string, int> told;
  int silent = 0, right = 0;
  for (std::size_t i = 0; i < study.samples(); ++i) {
    for (const Known& known : kKnown) {
      const planner::Task& t = study.task(i);
      if (t.grip != known.task.grip || t.transport != known.task.transport) continue;
      told.try_emplace(known.sequence, static_cast<int>(study.bundle(i)));
    }
  }
  for (const auto& [sequence, bundle] : told) silent += bundle_of(ladder, sequence.c_str(), -1) < 0;
  for (const auto& [sequence, bundle] : told) bundle_of(ladder, sequence.c_str(), bundle);
  for (const auto& [sequence, bundle] : told) {
    right += bundle_of(ladder, sequence.c_str(), -1) == bundle;
  }
  const auto all = static_cast<double>(told.size());
  report.rows.push_back(at_least("before learning: decisions in F5 that name no bundle", silent,
                                 all, "1", "all kinds that have a plan"));
  report.rows.push_back(at_least("learned: decisions in F5 that name their bundle", right, all, "1",
                                 "all kinds that have a plan"));

  // New places of the object: the bundle that F5 names, and none.
  int trials = 0;
  Effort with, without;
  for (unsigned seed = 101; seed <= 104; ++seed) {
    for (const Known& known : kKnown) {
      const Motion ends = study.transport(known.task, seed);
      if (ends.empty()) continue;
      const auto free = study.effort(known.task, ends, seed, -1);
      const auto led = study.effort(known.task, ends, seed, bundle_of(ladder, known.sequence, -1));
      if (!free || !led) continue;
      ++trials;
      without.links += free->links, without.length_rad += free->length_rad;
      with.links += led->links, with.length_rad += led->length_rad;
    }
  }
  report.rows.push_back(
      at_least("transports in new scenes", trials, 4.0, "1", "with and without pre-selection"));
  report.rows.push_back(reproduce::beside("links certified, with pre-selection to without",
                                          with.links / without.links, goal(1.0), "1",
                                          "M18 2.3.1 expects fewer; known postures lie close "
                                          "together, and paths through them have more"));
  report.rows.push_back(reproduce::at_most("length of the paths, with to without",
                                           with.length_rad / without.length_rad, 1.0, "1",
                                           "pre-selected paths are no detours"));
  return report;
}

}  // namespace

void add_bundle_figures(std::vector<reproduce::Figure>& to) {
  to.push_back({"fields-bundles",
                "Motor primitives in F5 from bundles of planned motions, and what they pre-select",
                "own",
                {.goal = 9},
                learned_bundles,
                {},
                1.0});
}

}  // namespace mimesis::cognition
