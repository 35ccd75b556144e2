#include "experiments/walk/study/playback.h"

#include <deque>

#include "nodes/walker/pattern/generators.h"
#include "nodes/walker/stabilizer/stabilizer.h"
#include "experiments/walk/study/drawer_runs.h"

namespace mimesis::walk {
namespace {

using Eigen::Isometry3d;
using walker::kTick_s;

walker::Sensors to_walker(const hw::sim::BodySensors& s) {
  return {s.q, s.dq, s.R_WI, s.gyro_I, s.specific_force_I, s.foot_S};
}

/// Legs anew for what the stabilizer wants different.
class Corrected {
 public:
  Corrected(const robot::Biped& biped, const walker::StabilizerSettings& settings)
      : biped_(biped),
        stabilizer_(biped, walker::gait_settings(biped), settings),
        ik_{robot::LegIk(biped, robot::kLeft), robot::LegIk(biped, robot::kRight)} {}

  Eigen::VectorXd step(const walker::StabilizerPlan& plan, const Eigen::VectorXd& q,
                       const walker::Sensors& sensors) {
    walker::StabilizerPlan p = plan;
    p.X_WB_last = X_WB_ ? *X_WB_ : plan.X_WB_last;
    const walker::StabilizerCommand& c = stabilizer_.step(p, sensors);
    Isometry3d X_WB = plan.X_WB_last;
    X_WB.translation().head<2>() += c.com_shift_W_m;
    Eigen::VectorXd out = q;
    for (const robot::Side s : robot::kSides) {
      const auto legs = ik_[s].solve(X_WB.inverse() * c.X_WS[s]);
      for (std::size_t i = 0; i < 6; ++i) {
        out[biped_.leg[s].dof[i]] = legs.q[static_cast<Eigen::Index>(i)];
      }
    }
    X_WB_ = X_WB;
    return out;
  }

 private:
  const robot::Biped& biped_;
  walker::Stabilizer stabilizer_;
  std::array<robot::LegIk, 2> ik_;
  std::optional<Isometry3d> X_WB_;
};

}  // namespace

TrialResult play(const Robot& robot, const JointTrack& track, Feedback feedback) {
  hw::sim::BodyWorld world(robot.biped, robot.urdf_file, {});
  hw::sim::WalkJudge judge;
  Corrected corrected(robot.biped, launched_walker().stabilizer);
  std::vector<walker::StabilizerPlan> reference;
  if (feedback == Feedback::kOwn) reference = implied_reference(robot.biped, track);
  std::deque<walker::Sensors> on_their_way(kSensorDelayTicks, to_walker(world.sensors()));
  TrialResult result;
  for (std::size_t k = 0; k < track.q.size() && !world.truth().fell; ++k) {
    on_their_way.push_back(to_walker(world.sensors()));
    const Eigen::VectorXd q = feedback == Feedback::kOwn
                                  ? corrected.step(reference[k], track.q[k], on_their_way.front())
                                  : track.q[k];
    on_their_way.pop_front();
    world.step({q.data(), static_cast<std::size_t>(q.size())}, kTick_s);
    judge.tick(world.truth(), std::nullopt);
  }
  result.figures = judge.figures();
  if (world.truth().fell) result.fell_at_s = world.time_s();
  return result;
}

}  // namespace mimesis::walk
