#include "experiments/motion/drawer_training.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "common/motion/demix/held_out.h"

namespace mimesis::synthesizer {
namespace {

struct Low {
  bool toes;
  Eigen::Vector3d p_W;
};

Low lowest(const mocap::Body& body, const mocap::BodyPose& pose, mocap::Side side) {
  const int ankle = side == mocap::kLeft ? mocap::kLeftAnkle : mocap::kRightAnkle;
  const Eigen::Vector3d heel = pose.point(ankle, body.heel_m[side]);
  const Eigen::Vector3d toes = pose.point(ankle, body.toe_m[side]);
  return heel.z() < toes.z() ? Low{false, heel} : Low{true, toes};
}

mocap::BodyPose drawer_pose(const SequenceState& state) {
  return forward_kinematics(
      drawer_maps().model().body,
      std::span<const double, mocap::kBodyRows>(state.angle_rad.data(), mocap::kBodyRows),
      state.pelvis_W_m);
}

void measure(const SequenceState& before, const SequenceState& now, DrawerRun* run) {
  const double dt = now.time_s - before.time_s;
  const auto a = drawer_pose(before), b = drawer_pose(now);
  const mocap::Body& body = drawer_maps().model().body;
  run->joint_speed_rad_s = std::max(run->joint_speed_rad_s,
                                    (now.angle_rad - before.angle_rad).cwiseAbs().maxCoeff() / dt);
  for (const auto side : {mocap::kLeft, mocap::kRight}) {
    const Low was = lowest(body, a, side), is = lowest(body, b, side);
    if (before.stands[side] && now.stands[side] && was.toes == is.toes)
      run->foot_speed_m_s = std::max(run->foot_speed_m_s, (is.p_W - was.p_W).head<2>().norm() / dt);
  }
}

// Task of a trial of the data, as ActionMaps::task_of() has it for those it was learned from.
ActionTask task_of(const std::array<mocap::Trials, kActions>& sets, std::size_t a, std::size_t i) {
  const mocap::Trial& trial = sets[a].trials[i];
  return {.length_m = trial.step_length_m,
          .duration_s = trial.duration_s,
          .previous_length_m = a == 0 ? 0.0 : sets[a - 1].trials[i].step_length_m,
          .final_distance_m = trial.task.at(1),
          .object_depth_m = trial.task.at(2),
          .object_lateral_m = trial.task.at(3)};
}

// The mixture that the parameters of an action say, for the rows of one trial.
demix::Mixture as_mixture(const motion::MotionModel& model, const MotionParameters& p,
                          Eigen::Index sources) {
  return {model.sources.topRows(sources), p.weight_rad.leftCols(sources),
          p.delay_rad.leftCols(sources), p.mean_rad, model.fixed};
}

double q_about(const Eigen::VectorXd& posture, const Eigen::MatrixXd& truth,
               const Eigen::MatrixXd& guess) {
  return 1.0 - (truth - guess).norm() / (truth.colwise() - posture).norm();
}

}  // namespace

LeftOutDrawer leave_recordings_out(const DrawerData& data) {
  LeftOutDrawer out;
  double missing = 0.0, all = 0.0;
  std::set<std::string> clips;
  for (const mocap::Trial& t : data.action[0].trials) clips.insert(t.clip);
  for (const std::string& clip : clips) {
    const auto is_it = [&](const mocap::Trial& t) { return t.clip == clip; };
    DrawerData others = data, asked = data;
    for (std::size_t a = 0; a < kActions; ++a) {
      others.action[a] = demix::subset(data.action[a], std::not_fn(is_it));
      asked.action[a] = demix::subset(data.action[a], is_it);
    }
    const ActionMaps maps(learn_drawer_model(others));
    for (const Action a : {kNormalStep, kReachingStep, kStanding}) {
      const motion::MotionModel& model = maps.model().action[a];
      const auto rows = asked.action[a].rows_per_trial();
      const auto sources = a == kNormalStep ? 1 + maps.model().options.first_sources
                                            : static_cast<int>(model.sources.rows());
      const demix::Mixture learned =
          as_mixture(model, parameters_of(model.patterns.front()), sources);
      const Eigen::MatrixXd& x = asked.action[a].samples;
      const Eigen::MatrixXd fit =
          demix::fit_to(asked.action[a], learned, demix::Delays::tied).reconstruct();
      missing += (x - fit).squaredNorm();
      all += (x.colwise() - x.rowwise().mean()).squaredNorm();
      Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(rows, x.cols());
      const auto count = static_cast<Eigen::Index>(others.action[a].trials.size());
      for (Eigen::Index i = 0; i < count; ++i) {
        mean += others.action[a].samples.middleRows(i * rows, rows) / static_cast<double>(count);
      }
      for (std::size_t i = 0; i < asked.action[a].trials.size(); ++i) {
        const auto first = static_cast<Eigen::Index>(i) * rows;
        const auto q = [&, truth = Eigen::MatrixXd(x.middleRows(first, rows))](const auto& guess) {
          return q_about(mean.rowwise().mean(), truth, guess);
        };
        const MotionParameters p = maps.at(a, task_of(asked.action, a, i));
        out.action[a].push_back({q(as_mixture(model, p, model.sources.rows()).reconstruct()),
                                 q(fit.middleRows(first, rows)), q(mean)});
      }
    }
  }
  out.quality_squared = 1.0 - missing / all;
  return out;
}

const LeftOutDrawer& drawer_left_out() {
  static const LeftOutDrawer out = leave_recordings_out(drawer_data());
  return out;
}

const DrawerData& drawer_data() {
  static const DrawerData data = generate_drawer_data(mocap::standard_body(), {}, {});
  return data;
}

const ActionMaps& drawer_maps() {
  static const ActionMaps maps(learn_drawer_model(drawer_data()));
  return maps;
}

int DrawerRun::count(Action action) const {
  return static_cast<int>(
      std::ranges::count_if(history, [&](const auto& a) { return a.action == action; }));
}

DrawerRun run_drawer(double distance_m, const std::vector<DrawerJump>& jumps) {
  auto sequence = DrawerSequence::start(drawer_maps(), {.front_W_m = distance_m});
  if (!sequence) throw std::runtime_error("drawer: " + sequence.error().reason);
  DrawerRun run;
  double front = distance_m;
  std::size_t next = 0;
  while (!sequence->state().done && sequence->state().time_s < 60.0) {
    if (next < jumps.size() && sequence->state().time_s >= jumps[next].at_s)
      sequence->set_goal({.front_W_m = front += jumps[next++].by_m});
    run.states.push_back(sequence->step());
    run.front_W_m.push_back(front);
    if (run.states.size() > 1) measure(*(run.states.end() - 2), run.states.back(), &run);
  }
  double squares = 0.0;
  for (const auto& s : run.states) squares += s.correction_m * s.correction_m;
  run.foot_correction_m = std::sqrt(squares / static_cast<double>(run.states.size()));
  run.history = sequence->history();
  run.final_distance_m = sequence->distance_m();
  return run;
}

}  // namespace mimesis::synthesizer
