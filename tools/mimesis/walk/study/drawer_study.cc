#include "tools/mimesis/walk/study/drawer_study.h"

#include <cmath>

#include "common/error.h"
#include "tools/mimesis/walk/study/parallel.h"
#include "tools/mimesis/walk/study/stance_zmp.h"

namespace mimesis::walk {
namespace {

using synthesizer::kNormalStep, synthesizer::kReachingStep, synthesizer::kStanding;

constexpr int kGoals = 30, kClass = 10;
constexpr std::size_t kChosen = 8;  // of the training trials
// Of the dissertation's goals: the object lies the deeper, the farther the hand reaches.
constexpr double kLeastDepth_m = 0.124, kMostDepth_m = 0.273;
constexpr double kLeastReach_m = 0.663, kMostReach_m = 0.755;

DrawerGoal goal(double normal_m, double reaching_m, double deep) {
  const double depth = std::lerp(kLeastDepth_m, kMostDepth_m, deep);
  return {normal_m, reaching_m, std::lerp(kLeastReach_m, kMostReach_m, deep) - depth, depth, 0.0};
}

synthesizer::RobotTrialSettings trial_settings() {
  synthesizer::RobotTrialSettings s;
  s.trials = 8;  // times four paces: about the 30 of the dissertation
  s.paces = {0.8, 1.2};
  return s;
}

Outcome outcome_of(const TrialResult& r, const StanceZmp& zmp) {
  Outcome o;
  o.fell = r.figures.fell;
  o.fell_at_s = r.fell_at_s;
  o.trouble = r.figures.fell ? r.figures.how : r.trouble;
  o.ankle_n_m = r.figures.ankle_pitch_slow_peak_n_m;
  o.normal_n = r.figures.normal_peak_n;
  o.zmp_std_m = zmp.std_m();
  return o;
}

double middle_m(const hw::sim::BodyTruth& truth) {
  return 0.5 * (truth.X_WS[0].translation().x() + truth.X_WS[1].translation().x());
}

/// Of several of its kind the last one.
void note_length(Outcome& o, synthesizer::Action action, double error_m) {
  (action == kNormalStep ? o.normal_error_m : o.reaching_error_m) = error_m;
}

}  // namespace

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

walker::WalkerSettings flat_floor() {
  walker::WalkerSettings s;
  s.stabilizer.landing_m_s_n = 1e-4;
  s.stabilizer.swing_filter_s = 0.01;
  return s;
}

DrawerTrialSpec online_spec(const Robot& robot, const synthesizer::BipedDrawer& actions,
                            const DrawerGoal& goal) {
  DrawerTrialSpec spec;
  spec.robot = &robot;
  spec.actions = &actions;
  spec.front_m = goal.front_m();
  spec.object_depth_m = goal.object_depth_m;
  synthesizer::StepPlanSettings& plan = spec.sequence.plan;
  plan.normal_m = goal.normal_m;
  plan.reaching_m = goal.reaching_m;
  plan.normal_half_m = plan.reaching_half_m = 0.01;  // other plans are out of the question
  plan.least_normal_m = 0.33;
  plan.longest_step_m = 0.285;
  spec.walker = flat_floor();
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
  o.reach_error_m = r.reach_error_m;
  for (const auto& l : r.lengths) note_length(o, l.action, l.walked_m - l.wished_m);
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
  spec.walker = flat_floor();
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

DrawerStudy& DrawerStudy::shared() {
  static DrawerStudy study;
  return study;
}

DrawerStudy::DrawerStudy()
    : biped_(load_robot("biped")),
      script_robot_(biped_, synthesizer::robot_drawer()),
      trials_(generate_robot_data(biped_.biped.tree, script_robot_.figure, script_robot_.drawer,
                                  trial_settings())) {}

const FeasibleData& DrawerStudy::feasible() {
  if (!feasible_) feasible_ = std::make_unique<FeasibleData>(make_feasible(script_robot_, trials_));
  return *feasible_;
}

const synthesizer::BipedDrawer& DrawerStudy::actions(Sources s) {
  auto& a = actions_[s];
  if (!a) {
    a = std::make_unique<synthesizer::BipedDrawer>(make_biped_drawer(
        biped_.biped.tree, script_robot_.figure, feasible().upper_body, s.first, s.further));
  }
  return *a;
}

const synthesizer::LearnedActions& DrawerStudy::joints(Sources s) {
  auto& j = joints_[s];
  if (!j) {
    j = std::make_unique<synthesizer::LearnedActions>(feasible().joints, s.first, s.further);
  }
  return *j;
}

std::vector<std::size_t> DrawerStudy::chosen_trials() const {
  std::vector<std::size_t> out;
  const std::size_t n = trials_.action[0].trials.size();
  for (std::size_t i = 0; i < kChosen; ++i) out.push_back(i * n / kChosen + i % 2);
  return out;
}

const DrawerStudy::Outcomes& DrawerStudy::originals() {
  Outcomes& o = outcomes_["originals"];
  if (!o.empty()) return o;
  const auto chosen = chosen_trials();
  return o = in_parallel(chosen.size(), [&](std::size_t i) {
           const DrawerGoal g = goal_of(trials_, chosen[i]);
           return run_script(script_robot_, rows_of(trials_, chosen[i]), g, g);
         });
}

const DrawerStudy::Outcomes& DrawerStudy::resynthesis(Sources s) {
  Outcomes& o = outcomes_["resynthesis " + s.text()];
  if (!o.empty()) return o;
  const synthesizer::LearnedActions& learned = actions(s).actions;
  const auto chosen = chosen_trials();
  return o = in_parallel(chosen.size(), [&](std::size_t i) {
           const DrawerGoal wished = goal_of(trials_, chosen[i]);
           const ActionRows rows{learned.reconstruct(kNormalStep, chosen[i]),
                                 learned.reconstruct(kReachingStep, chosen[i]),
                                 learned.reconstruct(kStanding, chosen[i])};
           DrawerGoal goal = wished;  // it walks as far as the mixture says
           goal.normal_m = synthesizer::travel_m(learned.rows(), rows[kNormalStep], 2.0 * kStep_s);
           goal.reaching_m =
               synthesizer::travel_m(learned.rows(), rows[kReachingStep], 2.0 * kStep_s);
           return run_script(script_robot_, rows, goal, wished);
         });
}

const DrawerStudy::Outcomes& DrawerStudy::inference(Sources s) {
  Outcomes& o = outcomes_["inference " + s.text()];
  if (!o.empty()) return o;
  const synthesizer::BipedDrawer& learned = actions(s);
  const auto goals = novel_goals();
  const std::size_t every = s == kSources[1] ? 1 : 3;
  return o = in_parallel(goals.size() / every, [&](std::size_t i) {
           return run_online(online_spec(biped_, learned, goals[i * every + every / 2]));
         });
}

const DrawerStudy::Outcomes& DrawerStudy::extremes() {
  Outcomes& o = outcomes_["extremes"];
  if (!o.empty()) return o;
  const synthesizer::BipedDrawer& learned = actions(kSources[1]);
  const auto goals = extreme_goals();
  return o = in_parallel(goals.size(), [&](std::size_t i) {
           return run_online(online_spec(biped_, learned, goals[i]));
         });
}

const std::vector<Recording>& DrawerStudy::walks() {
  if (!walks_.empty()) return walks_;
  const synthesizer::LearnedActions& learned = actions(kSources[1]).actions;
  const auto goals = novel_goals();
  walks_ = in_parallel(goals.size(), [&](std::size_t i) {
    synthesizer::ActionTask task = goals[i].task();
    ActionRows rows;
    task.length_m = goals[i].normal_m;
    rows[kNormalStep] = learned.infer(kNormalStep, task);
    task.length_m = goals[i].reaching_m;
    task.previous_length_m = goals[i].normal_m;
    rows[kReachingStep] = learned.infer(kReachingStep, task);
    rows[kStanding] = learned.infer(kStanding, goals[i].task());
    return record(script_robot_, Script(script_robot_, std::move(rows), goals[i]));
  });
  return walks_;
}

const DrawerStudy::Outcomes& DrawerStudy::naive_resynthesis(Sources s) {
  Outcomes& o = outcomes_["naive resynthesis " + s.text()];
  if (!o.empty()) return o;
  const synthesizer::LearnedActions& learned = joints(s);
  const auto chosen = chosen_trials();
  return o = in_parallel(chosen.size(), [&](std::size_t i) {
           const JointTrack track = naive_track(learned, reconstructed(learned, chosen[i]),
                                                feasible_->recordings[chosen[i]]);
           return outcome_of(play(biped_, track, Feedback::kOwn, flat_floor().stabilizer), {});
         });
}

const DrawerStudy::Outcomes& DrawerStudy::naive_inference(Sources s, Feedback feedback) {
  Outcomes& o =
      outcomes_["naive inference " + s.text() + (feedback == Feedback::kOwn ? " own" : "")];
  if (!o.empty()) return o;
  const synthesizer::LearnedActions& learned = joints(s);
  const auto goals = novel_goals();
  const std::vector<Recording>& walk = walks();
  return o = in_parallel(goals.size(), [&](std::size_t i) {
           const JointTrack track = naive_track(learned, inferred(learned, goals[i]), walk[i]);
           return outcome_of(play(biped_, track, feedback, flat_floor().stabilizer), {});
         });
}

const DrawerStudy::Outcomes& DrawerStudy::played_originals(Feedback feedback) {
  Outcomes& o = outcomes_[feedback == Feedback::kOwn ? "played originals own" : "played originals"];
  if (!o.empty()) return o;
  const FeasibleData& data = feasible();
  const auto chosen = chosen_trials();
  return o = in_parallel(chosen.size(), [&](std::size_t i) {
           return outcome_of(play(biped_, track_of(data.recordings[chosen[i]]), feedback,
                                  flat_floor().stabilizer),
                             {});
         });
}

}  // namespace mimesis::walk
