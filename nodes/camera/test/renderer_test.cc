#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "nodes/camera/random_scene.h"

namespace mimesis::camera {
namespace {

Demonstration combination(int k) {
  return {k & 4 ? Grip::full : Grip::precision, k & 2 ? Transport::below : Transport::above,
          k & 1 ? Goal::low : Goal::high};
}

TEST(Demonstration, IsRefusedWhereTheHandDoesNotFitBelowTheBar) {
  TeacherTable table;
  table.bar_height_m = 0.15;
  EXPECT_THROW(check_passable({Grip::precision, Transport::below, Goal::low}, table), ConfigError);
  EXPECT_NO_THROW(check_passable({Grip::full, Transport::below, Goal::low}, table));
  EXPECT_NO_THROW(check_passable({Grip::precision, Transport::above, Goal::low}, table));
  table.bar_removed = true;
  EXPECT_NO_THROW(check_passable({Grip::precision, Transport::below, Goal::low}, table));
}

class EveryDemonstration : public ::testing::TestWithParam<int> {};

TEST_P(EveryDemonstration, CarriesTheObjectPastTheBarOnTheRightSideToTheGoal) {
  const TeacherTable table;
  TeacherScript script;
  script.demonstration = combination(GetParam());
  const TeacherMotion motion(script, table);
  const double half = 0.5 * table.object_height_m;
  for (double t = 0.0; t < motion.end_s(); t += 0.005) {
    const TeacherPose pose = motion.pose(t);
    EXPECT_GT(pose.object.y(), half - 1e-9);  // never in the table
    if (std::abs(pose.object.x()) > 0.5 * table.bar_width_m + table.object_radius_m) continue;
    if (script.demonstration.transport == Transport::above) {
      EXPECT_GT(pose.object.y() - half, table.bar_height_m + table.bar_thickness_m);
    } else {
      EXPECT_LT(pose.object.y() + half, table.bar_height_m);
    }
  }
  const TeacherPose end = motion.pose(motion.end_s() + 1.0);
  const bool high = script.demonstration.goal == Goal::high;
  EXPECT_NEAR(end.object.x(), high ? table.goal_high_x_m : table.goal_low_x_m, 1e-9);
  EXPECT_NEAR(end.object.y(), (high ? table.goal_high_y_m : table.goal_low_y_m) + half, 1e-9);
  EXPECT_LT(end.palm.x(), -0.6);  // withdrawn
}

TEST_P(EveryDemonstration, MovesWithoutJumps) {
  TeacherScript script;
  script.demonstration = combination(GetParam());
  const TeacherMotion motion(script, TeacherTable{});
  constexpr double kStep = 0.002;
  Eigen::Vector3d wrist = motion.pose(0.0).wrist, object = motion.pose(0.0).object;
  for (double t = kStep; t < motion.end_s(); t += kStep) {
    const TeacherPose pose = motion.pose(t);
    EXPECT_LT((pose.wrist - wrist).norm(), 2.5 * kStep) << t;  // 2.5 m/s
    EXPECT_LT((pose.object - object).norm(), 2.5 * kStep) << t;
    wrist = pose.wrist;
    object = pose.object;
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryDemonstration, ::testing::Range(0, 8));

TEST(TeacherMotion, StaysAtTheObjectIfOnlyTheGraspIsShown) {
  TeacherScript script;
  script.only_grasp = true;
  const TeacherTable table;
  const TeacherPose pose = TeacherMotion(script, table).pose(60.0);
  EXPECT_TRUE(pose.held);
  EXPECT_NEAR(pose.object.x(), table.object_x_m, 1e-12);
  EXPECT_EQ(pose.closure, 1.0);
}

TEST(RayScene, MeetsBoxCylinderAndTableWhereTheyAre) {
  RayScene scene{Room{}};
  scene.add_box({0.0, 0.5, 0.0}, {0.1, 0.1, 0.1}, Bgr(1, 2, 3));
  scene.add_cylinder({1.0, 0.0, 0.0}, 0.2, 0.6, Bgr(4, 5, 6), Bgr(7, 8, 9));
  const auto box = scene.trace({0.0, 0.5, 2.0}, -Eigen::Vector3d::UnitZ());
  ASSERT_TRUE(box);
  EXPECT_NEAR(box->distance, 1.9, 1e-12);
  EXPECT_TRUE(box->normal.isApprox(Eigen::Vector3d::UnitZ()));
  const auto side = scene.trace({1.0, 0.3, 2.0}, -Eigen::Vector3d::UnitZ());
  ASSERT_TRUE(side);
  EXPECT_NEAR(side->distance, 1.8, 1e-12);
  EXPECT_EQ(side->color, Bgr(4, 5, 6));
  const auto top = scene.trace({1.0, 2.0, 0.0}, -Eigen::Vector3d::UnitY());
  ASSERT_TRUE(top);
  EXPECT_NEAR(top->distance, 1.4, 1e-12);
  EXPECT_EQ(top->color, Bgr(7, 8, 9));
  const auto table = scene.trace({0.5, 2.0, 0.5}, -Eigen::Vector3d::UnitY());
  ASSERT_TRUE(table);
  EXPECT_NEAR(table->distance, 2.0, 1e-12);
  EXPECT_TRUE(scene.blocked({0.0, 0.5, 2.0}, {0.0, 0.5, -2.0}));
  EXPECT_FALSE(scene.blocked({0.0, 0.5, 2.0}, {0.0, 0.5, 1.0}));
  EXPECT_FALSE(scene.trace({0.0, 1.0, 2.0}, Eigen::Vector3d::UnitZ()));
}

TEST(PictureFaults, GainWarmthAndNoiseAreWhatTheySay) {
  image::Image grey(64, 48);
  std::fill(grey.bgr.begin(), grey.bgr.end(), std::uint8_t{100});
  image::Image lit = grey;
  PictureFaults({0.0, 0.0, 1.2, 1.25}, 1).apply(0, lit);
  EXPECT_EQ(lit.at(3, 3)[0], 96);
  EXPECT_EQ(lit.at(3, 3)[1], 120);
  EXPECT_EQ(lit.at(3, 3)[2], 150);

  image::Image noisy = grey, again = grey, later = grey;
  const PictureFaults noise({8.0, 0.0, 1.0, 1.0}, 1);
  noise.apply(1, noisy);
  noise.apply(1, again);
  noise.apply(2, later);
  EXPECT_EQ(noisy.bgr, again.bgr);
  EXPECT_NE(noisy.bgr, later.bgr);
  double sum = 0.0, squares = 0.0;
  for (const std::uint8_t byte : noisy.bgr) {
    sum += byte - 100.0;
    squares += (byte - 100.0) * (byte - 100.0);
  }
  const auto n = static_cast<double>(noisy.bgr.size());
  EXPECT_NEAR(sum / n, 0.0, 0.3);
  EXPECT_NEAR(std::sqrt(squares / n), 8.0, 0.3);
}

TEST(Renderer, DrawsTheObjectWhereTheTruthIs) {
  Picture picture;
  picture.faults = {0.0, 0.0, 1.0, 1.0};
  Renderer renderer(picture);
  const image::Camera camera(picture.view);
  image::Image frame;
  for (const double t : {0.0, 3.4, 7.0}) {
    renderer.render(t, frame);
    const Truth truth = renderer.truth(t);
    const Eigen::Vector2d p = camera.project({truth.object.x(), truth.object.y() - 0.02, 0.0});
    const std::uint8_t* pixel =
        frame.at(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
    EXPECT_GT(pixel[1], pixel[0] + 30) << t;  // green
    EXPECT_GT(pixel[1], pixel[2] + 30) << t;
  }
}

TEST(Passer, CrossesTheViewOnceFromTheSideItComesFrom) {
  for (const double speed : {-0.8, 0.8}) {
    const Passer passer{2.0, speed, 0.35, 0.1, 0.01, Bgr::Zero()};
    EXPECT_FALSE(passer.at(1.99));
    const auto first = passer.at(2.0), later = passer.at(3.0);
    ASSERT_TRUE(first && later);
    EXPECT_NEAR(first->a.x(), speed < 0.0 ? 1.0 : -1.0, 1e-12);
    EXPECT_NEAR(later->a.x() - first->a.x(), speed, 1e-12);
    EXPECT_DOUBLE_EQ(later->a.z(), 0.35);
    EXPECT_NEAR(later->b.x() - later->a.x(), 0.1 * later->b.y(), 1e-12);
    EXPECT_FALSE(passer.at(2.0 + 2.01 / 0.8));
  }
  EXPECT_FALSE(Passer{}.at(1.0));
}

TEST(Passer, IsBeforeHandAndTable) {
  Picture with;
  with.faults = {0.0, 0.0, 1.0, 1.0};
  with.passer = {0.0, 1.0, 0.35, 0.0, 0.02, Bgr(10.0f, 10.0f, 10.0f)};
  Renderer renderer(with);
  image::Image image;
  renderer.render(1.0, image);  // in the middle
  const image::Camera camera{with.view};
  const Eigen::Vector2d p = camera.project({0.0, 0.2, 0.35});
  EXPECT_LT(image.at(static_cast<int>(p.x()), static_cast<int>(p.y()))[1], 15);
}

TEST(Looks, TheSleeveEndsWhereTheForearmIsBare) {
  const TeacherMotion motion({}, {});
  for (const double bare : {0.1, 0.55, 0.9}) {
    Looks looks;
    looks.bare = bare;
    std::vector<Capsule> arm;
    const TeacherPose pose = motion.pose(1.0);
    hand_capsules(pose, Grip::full, looks, arm);
    const Eigen::Vector3d end = pose.wrist + bare * (pose.elbow - pose.wrist);
    const auto ends = [&](const Capsule& c, const Bgr& color) {
      return c.color == color && std::min((c.a - end).norm(), (c.b - end).norm()) < 1e-12;
    };
    EXPECT_EQ(std::ranges::count_if(arm, [&](const Capsule& c) { return ends(c, looks.skin); }), 1);
    EXPECT_EQ(std::ranges::count_if(arm, [&](const Capsule& c) { return ends(c, looks.cloth); }),
              1);
  }
}

TEST(Looks, ARightHandIsTheMirrorImage) {
  const TeacherPose pose = TeacherMotion({}, {}).pose(2.0);
  const Eigen::Vector3d side = pose.palm_normal.cross(pose.fingers).normalized();
  Looks right;
  right.right_hand = true;
  std::vector<Capsule> of_left, of_right;
  hand_capsules(pose, Grip::full, {}, of_left);
  hand_capsules(pose, Grip::full, right, of_right);
  ASSERT_EQ(of_left.size(), of_right.size());
  constexpr std::size_t kArm = 3;  // the same of both
  double thumb = 0.0;
  for (std::size_t i = kArm; i < of_left.size(); ++i) {
    const auto mirrored = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
      return p - 2.0 * (p - pose.wrist).dot(side) * side;
    };
    EXPECT_LT((of_right[i].a - mirrored(of_left[i].a)).norm(), 1e-12) << i;
    EXPECT_LT((of_right[i].b - mirrored(of_left[i].b)).norm(), 1e-12) << i;
    thumb = std::max(thumb, (of_left[i].b - pose.wrist).dot(side));
  }
  EXPECT_GT(thumb, 0.05);  // of a left one it points to n x fingers
}

TEST(RandomScene, DrawsTableLightTeacherAndWhatIsInTheWayFromItsSeed) {
  int passers = 0, like_skin = 0, right_hands = 0;
  double least_bare = 1.0, most_bare = 0.0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Picture a = random_scene({}, seed).picture, b = random_scene({}, seed).picture;
    EXPECT_EQ(a.room.lamp_m, b.room.lamp_m);
    EXPECT_EQ(a.looks.skin, b.looks.skin);
    EXPECT_NE(a.room.wood, random_scene({}, seed + 1).picture.room.wood);
    passers += a.passer.begin_s >= 0.0 ? 1 : 0;
    like_skin += a.skin_clutter;
    EXPECT_LE(a.skin_clutter, a.clutter);
    right_hands += a.looks.right_hand ? 1 : 0;
    least_bare = std::min(least_bare, a.looks.bare);
    most_bare = std::max(most_bare, a.looks.bare);
  }
  EXPECT_GT(passers, 15);
  EXPECT_LT(passers, 40);
  EXPECT_GT(like_skin, 20);
  EXPECT_GT(right_hands, 10);
  EXPECT_LT(right_hands, 30);
  EXPECT_LT(least_bare, 0.15);
  EXPECT_GT(most_bare, 0.75);
}

}  // namespace
}  // namespace mimesis::camera
