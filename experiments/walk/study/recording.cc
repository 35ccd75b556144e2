#include "experiments/walk/study/recording.h"

#include "common/error.h"
#include "experiments/walk/study/parallel.h"

namespace mimesis::walk {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;
using walker::kTick_s;

/// Mean over one step of two in an action: the pelvis goes faster and slower once a step.
Eigen::RowVectorXd without_sway(const Eigen::RowVectorXd& v) {
  const Index n = v.size(), half = n / 4;
  Eigen::RowVectorXd out(n);
  for (Index k = 0; k < n; ++k) {
    const Index from = std::max<Index>(0, k - half), to = std::min(n, k + half + 1);
    out[k] = v.segment(from, to - from).mean();
  }
  return out;
}

MatrixXd velocity(const Recording& r, int number, int samples, double length_m) {
  const MatrixXd p = resample(r, number, samples, [](const Recording::Tick& t) {
    return VectorXd(t.X_WB.translation().head<2>());
  });
  const double duration_s = number == 3 ? kStanding_s : 2.0 * kStep_s;
  MatrixXd v = MatrixXd::Zero(3, samples);
  for (Index k = 0; k + 1 < samples; ++k) {
    v.col(k).head<2>() = (p.col(k + 1) - p.col(k)) * samples / duration_s;
  }
  v.col(samples - 1) = v.col(samples - 2);
  v.row(0) = without_sway(v.row(0));
  v.row(0).array() += length_m / duration_s - v.row(0).mean();
  v.row(1).setZero();
  return v;
}

/// Joints between pelvis and trunk that turn about y.
std::vector<int> waist_pitch(const robot::Biped& biped) {
  std::vector<int> out;
  for (int l = biped.trunk; l > 0; l = biped.tree.link(l).parent) {
    const robot::Link& link = biped.tree.link(l);
    if (link.dof >= 0 && std::abs(link.axis.y()) > 0.9) out.push_back(link.dof);
  }
  return out;
}

/// Set-points as they would be above an upright pelvis: the walker tilts its pelvis to reach, and
/// takes a wished waist as that of an upright one.
VectorXd upright(const Recording::Tick& t, const std::vector<int>& waist) {
  VectorXd q = t.q;
  const double pitch = std::atan2(-t.X_WB(2, 0), t.X_WB(0, 0));
  for (const int dof : waist) q[dof] += pitch / static_cast<double>(waist.size());
  return q;
}

}  // namespace

std::optional<std::size_t> Recording::begin(int number) const {
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (ticks[i].number == number) return i;
  }
  return {};
}

Recording record(const ScriptRobot& robot, Script script) {
  const robot::Biped& biped = robot.robot->biped;
  walker::WalkerSettings settings;
  settings.stabilize = false;
  walker::Walker walker(biped, settings);
  walker::Sensors sensors;
  sensors.q = biped.half_sitting;
  sensors.dq = VectorXd::Zero(biped.tree.dof());
  Recording out;
  const walker::PatternSample* plan = nullptr;
  const auto ticks = static_cast<int>(std::lround(kScript_s / kTick_s));
  for (int k = 0; k < ticks; ++k) {
    const walker::WalkerOutput& now = walker.step(script.step(plan), sensors);
    plan = &now.pattern;
    out.ticks.push_back({script.number(), script.phase(), now.q, now.X_WB, now.pattern});
    out.clipped += now.clipped;
    out.failed += now.failed;
    out.limited += now.limited;
    if (out.trouble.empty()) out.trouble = now.trouble;
  }
  return out;
}

FeasibleData make_feasible(const ScriptRobot& robot, const synthesizer::DrawerData& data) {
  const std::size_t trials = data.action[0].trials.size();
  FeasibleData out{data, data, {}};
  out.recordings = in_parallel(trials, [&](std::size_t i) {
    return record(robot, Script(robot, rows_of(data, i), goal_of(data, i)));
  });
  const auto joints = static_cast<Index>(robot.robot->biped.tree.dof());
  const auto upper = static_cast<Index>(robot.upper.dof());
  std::vector<Index> of_tree(static_cast<std::size_t>(upper));
  for (std::size_t i = 0; i < robot.joint.size(); ++i) {
    of_tree[static_cast<std::size_t>(robot.joint[i])] = robot.robot->biped.upper_body[i];
  }
  const std::vector<int> waist = waist_pitch(robot.robot->biped);
  for (std::size_t a = 0; a < data.action.size(); ++a) {
    const Index samples = data.action[a].samples.cols();
    const auto n = static_cast<int>(samples);
    mocap::Trials &u = out.upper_body.action[a], &q = out.joints.action[a];
    q.rows = robot.robot->biped.tree.joint_names();
    q.samples.resize(static_cast<Index>(trials) * joints, samples);
    const int number = static_cast<int>(a) + 1;
    for (std::size_t i = 0; i < trials; ++i) {
      const Recording& r = out.recordings[i];
      if (!r.begin(3))
        throw ConfigError("trial " + std::to_string(i) + " of the drawer: " +
                          (r.trouble.empty() ? "the walk does not end" : r.trouble));
      const MatrixXd all = resample(r, number, n, [](const Recording::Tick& t) { return t.q; });
      q.samples.middleRows(static_cast<Index>(i) * joints, joints) = all;
      auto block = u.samples.middleRows(static_cast<Index>(i) * (upper + 3), upper + 3);
      const MatrixXd above =
          resample(r, number, n, [&](const Recording::Tick& t) { return upright(t, waist); });
      block.topRows(upper) = above(of_tree, Eigen::all);
      block.bottomRows(3) = velocity(r, number, n, data.action[a].trials[i].step_length_m);
    }
  }
  return out;
}

}  // namespace mimesis::walk
