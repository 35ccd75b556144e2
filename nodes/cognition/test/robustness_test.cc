#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "nodes/cognition/trial.h"

namespace mimesis::cognition {
namespace {

/// Site of each layer's peak at the end, -1 without one.
using Sites = std::array<int, kLayers>;

template <class Real>
Sites outcome(Ladder<Real>& ladder, const Trial& trial) {
  const TrialResult r = run_trial(ladder, trial);
  Sites sites{};
  for (const Layer layer : kAllLayers) sites[index(layer)] = r.site(layer);
  return sites;
}

/// The six situations of M18 2.4.1 to 2.4.3: copy twice, infer, override, attend to the means or
/// not.
template <class Real>
std::vector<Sites> imitation(const LadderParams& params, double weak) {
  Ladder<Real> ladder(params);
  for (int s = 0; s < 2; ++s) {
    ladder.install(Connection::pf_pfc, s, s);
    ladder.install(Connection::pfc_pf, s, s);
  }
  const TaskInput task = params.task;
  std::vector<Sites> all;
  all.push_back(outcome(ladder, {.shown = parse_sequence("precision,above,high"), .task = task}));
  all.push_back(outcome(ladder, {.shown = parse_sequence("full,below,low"), .task = task}));
  all.push_back(outcome(ladder, {.shown = {.grip = Grip::full}, .task = task}));
  all.push_back(outcome(ladder, {.shown = parse_sequence("full,above,high"), .task = task}));
  ladder.install(Connection::pfc_pf, 0, kFgBt, weak);
  for (const double pfc : {task.pfc, 0.0}) {
    all.push_back(outcome(
        ladder, {.shown = parse_sequence("full,below,high"), .task = {.pf = 0.0, .pfc = pfc}}));
  }
  return all;
}

/// STSg STSt PF F5g F5t PFC COL
const std::vector<Sites> kExpected = {{0, 0, kPgAt, 0, 0, 0, -1},  {1, 1, kFgBt, 1, 1, 1, -1},
                                      {1, -1, kFgBt, 1, 1, 1, -1}, {1, 0, kPgAt, 0, 0, 0, -1},
                                      {1, 1, kPgAt, 0, 0, 0, -1},  {1, 1, kFgBt, 1, 1, 0, -1}};

/// Colour and goal trigger each other, after practice.
template <class Real>
std::vector<Sites> color(const LadderParams& params) {
  Ladder<Real> ladder(params);
  EXPECT_TRUE(rehearse(ladder, parse_sequence("precision,above,high,light")));
  EXPECT_TRUE(rehearse(ladder, parse_sequence("full,below,low,dark")));
  return {outcome(ladder, {.shown = {.color = Color::light}}),
          outcome(ladder, {.shown = {.color = Color::dark}}),
          outcome(ladder, {.shown = {.goal = Goal::high}}),
          outcome(ladder, {.shown = {.goal = Goal::low}})};
}

TEST(Robustness, DecisionsDependNeitherOnTheStepNorOnThePrecision) {
  const std::vector<Sites> colors = {{-1, -1, kPgAt, 0, 0, 0, 0},
                                     {-1, -1, kFgBt, 1, 1, 1, 1},
                                     {-1, -1, kPgAt, 0, 0, 0, 0},
                                     {-1, -1, kFgBt, 1, 1, 1, 1}};
  for (const double dt_s : {0.001, 0.002, 0.005}) {
    LadderParams params;
    params.dt_s = dt_s;
    EXPECT_EQ(imitation<double>(params, 0.2), kExpected) << dt_s;
    EXPECT_EQ(imitation<float>(params, 0.2), kExpected) << dt_s;
    EXPECT_EQ(color<double>(params), colors) << dt_s;
    EXPECT_EQ(color<float>(params), colors) << dt_s;
  }
}

/// Normal deviate by Box and Muller: std::normal_distribution differs between libraries.
double normal(std::mt19937& random) {
  const auto uniform = [&] { return (static_cast<double>(random()) + 0.5) / 4294967296.0; };
  const double radius = std::sqrt(-2.0 * std::log(uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

struct Survivors {
  int imitation = 0;  ///< sets that keep the decisions of figs. 2.17, 2.18, 2.20 and 2.21
  int all = 0;        ///< sets in which also both ends of fig. 2.19 hold
};

/// Tries `sets` sets of constants with ten gains jittered by `spread`.
Survivors survivors(int sets, double spread) {
  Survivors kept;
  for (int i = 0; i < sets; ++i) {
    std::mt19937 random(static_cast<unsigned>(i + 1));
    LadderParams p;
    p.dt_s = 0.002;
    double weak = 0.2;
    for (double* gain :
         {&p.gain.sts_to_pf, &p.gain.sts_to_f5, &p.gain.pf_to_f5, &p.gain.pf_to_pfc,
          &p.gain.pfc_to_pf, &p.vision.sts, &p.vision.pfc, &p.task.pf, &p.task.pfc, &weak}) {
      *gain *= 1.0 + spread * normal(random);
    }
    const auto decisions = imitation<float>(p, weak);
    kept.imitation +=
        std::equal(decisions.begin(), decisions.begin() + 4, kExpected.begin()) ? 1 : 0;
    kept.all += decisions == kExpected ? 1 : 0;
  }
  return kept;
}

TEST(Robustness, DecisionsSurviveJitteredGains) {
  const Survivors two_percent = survivors(10, 0.02), five_percent = survivors(20, 0.05);
  EXPECT_EQ(two_percent.all, 10);
  EXPECT_EQ(five_percent.imitation, 20);
  // Fig. 2.19 is a race that the text tunes by hand: of 100 sets 83 keep both ends.
  EXPECT_GE(five_percent.all, 15);
  RecordProperty("kept_of_20_at_5_percent", five_percent.all);
}

}  // namespace
}  // namespace mimesis::cognition
