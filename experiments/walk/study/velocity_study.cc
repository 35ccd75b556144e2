#include "experiments/walk/study/velocity_study.h"

#include "common/error.h"
#include "common/math/so3.h"
#include "common/robot/kinematics.h"
#include "experiments/walk/trial/suites.h"
#include "nodes/synthesizer/sequence/action_course.h"

namespace mimesis::walk {
namespace {

using synthesizer::kNormalStep, synthesizer::kReachingStep, synthesizer::kStanding;

Eigen::Vector2d middle_of_feet(const hw::sim::BodyTruth& truth) {
  return 0.5 * (truth.X_WS[0].translation() + truth.X_WS[1].translation()).head<2>();
}

double heading_of_feet(const hw::sim::BodyTruth& truth) {
  return 0.5 * (math::yaw_of(truth.X_WS[0].linear()) + math::yaw_of(truth.X_WS[1].linear()));
}

/// Right hand of the mixture at the end of its way, as the pelvis sees it.
Eigen::Vector3d hand_B_m(const ScriptRobot& robot, const synthesizer::ActionMaps& maps,
                         const synthesizer::MotionParameters& standing) {
  const Eigen::MatrixXd rows = synthesizer::mixture_rows(maps.model().action[kStanding], standing);
  robot::Kinematics kinematics(robot.upper);
  kinematics.update(Eigen::Isometry3d::Identity(),
                    at_phase(rows, kArrives).head(robot.upper.dof()));
  const int wrist = robot.upper.require_link(robot.figure.wrist[robot::kRight]);
  return kinematics.X_WL(wrist) * robot.figure.hand_m[robot::kRight];
}

/// hand_B_m() of the training trials by their task, with the joints' wide kernel.
synthesizer::LocalRegression learned_hands(const ScriptRobot& robot,
                                           const synthesizer::ActionMaps& maps) {
  const auto& patterns = maps.model().action[kStanding].patterns;
  Eigen::MatrixXd task(std::ssize(patterns), 4), hand(std::ssize(patterns), 3);
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    task.row(row) = maps.inputs(kStanding, maps.task_of(kStanding, i));
    hand.row(row) = hand_B_m(robot, maps, synthesizer::parameters_of(patterns[i]));
  }
  return {task, hand, {.bandwidth = 4.0, .ridge = 1e-3}};
}

/// Joints between those of trials have the hand beside the place between its places, for it moves
/// on curves: the map is asked for a goal as far on the other side.
ActionParameters with_hand_at(const ScriptRobot& robot, const synthesizer::ActionMaps& maps,
                              const synthesizer::LocalRegression& hands, DrawerGoal goal) {
  constexpr int kTurns = 4;  // each leaves about a quarter
  const Eigen::Vector3d wished = hands.at(maps.inputs(kStanding, goal.task())).value;
  for (int k = 0; k < kTurns; ++k) {
    const Eigen::Vector3d off = wished - hand_B_m(robot, maps, inferred(maps, goal)[kStanding]);
    goal.final_distance_m += off.x();
    goal.object_lateral_m += off.y();
  }
  return inferred(maps, goal);
}

}  // namespace

Places operator-(const Places& a, const Places& b) {
  return {a.normal_m - b.normal_m, a.reaching_m - b.reaching_m, a.reach_m - b.reach_m,
          a.heading_rad - b.heading_rad};
}

Places middle(const Places& a, const Places& b) {
  return {0.5 * (a.normal_m + b.normal_m), 0.5 * (a.reaching_m + b.reaching_m),
          0.5 * (a.reach_m + b.reach_m), 0.5 * (a.heading_rad + b.heading_rad)};
}

FreeWalk walk_free(const ScriptRobot& robot, const ActionRows& rows) {
  Script script(robot, rows, {}, {.feet = false, .hands = false});
  bool reached = false;
  int number = -1;
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  FreeWalk out;
  const double none = std::nan("");
  out.came = {Eigen::Vector2d::Constant(none), Eigen::Vector2d::Constant(none),
              Eigen::Vector3d::Constant(none), none};
  const TrialResult r = walk_script(robot, script, [&](const TrialTick& tick) {
    const Eigen::Vector2d middle = middle_of_feet(tick.truth);
    if (script.number() != number) {
      if (number == 1) out.came.normal_m = middle - start;
      if (number == 2) out.came.reaching_m = middle - start;
      number = script.number();
      start = middle;
    }
    if (number == 3 && !reached && script.phase() >= kArrives) {
      reached = true;
      out.came.reach_m = tick.truth.hand_W_m[robot::kRight];
      out.came.reach_m.head<2>() -= middle;
      out.came.heading_rad = heading_of_feet(tick.truth);
    }
  });
  out.fell = r.figures.fell;
  out.trouble = r.figures.fell ? r.figures.how : r.trouble;
  return out;
}

const synthesizer::DrawerData& VelocityStudy::trials() {
  if (trials_) return *trials_;
  trials_ = std::make_unique<synthesizer::DrawerData>(
      make_feasible(*robot_, *kinematic_, {.feet = false}).upper_body);
  const auto walks = in_parallel(trials_->action[0].trials.size(), [&](std::size_t i) {
    return walk_free(*robot_, rows_of(*trials_, i));
  });
  for (std::size_t i = 0; i < walks.size(); ++i) {
    const Places& came = walks[i].came;
    if (walks[i].fell || !came.reach_m.allFinite())
      throw ConfigError("free walk of trial " + std::to_string(i) + ": " + walks[i].trouble);
    labels_.push_back({{came.normal_m.x(), 0.0}, {came.reaching_m.x(), 0.0}, came.reach_m, 0.0});
    trials_->action[kNormalStep].trials[i].step_length_m = came.normal_m.x();
    trials_->action[kReachingStep].trials[i].step_length_m = came.reaching_m.x();
    for (mocap::Trials& action : trials_->action) {
      std::vector<double>& task = action.trials[i].task;
      task.at(1) = came.reach_m.x() + kinematic_->drawer.pull_m - task.at(2);
      task.at(3) = came.reach_m.y();
    }
  }
  return *trials_;
}

const synthesizer::ActionMaps& VelocityStudy::maps(Sources s) {
  auto& m = maps_[s];
  if (!m) {
    m = std::make_unique<synthesizer::ActionMaps>(synthesizer::learn_drawer_model(
        trials(), {.first_sources = s.first, .further_sources = s.further}));
  }
  return *m;
}

std::vector<FreeWalk> VelocityStudy::resynthesis(Sources sources,
                                                 const std::vector<std::size_t>& numbers) {
  const synthesizer::ActionMaps& learned = maps(sources);
  return in_parallel(numbers.size(), [&](std::size_t k) {
    const std::size_t i = numbers[k];
    FreeWalk walk = walk_free(*robot_, mixed_rows(learned, reconstructed(learned, i)));
    walk.came = walk.came - labels_[i];
    return walk;
  });
}

std::vector<FreeWalk> VelocityStudy::inference(Sources sources, const std::vector<Pair>& between) {
  const synthesizer::ActionMaps& learned = maps(sources);
  const synthesizer::LocalRegression hands = learned_hands(*robot_, learned);
  return in_parallel(between.size(), [&](std::size_t k) {
    const auto& [i, j] = between[k];
    const DrawerGoal a = goal_of(*trials_, i), b = goal_of(*trials_, j);
    const DrawerGoal goal{0.5 * (a.normal_m + b.normal_m), 0.5 * (a.reaching_m + b.reaching_m),
                          0.5 * (a.final_distance_m + b.final_distance_m),
                          0.5 * (a.object_depth_m + b.object_depth_m),
                          0.5 * (a.object_lateral_m + b.object_lateral_m)};
    FreeWalk walk =
        walk_free(*robot_, mixed_rows(learned, with_hand_at(*robot_, learned, hands, goal)));
    walk.came = walk.came - middle(labels_[i], labels_[j]);
    return walk;
  });
}

}  // namespace mimesis::walk
