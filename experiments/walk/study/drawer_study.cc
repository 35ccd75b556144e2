#include "experiments/walk/study/drawer_study.h"

#include <cmath>

#include "experiments/walk/trial/suites.h"

namespace mimesis::walk {
namespace {

using synthesizer::kNormalStep;

constexpr int kGoals = 30, kClass = 10;
// Ranges of the dissertation's goals: the object lies the deeper, the farther the hand reaches.
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
  s.stabilizer.delay_ticks = kSensorDelayTicks + 1;
  return s;
}

void sense(DrawerTrialSpec& spec, hw::sim::Plant plant, std::size_t number) {
  SuiteOptions options(plant);
  options.body.ankle_pitch_n_m = kMostAnkle_n_m;
  options.walker.stabilizer.delay_ticks = launched_walker().stabilizer.delay_ticks;
  set_up(options, number, spec.body, spec.walker);
  spec.delay_ticks = kSensorDelayTicks;
}

DrawerTrialSpec online_spec(const Robot& robot, const synthesizer::BipedDrawer& actions,
                            const DrawerGoal& goal, hw::sim::Plant plant, std::size_t number) {
  DrawerTrialSpec spec;
  spec.robot = &robot;
  sense(spec, plant, number);
  spec.actions = &actions;
  spec.front_m = goal.front_m();
  spec.object_depth_m = goal.object_depth_m;
  synthesizer::StepPlanSettings& plan = spec.sequence.plan.emplace(actions.plan);
  plan.normal_m = goal.normal_m;
  plan.reaching_m = goal.reaching_m;
  plan.normal_half_m = plan.reaching_half_m = 0.01;  // other plans are out of the question
  plan.least_normal_m = 0.33;
  plan.longest_step_m = 0.285;
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

TrialResult walk_script(const ScriptRobot& robot, Script& script,
                        const std::function<void(const TrialTick&)>& watch) {
  walker::PatternSample plan;
  bool first = true;
  TrialSpec spec;
  spec.robot = robot.robot;
  spec.body.ankle_pitch_n_m = kMostAnkle_n_m;
  spec.walker = launched_walker();
  spec.delay_ticks = kSensorDelayTicks;
  spec.duration_s = kScript_s;
  spec.wish = [&](double) { return script.step(first ? nullptr : &plan); };
  return run_trial(spec, [&](const TrialTick& tick) {
    first = false;
    plan = tick.out.pattern;
    watch(tick);
  });
}

Outcome run_script(const ScriptRobot& robot, const ActionRows& rows, const DrawerGoal& goal,
                   const DrawerGoal& wished) {
  Script script(robot, rows, goal);
  StanceZmp zmp;
  int number = -1;
  double start_m = 0.0;
  Outcome seen;
  const TrialResult r = walk_script(robot, script, [&](const TrialTick& tick) {
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

namespace {

using synthesizer::kReachingStep;

constexpr std::size_t kNovelGoals = 30, kChosen = 8;  // numbers of training trials

synthesizer::RobotTrialSettings trial_settings() {
  synthesizer::RobotTrialSettings s;
  s.trials = 8;  // times four paces: about the 30 of the dissertation
  s.paces = {0.8, 1.2};
  return s;
}

std::vector<std::size_t> numbers_of(Goals which) {
  std::vector<std::size_t> out;
  if (which == Goals::all) {
    for (std::size_t i = 0; i < kNovelGoals; ++i) out.push_back(i);
  } else {
    for (std::size_t i = 1; i < kNovelGoals; i += 3) out.push_back(i);
  }
  return out;
}

}  // namespace

DrawerStudy& DrawerStudy::shared() {
  static DrawerStudy study;
  return study;
}

DrawerStudy::DrawerStudy()
    : biped_(load_robot("biped")),
      script_robot_(biped_),
      trials_(generate_robot_data(biped_.biped, trial_settings())) {}

const FeasibleData& DrawerStudy::feasible() {
  if (!feasible_) feasible_ = std::make_unique<FeasibleData>(make_feasible(script_robot_, trials_));
  return *feasible_;
}

const synthesizer::BipedDrawer& DrawerStudy::actions(Sources s) {
  auto& a = actions_[s];
  if (!a) {
    a = std::make_unique<synthesizer::BipedDrawer>(
        make_biped_drawer(biped_.biped, feasible().upper_body,
                          {.first_sources = s.first, .further_sources = s.further}));
  }
  return *a;
}

const synthesizer::ActionMaps& DrawerStudy::joints(Sources s, std::size_t model) {
  auto& j = joints_[{s, model}];
  if (!j) {
    j = std::make_unique<synthesizer::ActionMaps>(synthesizer::learn_drawer_model(
        feasible().joints, {.first_sources = s.first,
                            .further_sources = s.further,
                            .turns = 200,
                            .tolerance = 1e-6,
                            .seed = 1 + static_cast<std::uint32_t>(model)}));
  }
  return *j;
}

std::vector<std::size_t> DrawerStudy::chosen_trials() const {
  std::vector<std::size_t> out;
  const std::size_t n = trials_.action[0].trials.size();
  for (std::size_t i = 0; i < kChosen; ++i) out.push_back(i * n / kChosen + i % 2);
  return out;
}

template <class Run>
DrawerStudy::Outcomes DrawerStudy::known_or(const std::string& experiment,
                                            const std::vector<std::size_t>& numbers,
                                            const Run& run) {
  std::map<std::size_t, Outcome>& known = outcomes_[experiment];
  std::vector<std::size_t> missing;
  for (const std::size_t i : numbers) {
    if (!known.contains(i)) missing.push_back(i);
  }
  const Outcomes found =
      in_parallel(missing.size(), [&](std::size_t k) { return run(missing[k]); });
  for (std::size_t k = 0; k < missing.size(); ++k) known[missing[k]] = found[k];
  Outcomes out;
  for (const std::size_t i : numbers) out.push_back(known.at(i));
  return out;
}

DrawerStudy::Outcomes DrawerStudy::originals() {
  return known_or("originals", chosen_trials(), [&](std::size_t i) {
    const DrawerGoal g = goal_of(trials_, i);
    return run_script(script_robot_, rows_of(trials_, i), g, g);
  });
}

DrawerStudy::Outcomes DrawerStudy::resynthesis(Sources s) {
  const synthesizer::ActionMaps& learned = actions(s).actions;
  return known_or("resynthesis " + s.text(), chosen_trials(), [&](std::size_t i) {
    const DrawerGoal wished = goal_of(trials_, i);
    const ActionRows rows = mixed_rows(learned, reconstructed(learned, i));
    const auto travel_m = [](const Eigen::MatrixXd& r) {  // kVelocityRows are the last
      return 2.0 * kStep_s * r.row(r.rows() - 3).mean();
    };
    DrawerGoal goal = wished;  // it walks as far as the mixture says
    goal.normal_m = travel_m(rows[kNormalStep]);
    goal.reaching_m = travel_m(rows[kReachingStep]);
    return run_script(script_robot_, rows, goal, wished);
  });
}

DrawerStudy::Outcomes DrawerStudy::inference(Sources s, Goals which, hw::sim::Plant plant) {
  const synthesizer::BipedDrawer& learned = actions(s);
  const auto goals = novel_goals();
  const std::string name =
      "inference " + s.text() + (plant == hw::sim::Plant::servo ? " servo" : "");
  return known_or(name, numbers_of(which), [&](std::size_t i) {
    return run_online(online_spec(biped_, learned, goals[i], plant, i));
  });
}

DrawerStudy::Outcomes DrawerStudy::extremes() {
  const synthesizer::BipedDrawer& learned = actions(kSources[1]);
  const auto goals = extreme_goals();
  return known_or("extremes", numbers_of(Goals::all), [&](std::size_t i) {
    return run_online(online_spec(biped_, learned, goals[i], hw::sim::Plant::springs, i));
  });
}

const std::vector<Recording>& DrawerStudy::walks() {
  if (!walks_.empty()) return walks_;
  const synthesizer::ActionMaps& learned = actions(kSources[1]).actions;
  const auto goals = novel_goals();
  walks_ = in_parallel(goals.size(), [&](std::size_t i) {
    ActionRows rows = mixed_rows(learned, inferred(learned, goals[i]));
    return record(script_robot_, Script(script_robot_, std::move(rows), goals[i]));
  });
  return walks_;
}

DrawerStudy::Outcomes DrawerStudy::naive_resynthesis(Sources s, std::size_t model) {
  const synthesizer::ActionMaps& learned = joints(s, model);
  const std::string name = "naive resynthesis " + s.text() + " " + std::to_string(model);
  return known_or(name, chosen_trials(), [&](std::size_t i) {
    return played(naive_track(learned, reconstructed(learned, i), feasible_->recordings[i]), {});
  });
}

DrawerStudy::Outcomes DrawerStudy::naive_inference(Sources s, Goals which, std::size_t model,
                                                   const Playing& how) {
  const synthesizer::ActionMaps& learned = joints(s, model);
  const auto goals = novel_goals();
  const std::vector<Recording>& walk = walks();
  const std::string name =
      "naive inference " + s.text() + " " + std::to_string(model) + " " + how.text();
  return known_or(name, numbers_of(which), [&](std::size_t i) {
    return played(naive_track(learned, inferred(learned, goals[i]), walk[i]), how);
  });
}

DrawerStudy::Outcomes DrawerStudy::played_originals(const Playing& how) {
  const FeasibleData& data = feasible();
  return known_or("played originals " + how.text(), chosen_trials(),
                  [&](std::size_t i) { return played(track_of(data.recordings[i]), how); });
}

Outcome DrawerStudy::played(const JointTrack& track, const Playing& how) const {
  return outcome_of(play(biped_, track, how), {});
}

}  // namespace mimesis::walk
