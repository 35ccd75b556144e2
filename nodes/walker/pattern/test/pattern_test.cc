#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "common/error.h"
#include "common/model/files.h"
#include "common/shared_data.h"
#include "common/testing/no_malloc.h"
#include "nodes/walker/pattern/generators.h"
#include "nodes/walker/pattern/test/patterns.h"

namespace mimesis::walker {
namespace {

robot::Biped load(const std::string& name) {
  return model::load_biped(std::string(MIMESIS_SOURCE_DIR) + "/models/" + name);
}

TEST(GaitSettingsOfARobot, OurBipedHasTheDefaults) {
  const robot::Biped biped = load("biped.yaml");
  const GaitSettings s = gait_settings(biped), standard;
  EXPECT_NEAR(s.com_height_m, 0.807, 1e-3);
  EXPECT_NEAR(s.feet_distance_m, 0.19, 1e-9);
  EXPECT_NEAR(s.longest_step_m, standard.longest_step_m, 2e-3);
  EXPECT_NEAR(s.widest_step_m, standard.widest_step_m, 2e-3);
  EXPECT_NEAR(s.narrowest_step_m, standard.narrowest_step_m, 1e-6);
  EXPECT_NEAR(s.most_forward_m_s, standard.most_forward_m_s, 2e-3);
  EXPECT_NEAR(s.step_height_m, standard.step_height_m, 2e-3);
  EXPECT_LT((s.zmp_half_m - standard.zmp_half_m).norm(), 1e-6);
}

/// Conditions for any robot: the ZMP stays on the sole, feet do not touch each other, steps are
/// shorter than legs.
void expect_sane(const robot::Biped& biped) {
  const GaitSettings s = gait_settings(biped);
  EXPECT_NO_THROW(check(s));
  EXPECT_EQ(s.com_height_m, biped.com_height_m);
  for (const Side side : robot::kSides) {
    const robot::Biped::Leg& leg = biped.leg[side];
    EXPECT_LT(s.zmp_half_m.x(), std::min(-leg.min_S_m.x(), leg.max_S_m.x()));
    EXPECT_LT(s.zmp_half_m.y(), std::min(-leg.min_S_m.y(), leg.max_S_m.y()));
  }
  EXPECT_GT(s.zmp_half_m.minCoeff(), 0.02);
  const double inner = biped.leg[kRight].max_S_m.y() - biped.leg[kLeft].min_S_m.y();
  EXPECT_GT(s.narrowest_step_m, inner) << "soles side by side would overlap";
  EXPECT_LT(s.longest_step_m, 0.5 * biped.com_height_m);
  EXPECT_GT(s.longest_step_m, 0.2 * biped.com_height_m);
  EXPECT_GT(s.most_forward_m_s * s.step_s, 0.5 * s.longest_step_m);
}

TEST(GaitSettingsOfARobot, AreSaneForOurBiped) { expect_sane(load("biped.yaml")); }

TEST(GaitSettingsOfARobot, AreSaneForJvrc1) {
  if (!std::filesystem::exists(shared_data("data/robots/jvrc1.urdf"))) {
    GTEST_SKIP() << "not here: needs data/robots/jvrc1.urdf of the shared folder";
  }
  const robot::Biped biped = load("jvrc1.yaml");
  expect_sane(biped);
  const GaitSettings s = gait_settings(biped);
  LinearMpc pattern(s);
  Wish wish;
  wish.velocity_m_s.x() = 0.8 * s.most_forward_m_s;
  for (int i = 0; i < 2000; ++i) {
    pattern.step(wish);
    ASSERT_EQ(pattern.trouble().failed_solves, 0) << i;
  }
  EXPECT_EQ(pattern.now().gait, Gait::walking);
  EXPECT_FALSE(pattern.trouble().clipped);
}

}  // namespace

namespace {

using mimesis::testing::NoMalloc;
using testing::expect_all_right;
using testing::forward;
using testing::ground_pose;
using testing::Kind;
using testing::kNan;
using testing::Patterns;
using testing::stop;
using testing::Watch;

TEST_P(Patterns, StandInTheMiddleAfterReset) {
  auto pattern = make();
  pattern->reset({Footprint{kLeft, {1.0, 2.1}, 0.1}, Footprint{kRight, {1.02, 1.9}, 0.1}});
  run(*pattern, stop(), 100);
  const PatternSample& s = pattern->now();
  EXPECT_EQ(s.gait, Gait::standing);
  EXPECT_LT((s.com.p_W_m - Eigen::Vector2d(1.01, 2.0)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(s.yaw_rad, 0.1);
  EXPECT_TRUE(s.contact[kLeft] && s.contact[kRight]);
}

TEST_P(Patterns, StartWalkStopInTime) {
  auto pattern = make();
  int lifted = -1, landed = -1;
  for (int i = 1; i <= 400 && landed < 0; ++i) {
    pattern->step(forward(0.2));
    if (!pattern->now().contact[kLeft] && lifted < 0) lifted = i;
    if (lifted > 0 && pattern->now().contact[kLeft]) landed = i;
  }
  EXPECT_EQ(lifted, 160 + 20 + 1);  // the first tick in the air
  EXPECT_EQ(landed, 160 + 160);
  EXPECT_EQ(pattern->now().gait, Gait::walking);
  EXPECT_EQ(pattern->now().steps, 1);
  run(*pattern, forward(0.2), 5 * 160 + 50);
  EXPECT_EQ(pattern->now().steps, 6);
  EXPECT_NEAR(pattern->now().to_landing_s, 0.55, 1e-9);
  run(*pattern, stop(), 110);
  EXPECT_EQ(pattern->now().gait, Gait::stopping);
  run(*pattern, stop(), 160);
  EXPECT_EQ(pattern->now().steps, 8) << "two more landings";
  run(*pattern, stop(), 600);
  const PatternSample& s = pattern->now();
  EXPECT_EQ(s.gait, Gait::standing);
  EXPECT_EQ(s.steps, 8);
  const Eigen::Vector3d left = s.foot[kLeft].X_WS.translation(),
                        right = s.foot[kRight].X_WS.translation();
  EXPECT_NEAR(left.x(), right.x(), 1e-3);
  EXPECT_NEAR(left.y() - right.y(), 0.19, 1e-3);
  EXPECT_LT((s.com.p_W_m - (left + right).head<2>() / 2.0).norm(), 1e-3);
  EXPECT_LT(s.com.v_W.norm(), 1e-3);
}

TEST_P(Patterns, WalkAsFastAsIsWished) {
  struct Speed {
    double forward, left, turn;
  };
  for (const Speed c : {Speed{0.1, 0, 0},
                        {0.2, 0, 0},
                        {0.35, 0, 0},
                        {-0.2, 0, 0},
                        {0, 0.1, 0},
                        {0, -0.1, 0},
                        {0.15, 0.05, 0},
                        {0.2, 0, 0.15},
                        {0, 0, 0.2},
                        {0, 0, -0.2}}) {
    auto pattern = make();
    Wish wish;
    wish.velocity_m_s = {c.forward, c.left};
    wish.yaw_rate_rad_s = c.turn;
    run(*pattern, wish, 160 * 9);
    Eigen::Vector2d way = Eigen::Vector2d::Zero();
    const double yaw = pattern->now().yaw_rad;
    constexpr int kSteps = 8;  // pairs of them: a walk aside limps
    for (int i = 0; i < 160 * kSteps; ++i) {
      pattern->step(wish);
      EXPECT_FALSE(pattern->trouble().clipped);
      const PatternSample& s = pattern->now();
      way += rotation(-s.yaw_rad) * s.com.v_W * kTick_s;
    }
    const double seconds = kSteps * 0.8;
    const double speed = std::hypot(c.forward, c.left);
    EXPECT_LT((way / seconds - Eigen::Vector2d(c.forward, c.left)).norm(),
              speed > 0.0 ? 0.02 * speed : 0.004)
        << c.forward << ' ' << c.left << ' ' << c.turn << ": " << (way / seconds).transpose();
    EXPECT_NEAR((pattern->now().yaw_rad - yaw) / seconds, c.turn, 0.02 * std::abs(c.turn) + 1e-9);
  }
}

TEST_P(Patterns, HoldEveryStepOfAStraightWalkToTheWish) {
  auto pattern = make();
  run(*pattern, forward(0.25), 160 * 6);
  for (int step = 0; step < 6; ++step) {
    const double x = pattern->now().com.p_W_m.x();
    run(*pattern, forward(0.25), 160);
    EXPECT_NEAR((pattern->now().com.p_W_m.x() - x) / 0.8, 0.25, 0.02 * 0.25);
  }
}

TEST_P(Patterns, PreviewWhatTheyThenDo) {
  auto pattern = make();
  run(*pattern, forward(0.25), 160 * 6 + 37);
  for (const int ahead : {0, 1, 20, 60, 140, 200, 319}) {
    const PatternSample preview = pattern->ahead(ahead);
    auto later = make();
    run(*later, forward(0.25), 160 * 6 + 37 + ahead);
    const PatternSample& s = later->now();
    const double tolerance = ahead == 0 ? 0.0
                                        : (ahead <= 140   ? 1.0
                                           : ahead <= 200 ? 5.0
                                                          : 12.5) *
                                              GetParam().preview_m;
    EXPECT_LE((preview.com.p_W_m - s.com.p_W_m).norm(), tolerance) << ahead;
    EXPECT_LE((preview.zmp_W_m - s.zmp_W_m).norm(), 5.0 * tolerance) << ahead;
    for (const Side side : robot::kSides) {
      EXPECT_LE((preview.foot[side].X_WS.translation() - s.foot[side].X_WS.translation()).norm(),
                5.0 * tolerance)
          << ahead;
      EXPECT_EQ(preview.contact[side], s.contact[side]) << ahead;
    }
    EXPECT_EQ(preview.swing, s.swing);
    EXPECT_EQ(preview.gait, s.gait);
    EXPECT_EQ(preview.steps, s.steps);
    EXPECT_NEAR(preview.to_landing_s, s.to_landing_s, 1e-12);
  }
}

TEST_P(Patterns, PreviewIsNowAtEveryTick) {
  auto pattern = make();
  for (int i = 0; i < 1500; ++i) {
    pattern->step(i < 900 ? forward(0.3) : stop());
    const PatternSample& now = pattern->now();
    const PatternSample preview = pattern->ahead(0);
    ASSERT_EQ(preview.com.p_W_m, now.com.p_W_m);
    ASSERT_EQ(preview.zmp_W_m, now.zmp_W_m);
    ASSERT_EQ(preview.foot[kLeft].X_WS.translation(), now.foot[kLeft].X_WS.translation());
    ASSERT_EQ(preview.left_share, now.left_share);
  }
}

TEST_P(Patterns, ShiftAll) {
  auto pattern = make(), other = make();
  const Eigen::Vector2d shift(0.02, -0.01);
  run(*pattern, forward(0.2), 160 * 4 + 71);
  run(*other, forward(0.2), 160 * 4 + 71);
  pattern->shift(shift);
  for (int i = 0; i < 700; ++i) {
    const PatternSample &a = pattern->now(), &b = other->now();
    ASSERT_LT((a.com.p_W_m - b.com.p_W_m - shift).norm(), 1e-6) << i;
    ASSERT_LT((a.zmp_W_m - b.zmp_W_m - shift).norm(), 1e-5);
    for (const Side side : robot::kSides)
      ASSERT_LT(
          ((a.foot[side].X_WS.translation() - b.foot[side].X_WS.translation()).head<2>() - shift)
              .norm(),
          1e-6);
    const PatternSample c = pattern->ahead(100), d = other->ahead(100);
    ASSERT_LT((c.com.p_W_m - d.com.p_W_m - shift).norm(), 1e-5);
    pattern->step(forward(0.2));
    other->step(forward(0.2));
  }
}

TEST_P(Patterns, WalkTheSameFarFromTheOriginAndTurned) {
  auto pattern = make(), far = make();
  const double yaw = 2.5;
  const Eigen::Vector2d origin(2000.0, -3000.0);
  std::array<Footprint, 2> feet = {Footprint{kLeft, {0.0, 0.095}, yaw},
                                   Footprint{kRight, {0.0, -0.095}, yaw}};
  for (Footprint& foot : feet) foot.p_W_m = origin + rotation(yaw) * foot.p_W_m;
  far->reset(feet);
  Wish wish = forward(0.2);
  wish.yaw_rate_rad_s = 0.1;
  for (int i = 0; i < 2000; ++i) {
    pattern->step(wish);
    far->step(wish);
    ASSERT_LT((rotation(-yaw) * (far->now().com.p_W_m - origin) - pattern->now().com.p_W_m).norm(),
              1e-5)
        << i;
  }
}

TEST_P(Patterns, AreTheSameBitsEveryTime) {
  auto a = make(), b = make();
  run(*b, forward(0.1), 777);
  b->reset({Footprint{kLeft, {0.0, 0.095}, 0.0}, Footprint{kRight, {0.0, -0.095}, 0.0}});
  for (int i = 0; i < 1000; ++i) {
    a->step(forward(0.3));
    b->step(forward(0.3));
    ASSERT_EQ(a->now().com.p_W_m, b->now().com.p_W_m) << i;
    ASSERT_EQ(a->now().zmp_W_m, b->now().zmp_W_m) << i;
  }
}

TEST_P(Patterns, RefuseSettingsThatMakeNoSense) {
  GaitSettings gait;
  gait.step_s = 0.83;
  EXPECT_THROW((void)make(gait), ConfigError);
  gait = {};
  gait.com_height_m = kNan;
  EXPECT_THROW((void)make(gait), ConfigError);
  gait = {};
  gait.narrowest_step_m = 0.3;
  EXPECT_THROW((void)make(gait), ConfigError);
}

INSTANTIATE_TEST_SUITE_P(
    All, Patterns,
    ::testing::Values(
        Kind{"linear", [](const GaitSettings& g) { return std::make_unique<LinearMpc>(g); }, 0.005,
             0.002, true},
        Kind{"nonlinear", [](const GaitSettings& g) { return std::make_unique<NonlinearMpc>(g); },
             0.005, 0.002, true},
        Kind{"preview", [](const GaitSettings& g) { return std::make_unique<PreviewPattern>(g); },
             0.03, 0.002, false}),
    [](const auto& kind) { return kind.param.name; });

}  // namespace

// Patterns for wishes: landings, changes at any time, too much, no numbers.
namespace {

TEST_P(Patterns, MeetWishedLandings) {
  for (const double length : {0.15, 0.22, 0.2805}) {
    auto pattern = make();
    run(*pattern, forward(0.25), 160 * 5);
    // the foot after the next one: every generator can still place it
    const Footprint next = pattern->now().landing;
    Footprint wished{robot::other(next.side), next.p_W_m, next.yaw_rad + 0.02};
    wished.p_W_m += Eigen::Vector2d(length, robot::sign(wished.side) * 0.19);
    Wish wish = forward(length / 0.8);
    wish.velocity_m_s.x() = std::min(0.35, wish.velocity_m_s.x());
    wish.landing[0] = next;
    wish.landing[1] = wished;
    run(*pattern, wish, 160);
    wish.landing = {wished, std::nullopt};
    run(*pattern, wish, 159);
    EXPECT_FALSE(pattern->trouble().clipped);
    run(*pattern, wish, 1);
    const Footprint landed = ground_pose(pattern->now().foot[wished.side], wished.side);
    EXPECT_LT((landed.p_W_m - wished.p_W_m).norm(), 1e-3) << length;
    EXPECT_NEAR(landed.yaw_rad, wished.yaw_rad, 1e-3);
  }
}

TEST_P(Patterns, ChangeALandingInTheMiddleOfTheSwing) {
  if (!GetParam().places_feet_in_time) GTEST_SKIP() << "no such case: decides before the swing";
  auto pattern = make();
  run(*pattern, forward(0.2), 160 * 5 + 60);
  Wish wish = forward(0.2);
  wish.landing[0] = pattern->now().landing;
  wish.landing[0]->p_W_m += Eigen::Vector2d(0.03, 0.02 * robot::sign(wish.landing[0]->side));
  run(*pattern, wish, 100);
  const Footprint landed =
      ground_pose(pattern->now().foot[wish.landing[0]->side], wish.landing[0]->side);
  EXPECT_LT((landed.p_W_m - wish.landing[0]->p_W_m).norm(), 1e-3);
}

TEST_P(Patterns, SayThatALandingIsOutOfReach) {
  auto pattern = make();
  run(*pattern, forward(0.2), 160 * 5 + 10);
  Wish wish = forward(0.2);
  wish.landing[0] = pattern->now().landing;
  wish.landing[0]->p_W_m.x() += 1.0;
  run(*pattern, wish, 149);
  EXPECT_TRUE(pattern->trouble().clipped);
  EXPECT_EQ(pattern->trouble().failed_solves, 0);
}

TEST_P(Patterns, KeepUprightForMinutesOfRandomWishes) {
  for (const unsigned seed : {1u, 2u}) {
    const GaitSettings gait;
    auto pattern = make(gait);
    Watch watch(gait);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Wish wish;
    int until = 0;
    for (int i = 0; i < 200 * 60; ++i) {
      if (i == until) {  // anything, at any time, from one tick to 4 s
        until = i + 1 + static_cast<int>(std::pow(std::abs(uniform(random)), 2.0) * 800.0);
        wish.velocity_m_s = {0.5 * uniform(random), 0.2 * uniform(random)};
        wish.yaw_rate_rad_s = 0.3 * uniform(random);
        wish.walk = uniform(random) > -0.6;
        wish.landing = {};
        for (std::size_t k = 0; k < 2; ++k)
          if (uniform(random) > 0.5) {
            const PatternSample& s = pattern->now();
            const Side side = uniform(random) > 0.0 ? kLeft : kRight;
            wish.landing[k] = Footprint{
                side,
                s.com.p_W_m + Eigen::Vector2d(0.4 * uniform(random),
                                              robot::sign(side) * 0.1 + 0.3 * uniform(random)),
                s.yaw_rad + 0.3 * uniform(random)};
          }
      }
      pattern->step(wish);
      watch.look(pattern->now());
      ASSERT_EQ(pattern->trouble().failed_solves, 0) << i << pattern->trouble().reason;
    }
    SCOPED_TRACE(seed);
    expect_all_right(watch, GetParam(), gait);
  }
}

TEST_P(Patterns, StopAndStartAgainAtEveryInstant) {
  const GaitSettings gait;
  for (int at = 0; at < 800; at += 41) {
    auto pattern = make(gait);
    Watch watch(gait);
    const auto go = [&](const Wish& wish, int ticks) {
      for (int i = 0; i < ticks; ++i) {
        pattern->step(wish);
        watch.look(pattern->now());
        ASSERT_EQ(pattern->trouble().failed_solves, 0) << at;
      }
    };
    go(forward(0.35), 160 + at);
    go(stop(), at);
    go(forward(-0.2), 400);
    go(stop(), 900);
    EXPECT_EQ(pattern->now().gait, Gait::standing);
    SCOPED_TRACE(at);
    expect_all_right(watch, GetParam(), gait);
  }
}

TEST_P(Patterns, StopForAWishThatIsNoNumber) {
  auto pattern = make();
  run(*pattern, forward(0.3), 1000);
  Wish wish = forward(kNan);
  run(*pattern, wish, 1);
  EXPECT_NE(pattern->trouble().reason.find("not a number"), std::string::npos);
  run(*pattern, wish, 1200);
  EXPECT_EQ(pattern->now().gait, Gait::standing);
  wish = forward(0.2);
  wish.landing[0] = Footprint{kLeft, {kNan, 0.0}, 0.0};
  run(*pattern, wish, 500);
  EXPECT_EQ(pattern->now().gait, Gait::walking);
  EXPECT_TRUE(pattern->now().com.p_W_m.allFinite());
  EXPECT_FALSE(pattern->trouble().reason.empty());
}

TEST_P(Patterns, CutWhatIsTooFast) {
  auto pattern = make();
  run(*pattern, forward(5.0), 160 * 8);
  EXPECT_TRUE(pattern->trouble().clipped);
  const double x = pattern->now().com.p_W_m.x();
  run(*pattern, forward(5.0), 320);
  EXPECT_NEAR((pattern->now().com.p_W_m.x() - x) / 1.6, 0.35, 0.02 * 0.35);
  pattern->step(forward(0.2));
  EXPECT_FALSE(pattern->trouble().clipped);
}

TEST_P(Patterns, WalkWithOtherSettings) {
  GaitSettings gait;
  gait.com_height_m = 1.0;
  gait.step_s = 0.7;
  gait.double_support_s = 0.2;
  gait.feet_distance_m = 0.22;
  auto pattern = make(gait);
  Watch watch(gait);
  for (int i = 0; i < 4000; ++i) {
    pattern->step(i < 3000 ? forward(0.25) : stop());
    watch.look(pattern->now());
  }
  expect_all_right(watch, GetParam(), gait);
  EXPECT_EQ(pattern->now().gait, Gait::standing);
}

}  // namespace

// Walking without a solution of the MPC.
namespace {

using mimesis::testing::NoMalloc;

/// A generator whose programs are not solved any more, from one tick to another.
template <typename Mpc>
void stop_without_plans() {
  const GaitSettings gait;
  const Kind kind{"without plans", {}, 0.03, 0.0, true};
  for (int at = 0; at < 640; at += 71) {
    SCOPED_TRACE(at);
    Mpc pattern(gait);
    Watch watch(gait);
    Wish wish = forward(0.3);
    wish.velocity_m_s.y() = 0.05;
    wish.yaw_rate_rad_s = 0.1;
    for (int i = 0; i < 160 + at; ++i) {
      pattern.step(wish);
      watch.look(pattern.now());
    }
    const int steps = pattern.now().steps;
    const Eigen::Vector2d from = pattern.now().com.p_W_m;
    pattern.limit_iterations(1);
    bool told = false;
    for (int i = 0; i < 1400; ++i) {
      const NoMalloc guard;
      const PatternSample soon = pattern.ahead(1);
      pattern.forget();  // a start from the last solution may need no iteration
      pattern.step(wish);
      told = told || pattern.trouble().reason.find("stops") != std::string::npos;
      if (i > 100 && pattern.trouble().failed_solves > 0 && !pattern.trouble().reason.empty() &&
          pattern.now().gait != Gait::standing) {
        EXPECT_LT((pattern.now().com.p_W_m - soon.com.p_W_m).norm(), 1e-4) << i;
      }
      watch.look(pattern.now());
    }
    EXPECT_TRUE(told);
    EXPECT_EQ(pattern.now().gait, Gait::standing);
    EXPECT_LE(pattern.now().steps, steps + 3);
    EXPECT_LT(pattern.now().com.v_W.norm(), 1e-6);
    EXPECT_LT((pattern.now().com.p_W_m - from).norm(), 1.2);
    EXPECT_GT(pattern.trouble().failed_solves, 0) << "it would still walk";
    pattern.limit_iterations(0);
    for (int i = 0; i < 900; ++i) {
      pattern.step(i < 500 ? wish : stop());
      watch.look(pattern.now());
      ASSERT_EQ(pattern.trouble().failed_solves, 0) << i;
      if (i == 499) {
        EXPECT_EQ(pattern.now().gait, Gait::walking);
      }
    }
    expect_all_right(watch, kind, gait);
  }
}

TEST(LinearMpc, StopsWhenItHasNoPlansForLong) { stop_without_plans<LinearMpc>(); }

TEST(NonlinearMpc, StopsWhenItHasNoPlansForLong) { stop_without_plans<NonlinearMpc>(); }

TEST(LinearMpc, GoesOnWithTheLastPlanForAMoment) {
  LinearMpc pattern{GaitSettings{}};
  int failed = 0;
  for (int i = 0; i < 1500; ++i) {
    const bool without = i > 600 && i % 50 < 30;  // some programs need no iteration
    pattern.limit_iterations(without ? 1 : 0);
    if (without) pattern.forget();
    const PatternSample soon = pattern.ahead(1);
    pattern.step(forward(0.2));
    if (pattern.trouble().failed_solves == 0) continue;
    ++failed;
    EXPECT_NE(pattern.trouble().reason.find("the last plan goes on"), std::string::npos);
    ASSERT_LT((pattern.now().com.p_W_m - soon.com.p_W_m).norm(), 1e-12) << i;
    ASSERT_LT((pattern.now().zmp_W_m - soon.zmp_W_m).norm(), 1e-12) << i;
  }
  EXPECT_GT(failed, 50);
  EXPECT_EQ(pattern.now().gait, Gait::walking);
}

TEST(LinearMpc, StopsFromTheJerkThatItHad) {
  double jerks = 0.0, changes = 0.0;
  for (int at = 0; at < 320; at += 20) {
    LinearMpc pattern{GaitSettings{}};
    for (int i = 0; i < 480 + at; ++i) pattern.step(forward(0.3));
    pattern.limit_iterations(1);
    Eigen::Vector2d jerk = Eigen::Vector2d::Zero(), before = jerk;
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector2d a_W = pattern.now().com.a_W;
      pattern.forget();
      pattern.step(forward(0.3));
      before = std::exchange(jerk, (pattern.now().com.a_W - a_W) / kTick_s);
      if (pattern.trouble().reason.find("stops") != std::string::npos) break;
    }
    ASSERT_NE(pattern.trouble().reason.find("stops"), std::string::npos) << at;
    jerks += before.norm();
    changes += (jerk - before).norm();
  }
  EXPECT_GT(jerks, 16 * 1.0);
  EXPECT_LT(changes, 1.2 * jerks);  // from the jerk turned round: 1.6 times
}

TEST(LinearMpc, IsShiftedWhileItStops) {
  LinearMpc pattern{GaitSettings{}}, other{GaitSettings{}};
  const Eigen::Vector2d shift(0.02, -0.01);
  bool shifted = false;
  for (int i = 0; i < 2400; ++i) {
    for (LinearMpc* p : {&pattern, &other}) {
      if (i == 700) p->limit_iterations(1);
      if (i >= 700) p->forget();
      p->step(forward(0.3));
    }
    if (!shifted && other.trouble().reason.find("stops") != std::string::npos) {
      pattern.shift(shift);
      shifted = true;
    }
    if (!shifted) continue;
    for (const int ahead : {0, 50}) {
      const PatternSample a = pattern.ahead(ahead), b = other.ahead(ahead);
      ASSERT_LT((a.com.p_W_m - b.com.p_W_m - shift).norm(), 1e-9) << i;
      for (const Side side : robot::kSides) {
        const Eigen::Vector3d apart =
            a.foot[side].X_WS.translation() - b.foot[side].X_WS.translation();
        ASSERT_LT((apart.head<2>() - shift).norm(), 1e-9) << i;
      }
    }
  }
  EXPECT_TRUE(shifted);
}

}  // namespace

}  // namespace mimesis::walker
