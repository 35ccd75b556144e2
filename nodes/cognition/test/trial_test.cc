#include "nodes/cognition/trial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/testing/no_malloc.h"
#include "nodes/cognition/architecture_node.h"
#include "nodes/cognition/reasons.h"

namespace mimesis::cognition {
namespace {

constexpr std::size_t kNeurons = 128;

std::vector<double> weights(const Ladder<double>& ladder, const char* c) {
  std::vector<double> all;
  for (std::size_t y = 0; y < kNeurons; ++y) {
    for (std::size_t x = 0; x < kNeurons; ++x) all.push_back(ladder.link(c).weight(x, y));
  }
  return all;
}

TEST(Trial, TaskInputAloneDecidesNothing) {
  Ladder<double> ladder(load_architecture());
  ASSERT_TRUE(rehearse(ladder, parse_sequence("precision,above,high")));
  ASSERT_TRUE(rehearse(ladder, parse_sequence("full,below,low")));
  const TrialResult r = run_trial(ladder, {.duration_s = 3.0});
  for (const Layer layer : kAllLayers) EXPECT_TRUE(std::isnan(r.onset(layer))) << layer_name(layer);
  EXPECT_EQ(r.decision, Decision{});
}

TEST(Trial, UntrainedRobotDoesNotInferTheGoal) {
  Ladder<double> ladder(load_architecture());
  const TrialResult r = run_trial(ladder, {.shown = {.grip = Grip::full}});
  EXPECT_EQ(r.site(Layer::pf), kFgBt);  // the task input names the combination
  EXPECT_EQ(r.decision.goal, Goal::unknown);
  EXPECT_FALSE(r.decision.settled);
}

TEST(Trial, RehearsalReachesTheClosedForm) {  // in the ladder, where patterns excite each other
  Ladder<double> ladder(load_architecture());
  ASSERT_TRUE(rehearse(ladder, parse_sequence("precision,above,high")));
  // ū of eq. 2.4: the stable state under the links as learned
  run_trial(ladder, {.shown = parse_sequence("precision,above,high")});
  const double local = ladder.field(Layer::pf).f2(ladder.architecture().learning.local_above);
  for (const auto& [c, source, target] : {std::tuple{"PF->PFC", Layer::pf, Layer::pfc},
                                          std::tuple{"PFC->PF", Layer::pfc, Layer::pf}}) {
    const auto r2 = ladder.field(source).rate(), r1 = ladder.field(target).rate();
    const double eta = ladder.eta(c);
    double worst = 0.0;
    for (std::size_t y = 0; y < kNeurons; ++y) {
      for (std::size_t x = 0; x < kNeurons; ++x) {
        const bool both = r1[x] >= local && r2[y] >= local;
        const double exact = both ? eta * r1[x] * r2[y] : 0.0;
        worst = std::max(worst, std::abs(ladder.link(c).weight(x, y) - exact));
      }
    }
    EXPECT_LT(worst / eta, 0.01);
  }
}

TEST(Trial, WithoutRewardTheLinksKeepEveryBit) {
  Ladder<double> ladder(load_architecture());
  ASSERT_TRUE(rehearse(ladder, parse_sequence("precision,above,high,light")));
  for (const char* c : {"PF->PFC", "PFC->PF", "COL->PFC", "PFC->COL", "STSg->PF"}) {
    const auto before = weights(ladder, c);
    run_trial(ladder, {.shown = parse_sequence("full,below,low,dark")});
    const auto after = weights(ladder, c);
    EXPECT_EQ(std::memcmp(before.data(), after.data(), before.size() * sizeof(double)), 0);
  }
}

TEST(Trial, RefusesToRehearseAgainstItsHabit) {
  Ladder<double> ladder(load_architecture());
  ASSERT_TRUE(rehearse(ladder, parse_sequence("precision,above,high")));
  const auto before = weights(ladder, "PFC->PF");
  EXPECT_FALSE(rehearse(ladder, parse_sequence("full,below,high")));
  EXPECT_EQ(weights(ladder, "PFC->PF"), before);
}

/// Largest weight of PFC->PF from the high goal to the population at one site of PF.
double link_of_high(const Ladder<double>& ladder, int site) {
  const auto at = [&](Layer layer, int s) {
    const FieldSpec& field = ladder.architecture().fields[index(layer)];
    return static_cast<std::size_t>(std::lround(site_place(field, s).x));
  };
  const std::size_t x = at(Layer::pf, site), y = at(Layer::pfc, 0);
  double largest = 0.0;
  for (std::size_t i = x - 12; i < x + 12; ++i) {
    for (std::size_t j = y - 12; j < y + 12; ++j) {
      largest = std::max(largest, ladder.link("PFC->PF").weight(i, j));
    }
  }
  return largest;
}

TEST(Trial, WhatIsOnlyPreshapedIsNotLinked) {  // the task input preshapes PG-AT and FG-BT all along
  Ladder<double> ladder(load_architecture());
  ASSERT_TRUE(rehearse(ladder, parse_sequence("full,above,high")));
  EXPECT_GT(link_of_high(ladder, kFgAt), 0.1);
  for (const int other : {kPgAt, kFgBt, kPgBt})
    EXPECT_EQ(link_of_high(ladder, other), 0.0) << other;
  ASSERT_TRUE(rehearse(ladder, parse_sequence("full,below,low")));
  const TrialResult r = run_trial(ladder, {.shown = {.grip = Grip::full}});
  EXPECT_EQ(r.site(Layer::pf), kFgBt);
  EXPECT_EQ(r.decision.goal, Goal::low);
}

TEST(Trial, StepDoesNotAllocateAndRepeatsEveryBit) {
  Ladder<float> a(load_architecture()), b(load_architecture());
  Stimulus stimulus = task_stimulus(a.architecture());
  add_vision(a.architecture(), parse_sequence("full,below,low,dark"), stimulus);
  Reasons reasons(a);
  const Stimulus task = task_stimulus(a.architecture());
  for (int i = 0; i < 300; ++i) {
    const testing::NoMalloc guard;
    reasons.observe(a, task, stimulus, "vision", 0.001 * i);
    a.step(stimulus, i > 150);
    b.step(stimulus, i > 150);
    read_decision(a);
  }
  for (const Layer layer : kAllLayers) {
    const auto ua = a.field(layer).activity(), ub = b.field(layer).activity();
    EXPECT_EQ(std::memcmp(ua.data(), ub.data(), ua.size_bytes()), 0) << layer_name(layer);
  }
  EXPECT_GT(a.link("COL->PFC").weight(96, 96), 0.0F);
  EXPECT_EQ(reasons.fields()[index(Layer::pf)].site, kFgBt);
  EXPECT_EQ(reasons.names()[reasons.fields()[index(Layer::color)].parts[0].from], "vision");
}

TEST(Trial, ParsesSequences) {
  const Demonstration d = parse_sequence("full,above,low,dark");
  EXPECT_EQ(d.grip, Grip::full);
  EXPECT_EQ(d.transport, Transport::above);
  EXPECT_EQ(d.goal, Goal::low);
  EXPECT_EQ(d.color, Color::dark);
  EXPECT_EQ(parse_sequence("precision,below,high").color, Color::unknown);
  for (const char* wrong :
       {"", "full", "full,above,low,dark,dark", "full,above,middle", "full, above,low"}) {
    EXPECT_THROW(parse_sequence(wrong), ConfigError) << wrong;
  }
}

}  // namespace
}  // namespace mimesis::cognition
