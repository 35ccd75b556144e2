#include "nodes/cognition/trial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "common/error.h"
#include "common/testing/no_malloc.h"
#include "nodes/cognition/imitator.h"
#include "nodes/cognition/network_file.h"

namespace mimesis::cognition {
namespace {

constexpr std::size_t kNeurons = 128;

std::vector<double> weights(const FieldNetwork<double>& network, const char* c) {
  std::vector<double> all;
  for (std::size_t y = 0; y < kNeurons; ++y) {
    for (std::size_t x = 0; x < kNeurons; ++x) all.push_back(network.link(c).weight(x, y));
  }
  return all;
}

TEST(Trial, TaskInputAloneDecidesNothing) {
  FieldNetwork<double> network(load_network());
  ASSERT_TRUE(rehearse(network, task::parse_demonstration("precision,above,high")));
  ASSERT_TRUE(rehearse(network, task::parse_demonstration("full,below,low")));
  const TrialResult r = run_trial(network, {.duration_s = 3.0});
  for (const Layer layer : kAllLayers) EXPECT_TRUE(std::isnan(r.onset(layer))) << layer_name(layer);
  EXPECT_EQ(r.decision, Decision{});
}

TEST(Trial, UntrainedRobotDoesNotInferTheGoal) {
  FieldNetwork<double> network(load_network());
  const TrialResult r = run_trial(network, {.shown = {.grip = Grip::full}});
  EXPECT_EQ(r.site(Layer::pf), kFgBt);  // the task input names the combination
  EXPECT_EQ(r.decision.goal, Goal::unknown);
  EXPECT_FALSE(r.decision.settled);
}

TEST(Trial, RehearsalReachesTheClosedForm) {  // in the network, where patterns excite each other
  FieldNetwork<double> network(load_network());
  ASSERT_TRUE(rehearse(network, task::parse_demonstration("precision,above,high")));
  // ū of eq. 2.4: the stable state under the links as learned
  run_trial(network, {.shown = task::parse_demonstration("precision,above,high")});
  const double local = network.field(Layer::pf).f2(network.spec().learning.local_above);
  for (const auto& [c, source, target] : {std::tuple{"PF->PFC", Layer::pf, Layer::pfc},
                                          std::tuple{"PFC->PF", Layer::pfc, Layer::pf}}) {
    const auto r2 = network.field(source).rate(), r1 = network.field(target).rate();
    const double eta = network.eta(c);
    double worst = 0.0;
    for (std::size_t y = 0; y < kNeurons; ++y) {
      for (std::size_t x = 0; x < kNeurons; ++x) {
        const bool both = r1[x] >= local && r2[y] >= local;
        const double exact = both ? eta * r1[x] * r2[y] : 0.0;
        worst = std::max(worst, std::abs(network.link(c).weight(x, y) - exact));
      }
    }
    EXPECT_LT(worst / eta, 0.01);
  }
}

TEST(Trial, WithoutRewardTheLinksKeepEveryBit) {
  FieldNetwork<double> network(load_network());
  ASSERT_TRUE(rehearse(network, task::parse_demonstration("precision,above,high,light")));
  for (const char* c : {"PF->PFC", "PFC->PF", "COL->PFC", "PFC->COL", "STSg->PF"}) {
    const auto before = weights(network, c);
    run_trial(network, {.shown = task::parse_demonstration("full,below,low,dark")});
    const auto after = weights(network, c);
    EXPECT_EQ(std::memcmp(before.data(), after.data(), before.size() * sizeof(double)), 0);
  }
}

TEST(Trial, RefusesToRehearseAgainstItsHabit) {
  FieldNetwork<double> network(load_network());
  ASSERT_TRUE(rehearse(network, task::parse_demonstration("precision,above,high")));
  const auto before = weights(network, "PFC->PF");
  EXPECT_FALSE(rehearse(network, task::parse_demonstration("full,below,high")));
  EXPECT_EQ(weights(network, "PFC->PF"), before);
}

/// Largest weight of PFC->PF from the high goal to the population at one site of PF.
double link_of_high(const FieldNetwork<double>& network, int site) {
  const auto at = [&](Layer layer, int s) {
    const FieldSpec& field = network.spec().fields[index(layer)];
    return static_cast<std::size_t>(std::lround(site_place(field, s).x));
  };
  const std::size_t x = at(Layer::pf, site), y = at(Layer::pfc, 0);
  double largest = 0.0;
  for (std::size_t i = x - 12; i < x + 12; ++i) {
    for (std::size_t j = y - 12; j < y + 12; ++j) {
      largest = std::max(largest, network.link("PFC->PF").weight(i, j));
    }
  }
  return largest;
}

TEST(Trial, WhatIsOnlyPreshapedIsNotLinked) {  // the task input preshapes PG-AT and FG-BT all along
  FieldNetwork<double> network(load_network());
  ASSERT_TRUE(rehearse(network, task::parse_demonstration("full,above,high")));
  EXPECT_GT(link_of_high(network, kFgAt), 0.1);
  for (const int other : {kPgAt, kFgBt, kPgBt})
    EXPECT_EQ(link_of_high(network, other), 0.0) << other;
  ASSERT_TRUE(rehearse(network, task::parse_demonstration("full,below,low")));
  const TrialResult r = run_trial(network, {.shown = {.grip = Grip::full}});
  EXPECT_EQ(r.site(Layer::pf), kFgBt);
  EXPECT_EQ(r.decision.goal, Goal::low);
}

TEST(Trial, StepDoesNotAllocateAndRepeatsEveryBit) {
  FieldNetwork<float> a(load_network()), b(load_network());
  Stimulus stimulus = task_stimulus(a.spec());
  add_vision(a.spec(), task::parse_demonstration("full,below,low,dark"), stimulus);
  Reasons reasons(a);
  const Stimulus task = task_stimulus(a.spec());
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
  const Demonstration d = task::parse_demonstration("full,above,low,dark");
  EXPECT_EQ(d.grip, Grip::full);
  EXPECT_EQ(d.transport, Transport::above);
  EXPECT_EQ(d.goal, Goal::low);
  EXPECT_EQ(d.color, Color::dark);
  EXPECT_EQ(task::parse_demonstration("precision,below,high").color, Color::unknown);
  EXPECT_EQ(task::parse_demonstration("full, above, low").goal, Goal::low);
  for (const char* wrong :
       {"", "full", "full,above,low,dark,dark", "full,above,middle", "full;above;low"}) {
    EXPECT_THROW(task::parse_demonstration(wrong), ConfigError) << wrong;
  }
}

}  // namespace
}  // namespace mimesis::cognition
