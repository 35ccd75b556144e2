#include "nodes/vision/stereo_scene.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include "nodes/vision/robot_table.h"
#include "nodes/vision/solids.h"

namespace mimesis::vision {
namespace {

using Eigen::Vector3d;

/// Two cameras `baseline_m` apart; the right one is turned inwards a little.
std::array<image::Camera, 2> pair(double baseline_m = 0.3) {
  image::View left, right;
  left.eye_m = {0.4 - 0.5 * baseline_m, 0.5, 1.0};
  right.eye_m = {0.4 + 0.5 * baseline_m, 0.52, 1.05};
  right.target_m = {0.02, 0.12, 0.0};
  return {image::Camera(left), image::Camera(right)};
}

std::array<Outline, 2> seen(const Solid& solid, const std::array<image::Camera, 2>& cameras) {
  return {outline(cameras[0], solid.body(), solid.center),
          outline(cameras[1], solid.body(), solid.center)};
}

/// A region with the given outline, as if its pixels had these sums.
Region region(Kind kind, const Outline& o) {
  Region r{kind, {}};
  Moments& m = r.moments;
  m.area = o.area;
  m.u = o.area * o.mean.x();
  m.v = o.area * o.mean.y();
  m.uu = o.area * (o.spread(0, 0) + o.mean.x() * o.mean.x() - 1.0 / 12.0);
  m.uv = o.area * (o.spread(0, 1) + o.mean.x() * o.mean.y());
  m.vv = o.area * (o.spread(1, 1) + o.mean.y() * o.mean.y() - 1.0 / 12.0);
  return r;
}

TEST(Outline, OfASquareBeforeTheCameraIsThatOfItsSides) {
  image::View view;
  view.eye_m = {0.0, 0.0, 2.0};
  view.target_m = {0.0, 0.0, 0.0};
  const image::Camera camera{view};
  const double w = 0.2 * 740.0 / 2.0, h = 0.1 * 740.0 / 2.0;  // [px]
  const Outline o = outline(camera, box(0.2, 0.1, 1e-9), Vector3d::Zero());
  EXPECT_NEAR(o.area, w * h, 1e-4);
  EXPECT_NEAR((o.mean - Eigen::Vector2d(319.5, 239.5)).norm(), 0.0, 1e-6);
  EXPECT_NEAR(o.spread(0, 0), w * w / 12.0, 1e-4);
  EXPECT_NEAR(o.spread(1, 1), h * h / 12.0, 1e-4);
  EXPECT_NEAR(o.spread(0, 1), 0.0, 1e-6);
}

TEST(FitSolid, FindsPlaceAndSizesOfEveryForm) {
  std::mt19937 random(11);
  const auto between = [&random](double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random);
  };
  const auto cameras = pair();
  for (int k = 0; k < 60; ++k) {
    Solid solid;
    solid.form = static_cast<Form>(k % 3);
    solid.center = {between(-0.3, 0.4), between(0.02, 0.3), between(-0.15, 0.15)};
    solid.half_width = between(0.015, 0.05);
    solid.length = solid.form == Form::bar ? between(0.15, 0.5) : between(0.02, 0.12);
    if (solid.form == Form::bar) {
      solid.half_width = between(0.01, 0.025);
      solid.yaw_rad = between(-1.5, 1.5);
      solid.aspect = between(0.8, 1.2);
    }
    const auto found = fit_solid(solid, cameras, seen(solid, cameras), 0.15);
    ASSERT_TRUE(found) << k;
    EXPECT_NEAR((found->solid.center - solid.center).norm(), 0.0, 2e-4) << k;
    EXPECT_NEAR(found->solid.half_width, solid.half_width, 0.01 * solid.half_width) << k;
    EXPECT_NEAR(found->solid.length, solid.length, 0.01 * solid.length) << k;
    if (solid.form == Form::bar) {
      EXPECT_NEAR(std::remainder(found->solid.yaw_rad - solid.yaw_rad, std::numbers::pi), 0.0, 0.01)
          << k;
    }
  }
}

TEST(FitSolid, IsUncertainAlongTheLineOfSightByTheBaseline) {
  Solid solid{Form::cylinder, {0.1, 0.05, 0.0}, 0.03, 0.08};
  double before = 0.0;
  for (const double baseline : {0.4, 0.2, 0.1}) {
    const auto cameras = pair(baseline);
    const auto found = fit_solid(solid, cameras, seen(solid, cameras), 0.2);
    ASSERT_TRUE(found);
    const Vector3d ray = (solid.center - cameras[0].eye()).normalized();
    const double along = std::sqrt(ray.dot(found->covariance_m2 * ray));
    const double depth = cameras[0].depth(solid.center);
    // Sizes tell a little of depths, too, and the cameras stand 50 mm one behind the other.
    EXPECT_NEAR(along, depth * depth / 740.0 / baseline * 0.2 * std::sqrt(2.0), 0.35 * along);
    EXPECT_GT(along, 1.5 * before);
    before = along;
  }
}

TEST(StereoScene, TellsTwoThingsOfOneColourApartInOneRow) {
  const auto cameras = pair();
  StereoScene scene(cameras[0], cameras[1], SceneLimits{});
  const Solid a{Form::cylinder, {-0.2, 0.04, 0.0}, 0.03, 0.08};
  Solid b = a;
  b.center.x() = 0.1;
  std::vector<Region> left, right;
  for (const Solid& s : {a, b}) {
    left.push_back(region(Kind::object, seen(s, cameras)[0]));
    right.insert(right.begin(), region(Kind::object, seen(s, cameras)[1]));
  }
  for (int i = 0; i < 10; ++i) scene.update(left, right);
  const auto things = scene.of(Kind::object);
  ASSERT_EQ(things.size(), 2u);
  const bool first = things[0].solid.center.x() < 0.0;
  EXPECT_NEAR((things[first ? 0 : 1].solid.center - a.center).norm(), 0.0, 1e-3);
  EXPECT_NEAR((things[first ? 1 : 0].solid.center - b.center).norm(), 0.0, 1e-3);
}

TEST(StereoScene, SaysWhatAppearsMovesAndGoesAndKeepsItsNumber) {
  const auto cameras = pair();
  SceneLimits limits;
  StereoScene scene(cameras[0], cameras[1], limits);
  Solid goal{Form::cylinder, {0.2, 0.06, 0.0}, 0.045, 0.02};
  std::vector<std::string> said;
  const auto show = [&](bool there, int pictures) {
    for (int i = 0; i < pictures; ++i) {
      std::vector<Region> left, right;
      if (there) {
        left.push_back(region(Kind::goal_low, seen(goal, cameras)[0]));
        right.push_back(region(Kind::goal_low, seen(goal, cameras)[1]));
      }
      scene.update(left, right);
      said.insert(said.end(), scene.changes().begin(), scene.changes().end());
    }
  };
  show(true, 20);
  ASSERT_EQ(scene.goals().size(), 1u);
  const int id = scene.goals()[0].id;
  show(false, limits.gone_pictures - 1);  // a hand before it
  EXPECT_EQ(scene.goals().size(), 1u);
  EXPECT_FALSE(scene.goals()[0].seen);
  goal.center.x() += 0.05;
  show(true, 10);
  ASSERT_EQ(scene.goals().size(), 1u);
  EXPECT_EQ(scene.goals()[0].id, id);
  EXPECT_NEAR((scene.goals()[0].solid.center - goal.center).norm(), 0.0, 1e-3);
  show(false, limits.gone_pictures + 1);
  EXPECT_TRUE(scene.goals().empty());
  ASSERT_EQ(said.size(), 3u);
  EXPECT_NE(said[0].find("goal_low 1 appeared at"), std::string::npos) << said[0];
  EXPECT_NE(said[1].find("goal_low 1 moved by 50 mm"), std::string::npos) << said[1];
  EXPECT_EQ(said[2], "goal_low 1 is gone");
}

/// Specks of noise may be of its class, one seen before the move, one after it.
TEST(StereoScene, SpecksDoNotHideThatAThingWasMoved) {
  const auto cameras = pair();
  StereoScene scene(cameras[0], cameras[1], SceneLimits{});
  Solid goal{Form::cylinder, {0.2, 0.06, 0.0}, 0.045, 0.02};
  const Solid before{Form::cylinder, {-0.3, 0.10, 0.0}, 0.006, 0.012},
      after{Form::cylinder, {-0.1, 0.20, 0.0}, 0.006, 0.012};
  std::vector<std::string> said;
  for (int i = 0; i < 30; ++i) {
    if (i == 20) goal.center.x() += 0.05;
    std::array<std::vector<Region>, 2> seen_by;
    for (std::size_t side = 0; side < 2; ++side) {
      seen_by[side].push_back(region(Kind::goal_low, seen(goal, cameras)[side]));
      const bool speck = i == 19 || i == 20 || i == 21;
      if (speck)
        seen_by[side].push_back(
            region(Kind::goal_low, seen(i == 19 ? before : after, cameras)[side]));
    }
    scene.update(seen_by[0], seen_by[1]);
    said.insert(said.end(), scene.changes().begin(), scene.changes().end());
  }
  ASSERT_EQ(said.size(), 2u);
  EXPECT_NE(said[1].find("goal_low 1 moved by 50 mm"), std::string::npos) << said[1];
}

/// Something of no class, so that only sizes and places tell that it hides a part of the thing.
TEST(StereoScene, WhatPassesBeforeAThingDoesNotMoveIt) {
  const auto cameras = pair();
  StereoScene scene(cameras[0], cameras[1], SceneLimits{});
  const Solid goal{Form::cylinder, {0.2, 0.06, 0.0}, 0.045, 0.02};
  std::vector<std::string> said;
  for (int i = 0; i < 60; ++i) {
    auto outlines = seen(goal, cameras);
    const double hidden = i < 20 || i > 33 ? 0.0 : std::min(0.01 * (i - 19), 0.1);
    outlines[1].mean.x() += 0.5 * hidden * std::sqrt(12.0 * outlines[1].spread(0, 0));
    outlines[1].area *= 1.0 - hidden;
    scene.update(std::array{region(Kind::goal_low, outlines[0])},
                 std::array{region(Kind::goal_low, outlines[1])});
    said.insert(said.end(), scene.changes().begin(), scene.changes().end());
    ASSERT_TRUE(i < 10 || scene.goals().size() == 1u) << i;
  }
  ASSERT_EQ(said.size(), 1u) << said.back();
  EXPECT_NEAR((scene.goals()[0].solid.center - goal.center).norm(), 0.0, 1e-3);
}

/// The middles of its two pictures are far from each other's epipolar lines.
TEST(StereoScene, ABarAcrossThePicturesIsOneThing) {
  std::mt19937 random(12);
  const auto between = [&random](double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random);
  };
  double most = 0.0;
  for (int k = 0; k < 300; ++k) {
    image::View left, right;
    left.eye_m = {between(-0.2, 0.4), between(0.7, 1.0), between(0.8, 1.2)};
    right.eye_m = {left.eye_m[0] + between(0.25, 0.4), left.eye_m[1] + between(-0.05, 0.05),
                   left.eye_m[2] + between(-0.15, 0.15)};
    left.target_m = right.target_m = {between(-0.1, 0.1), 0.25, 0.0};
    const std::array cameras{image::Camera(left), image::Camera(right)};
    Solid bar{Form::bar, {0.0, between(0.4, 0.48), 0.0}, 0.03, 0.74};
    bar.yaw_rad = between(-0.2, 0.2);
    const auto outlines = seen(bar, cameras);
    most = std::max(
        most, image::epipolar_distance(cameras[0], cameras[1], outlines[0].mean, outlines[1].mean));
    StereoScene scene(cameras[0], cameras[1], SceneLimits{});
    for (int i = 0; i < 8; ++i)
      scene.update(std::array{region(Kind::bar, outlines[0])},
                   std::array{region(Kind::bar, outlines[1])});
    ASSERT_NE(scene.bar(), nullptr) << k;
    EXPECT_NEAR((scene.bar()->solid.center - bar.center).norm(), 0.0, 2e-3) << k;
  }
  EXPECT_GT(most, SceneLimits{}.epipolar_px);  // else this shows nothing
}

TEST(StereoScene, CountsThingsThatDoNotMatchWhereCamerasAreSwapped) {
  const auto cameras = pair();
  const Solid object{Form::cylinder, {-0.2, 0.04, 0.0}, 0.03, 0.08},
      goal{Form::cylinder, {0.2, 0.06, 0.0}, 0.045, 0.02};
  for (const bool swapped : {false, true}) {
    StereoScene scene(cameras[0], cameras[1], SceneLimits{});
    std::array<std::vector<Region>, 2> regions;
    for (std::size_t side = 0; side < 2; ++side) {
      regions[side] = {region(Kind::object, seen(object, cameras)[side]),
                       region(Kind::goal_low, seen(goal, cameras)[side])};
    }
    for (int i = 0; i < 10; ++i) scene.update(regions[swapped ? 1 : 0], regions[swapped ? 0 : 1]);
    EXPECT_EQ(scene.unmatched(), swapped ? 2 : 0);
    EXPECT_EQ(scene.things().empty(), swapped);
  }
}

/// Things of every form about the table as the right camera sees them that was turned by an angle
/// about one of its axes (x: right, y: down, z: forward) after its calibration.
std::optional<double> rows_off(int axis, double angle_rad, unsigned seed) {
  std::mt19937 random(seed);
  const auto between = [&random](double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random);
  };
  const auto known = pair();
  auto turned = known;
  turned[1] = image::Camera(
      known[1].lens(),
      Eigen::AngleAxisd(angle_rad, Vector3d::Unit(axis)).toRotationMatrix() * known[1].R_CT(),
      known[1].eye());
  std::vector<std::pair<Kind, Solid>> things{
      {Kind::object, {Form::cylinder, {between(-0.3, -0.1), 0.05, 0.0}, 0.025, 0.1}},
      {Kind::bar, {Form::bar, {0.0, between(0.18, 0.25), 0.0}, 0.015, 0.5, between(0.5, 1.6)}},
      {Kind::goal_high, {Form::cylinder, {between(0.15, 0.35), 0.17, 0.02}, 0.045, 0.02}},
      {Kind::goal_low, {Form::cylinder, {between(0.1, 0.3), 0.06, 0.12}, 0.045, 0.02}}};
  StereoScene scene(known[0], known[1], SceneLimits{});
  std::normal_distribution<double> noise(0.0, 0.25);
  for (int i = 0; i < 40; ++i) {
    std::array<std::vector<Region>, 2> regions;
    for (const auto& [kind, solid] : things) {
      auto now = seen(solid, turned);
      for (std::size_t side = 0; side < 2; ++side) {
        now[side].mean += Eigen::Vector2d(noise(random), noise(random));
        regions[side].push_back(region(kind, now[side]));
      }
    }
    scene.update(regions[0], regions[1]);
  }
  // A far outlier has no partner at all.
  return scene.unmatched() >= 2 ? std::optional(1e3) : scene.rows_off_px();
}

/// About the horizontal by half a degree; about its line of sight, which moves the rows of what is
/// in the middle less, by one.
TEST(StereoScene, NoticesACameraThatWasTurned) {
  constexpr double kHalf_rad = 0.5 * std::numbers::pi / 180.0;
  const double most = SceneLimits{}.rows_px;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const auto right = rows_off(0, 0.0, seed);
    ASSERT_TRUE(right);
    EXPECT_LT(*right, 0.4 * most) << seed;
    // The errors that calibrations of real pairs leave.
    EXPECT_LT(rows_off(0, 7e-5, seed).value_or(1e3), 0.6 * most) << seed;
    for (const int axis : {0, 2}) {
      for (const double sign : {-1.0, 1.0}) {
        EXPECT_GT(rows_off(axis, sign * (axis + 2) * kHalf_rad / 2, seed).value_or(0.0), most)
            << "axis " << axis << ", sign " << sign << ", seed " << seed;
      }
    }
  }
}

TEST(StereoScene, TheRigsErrorsArePartOfTheDoubt) {
  const auto cameras = pair();
  const Solid solid{Form::cylinder, {0.1, 0.05, 0.0}, 0.03, 0.08};
  const auto spread = [&](const RigAccuracy& rig) {
    SceneLimits limits;
    limits.rig = rig;
    StereoScene scene(cameras[0], cameras[1], limits);
    const std::vector left{region(Kind::object, seen(solid, cameras)[0])},
        right{region(Kind::object, seen(solid, cameras)[1])};
    for (int i = 0; i < 20; ++i) scene.update(left, right);
    return scene.things().at(0).covariance_m2;
  };
  RigAccuracy exact{0.0, 0.0, 0.0, 0.0, 0.0}, shifted = exact, turned = exact;
  shifted.place_m = 0.003;
  turned.pair_turn_rad = 0.001;
  const Eigen::Matrix3d none = spread(exact);
  EXPECT_TRUE((spread(shifted) - none).isApprox(9e-6 * Eigen::Matrix3d::Identity(), 1e-3));
  // A second camera turned about the vertical by a: the depth is wrong by a d² / baseline.
  const Vector3d ray = (solid.center - cameras[0].eye()).normalized();
  const double d = (solid.center - cameras[1].eye()).norm();
  const double along = std::sqrt(ray.dot((spread(turned) - none) * ray));
  EXPECT_NEAR(along, 0.001 * d * d / 0.3, 0.25 * along);
}

/// One inflated area must not freeze a place, nor may a hand that hides half of a thing move it.
TEST(StereoScene, HalfHiddenThingsStayWhereTheyAre) {
  const auto cameras = pair();
  StereoScene scene(cameras[0], cameras[1], SceneLimits{});
  const Solid goal{Form::cylinder, {0.2, 0.06, 0.0}, 0.045, 0.02};
  const auto whole = seen(goal, cameras);
  for (int i = 0; i < 60; ++i) {
    auto now = whole;
    if (i == 3) now[0].area *= 1.5;
    if (i >= 20 && i < 40) {
      for (Outline& o : now) {
        o.area *= 0.5;
        o.mean.x() += 14.0;
      }
    }
    scene.update(std::vector{region(Kind::goal_low, now[0])},
                 std::vector{region(Kind::goal_low, now[1])});
    EXPECT_TRUE(i <= 10 || scene.changes().empty()) << i;
  }
  ASSERT_EQ(scene.goals().size(), 1u);
  EXPECT_NEAR((scene.goals()[0].solid.center - goal.center).norm(), 0.0, 1e-3);
}

/// Things with their kinds, shown often enough to be known.
StereoScene shown(const std::vector<std::pair<Kind, Solid>>& things) {
  const auto cameras = pair();
  SceneLimits limits;
  limits.goal_form = "block";
  StereoScene scene(cameras[0], cameras[1], limits);
  std::vector<Region> left, right;
  for (const auto& [kind, solid] : things) {
    left.push_back(region(kind, seen(solid, cameras)[0]));
    right.push_back(region(kind, seen(solid, cameras)[1]));
  }
  for (int i = 0; i < limits.settled_pictures; ++i) {
    EXPECT_FALSE(scene.settled() && !scene.things().empty());
    scene.update(left, right);
  }
  EXPECT_TRUE(scene.settled());
  return scene;
}

const Solid kSeenObject{Form::cylinder, {-0.15, 0.09, -0.10}, 0.022, 0.10};
const Solid kSeenBar{Form::bar, {0.0, 0.25, 0.0}, 0.02, 0.50};
const Solid kSeenHigh{Form::block, {0.20, 0.19, 0.12}, 0.04, 0.02};
const Solid kSeenLow{Form::block, {0.0, 0.05, 0.14}, 0.04, 0.02};

TEST(StereoScene, WhatSomethingStandsOnForLongStaysAsItWasSeenAlone) {
  const auto cameras = pair();
  StereoScene scene(cameras[0], cameras[1], SceneLimits{});
  const Solid cap{Form::cylinder, {0.2, 0.11, 0.0}, 0.045, 0.02};
  const Solid object{Form::cylinder, {0.2, 0.1625, 0.0}, 0.024, 0.085};
  const auto show = [&](bool stands, int pictures) {
    std::array<Outline, 2> seen_cap = seen(cap, cameras);
    const auto seen_object = seen(object, cameras);
    for (Outline& o : seen_cap) {  // its upper third is hidden
      if (!stands) continue;
      o.area *= 0.66;
      o.mean.y() += 3.0;
      o.spread(1, 1) *= 0.5;
    }
    for (int i = 0; i < pictures; ++i) {
      std::vector<Region> left{region(Kind::goal_high, seen_cap[0])},
          right{region(Kind::goal_high, seen_cap[1])};
      if (stands) left.push_back(region(Kind::object, seen_object[0]));
      if (stands) right.push_back(region(Kind::object, seen_object[1]));
      scene.update(left, right);
    }
    return scene.goals().at(0).solid.top();
  };
  EXPECT_NEAR(show(false, 30), cap.top(), 5e-4);
  EXPECT_NEAR(show(true, 300), cap.top(), 5e-4);
  EXPECT_TRUE(scene.settled());
}

TEST(RobotTable, TurnsWhatIsSeenIntoObstaclesGoalsAndObjectInTheWorld) {
  // The colours are the wrong way round: height decides.
  const StereoScene scene = shown({{Kind::object, kSeenObject},
                                   {Kind::bar, kSeenBar},
                                   {Kind::goal_low, kSeenHigh},
                                   {Kind::goal_high, kSeenLow}});
  RobotTableSetup setup;
  setup.origin_m = {0.5, 0.1, -0.01};
  setup.inflation_sigma = 0.0;
  const auto found = robot_table(scene, setup);
  ASSERT_TRUE(found);
  const kin::Table& t = found->table;
  constexpr double kNear = 5e-4;
  // x, y, z of T are y, z, x of W.
  EXPECT_LT((t.object - Vector3d(0.40, -0.05, 0.08)).norm(), kNear);
  EXPECT_NEAR(t.object_radius, 0.022, kNear);
  EXPECT_NEAR(t.object_height, 0.10, kNear);
  EXPECT_LT((t.bar_center - Vector3d(0.5, 0.1, 0.24)).norm(), kNear);
  EXPECT_NEAR(t.bar_height, 0.23, kNear);
  ASSERT_EQ(t.goals.size(), 2u);
  EXPECT_EQ(t.goals[0].name, "high");
  EXPECT_LT((t.goals[0].position - Vector3d(0.62, 0.30, 0.24)).norm(), kNear);
  EXPECT_LT((t.goals[1].position - Vector3d(0.64, 0.10, 0.10)).norm(), kNear);
  ASSERT_EQ(t.boxes.size(), 4u);
  const kin::Box& plinth = t.boxes[1];
  EXPECT_EQ(plinth.name, "plinth");
  EXPECT_NEAR(plinth.center.z() + plinth.half_extent.z(), 0.03, kNear);
  const kin::Box& stand = t.boxes[2];
  EXPECT_EQ(stand.name, "high stand");
  EXPECT_NEAR(stand.center.z() - stand.half_extent.z(), -0.01, 1e-12);
  EXPECT_NEAR(stand.half_extent.x(), 0.04, kNear);
  // The bar's balls lie along y, its ends where they were seen.
  double first = 1e9, last = -1e9;
  for (const kin::Ball& ball : t.balls) {
    EXPECT_NEAR(ball.center.x(), 0.5, kNear);
    first = std::min(first, ball.center.y() - ball.radius);
    last = std::max(last, ball.center.y() + ball.radius);
  }
  EXPECT_NEAR(first, 0.1 - 0.25, 2e-3);
  EXPECT_NEAR(last, 0.1 + 0.25, 2e-3);
  EXPECT_GT(found->object_m2.trace(), 0.0);
  EXPECT_EQ(found->goals_m2.size(), 2u);
}

TEST(RobotTable, DoubtMakesObstaclesLargerAndLetsGoAboveTheStand) {
  const StereoScene scene = shown({{Kind::object, kSeenObject},
                                   {Kind::bar, kSeenBar},
                                   {Kind::goal_high, kSeenHigh},
                                   {Kind::goal_low, kSeenLow}});
  RobotTableSetup sure, doubtful;
  sure.inflation_sigma = 0.0;
  doubtful.inflation_sigma = 3.0;
  const auto unsure = robot_table(scene, doubtful);
  const kin::Table small = robot_table(scene, sure)->table, &large = unsure->table;
  EXPECT_GT(large.balls[0].radius, small.balls[0].radius);
  EXPECT_GT(large.boxes[2].half_extent.x(), small.boxes[2].half_extent.x());
  EXPECT_EQ(large.object, small.object);
  for (std::size_t k = 0; k < 2; ++k) {
    const Vector3d raised = large.goals[k].position - small.goals[k].position;
    EXPECT_NEAR(raised.z(), 3.0 * std::sqrt(unsure->object_m2(2, 2) + unsure->goals_m2[k](2, 2)),
                1e-9);
    EXPECT_EQ(raised.head<2>().norm(), 0.0);
  }
}

TEST(RobotTable, KnowsNothingWithoutObjectBarAndTwoHeights) {
  const std::vector<std::pair<Kind, Solid>> all{{Kind::object, kSeenObject},
                                                {Kind::bar, kSeenBar},
                                                {Kind::goal_high, kSeenHigh},
                                                {Kind::goal_low, kSeenLow}};
  for (std::size_t left_out = 0; left_out < all.size(); ++left_out) {
    auto some = all;
    some.erase(some.begin() + static_cast<std::ptrdiff_t>(left_out));
    EXPECT_FALSE(robot_table(shown(some), RobotTableSetup{})) << left_out;
  }
}

/// A stand before the foot of the object: what is left of it looks like no cylinder.
TEST(RobotTable, WaitsWhileAPartOfAThingIsHidden) {
  const auto cameras = pair();
  SceneLimits limits;
  limits.goal_form = "block";
  StereoScene scene(cameras[0], cameras[1], limits);
  std::array<std::vector<Region>, 2> regions;
  for (const auto& [kind, solid] : {std::pair(Kind::object, kSeenObject),
                                    {Kind::bar, kSeenBar},
                                    {Kind::goal_high, kSeenHigh},
                                    {Kind::goal_low, kSeenLow}}) {
    for (std::size_t side = 0; side < 2; ++side) {
      Solid visible = solid;
      if (kind == Kind::object && side == 0) {  // 15 mm less of it
        visible.length -= 0.015;
        visible.center.y() += 0.0075;
      }
      regions[side].push_back(region(kind, seen(visible, cameras)[side]));
    }
  }
  for (int i = 0; i < 20; ++i) scene.update(regions[0], regions[1]);
  const auto found = robot_table(scene, RobotTableSetup{});
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().reason.find("object 1 is known to"), std::string::npos)
      << found.error().reason;
}

TEST(RobotTable, AGoalThatStaysAloneIsToldByItsGapToTheBar) {
  for (const auto& [solid, name] : {std::pair(kSeenHigh, "high"), std::pair(kSeenLow, "low")}) {
    const auto found = robot_table(
        shown({{Kind::object, kSeenObject}, {Kind::bar, kSeenBar}, {Kind::goal_low, solid}}),
        RobotTableSetup{}, true);
    ASSERT_TRUE(found) << name;
    ASSERT_EQ(found->table.goals.size(), 1u);
    EXPECT_EQ(found->table.goals[0].name, name);
  }
}

TEST(RobotTable, AnotherObjectIsAnObstacleTheOneOnAGoalIsNoneToGrasp) {
  Solid block = kSeenObject;
  block.center = kSeenLow.center;
  block.center.y() = kSeenLow.top() + 0.5 * block.length;
  const StereoScene scene = shown({{Kind::object, block},
                                   {Kind::object, kSeenObject},
                                   {Kind::bar, kSeenBar},
                                   {Kind::goal_high, kSeenHigh},
                                   {Kind::goal_low, kSeenLow}});
  const auto found = robot_table(scene, RobotTableSetup{});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->table.object.x(), -0.10, 1e-3);
  EXPECT_EQ(std::ranges::count(found->table.boxes, "another object", &kin::Box::name), 1);
}

}  // namespace
}  // namespace mimesis::vision
