#pragma once
#include <map>
#include <memory>

#include "tools/mimesis/walk/drawer/drawer_trial.h"
#include "tools/mimesis/walk/study/naive.h"
#include "tools/mimesis/walk/study/playback.h"

namespace mimesis::walk {

/// How one walk to the drawer went.
struct Outcome {
  bool fell = false, taken = false;
  std::string trouble;
  double fell_at_s = 0.0;
  double ankle_n_m = 0.0, normal_n = 0.0;               ///< peaks, low-passed by 20 ms
  double zmp_std_m = 0.0;                               ///< see StanceZmp
  double normal_error_m = 0.0, reaching_error_m = 0.0;  ///< of actions' lengths, walked − wished
  double reach_error_m = 0.0;  ///< of the right hand when it has the object, along the way
};

/// Sources of action 1, and more of the others.
struct Sources {
  int first = 4, further = 3;
  auto operator<=>(const Sources&) const = default;
  std::string text() const { return std::to_string(first) + "+" + std::to_string(further); }
};
inline constexpr std::array kSources = {Sources{3, 2}, Sources{4, 3}, Sources{5, 4}};

/// 30 goals that were in no training trial: 1-10 slow, 11-20 at middle speed, 21-30 fast, as the
/// paces 0.8, 1 and 1.2 of the training trials make steps of the same time.
std::vector<DrawerGoal> novel_goals();
/// 30 goals over the ranges of [M18 3.8.4]: 50.5-56.1 cm, 16.3-35.9 cm, reach 66.3-75.5 cm, depth
/// 12.4-27.3 cm, all growing together.
std::vector<DrawerGoal> extreme_goals();

/// For a floor that is known to be flat: the swing foot is corrected by what the base does with 10
/// ms of delay instead of 30. Springs of the joints let the body, and the foot with it, run ahead;
/// the longest cycles (0.56 m) came out 11 mm long with 30 ms, 3 mm with 10.
walker::WalkerSettings flat_floor();

/// The online task whose plan is that of the goal.
DrawerTrialSpec online_spec(const Robot& robot, const synthesizer::BipedDrawer& actions,
                            const DrawerGoal& goal);
/// As run_drawer_trial(), with the watch of it.
Outcome run_online(const DrawerTrialSpec& spec,
                   const std::function<void(const DrawerTick&)>& watch = {});
Outcome run_script(const ScriptRobot& robot, const ActionRows& rows, const DrawerGoal& goal,
                   const DrawerGoal& wished);

/// The experiments of [M18 3.8.3-3.8.4] on models/biped.yaml, each computed when it is first asked
/// for and kept: several figures are made of the same runs. Not for several threads.
class DrawerStudy {
 public:
  static DrawerStudy& shared();
  DrawerStudy();

  const ScriptRobot& robot() const { return script_robot_; }
  const synthesizer::DrawerData& trials() const { return trials_; }  ///< kinematic ones
  const FeasibleData& feasible();
  const synthesizer::BipedDrawer& actions(Sources sources);    ///< learned from feasible()
  const synthesizer::LearnedActions& joints(Sources sources);  ///< the naive approach's
  /// Numbers of the trials that originals and resyntheses are made of: eight, of all paces.
  std::vector<std::size_t> chosen_trials() const;

  using Outcomes = std::vector<Outcome>;
  const Outcomes& originals();                   ///< chosen trials, straight into the walker
  const Outcomes& resynthesis(Sources sources);  ///< their mixtures
  /// novel_goals() online: all with 4+3 sources, every third with others.
  const Outcomes& inference(Sources sources);
  const Outcomes& extremes();                          ///< extreme_goals() online, 4+3 sources
  const Outcomes& naive_resynthesis(Sources sources);  ///< with kOwn feedback
  const Outcomes& naive_inference(Sources sources, Feedback feedback);
  /// The recorded angles of originals, played: what the way of playing alone does.
  const Outcomes& played_originals(Feedback feedback);

 private:
  const std::vector<Recording>& walks();  ///< of novel_goals(): timing and start of naive ones

  Robot biped_;
  ScriptRobot script_robot_;
  synthesizer::DrawerData trials_;
  std::unique_ptr<FeasibleData> feasible_;
  std::map<Sources, std::unique_ptr<synthesizer::BipedDrawer>> actions_;
  std::map<Sources, std::unique_ptr<synthesizer::LearnedActions>> joints_;
  std::vector<Recording> walks_;
  std::map<std::string, Outcomes> outcomes_;
};

}  // namespace mimesis::walk
