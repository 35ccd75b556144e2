#include "experiments/walk/study/naive.h"

#include <cmath>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/character/parameters.h"
#include "nodes/synthesizer/character/smooth.h"

namespace mimesis::walk {
namespace {

using synthesizer::MotionParameters;
using walker::kTick_s;

constexpr double kBeta = 0.2, kFade_s = 0.4;

/// Plays the three actions at action and phase [0, 1].
class Player {
 public:
  Player(const synthesizer::LearnedActions& joints, const JointActions& actions)
      : joints_(joints), actions_(actions), mixed_(actions[0]) {}

  Eigen::VectorXd at(std::size_t action, double share) {
    const double window = kBeta * math::kTwoPi / 2.0;
    const double phase = std::min(share * math::kTwoPi, std::nextafter(math::kTwoPi, 0.0));
    const MotionParameters* p = &actions_[action];
    if (action > 0 && phase < window) {
      synthesizer::transition(actions_[action - 1], *p, 1, phase, kBeta, mixed_);
      p = &mixed_;
    } else if (action + 1 < actions_.size() && phase > math::kTwoPi - window) {
      synthesizer::transition(*p, actions_[action + 1], 1, phase - math::kTwoPi, kBeta, mixed_);
      p = &mixed_;
    }
    Eigen::VectorXd q(joints_.row_count());
    joints_.at(*p, phase, q);
    return q;
  }

 private:
  const synthesizer::LearnedActions& joints_;
  const JointActions& actions_;
  MotionParameters mixed_;
};

}  // namespace

JointActions reconstructed(const synthesizer::LearnedActions& joints, std::size_t trial) {
  JointActions out;
  for (std::size_t a = 0; a < out.size(); ++a) {
    out[a] = synthesizer::parameters_of(joints.maps().model().action[a].patterns.at(trial));
  }
  return out;
}

JointActions inferred(const synthesizer::LearnedActions& joints, const DrawerGoal& goal) {
  JointActions out;
  synthesizer::ActionTask task = goal.task();
  task.length_m = task.previous_length_m = goal.normal_m;
  out[0] = joints.maps().at(synthesizer::kNormalStep, task);
  task.length_m = goal.reaching_m;
  out[1] = joints.maps().at(synthesizer::kReachingStep, task);
  task.length_m = 0.0;
  task.duration_s = kStanding_s;
  task.previous_length_m = goal.reaching_m;
  out[2] = joints.maps().at(synthesizer::kStanding, task);
  return out;
}

JointTrack track_of(const Recording& walk) {
  JointTrack out;
  for (const Recording::Tick& t : walk.ticks) {
    out.q.push_back(t.q);
    out.plan.push_back(t.plan);
  }
  return out;
}

JointTrack naive_track(const synthesizer::LearnedActions& joints, const JointActions& actions,
                       const Recording& walk) {
  JointTrack out = track_of(walk);
  const std::size_t from = walk.begin(1).value();
  MIMESIS_ASSERT(from >= 2);
  Player player(joints, actions);
  Eigen::VectorXd off, rate;
  for (std::size_t k = from; k < out.q.size(); ++k) {
    const Recording::Tick& t = walk.ticks[k];
    const Eigen::VectorXd q = player.at(static_cast<std::size_t>(t.number) - 1, t.phase);
    if (k == from) {
      const Recording::Tick& next = walk.ticks[k + 1];
      const Eigen::VectorXd soon = player.at(static_cast<std::size_t>(next.number) - 1, next.phase);
      off = out.q[k] - q;
      rate = (out.q[k] - out.q[k - 1] - (soon - q)) / kTick_s;
    }
    const double since_s = static_cast<double>(k - from) * kTick_s;
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      out.q[k][i] = q[i] + synthesizer::faded(off[i], rate[i], since_s, kFade_s);
    }
  }
  return out;
}

}  // namespace mimesis::walk
