#pragma once
#include "common/robot/leg_ik.h"
#include "experiments/walk/study/script.h"
#include "experiments/walk/trial/trial.h"
#include "nodes/walker/stabilizer/stabilizer.h"

namespace mimesis::walk {

/// Joint angles as a robot plays them, tick by tick, and the timing of its steps.
struct JointTrack {
  std::vector<Eigen::VectorXd> q;           ///< all joints [rad]
  std::vector<walker::PatternSample> plan;  ///< contacts, gait and times count; poses do not
};

/// Reference that joint angles alone imply: standing feet stay flat where they came down, the
/// pelvis is where they carry it (in double support both, by their planned shares), the CoM follows
/// from kinematics and the ZMP from inverse dynamics (differences of 10 ms, mean of 125 ms, because
/// mixtures are rough).
std::vector<walker::StabilizerPlan> implied_reference(const robot::Biped& biped,
                                                      const JointTrack& track);

/// Parameters of the actions 1, 2, 3: of a training trial, or for a goal.
using ActionParameters = std::array<synthesizer::MotionParameters, synthesizer::kActions>;
ActionParameters reconstructed(const synthesizer::ActionMaps& maps, std::size_t trial);
ActionParameters inferred(const synthesizer::ActionMaps& maps, const DrawerGoal& goal);
/// Rows that their mixtures make, as many samples as were learned from.
ActionRows mixed_rows(const synthesizer::ActionMaps& maps, const ActionParameters& actions);

/// The naive approach [M18 3.8.4, table 3.1]: angles of all joints from their mixture, actions
/// joined by eq. 3.23. The start from standing, which was not learned, is that of `walk`, from the
/// pattern generator with the same goal; the mixture takes over in its second action, the
/// difference fading within half a step. Timing of steps as there, too.
JointTrack naive_track(const synthesizer::ActionMaps& joints, const ActionParameters& actions,
                       const Recording& walk);

/// The recorded angles themselves.
JointTrack track_of(const Recording& walk);

struct Playing {
  bool feedback = true;      ///< the walker's stabilizer around the reference that the angles imply
  bool adjust_steps = true;  ///< by that stabilizer
  hw::sim::Plant plant = hw::sim::Plant::springs;
  std::string text() const;  ///< "springs", "servos, steps as planned"
};

/// Plays angles until the robot falls or they end, with the delays and gains of launched_walker().
/// Sets figures, fell_at_s and, as the stabilizer estimates it, dcm_max_m. Deterministic.
TrialResult play(const Robot& robot, const JointTrack& track, const Playing& how,
                 std::span<const hw::sim::Push> pushes = {});

}  // namespace mimesis::walk
