#pragma once
#include "common/robot/leg_ik.h"
#include "nodes/walker/stabilizer/stabilizer.h"
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

/// Joint angles as a robot plays them, tick by tick, and the timing of its steps.
struct JointTrack {
  std::vector<Eigen::VectorXd> q;           ///< all joints [rad]
  std::vector<walker::PatternSample> plan;  ///< contacts, gait and times count; poses do not
};

/// What angles alone say of a walk: standing feet stay flat where they came down, the pelvis is
/// where they carry it (in double support both, by their planned shares), the CoM by kinematics and
/// the ZMP by inverse dynamics (differences of 10 ms, mean of 125 ms: mixtures are rough).
std::vector<walker::StabilizerPlan> implied_reference(const robot::Biped& biped,
                                                      const JointTrack& track);

}  // namespace mimesis::walk
