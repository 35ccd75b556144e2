#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/math/circle.h"
#include "common/testing/no_malloc.h"
#include "nodes/synthesizer/director.h"
#include "nodes/synthesizer/sequence/trials.h"
#include "nodes/synthesizer/test/models.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kFigureDt = 0.005;

const ActionMaps& actions() {
  static const ActionMaps maps(
      learn_drawer_model(generate_drawer_data(mocap::standard_body(), Drawer{}, {.trials = 6})));
  return maps;
}

/// One character, its path, and how smooth it is.
class FigureRig {
 public:
  explicit FigureRig(const ActionMaps* maps = &actions(), const CharacterStart& start = {})
      : FigureRig(testing::three_styles(), maps, start) {}
  FigureRig(const motion::MotionModel& model, const ActionMaps* maps,
            const CharacterStart& start = {})
      : owner_(make_figure_director(model, {&start, 1}, settings(), maps)) {}

  /// Until the goal is reached or `limit_s` is over. True: reached.
  bool run(double limit_s) {
    for (int k = 0; k < std::lround(limit_s / kFigureDt); ++k) {
      director().step(nullptr, {});
      watch();
      if (director().progress(0).reached) return true;
    }
    return false;
  }

  Director& director() { return *owner_; }
  double longest_jump_m = 0.0, largest_jump_rad = 0.0;  // in one step, of pelvis and rows
  double largest_kick_rad_s = 0.0;                      // change of a row's rate in one step
  double lowest_m = 1.0, sole_m = 0.0;                  // lower sole: of all steps, of the last
  double flexion_rad = 1.0;                             // the least
  std::vector<std::string> actions_seen;

 private:
  static CharactersSettings settings() {
    CharactersSettings s;
    s.walk.dt_s = kFigureDt;
    return s;
  }
  void watch() {
    const CharacterState& state = director().state(0);
    const auto angles = director().angles(0);
    std::vector<double> jumps(last_.size());
    if (!last_.empty()) {
      const Eigen::Vector3d p(state.root.position_W_m.x(), state.root.position_W_m.y(),
                              state.root.height_m);
      longest_jump_m = std::max(longest_jump_m, (p - place_).norm());
      for (std::size_t r = 0; r < angles.size(); ++r) {
        const double jump = static_cast<double>(angles[r]) - static_cast<double>(last_[r]);
        largest_jump_rad = std::max(largest_jump_rad, std::abs(jump));
        if (jump_.size() > r && in_sequence_ != (director().plan(0) != nullptr)) {
          largest_kick_rad_s = std::max(largest_kick_rad_s, std::abs(jump - jump_[r]) / kFigureDt);
        }
        jumps[r] = jump;
      }
    }
    std::array<double, mocap::kBodyRows> rows;
    std::copy(angles.begin(), angles.end(), rows.begin());
    const mocap::Body& body = director().characters().repertoire().model().body;
    const auto pose = mocap::forward_kinematics(
        body, std::span<const double, mocap::kBodyRows>(rows), {0.0, 0.0, state.root.height_m});
    double lower = 1.0;
    for (const std::size_t s : {0U, 1U}) {
      const int ankle = s == 0 ? mocap::kLeftAnkle : mocap::kRightAnkle;
      lower = std::min(
          {lower, pose.point(ankle, body.heel_m[s]).z(), pose.point(ankle, body.toe_m[s]).z()});
      flexion_rad = std::min(flexion_rad, rows[static_cast<std::size_t>(3 * ankle - 2)]);
    }
    lowest_m = std::min(lowest_m, lower);
    sole_m = lower;
    place_ << state.root.position_W_m, state.root.height_m;
    jump_ = jumps;
    in_sequence_ = director().plan(0) != nullptr;
    last_.assign(angles.begin(), angles.end());
    if (actions_seen.empty() || actions_seen.back() != director().motion(0).action) {
      actions_seen.emplace_back(director().motion(0).action);
    }
  }
  std::unique_ptr<Director> owner_;
  Eigen::Vector3d place_;
  std::vector<float> last_;
  std::vector<double> jump_;
  bool in_sequence_ = false;
};

TEST(FigureDirector, GoesToADrawerAndTakesWhatIsInIt) {
  for (const double far : {1.5, 2.6, 4.4, 9.0}) {
    FigureRig rig;
    ASSERT_EQ(rig.director().to_drawer(0, {{far, 0.0}, 0.2}), "");
    EXPECT_TRUE(rig.run(25.0)) << far << " " << rig.director().progress(0).reason;
    EXPECT_NEAR(rig.director().progress(0).distance_m, 0.60, 0.13) << far;
    EXPECT_NEAR(rig.director().state(0).root.position_W_m.x(), far - 0.6, 0.13);
    EXPECT_EQ(rig.actions_seen.back(), "take");
    EXPECT_LT(rig.longest_jump_m, 0.04) << far;  // in 5 ms
    EXPECT_LT(rig.largest_jump_rad, 0.12) << far;
  }
}

TEST(FigureDirector, AnyBodyStandsOnTheGroundAtADrawer) {
  motion::MotionModel model =
      motion::load_motion_model(MIMESIS_SOURCE_DIR "/models/walk.motion.json");
  for (const double size : {0.85, 1.0, 1.1}) {  // of the body that plays
    motion::MotionModel sized = model;
    for (auto& p : sized.body.offset_m) p *= size;
    for (auto* points : {&sized.body.toe_m, &sized.body.heel_m, &sized.body.hand_m}) {
      for (auto& p : *points) p *= size;
    }
    FigureRig rig(sized, &actions());
    ASSERT_EQ(rig.director().to_drawer(0, {{4.0, 0.0}, 0.2}), "");
    EXPECT_TRUE(rig.run(20.0)) << size;
    EXPECT_GT(rig.lowest_m, -0.002) << size;  // a body of another height sank by 23 mm
    EXPECT_LT(rig.sole_m, 0.002) << size;
    EXPECT_GT(rig.flexion_rad, -0.035) << size;
  }
}

TEST(FigureDirector, TurnsToADrawerThatIsAside) {
  FigureRig rig;
  ASSERT_EQ(rig.director().to_drawer(0, {{1.0, 5.0}, 0.2}), "");
  EXPECT_TRUE(rig.run(25.0));
  const RootPose& root = rig.director().state(0).root;
  EXPECT_NEAR((root.position_W_m - Eigen::Vector2d(1.0, 5.0)).norm(), 0.6, 0.13);
  const Eigen::Vector2d to = Eigen::Vector2d(1.0, 5.0) - root.position_W_m;
  EXPECT_NEAR(math::wrap_pi(root.heading_rad - std::atan2(to.y(), to.x())), 0.0, 0.05);
  EXPECT_EQ(rig.actions_seen.front(), "start");
  EXPECT_LT(rig.largest_kick_rad_s, 1.0);
  EXPECT_GT(rig.largest_kick_rad_s, 0.0);
  EXPECT_LT(rig.longest_jump_m, 0.04);
}

TEST(FigureDirector, FollowsADrawerThatJumps) {
  FigureRig rig;
  ASSERT_EQ(rig.director().to_drawer(0, {{2.6, 0.0}, 0.2}), "");
  EXPECT_FALSE(rig.run(0.6));
  ASSERT_NE(rig.director().plan(0), nullptr);
  const std::size_t before = rig.director().plan(0)->size();
  ASSERT_EQ(rig.director().to_drawer(0, {{3.9, 0.0}, 0.2}), "");  // along the way
  EXPECT_FALSE(rig.run(0.1));
  EXPECT_GT(rig.director().plan(0)->size(), before);
  EXPECT_TRUE(rig.run(15.0));
  EXPECT_NEAR(rig.director().state(0).root.position_W_m.x(), 3.3, 0.13);
  EXPECT_LT(rig.longest_jump_m, 0.04);
}

TEST(FigureDirector, WalksAgainToADrawerThatJumpsAside) {
  FigureRig rig;
  ASSERT_EQ(rig.director().to_drawer(0, {{4.0, 0.0}, 0.2}), "");
  EXPECT_FALSE(rig.run(1.5));
  ASSERT_EQ(rig.director().to_drawer(0, {{4.0, 3.0}, 0.2}), "");
  EXPECT_EQ(rig.director().plan(0), nullptr);  // out of the sequence
  EXPECT_TRUE(rig.run(25.0));
  EXPECT_NEAR((rig.director().state(0).root.position_W_m - Eigen::Vector2d(4.0, 3.0)).norm(), 0.6,
              0.13);
  EXPECT_LT(rig.longest_jump_m, 0.04);
  EXPECT_LT(rig.largest_jump_rad, 0.15);
}

TEST(FigureDirector, AnotherGoalTakesItOut) {
  FigureRig rig;
  ASSERT_EQ(rig.director().to_drawer(0, {{2.6, 0.0}, 0.2}), "");
  EXPECT_TRUE(rig.run(15.0));
  rig.director().walk_to(0, {0.0, 0.0});
  EXPECT_EQ(rig.director().progress(0).kind, GoalKind::walk_to);
  EXPECT_TRUE(rig.run(20.0));
  EXPECT_LT(rig.director().state(0).root.position_W_m.norm(), 0.15);
  EXPECT_LT(rig.longest_jump_m, 0.04);

  ASSERT_EQ(rig.director().to_drawer(0, {{5.0, 0.0}, 0.2}), "");
  EXPECT_FALSE(rig.run(6.0));
  rig.director().stop(0);
  EXPECT_TRUE(rig.run(2.5));
  EXPECT_STREQ(rig.director().motion(0).action, "stand");
}

TEST(FigureDirector, WithoutADrawerItDoesNotAllocate) {
  FigureRig rig(nullptr);
  const mimesis::testing::NoMalloc guard;
  for (int k = 0; k < 500; ++k) {
    if (k == 50) rig.director().walk_to(0, {2.0, 1.0});
    if (k == 300) rig.director().stop(0);
    rig.director().step(nullptr, {});
  }
}

TEST(FigureDirector, SaysWhyNot) {
  FigureRig without(nullptr);
  EXPECT_EQ(without.director().to_drawer(0, {{2.6, 0.0}, 0.2}),
            "no actions for drawers are loaded (parameter drawer)");
  FigureRig rig;
  ASSERT_EQ(rig.director().to_drawer(0, {{0.2, 0.0}, 0.2}), "");  // no sequence leads there
  EXPECT_FALSE(rig.run(20.0));
  EXPECT_NE(rig.director().progress(0).reason, "");
  EXPECT_EQ(rig.director().progress(0).kind, GoalKind::drawer);
  const CharacterStart start;
  const auto robot = make_figure_director(testing::robot_model(), {&start, 1}, {}, &actions());
  EXPECT_EQ(robot->to_drawer(0, {{2.6, 0.0}, 0.2}), "the model's rows are not those of a body");
}

}  // namespace
}  // namespace mimesis::synthesizer
