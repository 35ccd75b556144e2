#include "experiments/walk/study/drawer_study.h"

#include "experiments/walk/study/parallel.h"

namespace mimesis::walk {
namespace {

using synthesizer::kNormalStep, synthesizer::kReachingStep, synthesizer::kStanding;

constexpr std::size_t kGoals = 30, kChosen = 8;  // of the training trials

synthesizer::RobotTrialSettings trial_settings() {
  synthesizer::RobotTrialSettings s;
  s.trials = 8;  // times four paces: about the 30 of the dissertation
  s.paces = {0.8, 1.2};
  return s;
}

std::vector<std::size_t> numbers_of(Goals which) {
  std::vector<std::size_t> out;
  if (which == Goals::kAll) {
    for (std::size_t i = 0; i < kGoals; ++i) out.push_back(i);
  } else {
    for (std::size_t i = 1; i < kGoals; i += 3) out.push_back(i);
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

const synthesizer::LearnedActions& DrawerStudy::joints(Sources s, std::size_t model) {
  auto& j = joints_[{s, model}];
  if (!j) {
    j = std::make_unique<synthesizer::LearnedActions>(
        feasible().joints,
        synthesizer::DrawerModelOptions{.first_sources = s.first,
                                        .further_sources = s.further,
                                        .turns = 200,
                                        .tolerance = 1e-6,
                                        .seed = 1 + static_cast<std::uint32_t>(model)});
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
  const synthesizer::LearnedActions& learned = actions(s).actions;
  return known_or("resynthesis " + s.text(), chosen_trials(), [&](std::size_t i) {
    const DrawerGoal wished = goal_of(trials_, i);
    const ActionRows rows{learned.reconstruct(kNormalStep, i),
                          learned.reconstruct(kReachingStep, i), learned.reconstruct(kStanding, i)};
    DrawerGoal goal = wished;  // it walks as far as the mixture says
    goal.normal_m = synthesizer::travel_m(learned.rows(), rows[kNormalStep], 2.0 * kStep_s);
    goal.reaching_m = synthesizer::travel_m(learned.rows(), rows[kReachingStep], 2.0 * kStep_s);
    return run_script(script_robot_, rows, goal, wished);
  });
}

DrawerStudy::Outcomes DrawerStudy::inference(Sources s, Goals which, hw::sim::Plant plant) {
  const synthesizer::BipedDrawer& learned = actions(s);
  const auto goals = novel_goals();
  const std::string name =
      "inference " + s.text() + (plant == hw::sim::Plant::kServo ? " servo" : "");
  return known_or(name, numbers_of(which), [&](std::size_t i) {
    return run_online(online_spec(biped_, learned, goals[i], plant));
  });
}

DrawerStudy::Outcomes DrawerStudy::extremes() {
  const synthesizer::BipedDrawer& learned = actions(kSources[1]);
  const auto goals = extreme_goals();
  return known_or("extremes", numbers_of(Goals::kAll), [&](std::size_t i) {
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

DrawerStudy::Outcomes DrawerStudy::naive_resynthesis(Sources s, std::size_t model) {
  const synthesizer::LearnedActions& learned = joints(s, model);
  const std::string name = "naive resynthesis " + s.text() + " " + std::to_string(model);
  return known_or(name, chosen_trials(), [&](std::size_t i) {
    return played(naive_track(learned, reconstructed(learned, i), feasible_->recordings[i]));
  });
}

DrawerStudy::Outcomes DrawerStudy::naive_inference(Sources s, Goals which, std::size_t model) {
  const synthesizer::LearnedActions& learned = joints(s, model);
  const auto goals = novel_goals();
  const std::vector<Recording>& walk = walks();
  const std::string name = "naive inference " + s.text() + " " + std::to_string(model);
  return known_or(name, numbers_of(which), [&](std::size_t i) {
    return played(naive_track(learned, inferred(learned, goals[i]), walk[i]));
  });
}

DrawerStudy::Outcomes DrawerStudy::played_originals() {
  const FeasibleData& data = feasible();
  return known_or("played originals", chosen_trials(),
                  [&](std::size_t i) { return played(track_of(data.recordings[i])); });
}

Outcome DrawerStudy::played(const JointTrack& track) const {
  return outcome_of(play(biped_, track, Feedback::kOwn), {});
}

}  // namespace mimesis::walk
