#include "experiments/walk/study/drawer_runs.h"

#include <cmath>

namespace mimesis::walk {
namespace {

using synthesizer::kNormalStep;

constexpr int kGoals = 30, kClass = 10;
// Of the dissertation's goals: the object lies the deeper, the farther the hand reaches.
constexpr double kLeastDepth_m = 0.124, kMostDepth_m = 0.273;
constexpr double kLeastReach_m = 0.663, kMostReach_m = 0.755;

DrawerGoal goal(double normal_m, double reaching_m, double deep) {
  const double depth = std::lerp(kLeastDepth_m, kMostDepth_m, deep);
  return {normal_m, reaching_m, std::lerp(kLeastReach_m, kMostReach_m, deep) - depth, depth, 0.0};
}

double middle_m(const hw::sim::BodyTruth& truth) {
  return 0.5 * (truth.X_WS[0].translation().x() + truth.X_WS[1].translation().x());
}

}  // namespace

void Outcome::note_length(synthesizer::Action action, double error_m) {
  double& worst = action == kNormalStep ? normal_error_m : reaching_error_m;
  if (!(std::abs(worst) >= std::abs(error_m))) worst = error_m;  // NaN: none yet
}

Outcome outcome_of(const TrialResult& r, const StanceZmp& zmp) {
  Outcome o;
  o.fell = r.figures.fell;
  o.fell_at_s = r.fell_at_s;
  o.trouble = r.figures.fell ? r.figures.how : r.trouble;
  o.ankle_n_m = r.figures.ankle_pitch_slow_peak_n_m;
  o.normal_n = r.figures.normal_peak_n;
  if (r.figures.steps == 0) return o;
  o.zmp_std_m = zmp.std_m();
  o.step_error_m = r.figures.step_error_max_m;
  return o;
}

std::vector<DrawerGoal> novel_goals() {
  std::vector<DrawerGoal> out;
  for (int i = 0; i < kGoals; ++i) {
    const double pace = std::array{0.8, 1.0, 1.2}[static_cast<std::size_t>(i / kClass)];
    const auto share = [&](int stride) { return ((i % kClass) * stride % kClass + 0.5) / kClass; };
    out.push_back(goal(pace * std::lerp(0.423, 0.465, share(1)),
                       pace * std::lerp(0.21, 0.293, share(3)), share(7)));
  }
  return out;
}

std::vector<DrawerGoal> extreme_goals() {
  std::vector<DrawerGoal> out;
  for (int i = 0; i < kGoals; ++i) {
    const double u = static_cast<double>(i) / (kGoals - 1);
    out.push_back(goal(std::lerp(0.505, 0.561, u), std::lerp(0.163, 0.359, u), u));
  }
  return out;
}

walker::WalkerSettings launched_walker() {
  walker::WalkerSettings s;
  s.stabilizer.delay_ticks = 5;
  return s;
}

DrawerTrialSpec online_spec(const Robot& robot, const synthesizer::BipedDrawer& actions,
                            const DrawerGoal& goal, hw::sim::Plant plant) {
  DrawerTrialSpec spec;
  spec.robot = &robot;
  spec.body.plant = plant;
  spec.actions = &actions;
  spec.front_m = goal.front_m();
  spec.object_depth_m = goal.object_depth_m;
  synthesizer::StepPlanSettings& plan = spec.sequence.plan.emplace(actions.plan);
  plan.normal_m = goal.normal_m;
  plan.reaching_m = goal.reaching_m;
  plan.normal_half_m = plan.reaching_half_m = 0.01;  // other plans are out of the question
  plan.least_normal_m = 0.33;
  plan.longest_step_m = 0.285;
  spec.walker = launched_walker();
  spec.delay_ticks = kSensorDelayTicks;
  return spec;
}

Outcome run_online(const DrawerTrialSpec& spec,
                   const std::function<void(const DrawerTick&)>& watch) {
  StanceZmp zmp;
  const DrawerResult r = run_drawer_trial(spec, [&](const DrawerTick& tick) {
    zmp.tick(tick.trial.out, tick.trial.truth);
    if (watch) watch(tick);
  });
  Outcome o = outcome_of(r.walk, zmp);
  o.taken = r.taken;
  if (!r.taken && !o.fell) o.trouble = r.refused;
  if (r.taken) o.reach_error_m = r.reach_error_m;
  for (const auto& l : r.lengths) o.note_length(l.action, l.walked_m - l.wished_m);
  return o;
}

Outcome run_script(const ScriptRobot& robot, const ActionRows& rows, const DrawerGoal& goal,
                   const DrawerGoal& wished) {
  Script script(robot, rows, goal);
  StanceZmp zmp;
  walker::PatternSample plan;
  bool first = true;
  int number = -1;
  double start_m = 0.0;
  Outcome seen;
  TrialSpec spec;
  spec.robot = robot.robot;
  spec.walker = launched_walker();
  spec.delay_ticks = kSensorDelayTicks;
  spec.duration_s = kScript_s;
  spec.wish = [&](double) { return script.step(first ? nullptr : &plan); };
  const TrialResult r = run_trial(spec, [&](const TrialTick& tick) {
    first = false;
    plan = tick.out.pattern;
    zmp.tick(tick.out, tick.truth);
    if (script.number() != number) {
      const double middle = middle_m(tick.truth);
      if (number == 1) seen.normal_error_m = middle - start_m - wished.normal_m;
      if (number == 2) seen.reaching_error_m = middle - start_m - wished.reaching_m;
      number = script.number();
      start_m = middle;
    }
    if (number == 3 && !seen.taken && script.phase() >= kArrives) {
      seen.taken = true;
      const double reach = tick.truth.hand_W_m[robot::kRight].x() - middle_m(tick.truth);
      seen.reach_error_m = reach + robot.drawer.pull_m - wished.reach_m();
    }
  });
  Outcome o = outcome_of(r, zmp);
  o.taken = seen.taken;
  o.normal_error_m = seen.normal_error_m;
  o.reaching_error_m = seen.reaching_error_m;
  o.reach_error_m = seen.reach_error_m;
  return o;
}

}  // namespace mimesis::walk
