#include "experiments/walk/study/velocity_study.h"

#include "common/error.h"
#include "common/math/circle.h"
#include "common/math/so3.h"
#include "experiments/walk/trial/suites.h"
#include "nodes/synthesizer/sequence/action_course.h"

namespace mimesis::walk {
namespace {

using synthesizer::kNormalStep, synthesizer::kReachingStep;

Eigen::Vector2d middle_of_feet(const hw::sim::BodyTruth& truth) {
  return 0.5 * (truth.X_WS[0].translation() + truth.X_WS[1].translation()).head<2>();
}

double heading_of_feet(const hw::sim::BodyTruth& truth) {
  return 0.5 * (math::yaw_of(truth.X_WS[0].linear()) + math::yaw_of(truth.X_WS[1].linear()));
}

/// Rows that the mixtures of the three actions make, as many samples as were learned from.
ActionRows mixed_rows(const synthesizer::ActionMaps& maps, const ActionParameters& actions) {
  ActionRows out;
  for (std::size_t a = 0; a < out.size(); ++a) {
    const motion::MotionModel& model = maps.model().action[a];
    const Eigen::Index samples = model.sources.cols();
    out[a].resize(actions[a].mean_rad.size(), samples);
    for (Eigen::Index t = 0; t < samples; ++t) {
      const double phase_rad = math::kTwoPi * static_cast<double>(t) / static_cast<double>(samples);
      synthesizer::mixture_at(model, actions[a], phase_rad, synthesizer::Between::cubic,
                              out[a].col(t));
    }
  }
  return out;
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
  walker::PatternSample plan;
  bool first = true, reached = false;
  int number = -1;
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  FreeWalk out;
  const double none = std::nan("");
  out.came = {Eigen::Vector2d::Constant(none), Eigen::Vector2d::Constant(none),
              Eigen::Vector3d::Constant(none), none};
  TrialSpec spec;
  spec.robot = robot.robot;
  spec.walker = launched_walker();
  spec.delay_ticks = kSensorDelayTicks;
  spec.duration_s = kScript_s;
  spec.wish = [&](double) { return script.step(first ? nullptr : &plan); };
  const TrialResult r = run_trial(spec, [&](const TrialTick& tick) {
    first = false;
    plan = tick.out.pattern;
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
  return in_parallel(between.size(), [&](std::size_t k) {
    const auto& [i, j] = between[k];
    const DrawerGoal a = goal_of(*trials_, i), b = goal_of(*trials_, j);
    const DrawerGoal goal{0.5 * (a.normal_m + b.normal_m), 0.5 * (a.reaching_m + b.reaching_m),
                          0.5 * (a.final_distance_m + b.final_distance_m),
                          0.5 * (a.object_depth_m + b.object_depth_m),
                          0.5 * (a.object_lateral_m + b.object_lateral_m)};
    FreeWalk walk = walk_free(*robot_, mixed_rows(learned, inferred(learned, goal)));
    walk.came = walk.came - middle(labels_[i], labels_[j]);
    return walk;
  });
}

}  // namespace mimesis::walk
