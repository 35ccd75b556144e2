#include "nodes/crowd/rules/lanes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "common/math/circle.h"
#include "nodes/crowd/engine/steer.h"
#include "nodes/crowd/engine/testing/navigation.h"
#include "nodes/crowd/engine/walk_rows.h"

namespace mimesis::crowd {
namespace {

TEST(Lanes, FunctionsAreThoseOfTheLibrary) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-1e5, 1e5), small(-8.0, 8.0), negative(-50.0, 0.0);
  for (int i = 0; i < 100'000; ++i) {
    const double a = i < 50'000 ? small(random) : angle(random);
    EXPECT_NEAR(cos_sin_lane(a).cos, std::cos(a), 4e-16) << a;
    EXPECT_NEAR(cos_sin_lane(a).sin, std::sin(a), 4e-16) << a;
    EXPECT_NEAR(std::remainder(wrap_lane(a) - a, math::kTwoPi), 0.0, 3e-11);  // an ulp of a, twice
    EXPECT_LE(std::abs(wrap_lane(a)), std::numbers::pi + 3e-11);
    const double x = negative(random);
    EXPECT_NEAR(exp_lane(x) / std::exp(x), 1.0, 1e-15) << x;
    const double e = small(random);
    EXPECT_NEAR(tanh_lane(e, 0.7), 0.7 * std::tanh(e / 0.7), 4e-16) << e;
  }
}

TEST(Steer, SumsTheTermsOfTheNavigationDynamics) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-6.0, 6.0), heading(-4.0, 4.0), speed(0.0, 1.6);
  const auto around = std::make_unique<Surroundings>();
  for (int trial = 0; trial < 2000; ++trial) {
    NavigationParams p;
    p.avoid_1_s = speed(random);
    p.sigma_angle_rad = 0.3 + speed(random);
    p.sigma_distance_m = 0.3 + speed(random);
    p.horizon_s = 1.0 + speed(random);
    p.keep_right_rad = 0.2 * speed(random);
    const Pedestrian self{{place(random), place(random)}, heading(random), speed(random)};
    const double reach = 5.0;
    around->count = 0;
    double sum = 0.0;
    const auto meet = [&](const Pedestrian& other) {
      const double c = std::cos(other.heading_rad), s = std::sin(other.heading_rad);
      around->add(other.position_W_m.x(), other.position_W_m.y(),
                  static_cast<float>(other.speed_m_s * c), static_cast<float>(other.speed_m_s * s));
      const double d = (other.position_W_m - self.position_W_m).norm();
      if (d > reach || d == 0.0) return;
      sum += p.avoid_1_s * avoidance_term(self, other, p) +
             p.predict_1_s * prediction_term(self, other, p);
    };
    const int others = trial % 40;
    for (int i = 0; i < others; ++i) {
      meet({{place(random), place(random)}, heading(random), i % 5 == 0 ? 0.0 : speed(random)});
    }
    meet(self);
    around->pad();
    const double c = std::cos(self.heading_rad), s = std::sin(self.heading_rad);
    const Steered steered{static_cast<float>(self.position_W_m.x()),
                          static_cast<float>(self.position_W_m.y()),
                          static_cast<float>(self.speed_m_s * c),
                          static_cast<float>(self.speed_m_s * s),
                          static_cast<float>(c),
                          static_cast<float>(s)};
    EXPECT_NEAR(steer(*around, steered, SteerParams(p, reach)), sum, 1e-3) << trial;
    // The test's own instruction set is the plainest.
    EXPECT_EQ(steer(*around, steered, SteerParams(p, reach)),
              rows::steer_around(*around, steered, SteerParams(p, reach)));
  }
}

TEST(Walk, IsTheSameBitsOnThePlainestInstructionSet) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Agent> agents(1000);
  for (std::size_t i = 0; i < agents.size(); ++i) {
    agents[i].id = i + 1;
    agents[i].role = i % 7 == 0 ? Role::external : i % 11 == 0 ? Role::seen : Role::own;
    agents[i].state = {{9.0 * unit(random), unit(random)},
                       {unit(random), 0.3},
                       3.0 * unit(random),
                       50.0 * unit(random),
                       0.3 * unit(random),
                       6.0 + unit(random),
                       i % 3 == 0 ? AgentState::kNone : unit(random),
                       unit(random)};
    agents[i].traits = {6.0, 1.0 + 0.1 * unit(random), 0.3, unit(random), unit(random), {3.0, 4.0}};
  }
  const std::vector<double> cosine{0.02, 0.05}, sine{0.01, -0.03};
  for (const HeadingKind kind : {HeadingKind::keep, HeadingKind::lane, HeadingKind::consensus,
                                 HeadingKind::coupled, HeadingKind::goal}) {
    WalkField f;
    f.set_gait(SpeedFunction(0.22, cosine, sine), HeadingSway::make(sine, cosine));
    f.dt = 0.02;
    f.pull_to = {0.3, 1.0};
    f.frequency_gain = 0.01;
    f.saturation = 0.5;
    f.low_pass = 0.1;
    f.length_gain = 0.02;
    f.count = 1000.0;
    f.along_x = 0.6;
    f.along_y = 0.8;
    f.heading = kind;
    f.heading_gain = 1.0;
    f.mean_heading = {0.8, 0.6};
    f.mixed = kind != HeadingKind::lane;
    std::vector<double> wished(1000);
    f.wished_rate = f.wished_length = f.wished_turn = wished.data();
    AgentTable a;
    a.merge(0, 0, agents);
    AgentTable b = a;
    for (int step = 0; step < 5; ++step) {
      const GroupSums s = walk(f, a, 3, 997), t = rows::walk_rows(f, b, 3, 997);
      EXPECT_EQ(s.cos_phase, t.cos_phase);
      EXPECT_EQ(s.error_m, t.error_m);
      EXPECT_EQ(s.sin_heading, t.sin_heading);
      EXPECT_EQ(walk_sums(f, a, 0, 1000).sin_phase, rows::sum_rows(f, b, 0, 1000).sin_phase);
    }
    EXPECT_EQ(a.x, b.x);
    EXPECT_EQ(a.phase, b.phase);
    EXPECT_EQ(a.heading, b.heading);
    EXPECT_EQ(a.length, b.length);
  }
}

TEST(Contact, LimitsOfTwoCloseAtMostTheGapInOneHeadway) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> gap(-0.1, 1.0), v(-2.0, 2.0);
  for (int i = 0; i < 1000; ++i) {
    const double g = gap(random), m = v(random);
    const double a = shared_limit(g, 0.3, m), b = shared_limit(g, 0.3, -m);
    EXPECT_GE(a, 0.0);
    EXPECT_GE(b, 0.0);
    EXPECT_NEAR(a + b, std::max(g, 0.0) / 0.3, 1e-12);
    EXPECT_NEAR(lone_limit(g, 0.3, m), std::max(g, 0.0) / 0.3 + m, 1e-12);
  }
}

/// Two discs of 0.3 m that close faster than their gap allows, at random; whatever they do within
/// their bounds keeps the gap.
TEST(Contact, BoundsFaceWhereTheOtherIsAfterTheStepAndKeepTheGap) {
  constexpr double kHeadway_s = 0.3, kDt_s = 0.25, kRadii_m = 0.6, kSkin_m = 1e-4;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> gap(0.0, 0.5), v(-1.5, 1.5), angle(0.0, math::kTwoPi);
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  int facing = 0, as_far = 0;
  for (int i = 0; i < 3000; ++i) {
    const double a = angle(random), g = gap(random), d = kRadii_m + g;
    const Eigen::Vector2d n(std::cos(a), std::sin(a));
    const Pair pair{n, d, g, {v(random), v(random)}, {v(random), v(random)}};
    const auto own = step_end_bound(pair, kHeadway_s, kDt_s);
    const auto its = step_end_bound({-n, d, g, pair.other_m_s, pair.own_m_s}, kHeadway_s, kDt_s);
    const Eigen::Vector2d closing = pair.own_m_s - pair.other_m_s, end = d * n - kDt_s * closing;
    if (closing.dot(n) <= std::max(g - kSkin_m, 0.0) / kHeadway_s) {
      ASSERT_FALSE(own.has_value());
      continue;
    }
    if (!own) continue;  // the gap is as long as the way
    ASSERT_TRUE(its.has_value());
    EXPECT_LT((own->n + its->n).norm(), 1e-9);
    EXPECT_NEAR(own->n.norm(), 1.0, 1e-12);
    EXPECT_GE(own->limit_m_s, 0.0);
    // between n and the other's place after the step, as near to that as the gap allows
    EXPECT_GE(cross(n, own->n) * cross(n, end), 0.0);
    const double both = own->limit_m_s + its->limit_m_s;
    const bool faces = (own->n - end.normalized()).norm() < 1e-9;
    EXPECT_TRUE(faces || both < 1e-6) << both;
    faces ? ++facing : ++as_far;
    EXPECT_NEAR(own->limit_m_s - its->limit_m_s,
                std::clamp((pair.own_m_s + pair.other_m_s).dot(own->n), -both, both), 1e-9);
    // as fast as both may go along n', and anyhow across
    const Eigen::Vector2d across(-own->n.y(), own->n.x());
    const Eigen::Vector2d after = d * n + kDt_s * (its->limit_m_s * its->n + v(random) * across -
                                                   own->limit_m_s * own->n - v(random) * across);
    EXPECT_GE(after.dot(own->n), kRadii_m + (1.0 - kDt_s / kHeadway_s) * g - 1e-9);
    EXPECT_NEAR(after.dot(own->n), d - kDt_s * (std::max(g - kSkin_m, 0.0) / kHeadway_s), 1e-9);
  }
  EXPECT_GT(facing, 200);
  EXPECT_GT(as_far, 200);
}

TEST(Contact, NearestWithinBoundsIsFeasibleAndNearest) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(0.0, math::kTwoPi), limit(0.0, 1.0);
  const auto unit = [](double a) { return Eigen::Vector2d(std::cos(a), std::sin(a)); };
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<Bound> bounds;
    for (int i = 0; i < trial % 9; ++i) {
      bounds.push_back({unit(angle(random)), i % 3 == 0 ? 0.0 : limit(random)});
    }
    const Eigen::Vector2d wish = 1.5 * limit(random) * unit(angle(random));
    const Eigen::Vector2d v = nearest_within(wish, bounds);
    const auto broken = [&](const Eigen::Vector2d& x) {
      double most = 0.0;
      for (const Bound& b : bounds) most = std::max(most, b.n.dot(x) - b.limit_m_s);
      return most;
    };
    EXPECT_LT(broken(v), 1e-9);
    EXPECT_LE(v.norm(), wish.norm() + 1e-12);
    for (int k = 0; k < 300; ++k) {  // no feasible point is nearer
      const Eigen::Vector2d x = 1.5 * limit(random) * unit(angle(random));
      if (broken(x) > 0.0) continue;
      EXPECT_GE((x - wish).norm(), (v - wish).norm() - 1e-9);
    }
  }
}

TEST(Contact, MoreBoundsThanHaveRoomAreKeptToo) {
  Bounds bounds;
  for (int i = 0; i < 400; ++i) {
    const double a = 0.1 + 0.015 * i;  // the loosest first, with no agent behind
    bounds.add({{std::cos(a), std::sin(a)}, 1.2 - 0.002 * i});
  }
  const Eigen::Vector2d v = bounds.nearest({2.0, 0.5});
  for (int i = 0; i < 400; ++i) {
    const double a = 0.1 + 0.015 * i;
    EXPECT_LE(v.dot(Eigen::Vector2d(std::cos(a), std::sin(a))), 1.2 - 0.002 * i + 1e-9) << i;
  }
  EXPECT_GT(v.norm(), 0.3);
}

}  // namespace
}  // namespace mimesis::crowd
