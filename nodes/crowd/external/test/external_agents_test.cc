#include "nodes/crowd/external/external_agents.h"

#include <gtest/gtest.h>

#include <limits>

namespace mimesis::crowd {
namespace {

using namespace std::chrono_literals;
using Time = ExternalAgents::Time;

AgentReport walker(double x_m) {
  return {.p_W_m = {x_m, 0.0},
          .heading_rad = 0.0,
          .phase_rad = 1.0,
          .phase_rate_rad_s = 6.0,
          .speed_m_s = 1.2};
}

/// Walks at 1.2 m/s and reports with `delay`, from `from` until `to`, every 20 ms.
struct Course {
  ExternalAgents& agents;
  std::vector<ExternalAgents::Change> changes{};

  void walk(Time from, Time to, Time delay = 0ms) {
    for (Time now = from; now < to; now += 20ms) {
      const double t = std::chrono::duration<double>(now - delay).count();
      agents.hear(0, walker(1.2 * t), now - delay, now);
      for (const auto& change : agents.update(now)) changes.push_back(change);
    }
  }
  void silence(Time from, Time to) {
    for (Time now = from; now < to; now += 20ms) {
      for (const auto& change : agents.update(now)) changes.push_back(change);
    }
  }
};

TEST(ExternalAgents, TakesPartFromItsFirstMessage) {
  ExternalAgents agents(2, {});
  EXPECT_EQ(agents.trust(0), Trust::absent);
  EXPECT_EQ(agents.hear(0, walker(3.0), 10s, 10s), "");
  const auto& changes = agents.update(10s);
  ASSERT_EQ(changes.size(), 1u);
  EXPECT_EQ(changes[0].agent, 0);
  EXPECT_EQ(changes[0].to, Trust::trusted);
  EXPECT_EQ(changes[0].reason, "it came");
  EXPECT_EQ(agents.trust(1), Trust::absent);
  EXPECT_TRUE(agents.update(10s).empty());
}

TEST(ExternalAgents, IsBelievedWhereItsRatesBringIt) {
  ExternalAgents agents(1, {});
  AgentReport report = walker(0.0);
  report.heading_rad = M_PI / 2.0;
  agents.hear(0, report, 10s, 10s);
  const AgentReport later = agents.believed(0, 10s + 250ms);
  EXPECT_NEAR(later.p_W_m.x(), 0.0, 1e-12);
  EXPECT_NEAR(later.p_W_m.y(), 0.3, 1e-12);
  EXPECT_NEAR(later.phase_rad, 2.5, 1e-12);
}

TEST(ExternalAgents, WhoDiesIsNotTrustedThenForgotten) {
  ExternalAgents agents(1, {.stale_s = 0.3, .forget_s = 2.0});
  Course course{agents};
  course.walk(10s, 12s);
  course.silence(12s, 15s);
  ASSERT_EQ(course.changes.size(), 3u);
  EXPECT_EQ(course.changes[1].to, Trust::lagging);
  EXPECT_EQ(course.changes[1].reason, "its last state is 0.32 s old, at most 0.3 are trusted");
  EXPECT_EQ(course.changes[2].from, Trust::lagging);
  EXPECT_EQ(course.changes[2].to, Trust::absent);
  EXPECT_EQ(course.changes[2].reason.rfind("nothing believable for 2", 0), 0u);
  course.walk(15s, 16s);  // started again
  EXPECT_EQ(agents.trust(0), Trust::trusted);
}

TEST(ExternalAgents, WhoLagsComesBackAfterAWhileInTime) {
  ExternalAgents agents(1, {.stale_s = 0.3, .forget_s = 2.0, .return_s = 0.5});
  Course course{agents};
  course.walk(10s, 11s);
  course.walk(11s, 12s, 400ms);  // messages continue, their content is old
  EXPECT_EQ(agents.trust(0), Trust::lagging);
  course.walk(12s, 12s + 400ms);
  EXPECT_EQ(agents.trust(0), Trust::lagging) << "not at once";
  course.walk(12s + 400ms, 13s);
  EXPECT_EQ(agents.trust(0), Trust::trusted);
  ASSERT_EQ(course.changes.size(), 3u);
  EXPECT_EQ(course.changes[2].reason, "it is in time again");
}

TEST(ExternalAgents, RepetitionsAndOldReportsArePassedOver) {
  ExternalAgents agents(1, {});
  agents.hear(0, walker(1.0), 10s, 10s);
  agents.taken(0);
  agents.hear(0, walker(7.0), 10s, 10s);
  agents.hear(0, walker(8.0), 10s - 50ms, 10s);
  EXPECT_FALSE(agents.fresh(0));
  EXPECT_EQ(agents.believed(0, 10s).p_W_m.x(), 1.0);
}

TEST(ExternalAgents, WhatNoWalkerDoesIsNotBelieved) {
  const auto why = [](auto change) {
    ExternalAgents agents(1, {});
    agents.hear(0, walker(0.0), 10s, 10s);
    agents.update(10s);
    AgentReport next = walker(0.024);
    change(next);
    const std::string reason = agents.hear(0, next, 10s + 20ms, 10s + 20ms);
    agents.update(10s + 20ms);
    EXPECT_EQ(agents.trust(0), reason.empty() ? Trust::trusted : Trust::lagging);
    EXPECT_LT(agents.believed(0, 10s + 20ms).p_W_m.norm(), 0.1);
    return reason;
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(why([](AgentReport&) {}), "");
  EXPECT_EQ(why([](AgentReport& r) { r.p_W_m.x() = 5.0; }), "it moved by 5 m within 0.02 s");
  EXPECT_EQ(why([](AgentReport& r) { r.p_W_m.y() = kNan; }), "its state is no number");
  EXPECT_EQ(why([](AgentReport& r) { r.phase_rad = kNan; }), "its state is no number");
  EXPECT_EQ(why([](AgentReport& r) { r.p_W_m.x() = -2e5; }), "it is at (-2e+05, 0) m");
  EXPECT_EQ(why([](AgentReport& r) { r.speed_m_s = -30; }), "its speed of -30 m/s is no walker's");
  EXPECT_EQ(why([](AgentReport& r) { r.phase_rate_rad_s = 99; }),
            "its phase rate of 99 rad/s is no gait's");
}

TEST(ExternalAgents, WhoJumpedIsBelievedAtItsNewPlaceAfterAWhile) {
  ExternalAgents agents(1, {.return_s = 0.5});
  Course course{agents};
  course.walk(1s, 2s);
  for (Time now = 2s; now < 3s; now += 20ms) {  // carried away, stands there
    AgentReport report = walker(40.0);
    report.speed_m_s = 0.0;
    agents.hear(0, report, now, now);
    agents.update(now);
    if (now < 2s + 500ms) {
      EXPECT_EQ(agents.trust(0), Trust::lagging);
    }
  }
  EXPECT_EQ(agents.trust(0), Trust::trusted);
  EXPECT_EQ(agents.believed(0, 3s).p_W_m.x(), 40.0);
}

TEST(ExternalAgents, WhoLeavesIsGoneAtOnceAndMayComeBack) {
  ExternalAgents agents(1, {});
  agents.hear(0, walker(0.0), 10s, 10s);
  agents.update(10s);
  agents.leave(0);
  const auto& changes = agents.update(10s + 20ms);
  ASSERT_EQ(changes.size(), 1u);
  EXPECT_EQ(changes[0].to, Trust::absent);
  EXPECT_EQ(changes[0].reason, "it left");
  EXPECT_EQ(agents.hear(0, walker(9.0), 11s, 11s), "");
  agents.update(11s);
  EXPECT_EQ(agents.trust(0), Trust::trusted);
}

TEST(ExternalAgents, AnOldStateIsNoReasonToTakePart) {
  ExternalAgents agents(1, {.stale_s = 0.3});
  EXPECT_EQ(agents.hear(0, walker(0.0), 9s, 10s), "its state is 1 s old, at most 0.3 are trusted");
  agents.update(10s);
  EXPECT_EQ(agents.trust(0), Trust::absent);
}

TEST(ExternalAgents, AStateFromTheFutureIsNotBelieved) {
  ExternalAgents agents(1, {.stale_s = 0.3});
  EXPECT_NE(agents.hear(0, walker(0.0), 11s, 10s), "");
  agents.update(10s);
  EXPECT_EQ(agents.trust(0), Trust::absent);
}

}  // namespace
}  // namespace mimesis::crowd
