// Plans that are interrupted at one of their questions, each of many: they end with the reason, or
// are whole.
#include "common/interrupt.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <random>
#include <set>

#include "common/testing/no_malloc.h"
#include "nodes/planner/move_plan.h"
#include "nodes/planner/test/arms.h"
#include "nodes/planner/test/demo.h"

namespace mimesis::planner {
namespace {

/// Says yes from question `k` on.
Interrupt told_at(std::uint64_t k) {
  return {"it was told", [k, asked = std::uint64_t{}]() mutable { return ++asked >= k; }};
}

/// The same motions, bit for bit.
bool same(const TaskPlan& a, const TaskPlan& b) {
  return std::ranges::equal(a.motions, b.motions,
                            [](const PlannedMotion& one, const PlannedMotion& other) {
                              return one.phase == other.phase && one.curves == other.curves &&
                                     one.trajectory.position == other.trajectory.position &&
                                     one.trajectory.velocity == other.trajectory.velocity;
                            });
}

/// `count` numbers of questions: the first ones, the last ones, and random ones between.
std::vector<std::uint64_t> some_of(std::uint64_t questions, int count, std::mt19937_64& random) {
  std::vector<std::uint64_t> all{1, 2, questions - 1, questions};
  while (std::ssize(all) < count)
    all.push_back(std::uniform_int_distribution<std::uint64_t>(1, questions)(random));
  return all;
}

TEST(Interrupt, AsksEachSoManiethTimeAndNeverTakesAYesBack) {
  int looks = 0;
  const Interrupt interrupt(
      "time is up", [&looks] { return ++looks == 3; }, 4);
  const Interrupt copy = interrupt;
  copy.enter("nothing was done");
  for (int i = 1; i <= 11; ++i) EXPECT_FALSE((i % 2 == 0 ? interrupt : copy).now()) << i;
  EXPECT_FALSE(interrupt.told());
  EXPECT_TRUE(copy.now());
  interrupt.enter("it is too late to say");
  EXPECT_TRUE(interrupt.now());
  EXPECT_EQ(looks, 3);
  EXPECT_EQ(interrupt.told_at(), 12u);
  EXPECT_EQ(interrupt.asked(), 13u);
  EXPECT_EQ(interrupt.reason().reason, "time is up while nothing was done");
  const Interrupt never;
  never.enter("anything");
  EXPECT_FALSE(never.now());
  EXPECT_EQ(never.told_at(), Interrupt::kNever);
}

const std::array kTasks{Task{Grip::precision, Transport::above, "high", {}},
                        Task{Grip::full, Transport::below, "low", {}}};

TEST(Interrupt, EndsATaskWithAReasonOrLeavesItWhole) {
  constexpr int kSamples = 5;
  const Demo& d = demo();
  std::mt19937_64 random(11);
  for (const Task& task : kTasks) {
    const auto whole = d.plan(task, {});
    ASSERT_TRUE(whole) << whole.error().reason;
    const Interrupt never("", [] { return false; });
    const auto counted = d.plan(task, never);
    ASSERT_TRUE(counted);
    EXPECT_TRUE(same(*whole, *counted)) << "questions change nothing";
    std::set<std::string> parts;
    for (const std::uint64_t k : some_of(never.asked(), kSamples, random)) {
      const Interrupt interrupt = told_at(k);
      const auto cut = d.plan(task, interrupt);
      ASSERT_FALSE(cut) << k << " of " << never.asked();
      EXPECT_TRUE(cut.error().reason.starts_with("it was told while ")) << cut.error().reason;
      EXPECT_EQ(interrupt.told_at(), k);
      parts.insert(cut.error().reason);
    }
    EXPECT_GT(parts.size(), 1u) << "the reason says what was done";
    const auto late = d.plan(task, told_at(never.asked() + 1));
    ASSERT_TRUE(late);
    EXPECT_TRUE(same(*whole, *late));
  }
}

TEST(Interrupt, LeavesNoHalfRoadmap) {
  const Demo& d = demo();
  const auto known = std::make_shared<const Roadmap>(d.roadmap);
  kin::Table moved = d.table;
  for (kin::Ball& ball : moved.balls) ball.center.y() += 0.08;
  TaskSettings settings = d.settings;
  const Interrupt never("", [] { return false; });
  settings.interrupt = never;
  const auto refined = refreshed_roadmap(known, d.arm, moved, settings);
  ASSERT_NE(refined, known) << "more than 2 % are inhibited";
  std::mt19937_64 random(12);
  for (const std::uint64_t k : some_of(never.asked(), 12, random)) {
    settings.interrupt = told_at(k);
    EXPECT_EQ(refreshed_roadmap(known, d.arm, moved, settings), known) << k;
    EXPECT_EQ(settings.interrupt.reason().reason, "it was told while the roadmap was refined");
  }
}

TEST(Interrupt, EndsMovesAtAnyQuestion) {
  constexpr int kMoves = 8, kMost = 24;
  const kin::ArmModel arm = planar_arm();
  PlanRequest request;
  for (int i = 0; i < 16; ++i) request.table.balls.push_back({{1.2 + 0.04 * i, 0.1, 0.0}, 0.05});
  std::mt19937_64 random(13);
  const auto posture = [&] {
    Eigen::VectorXd q(2);
    for (Eigen::Index j = 0; j < 2; ++j)
      q[j] = std::uniform_real_distribution(arm.q_min[j], arm.q_max[j])(random);
    return q;
  };
  int planned = 0;
  for (int move = 0; move < kMoves; ++move) {
    request.start = posture();
    request.what = Move{{{posture()}}, {{posture()}, {posture()}}};
    const auto plan = [&](const Interrupt& interrupt) {
      TaskSettings settings;
      settings.search.max_branches = 2000;
      settings.interrupt = interrupt;
      return plan_request(arm, {}, request, settings);
    };
    const Interrupt never("", [] { return false; });
    const auto whole = plan(never);
    planned += whole.has_value();
    auto all = some_of(never.asked(), kMost, random);
    for (std::uint64_t k = 1; k <= std::min<std::uint64_t>(never.asked(), kMost); ++k)
      all.push_back(k);
    for (const std::uint64_t k : all) {
      const auto cut = plan(told_at(k));
      ASSERT_FALSE(cut) << k << " of " << never.asked();
      EXPECT_TRUE(cut.error().reason.starts_with("it was told while ")) << cut.error().reason;
    }
    const auto late = plan(told_at(never.asked() + 1));
    ASSERT_EQ(late.has_value(), whole.has_value());
    if (whole) {
      EXPECT_TRUE(same(*whole, *late));
    } else {
      EXPECT_EQ(late.error().reason, whole.error().reason);
    }
  }
  EXPECT_GT(planned, 2);
}

/// Work is counted by what it allocates, which nothing here does without: inverse kinematics some
/// tens of times in each iteration, a sample of a motion about ten times.
TEST(Interrupt, IsAskedBetweenSmallPartsOfAllWork) {
  constexpr std::uint64_t kMost = 600;
  const Demo& d = demo();
  TaskSettings settings = d.settings;
  std::uint64_t before = testing::allocations(), most = 0;
  std::string part;
  settings.interrupt = Interrupt("", [&] {
    const std::uint64_t now = testing::allocations();
    if (now - before > most) {
      most = now - before;
      part = settings.interrupt.reason().reason;
    }
    before = testing::allocations();
    return false;
  });
  const auto roadmap = prepare_roadmap(d.arm, d.table, settings);
  for (const Task& task : kTasks)
    EXPECT_TRUE(plan_task(d.arm, d.table, roadmap, d.arm.home, task, settings));
  EXPECT_LE(most, kMost) << part;
}

TEST(Interrupt, MeetsDeadlinesOfTheWallClock) {
  using Clock = std::chrono::steady_clock;
  const Demo& d = demo();
  std::mt19937_64 random(14);
  for (int i = 0; i < 12; ++i) {
    const double exponent = std::uniform_real_distribution(-6.0, std::log10(2.0))(random);
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<double>(std::pow(10.0, exponent)));
    const Interrupt interrupt(
        "too late", [end] { return Clock::now() >= end; }, 4);
    const auto plan = d.plan(kTasks[static_cast<std::size_t>(i % 2)], interrupt);
    EXPECT_EQ(plan.has_value(), !interrupt.told());
    if (!plan) {
      EXPECT_GE(Clock::now(), end);
      EXPECT_TRUE(plan.error().reason.starts_with("too late while ")) << plan.error().reason;
    }
  }
}

}  // namespace
}  // namespace mimesis::planner
