#pragma once
#include <map>
#include <memory>

#include "experiments/walk/study/drawer_runs.h"
#include "experiments/walk/study/naive.h"
#include "experiments/walk/study/playback.h"

namespace mimesis::walk {

/// Sources of action 1, and more of the others.
struct Sources {
  int first = 4, further = 3;
  auto operator<=>(const Sources&) const = default;
  std::string text() const { return std::to_string(first) + "+" + std::to_string(further); }
};
inline constexpr std::array kSources = {Sources{3, 2}, Sources{4, 3}, Sources{5, 4}};

/// Models of the naive approach for each number of sources. Learning is not convex, and which local
/// minimum it ends in says more about falls than how many sources there are: each begins with
/// random delays of its own and goes on until nothing is gained.
inline constexpr std::size_t kNaiveModels = 3;

/// Which of the thirty goals: a third of each speed class is enough for means and ranges.
enum class Goals { kAll, kEveryThird };

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
  const synthesizer::LearnedActions& joints(Sources sources, std::size_t model);
  /// Numbers of the trials that originals and resyntheses are made of: eight, of all paces.
  std::vector<std::size_t> chosen_trials() const;

  using Outcomes = std::vector<Outcome>;
  Outcomes originals();                   ///< chosen trials, straight into the walker
  Outcomes resynthesis(Sources sources);  ///< their mixtures
  Outcomes inference(Sources sources, Goals which,
                     hw::sim::Plant plant = hw::sim::Plant::kSprings);  ///< novel_goals() online
  Outcomes extremes();  ///< extreme_goals() online, 4+3 sources
  Outcomes naive_resynthesis(Sources sources, std::size_t model = 0);
  Outcomes naive_inference(Sources sources, Goals which, std::size_t model = 0);
  /// The recorded angles of originals, played: what the way of playing alone does.
  Outcomes played_originals();

 private:
  const std::vector<Recording>& walks();  ///< of novel_goals(): timing and start of naive ones
  Outcome played(const JointTrack& track) const;  ///< with kOwn feedback
  /// Those of `numbers` that are not known yet are computed, on all processors.
  template <class Run>
  Outcomes known_or(const std::string& experiment, const std::vector<std::size_t>& numbers,
                    const Run& run);

  Robot biped_;
  ScriptRobot script_robot_;
  synthesizer::DrawerData trials_;
  std::unique_ptr<FeasibleData> feasible_;
  std::map<Sources, std::unique_ptr<synthesizer::BipedDrawer>> actions_;
  std::map<std::pair<Sources, std::size_t>, std::unique_ptr<synthesizer::LearnedActions>> joints_;
  std::vector<Recording> walks_;
  std::map<std::string, std::map<std::size_t, Outcome>> outcomes_;  // by experiment, number
};

}  // namespace mimesis::walk
