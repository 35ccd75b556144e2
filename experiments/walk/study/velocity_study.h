#pragma once
#include <map>
#include <memory>

#include "experiments/walk/study/drawer_study.h"

namespace mimesis::walk {

/// Where a walk of actions 1, 1, 2, 3 comes to; or by how much it misses. In W, where it begins
/// towards x, seen from the middle of the feet on the ground.
struct Places {
  Eigen::Vector2d normal_m, reaching_m;  ///< travel in the second action 1, in action 2
  Eigen::Vector3d reach_m;               ///< right hand at the drawn-out object
  double heading_rad = 0.0;              ///< of the feet that stand
};
Places operator-(const Places& a, const Places& b);
Places middle(const Places& a, const Places& b);

/// One walk in the physics, led by velocities of the pelvis and joint angles of the upper body
/// alone.
struct FreeWalk {
  bool fell = false;
  std::string trouble;  ///< first one
  Places came;          ///< NaN: it did not come so far
};
FreeWalk walk_free(const ScriptRobot& robot, const ActionRows& rows);

/// Walks whose footprints the pattern generator makes, and whose hands are where the joints have
/// them [M18 3.8.3, fig. 3.41]: nothing but the learned rows tells the walker where to go, so that
/// errors of the mixture are errors of the robot's place. Trained by trials that were walked in the
/// same way, straight ahead: their labels are the places that they came to in the physics. Computed
/// when first asked for. Not for several threads.
class VelocityStudy {
 public:
  VelocityStudy(const ScriptRobot& robot, const synthesizer::DrawerData& kinematic)
      : robot_(&robot), kinematic_(&kinematic) {}

  /// Feasible trials with the labels that they came to.
  const synthesizer::DrawerData& trials();
  const Places& label(std::size_t trial) { return trials(), labels_.at(trial); }
  const synthesizer::ActionMaps& maps(Sources sources);

  /// Walks of the mixtures of training trials; errors against their labels.
  std::vector<FreeWalk> resynthesis(Sources sources, const std::vector<std::size_t>& trials);
  /// Walks by the learned maps to the places in the middle between those of two training trials;
  /// action 3 is inferred for a goal moved by what kinematics say its hand misses.
  using Pair = std::array<std::size_t, 2>;
  std::vector<FreeWalk> inference(Sources sources, const std::vector<Pair>& between);

 private:
  const ScriptRobot* robot_;
  const synthesizer::DrawerData* kinematic_;
  std::unique_ptr<synthesizer::DrawerData> trials_;
  std::vector<Places> labels_;
  std::map<Sources, std::unique_ptr<synthesizer::ActionMaps>> maps_;
};

}  // namespace mimesis::walk
