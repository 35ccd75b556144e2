#include "nodes/synthesizer/character/characters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>

#include "common/math/circle.h"
#include "common/testing/no_malloc.h"
#include "common/testing/refusal.h"
#include "nodes/synthesizer/test/models.h"

namespace mimesis::synthesizer {
namespace {

using Stage = StepCourse::Stage;
constexpr double kCharactersDt = 0.005;

Characters one(const motion::MotionModel& model, CharactersSettings settings = {},
               CharacterStart start = {}) {
  settings.walk.dt_s = kCharactersDt;
  return Characters(model, {&start, 1}, settings);
}

void run(Characters& characters, double duration_s) {
  for (int k = 0; k < std::lround(duration_s / kCharactersDt); ++k) characters.step();
}

/// Until the goal is reached [s], at most a minute.
double walk_to(Characters& characters, const Eigen::Vector2d& goal) {
  characters.walk(0).walk_to(goal);
  int k = 0;
  do characters.step();
  while (!characters.walk(0).reached() && ++k < 12000);
  return k * kCharactersDt;
}

double distance(const Characters& characters, double x, double y) {
  return (characters.state(0).root.position_W_m - Eigen::Vector2d(x, y)).norm();
}

TEST(Repertoire, MeasuresTheMotions) {
  const Repertoire repertoire(testing::three_styles(true));
  ASSERT_EQ(repertoire.style_count(), 3);
  EXPECT_EQ(repertoire.known(), "walk, slow, brisk");
  const StyleMotions& walk = repertoire.style(repertoire.find("walk"));
  EXPECT_NEAR(repertoire.motion(walk.straight).step_length_m, 0.5, 0.01);
  EXPECT_NEAR(repertoire.motion(walk.straight).turn_rad, 0.0, 1e-6);
  EXPECT_NEAR(repertoire.motion(walk.left).turn_rad, 0.8, 0.02);
  EXPECT_NEAR(repertoire.motion(walk.right).turn_rad, -0.8, 0.02);
  EXPECT_NEAR(repertoire.motion(walk.standing).step_length_m, 0.0, 1e-9);
  EXPECT_GT(walk.closing_share, 0.3);
  EXPECT_LT(walk.closing_share, 0.9);
  const StyleMotions& slow = repertoire.style(repertoire.find("slow"));
  EXPECT_NEAR(repertoire.motion(slow.straight).step_length_m, 0.325, 0.01);
  EXPECT_EQ(slow.left, -1);
  EXPECT_EQ(repertoire.find("happy"), -1);
}

TEST(Repertoire, StandsUprightOnFlatFeet) {
  Characters characters = one(testing::three_styles());
  run(characters, 1.0);
  const CharacterBatch& batch = characters.batch();
  for (const int side : {mocap::kLeft, mocap::kRight}) {
    EXPECT_NEAR(batch.heel_W_m(0, side).z(), 0.0, 1e-5);
    EXPECT_NEAR(batch.toe_W_m(0, side).z(), 0.0, 1e-5);
  }
  EXPECT_NEAR(characters.state(0).root.height_m, 0.961, 1e-3);  // legs of the standard body
  EXPECT_EQ(characters.state(0).root.velocity_H_m_s.norm(), 0.0);
}

TEST(Characters, ArriveAtGoalsAllAround) {
  for (const double angle : {0.0, 0.7, 1.6, 2.6, -3.1, -1.2}) {
    Characters characters = one(testing::three_styles());
    const double x = 4.0 * std::cos(angle), y = 4.0 * std::sin(angle);
    EXPECT_LT(walk_to(characters, {x, y}), 12.0) << angle;
    EXPECT_LT(distance(characters, x, y), 0.15) << angle;
    EXPECT_EQ(characters.walk(0).stage(), Stage::standing);
  }
}

TEST(Characters, ArriveNear) {
  for (const double x : {0.2, 0.3, 0.5, 0.8, 1.1, 1.5, -0.5}) {
    Characters characters = one(testing::three_styles());
    EXPECT_LT(walk_to(characters, {x, 0.1}), 12.0) << x;
    EXPECT_LT(distance(characters, x, 0.1), 0.15) << x;
  }
}

TEST(Characters, OfTheRepositoryArriveAnywhere) {
  const motion::MotionModel model =
      motion::load_motion_model(MIMESIS_SOURCE_DIR "/models/walk.motion.json");
  constexpr int kGoals = 34;
  const std::vector<CharacterStart> starts(kGoals);
  const auto row = [&](const char* name) {
    return std::ranges::find(model.rows, name) - model.rows.begin();
  };
  const auto left_knee = static_cast<std::size_t>(row("lknee.y")),
             right_knee = static_cast<std::size_t>(row("rknee.y"));
  for (const char* style : {"walk", "slow", "stride", "brisk"}) {
    Characters characters(model, starts, {.style = style});
    for (int i = 0; i < kGoals; ++i) {
      const double far = 0.2 + 0.18 * i, angle = 2.4 * i;
      characters.walk(i).walk_to({far * std::cos(angle), far * std::sin(angle)});
    }
    float flexion = 1.0F;  // the least of all [rad]
    for (int k = 0; k < 20 * 60; ++k) {
      characters.step();
      for (int i = 0; i < kGoals; ++i) {
        const auto q = characters.angles(i);
        flexion = std::min({flexion, q[left_knee], q[right_knee]});
      }
    }
    EXPECT_GT(flexion, -0.035F) << style;  // 2 degrees; recorded knees stretch as far
    int near = 0;
    for (int i = 0; i < kGoals; ++i) {
      EXPECT_TRUE(characters.walk(i).reached()) << style << " " << i;
      EXPECT_LT(characters.walk(i).goal_distance_m(), 0.31) << style << " " << i;
      near += characters.walk(i).goal_distance_m() < 0.15 ? 1 : 0;
    }
    EXPECT_GE(near, kGoals * 65 / 100) << style;
  }
}

TEST(Characters, TurnByTurningMotionsWhereTheModelHasThem) {
  const auto pivoting = [](bool turns) {
    Characters characters = one(testing::three_styles(turns));
    characters.walk(0).walk_to({0.0, 6.0});
    double sum = 0.0;
    for (int k = 0; k < 800; ++k) {
      characters.step();
      sum += std::abs(characters.walk(0).pivot_rad_s()) * kCharactersDt;
    }
    EXPECT_GT(characters.state(0).root.heading_rad, 1.3) << turns;  // both have turned to the goal
    return sum;
  };
  EXPECT_LT(pivoting(true), 0.75 * pivoting(false));
}

TEST(Characters, TheStandingFootStaysWhileTheCharacterTurns) {
  Characters characters = one(testing::three_styles());
  characters.walk(0).walk_to({0.0, 6.0});
  run(characters, 1.1);
  double slid = 0.0, turned = 0.0;
  for (int k = 0; k < 40; ++k) {  // within one stance
    const int side = characters.state(0).root.support;
    const Eigen::Vector2d heel = characters.batch().heel_W_m(0, side).head<2>();
    const Eigen::Vector2d toe = characters.batch().toe_W_m(0, side).head<2>();
    const double before = characters.state(0).root.heading_rad;
    characters.step();
    if (characters.state(0).root.support != side) continue;
    turned += characters.state(0).root.heading_rad - before;
    slid += std::min((characters.batch().heel_W_m(0, side).head<2>() - heel).norm(),
                     (characters.batch().toe_W_m(0, side).head<2>() - toe).norm());
  }
  EXPECT_GT(turned, 0.12);
  EXPECT_LT(slid, 0.01);  // turning about the pelvis: 0.15 rad · 0.1..0.2 m
}

TEST(Characters, AGoalThatJumpsIsFollowed) {
  Characters characters = one(testing::three_styles());
  characters.walk(0).walk_to({3.0, 0.0});
  run(characters, 2.0);
  EXPECT_LT(walk_to(characters, {1.5, -3.0}), 15.0);
  EXPECT_LT(distance(characters, 1.5, -3.0), 0.15);
  EXPECT_LT(walk_to(characters, {3.0, -3.0}), 15.0);  // from standing again
  EXPECT_LT(distance(characters, 3.0, -3.0), 0.15);
}

TEST(Characters, StopAtTheEndOfTheStep) {
  for (const double after : {1.1, 1.3, 1.55}) {
    Characters characters = one(testing::three_styles(), {.walking = true});
    run(characters, after);
    characters.walk(0).stop();
    const double to_strike = std::ceil(after / 0.5) * 0.5 - after;
    run(characters, to_strike - 0.05);
    EXPECT_EQ(characters.walk(0).stage(), Stage::walking) << after;
    run(characters, 0.1);
    EXPECT_EQ(characters.walk(0).stage(), Stage::closing) << after;
    run(characters, 0.5);
    EXPECT_EQ(characters.walk(0).stage(), Stage::standing) << after;
    run(characters, 1.5);  // the pelvis settles over the locked feet
    EXPECT_LT(characters.state(0).root.velocity_H_m_s.norm(), 1e-4);
    EXPECT_EQ(characters.state(0).phase_rate_rad_s, 0.0);
  }
}

/// Largest change of a row's rate in one step [rad/s], of the whole run.
class Smoothness {
 public:
  void see(const Characters& characters) {
    const auto now = characters.angles(0);
    std::vector<float> rate(now.size());
    for (std::size_t r = 0; r < now.size(); ++r) {
      if (count_ > 0) rate[r] = (now[r] - angle_[r]) / static_cast<float>(kCharactersDt);
      if (count_ > 1) worst_ = std::max(worst_, static_cast<double>(std::abs(rate[r] - rate_[r])));
    }
    angle_.assign(now.begin(), now.end());
    rate_ = rate;
    ++count_;
  }
  double worst() const { return worst_; }

 private:
  std::vector<float> angle_, rate_;
  int count_ = 0;
  double worst_ = 0.0;
};

double roughness(const std::function<void(Characters&, int)>& disturb) {
  Characters characters = one(testing::three_styles(), {.walking = true, .foot_lock = false});
  Smoothness smoothness;
  for (int k = 0; k < 1200; ++k) {
    disturb(characters, k);
    characters.step();
    smoothness.see(characters);
  }
  return smoothness.worst();
}

TEST(Characters, NothingTheyAreToldMakesAJump) {
  const double quiet = roughness([](Characters&, int) {});
  const std::vector<double> brisk = {0.0, 0.0, 1.0}, slow = {0.0, 1.0, 0.0};
  EXPECT_LT(roughness([&](Characters& w, int k) {
              if (k == 300) w.walk(0).style().wish(brisk, 0.0);
              if (k == 700) w.walk(0).style().wish(slow, 0.5);
            }),
            2.5 * quiet);
  EXPECT_LT(roughness([](Characters& w, int k) {
              if (k == 300) w.walk(0).stop();
              if (k == 700) w.walk(0).walk_to({9.0, 1.0});
            }),
            1.5 * quiet);
  EXPECT_LT(roughness([](Characters& w, int k) {  // from the opposite phase
              if (k == 300) w.set_beat(w.state(0).phase_rad + std::numbers::pi, 6.5);
            }),
            2.5 * quiet);
  EXPECT_LT(roughness([](Characters& w, int k) {
              if (k == 300) w.set_gait(0, {7.0, 0.3, 1.0}, 0.3);
              if (k == 700) w.release(0);
            }),
            2.5 * quiet);
}

TEST(Characters, LockToABeat) {
  for (const double offset : {0.5, std::numbers::pi, -2.0}) {
    Characters characters = one(testing::three_styles(), {.walking = true});
    run(characters, 1.0);
    double beat = characters.state(0).phase_rad + offset;
    characters.set_beat(beat, 7.0);
    for (int k = 0; k < 1600; ++k) {
      characters.step();
      beat += 7.0 * kCharactersDt;
      EXPECT_GT(characters.state(0).phase_rate_rad_s, 0.4 * 2.0 * std::numbers::pi);
      EXPECT_LT(characters.state(0).phase_rate_rad_s, 1.7 * 7.0);
    }
    EXPECT_NEAR(math::wrap_pi(characters.state(0).phase_rad - beat), 0.0, 0.01) << offset;
    EXPECT_NEAR(characters.state(0).phase_rate_rad_s, 7.0, 0.05);
    characters.end_beat();
    run(characters, 2.0);
    EXPECT_NEAR(characters.state(0).phase_rate_rad_s, 2.0 * std::numbers::pi, 0.01);
  }
}

TEST(Characters, ABeatTooFastIsFollowedAsFarAsOneCan) {
  Characters characters = one(testing::three_styles(), {.walking = true});
  characters.set_beat(0.0, 30.0);
  for (int k = 0; k < 1000; ++k) {
    characters.step();
    EXPECT_LT(characters.state(0).phase_rate_rad_s, 1.6 * 2.0 * std::numbers::pi / 0.6);
  }
}

TEST(Characters, StartWithTheFootOfTheBeat) {
  Characters characters = one(testing::three_styles());
  characters.set_beat(std::numbers::pi, 2.0 * std::numbers::pi);
  characters.walk(0).walk_to({5.0, 0.0});
  characters.step();
  EXPECT_NEAR(characters.state(0).phase_rad, std::numbers::pi, 0.2);
}

TEST(Characters, ObeyTheCoordinator) {
  Characters characters = one(testing::three_styles());
  run(characters, 0.5);
  EXPECT_EQ(characters.walk(0).stage(), Stage::standing);
  double phase = 1.0;
  characters.set_gait(0, {6.8, 0.4, 0.9}, phase);
  for (int k = 0; k < 1600; ++k) {
    characters.step();
    phase += 6.8 * kCharactersDt;
  }
  EXPECT_NEAR(math::wrap_pi(characters.state(0).phase_rad - phase), 0.0, 0.01);
  EXPECT_NEAR(characters.state(0).root.heading_rad, 0.9, 0.1);
  Eigen::Vector2d before = characters.state(0).root.position_W_m;
  run(characters, 5.0 * 2.0 * std::numbers::pi / 6.8);  // ten steps
  EXPECT_NEAR((characters.state(0).root.position_W_m - before).norm(), 4.0, 0.25);

  characters.set_gait(0, {.step_length_m = 5.0}, {});  // clamped to longest_step
  run(characters, 2.0);
  before = characters.state(0).root.position_W_m;
  run(characters, 5.0);
  EXPECT_NEAR((characters.state(0).root.position_W_m - before).norm(), 5.0 * 1.15, 0.35);

  characters.release(0);
  run(characters, 3.0);
  EXPECT_EQ(characters.walk(0).stage(), Stage::standing);
  EXPECT_NEAR(characters.state(0).root.heading_rad, 0.9, 0.1);
  characters.set_gait(0, {6.8, 0.4, 0.9}, phase);  // it is back
  run(characters, 3.0);
  EXPECT_EQ(characters.walk(0).stage(), Stage::walking);
}

TEST(Characters, TheCoordinatorGoesBeforeTheBeat) {
  Characters characters = one(testing::three_styles(), {.walking = true});
  double phase = 2.0;
  characters.set_beat(0.0, 6.0);
  characters.set_gait(0, {.phase_rate_rad_s = 6.6}, phase);
  for (int k = 0; k < 1600; ++k) {
    characters.step();
    phase += 6.6 * kCharactersDt;
  }
  EXPECT_NEAR(math::wrap_pi(characters.state(0).phase_rad - phase), 0.0, 0.01);
}

TEST(Characters, WhoWasToldToStopIsNotMovedByTheCoordinator) {
  Characters characters = one(testing::three_styles());
  characters.walk(0).stop();
  characters.set_gait(0, {.heading_rad = 1.0}, 0.0);
  run(characters, 1.0);
  EXPECT_EQ(characters.walk(0).stage(), Stage::standing);
}

TEST(Characters, TellThatAGoalComesNoNearer) {
  Characters characters = one(testing::three_styles(), {.walk = {.give_up_s = 3.0}});
  characters.walk(0).walk_to({50.0, 0.0});
  characters.set_gait(0, {.heading_rad = 1.7}, {});  // the coordinator leads away from it
  run(characters, 3.0);
  EXPECT_FALSE(characters.walk(0).stuck());
  run(characters, 5.0);
  EXPECT_TRUE(characters.walk(0).stuck());
  characters.release(0);
  run(characters, 12.0);
  EXPECT_FALSE(characters.walk(0).stuck());
}

TEST(Characters, FreeDelaysAreBlendedToo) {  // each pattern of the model has delays of its own
  const motion::MotionModel model = testing::three_styles();
  ASSERT_FALSE(model.tied);
  Characters characters = one(model, {.walking = true, .foot_lock = false});
  characters.walk(0).style().wish(std::vector<double>{0.5, 0.5, 0.0}, 0.5);
  run(characters, 3.0);
  const Repertoire& repertoire = characters.repertoire();
  const std::vector<MotionParameters> parts = {
      repertoire.motion(repertoire.style(0).straight).parameters,
      repertoire.motion(repertoire.style(1).straight).parameters};
  MotionParameters mixed = parts[0];
  blend(parts, std::vector<double>{0.5, 0.5}, mixed);
  CharacterBatch batch(repertoire.model(), 1, {.dt_s = kCharactersDt, .individual = true});
  batch.set_parameters(0, mixed.mean_rad, mixed.weight_rad, mixed.delay_rad,
                       std::vector<double>(repertoire.motions().size(), 0.0));
  batch.set_frequency(0, 0.0);
  batch.set_phase(0, characters.state(0).phase_rad);
  batch.step();
  for (std::size_t r = 0; r < 51; ++r) {
    EXPECT_NEAR(characters.angles(0)[r], batch.angles(0)[r], 2e-3) << r;
  }
}

TEST(Characters, ARobotsJointsAreSynthesizedButGetNowhere) {
  Characters characters = one(testing::robot_model(), {.walking = true});
  EXPECT_FALSE(characters.moves());
  run(characters, 1.0);
  EXPECT_EQ(characters.angles(0).size(), 51U);
  EXPECT_GT(std::abs(characters.angles(0)[7]), 1e-4F);
}

TEST(Characters, RefuseAnUnknownStyle) {
  const std::string refused =
      mimesis::testing::refusal([&] { one(testing::three_styles(), {.style = "happy"}); });
  EXPECT_EQ(refused, "style: 'happy' is none of the model's: walk, slow, brisk");
}

TEST(Characters, DependOnNothingButTheirOwnInputs) {
  const motion::MotionModel model = testing::three_styles(true);
  const auto starts = form(37, {.arrangement = "circle", .spread_phases = true});
  Characters crowd(model, starts, {.walk = {.dt_s = kCharactersDt}});
  Characters alone(model, {&starts[20], 1}, {.walk = {.dt_s = kCharactersDt}});
  for (int i = 0; i < 37; ++i) crowd.walk(i).walk_to({0.1 * i, 3.0});
  alone.walk(0).walk_to({2.0, 3.0});
  for (int k = 0; k < 600; ++k) {
    crowd.step();
    alone.step();
  }
  EXPECT_EQ(crowd.state(20).root.position_W_m, alone.state(0).root.position_W_m);
  EXPECT_EQ(crowd.state(20).phase_rad, alone.state(0).phase_rad);
  EXPECT_EQ(std::memcmp(crowd.angles(20).data(), alone.angles(0).data(), 51 * sizeof(float)), 0);
}

TEST(Characters, DoNotAllocate) {
  const auto starts = form(20, {});
  for (const bool tied : {false, true}) {
    motion::MotionModel model = tied ? testing::random_model(1) : testing::three_styles();
    Characters characters(model, starts, {.walk = {.dt_s = kCharactersDt}, .walking = true});
    const std::vector<double> shares = {0.2, 0.3, 0.5};
    const mimesis::testing::NoMalloc guard;
    for (int k = 0; k < 400; ++k) {
      if (k == 10) characters.set_beat(0.0, 6.0);
      if (k == 50) characters.walk(3).style().wish(shares, 0.0);
      if (k == 60) characters.walk(4).walk_to({3.0, 4.0});
      if (k == 70) characters.set_gait(5, {6.0, 0.5, 1.0}, 1.0);
      if (k == 90) characters.walk(6).stop();
      characters.step();
    }
  }
}

TEST(Formation, KeepsItsSpacing) {
  for (const char* arrangement : {"row", "circle", "grid"}) {
    const auto starts = form(17, {.arrangement = arrangement,
                                  .spacing_m = 1.5,
                                  .centre_W_m = {3.0, -2.0},
                                  .heading_rad = 0.6});
    Eigen::Vector2d sum(0.0, 0.0);
    double nearest = 1e9;
    for (const CharacterStart& a : starts) {
      sum += a.position_W_m;
      for (const CharacterStart& b : starts) {
        if (&a != &b) nearest = std::min(nearest, (a.position_W_m - b.position_W_m).norm());
      }
    }
    EXPECT_NEAR(nearest, 1.5, 1e-9);
    EXPECT_LT((sum / 17.0 - Eigen::Vector2d(3.0, -2.0)).norm(), 0.8);
  }
  const auto circle = form(4, {.arrangement = "circle"});
  for (const CharacterStart& s : circle) {  // all look to the middle
    const Eigen::Vector2d ahead(std::cos(s.heading_rad), std::sin(s.heading_rad));
    EXPECT_NEAR(ahead.dot(s.position_W_m.normalized()), -1.0, 1e-9);
  }
  EXPECT_EQ(form(1, {}).front().position_W_m, Eigen::Vector2d(0.0, 0.0));
}

}  // namespace
}  // namespace mimesis::synthesizer
