#pragma once
#include <cmath>
#include <map>
#include <memory>

#include "experiments/walk/drawer/drawer_trial.h"
#include "experiments/walk/study/naive.h"
#include "experiments/walk/study/script.h"
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

/// Lateral variability of the ZMP [M18 3.8.4, fig. 3.46]: standard deviation of true minus planned
/// ZMP, each seen from the standing foot, over all ticks in which one foot stands alone. (The text
/// does not say whether its stance intervals hold double support; there the difference has no one
/// foot to be seen from.)
class StanceZmp {
 public:
  void tick(const walker::WalkerOutput& out, const hw::sim::BodyTruth& truth) {
    const walker::PatternSample& plan = out.pattern;
    if (plan.contact[0] == plan.contact[1]) return;
    const robot::Side s = plan.contact[0] ? robot::kLeft : robot::kRight;
    const double now = truth.zmp_W_m.y() - truth.X_WS[s].translation().y();
    const double wished = plan.zmp_W_m.y() - plan.foot[s].X_WS.translation().y();
    add(now - wished);
  }
  void add(double difference_m) {
    ++count_;
    const double off = difference_m - mean_;
    mean_ += off / static_cast<double>(count_);
    squares_ += off * (difference_m - mean_);
  }
  double std_m() const {
    return count_ > 0 ? std::sqrt(squares_ / static_cast<double>(count_)) : 0.0;
  }

 private:
  long count_ = 0;
  double mean_ = 0.0, squares_ = 0.0;  // mean, and sum of the squared differences from it [Welford]
};

/// Result of one walk to the drawer. Errors that it did not come to are NaN.
struct Outcome {
  bool fell = false, taken = false;
  std::string trouble;
  double fell_at_s = 0.0;
  double ankle_n_m = 0.0, normal_n = 0.0;  ///< peaks until a fall, low-passed by 20 ms
  double zmp_std_m = std::nan("");         ///< see StanceZmp
  /// largest error of the soles against the plan, over all steps
  double step_error_m = std::nan("");
  /// Error of the actions' lengths, walked − wished; the largest of several of a kind.
  double normal_error_m = std::nan(""), reaching_error_m = std::nan("");
  double reach_error_m = std::nan("");  ///< error of the right hand when it has the object

  /// Notes the error of a finished action; the larger one of its kind stays.
  void note_length(synthesizer::Action action, double error_m);
};

/// Outcome from figures taken during a walk; only falls and peaks if no step was planned.
Outcome outcome_of(const TrialResult& result, const StanceZmp& zmp);

/// 30 goals that were in no training trial: 1-10 slow, 11-20 at middle speed, 21-30 fast, as the
/// paces 0.8, 1 and 1.2 of the training trials make steps of the same time.
std::vector<DrawerGoal> novel_goals();
/// 30 goals over the ranges of [M18 3.8.4]: 50.5-56.1 cm, 16.3-35.9 cm, reach 66.3-75.5 cm, depth
/// 12.4-27.3 cm, all growing together.
std::vector<DrawerGoal> extreme_goals();

/// Delays of launch/drawer.yaml: a set-point shows in the sensors three ticks later, through the
/// bridge, and the stabilizer compares with the plan of three ticks ago [docs/walking.md 6.7].
inline constexpr int kSensorDelayTicks = 2;
walker::WalkerSettings launched_walker();
/// Senses, errors of stiffness and gains of the suites (set_up, seed 1), these delays, ankles of
/// kMostAnkle_n_m.
void sense(DrawerTrialSpec& spec, hw::sim::Plant plant, std::size_t number);

/// Limit of the ankles' pitch motors in online and scripted walks, as HRP-2's [M18 3.8.4]. Played
/// joint angles have the motors of the robot's description: how far they go beyond it is a result.
inline constexpr double kMostAnkle_n_m = 30.0;

/// The online task whose plan is that of the goal; `number` draws its senses.
DrawerTrialSpec online_spec(const Robot& robot, const synthesizer::BipedDrawer& actions,
                            const DrawerGoal& goal, hw::sim::Plant plant = hw::sim::Plant::springs,
                            std::size_t number = 0);
/// Like run_drawer_trial(), observed by a watch.
Outcome run_online(const DrawerTrialSpec& spec,
                   const std::function<void(const DrawerTick&)>& watch = {});
/// Walks a script in the physics with launched_walker()'s settings and delays.
TrialResult walk_script(const ScriptRobot& robot, Script& script,
                        const std::function<void(const TrialTick&)>& watch);
Outcome run_script(const ScriptRobot& robot, const ActionRows& rows, const DrawerGoal& goal,
                   const DrawerGoal& wished);

/// Sources of action 1, and more of the others.
struct Sources {
  int first = 4, further = 3;
  auto operator<=>(const Sources&) const = default;
  std::string text() const { return std::to_string(first) + "+" + std::to_string(further); }
};
inline constexpr std::array kSources = {Sources{3, 2}, Sources{4, 3}, Sources{5, 4}};

/// Models of the naive approach for each number of sources. Learning is not convex, and falls
/// depend more on the local minimum than on the number of sources: each model starts from its own
/// random delays and is trained until the error no longer falls.
inline constexpr std::size_t kNaiveModels = 3;

/// Selection of the thirty goals: a third of each speed class is enough for means and ranges.
enum class Goals { all, every_third };

/// The experiments of [M18 3.8.3-3.8.4] on models/biped.yaml, each walk computed when it is first
/// asked for and kept: several figures are made of the same walks. Not for several threads.
class DrawerStudy {
 public:
  static DrawerStudy& shared();
  DrawerStudy();

  const ScriptRobot& robot() const { return script_robot_; }
  const synthesizer::DrawerData& trials() const { return trials_; }  ///< kinematic ones
  const FeasibleData& feasible();
  const synthesizer::BipedDrawer& actions(Sources sources);  ///< learned from feasible()
  /// The naive approach's. @param model  < kNaiveModels
  const synthesizer::ActionMaps& joints(Sources sources, std::size_t model);
  /// Numbers of the trials that originals and resyntheses are made of: eight, of all paces.
  std::vector<std::size_t> chosen_trials() const;

  using Outcomes = std::vector<Outcome>;
  Outcomes originals();  ///< chosen trials, straight into the walker
  /// Their mixtures, with feet and hands led to the labels: for forces and ZMP, not for places.
  Outcomes resynthesis(Sources sources);
  Outcomes inference(Sources sources, Goals which,
                     hw::sim::Plant plant = hw::sim::Plant::springs);  ///< novel_goals() online
  Outcomes extremes();  ///< extreme_goals() online, 4+3 sources
  Outcomes naive_resynthesis(Sources sources, std::size_t model = 0);
  Outcomes naive_inference(Sources sources, Goals which, std::size_t model = 0,
                           const Playing& how = {});
  /// The recorded angles of originals, played: the effect of the way of playing alone.
  Outcomes played_originals(const Playing& how = {});

 private:
  /// walks of novel_goals(): timing and start of naive ones
  const std::vector<Recording>& walks();
  Outcome played(const JointTrack& track, const Playing& how) const;
  /// Computes the missing ones of `numbers`, on all processors.
  template <class Run>
  Outcomes known_or(const std::string& experiment, const std::vector<std::size_t>& numbers,
                    const Run& run);

  Robot biped_;
  ScriptRobot script_robot_;
  synthesizer::DrawerData trials_;
  std::unique_ptr<FeasibleData> feasible_;
  std::map<Sources, std::unique_ptr<synthesizer::BipedDrawer>> actions_;
  std::map<std::pair<Sources, std::size_t>, std::unique_ptr<synthesizer::ActionMaps>> joints_;
  std::vector<Recording> walks_;
  std::map<std::string, std::map<std::size_t, Outcome>> outcomes_;  // by experiment, number
};

}  // namespace mimesis::walk
