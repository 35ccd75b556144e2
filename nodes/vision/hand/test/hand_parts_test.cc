#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/math/so3.h"
#include "common/testing/no_malloc.h"
#include "nodes/vision/hand/cma_es.h"
#include "nodes/vision/hand/skin_density.h"

namespace mimesis::vision {
namespace {

using Eigen::Vector3d;

TEST(HandModel, HasTheProportionsOfBuchholz) {
  const HandModel model(0.2);
  HandPose right;  // all joints straight
  right.left = false;
  const auto tips = model.tips(right);
  // Wrist at -0.223 L; the middle finger: 0.446 + 0.266 + 0.170 + 0.108 of L, splayed by 1 degree.
  const Vector3d wrist(-0.223 * 0.2, 0.0, 0.0);
  EXPECT_NEAR((tips[2] - wrist).norm(), 0.99 * 0.2, 0.001);
  EXPECT_LT((tips[4] - wrist).norm(), (tips[3] - wrist).norm());
  EXPECT_LT(tips[1].y(), tips[4].y());  // a right hand's index is at -y of its little finger
}

TEST(HandModel, APersonsPalmLeavesTheLengthAndItsBreadthTheBones) {
  const HandModel model(0.2);
  HandPose usual, person;
  person.shape = {0.1, -0.15, 0.0};
  const double palm = 0.446 * std::exp(0.1);
  EXPECT_NEAR(model.wrist(person).x(), -0.5 * palm * 0.2, 1e-12);
  // Stretched: as long as ever. Bent at the knuckle: less of it is finger.
  const auto reach = [&](const HandPose& p) { return (model.tips(p)[2] - model.wrist(p)).norm(); };
  EXPECT_NEAR(reach(person), reach(usual), 2e-4);
  person.joint_rad[4 * 2 + 1] = std::numbers::pi / 2.0;
  EXPECT_NEAR(model.tips(person)[2].z(), (0.99 - palm) * 0.2, 1e-3);
  person.shape.length = 0.05;
  EXPECT_NEAR(model.tips(person)[2].z(), (0.99 - palm) * 0.2 * std::exp(0.05), 1e-3);
  HandCapsules narrow, wide;
  model.capsules(person, narrow);
  person.shape.breadth = 0.15;
  model.capsules(person, wide);
  for (std::size_t k = 0; k + kForearmCapsules < kHandCapsules; ++k)
    EXPECT_NEAR(wide[k].radius_a / narrow[k].radius_a, std::exp(0.3), 1e-5) << k;
}

TEST(HandModel, LeftIsTheMirrorImageOfRight) {
  HandPose pose;
  for (std::size_t j = 0; j < kHandJoints; ++j)
    pose.joint_rad[j] = 0.1 + 0.03 * static_cast<double>(j);
  pose.wrist_rad = {0.2, 0.1};
  HandCapsules left, right;
  HandModel(0.18).capsules(pose, left);
  pose.left = false;
  HandModel(0.18).capsules(pose, right);
  for (std::size_t k = 0; k < kHandCapsules; ++k) {
    EXPECT_LT((left[k].a - Eigen::Vector3f(right[k].a.x(), -right[k].a.y(), right[k].a.z())).norm(),
              1e-6f);
    EXPECT_LT((left[k].b - Eigen::Vector3f(right[k].b.x(), -right[k].b.y(), right[k].b.z())).norm(),
              1e-6f);
  }
}

TEST(HandModel, BendsFingersTowardsThePalm) {
  HandPose straight, bent;
  bent.joint_rad[4 * 2 + 1] = std::numbers::pi / 2.0;  // knuckle of the middle finger
  const HandModel model(0.2);
  const Vector3d before = model.tips(straight)[2], after = model.tips(bent)[2];
  EXPECT_NEAR(after.z(), 0.544 * 0.2, 1e-3);
  EXPECT_NEAR(after.x(), 0.5 * 0.446 * 0.2, 1e-3);
  EXPECT_NEAR(before.z(), 0.0, 1e-9);
  // the thumb's joints bend towards palm and fingers
  HandPose thumb;
  thumb.joint_rad[2] = thumb.joint_rad[3] = 0.8;
  EXPECT_GT(model.tips(thumb)[0].z(), model.tips(straight)[0].z() + 0.01);
  EXPECT_LT(model.tips(thumb)[0].y(), model.tips(straight)[0].y() - 0.01);
}

TEST(HandModel, MovesWithItsPose) {
  HandPose pose, at;
  for (std::size_t j = 0; j < kHandJoints; ++j) pose.joint_rad[j] = at.joint_rad[j] = 0.2;
  at.p_CH = {0.1, -0.2, 0.7};
  at.R_CH = math::exp_so3(Vector3d(0.4, -0.9, 1.3));
  const HandModel model(0.19);
  const auto here = model.tips(pose), there = model.tips(at);
  HandCapsules a, b;
  model.capsules(pose, a);
  model.capsules(at, b);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_LT((there[i] - (at.p_CH + at.R_CH * here[i])).norm(), 1e-12);
  }
  for (std::size_t k = 0; k < kHandCapsules; ++k) {
    const Vector3d p = at.p_CH + at.R_CH * a[k].a.cast<double>();
    EXPECT_LT((b[k].a.cast<double>() - p).norm(), 1e-6);
    EXPECT_FLOAT_EQ(b[k].radius_a, a[k].radius_a);
  }
}

/// All capsules out of view but the first.
HandCapsules one_capsule(const Eigen::Vector3f& a, const Eigen::Vector3f& b, float ra, float rb) {
  HandCapsules all;
  all.fill({{0, 0, -1}, {0, 0, -1}, 0.01f, 0.01f});
  all[0] = {a, b, ra, rb};
  return all;
}

RasterCamera camera() {
  RasterCamera c;
  c.focal = 100.0f;
  c.cu = 79.5f;
  c.cv = 59.5f;
  return c;
}

TEST(HandRaster, CoversTheAreaOfACapsule) {
  Evidence evidence;
  evidence.resize(160, 120);
  std::fill(evidence.ratio.begin(), evidence.ratio.end(), 2.0f);
  HandRaster raster(160, 120);
  for (const double angle : {0.0, 0.4, 1.2, 2.5}) {  // 30 cells long, radius 6, anywhere
    const auto c = static_cast<float>(0.15 * std::cos(angle)),
               s = static_cast<float>(0.15 * std::sin(angle));
    const Match m = raster.match(one_capsule({-c, -s, 1.0f}, {c, s, 1.0f}, 0.06f, 0.06f), camera(),
                                 evidence, {});
    const double area = 30.0 * 12.0 + std::numbers::pi * 36.0;
    EXPECT_NEAR(m.area, area, 0.005 * area) << angle;
    EXPECT_NEAR(m.ratio, 2.0 * area, 0.01 * area);
    EXPECT_EQ(m.forearm, 0.0f);
  }
}

TEST(HandRaster, TheForearmEndsStraightAtTheSleeveAndPaysForWhatIsNoSkin) {
  Evidence evidence;
  evidence.resize(160, 120);
  std::fill(evidence.ratio.begin(), evidence.ratio.end(), -1.5f);
  HandRaster raster(160, 120);
  HandCapsules arm = one_capsule({0, 0, -1}, {0, 0, -1}, 0.01f, 0.01f);
  arm[kHandCapsules - 2] = {{-0.15f, 0, 1}, {0.15f, 0, 1}, 0.06f, 0.06f};
  arm[kHandCapsules - 1] = {{0.15f, 0, 1}, {0.15f, 0, 1}, 0.0f, 0.0f};
  const double area = 30.5 * 12.0 + 0.5 * std::numbers::pi * 36.0;  // one end is round
  const Match m = raster.match(arm, camera(), evidence, {});
  EXPECT_NEAR(m.forearm, -1.5 * area, 0.03 * area);
  EXPECT_EQ(m.area, 0.0f);
}

TEST(HandRaster, IsCutAtTheBordersAndForgetsTheLastHand) {
  Evidence evidence;
  evidence.resize(160, 120);
  HandRaster raster(160, 120);
  const HandCapsules centre = one_capsule({-0.1f, 0, 1}, {0.1f, 0, 1}, 0.05f, 0.05f);
  const float alone = raster.match(centre, camera(), evidence, {}).area;
  const Match half = raster.match(
      one_capsule({-0.1f, -0.595f, 1}, {0.1f, -0.595f, 1}, 0.05f, 0.05f), camera(), evidence, {});
  EXPECT_NEAR(half.area, 0.5 * static_cast<double>(alone), 16.0);
  EXPECT_EQ(
      raster.match(one_capsule({5, 5, 1}, {6, 5, 1}, 0.1f, 0.1f), camera(), evidence, {}).area,
      0.0f);
  EXPECT_EQ(raster.match(centre, camera(), evidence, {}).area, alone);
}

TEST(HandRaster, ExpectsTheLumaOfTheNearerNormal) {
  Evidence evidence;
  evidence.resize(160, 120);
  HandRaster raster(160, 120);
  Shading shading;
  shading.bias = 100.0f;
  shading.slope = {0.0f, 50.0f, -20.0f};
  HandCapsules two = one_capsule({-0.2f, 0, 1}, {0.2f, 0, 1}, 0.1f, 0.1f);
  raster.match(two, camera(), evidence, shading);
  const auto expected = [&](int u, int v) {
    return raster.expected()[static_cast<std::size_t>(v * evidence.stride + u)];
  };
  EXPECT_NEAR(expected(79, 59), 120.0f - 2.5f, 0.5f);  // half a cell above the axis: n_y = -0.05
  // 6 cells below the axis of a cylinder with radius 10: n = (0, 0.65, -0.76)
  EXPECT_NEAR(expected(79, 66), 100.0f + 50.0f * 0.65f + 20.0f * 0.76f, 0.5f);
  // Upright and upside down, lit from the right: 6 cells to the right, n = (0.65, 0, -0.76).
  for (const float sign : {1.0f, -1.0f}) {
    shading.slope = {50.0f, 0.0f, 0.0f};
    raster.match(one_capsule({0, -0.2f * sign, 1}, {0, 0.2f * sign, 1}, 0.1f, 0.1f), camera(),
                 evidence, shading);
    EXPECT_NEAR(expected(86, 59), 100.0f + 50.0f * 0.65f, 0.5f);
  }
  shading.slope = {0.0f, 50.0f, -20.0f};
  two[1] = {{0.0f, 0.04f, 0.9f}, {0.0f, 0.08f, 0.9f}, 0.03f, 0.03f};  // in front
  raster.match(two, camera(), evidence, shading);
  EXPECT_NEAR(expected(79, 66), 120.0f, 6.0f);
}

TEST(HandRaster, PaysForLumaThatFitsItsNormal) {
  Evidence evidence;
  evidence.resize(160, 120);
  HandRaster raster(160, 120);
  const HandCapsules hand = one_capsule({-0.2f, 0, 1}, {0.2f, 0, 1}, 0.1f, 0.1f);
  Shading shading;
  shading.bias = shading.mean = 100.0f;
  shading.slope = {0.0f, 40.0f, 0.0f};
  shading.weight = 0.5f / 25.0f;
  shading.weight_mean = 0.5f / 400.0f;
  raster.match(hand, camera(), evidence, shading);
  evidence.luma.assign(raster.expected().begin(), raster.expected().end());
  const float fits = raster.match(hand, camera(), evidence, shading).shading;
  for (float& y : evidence.luma) y = 200.0f - y;  // lit from the other side
  const float opposed = raster.match(hand, camera(), evidence, shading).shading;
  EXPECT_GT(fits, 100.0f);
  EXPECT_LT(opposed, 0.5f * fits);
}

TEST(CmaEs, FindsTheMinimumOfATurnedValleyWithoutAllocating) {
  constexpr int kN = 12;
  CmaEs cma(kN, 16, 3), again(kN, 16, 3);
  const std::vector<double> start(kN, 1.0);
  const auto cost = [](std::span<const double> x) {
    double sum = 0.0;
    for (int i = 0; i + 1 < kN; ++i) {  // neighbours are coupled; axes differ by 1 to 100
      const double a = x[static_cast<std::size_t>(i)], b = x[static_cast<std::size_t>(i + 1)];
      sum += (1.0 + 100.0 * i / kN) * (a + b) * (a + b) + 0.5 * a * a;
    }
    return sum + x[kN - 1] * x[kN - 1];
  };
  std::vector<double> values(16);
  const auto search = [&](CmaEs& c) {
    c.start(start, 0.5);
    for (int g = 0; g < 400; ++g) {
      c.ask();
      for (int k = 0; k < 16; ++k) values[static_cast<std::size_t>(k)] = cost(c.candidate(k));
      c.tell(values);
    }
  };
  {
    testing::NoMalloc guard;
    search(cma);
  }
  search(again);
  EXPECT_LT(cost(cma.mean()), 1e-8);
  EXPECT_LT(cma.sigma(), 0.01);
  EXPECT_TRUE(std::ranges::equal(cma.mean(), again.mean()));
  // What it learned of the valley helps at once.
  const std::vector<double> near(kN, 0.3);
  const auto after = [&](CmaEs& c) {
    for (int g = 0; g < 40; ++g) {
      c.ask();
      for (int k = 0; k < 16; ++k) values[static_cast<std::size_t>(k)] = cost(c.candidate(k));
      c.tell(values);
    }
    return cost(c.mean());
  };
  cma.resume(near, 0.3, 0.05);
  again.start(near, 0.3);
  const double resumed = after(cma), fresh = after(again);
  EXPECT_LT(resumed, fresh);
}

TEST(SkinDensity, TellsHandFromBackgroundAndLearnsSlowly) {
  image::Image image(640, 480);
  for (std::size_t i = 0; i < image.bgr.size(); i += 3) {
    const auto u = static_cast<int>(i / 3 % 640), v = static_cast<int>(i / 3 / 640);
    const bool hand = std::hypot(u - 320, v - 240) < 60.0;
    const bool patch = u > 500;  // blue
    const std::array<std::uint8_t, 3> bgr = hand    ? std::array<std::uint8_t, 3>{110, 140, 210}
                                            : patch ? std::array<std::uint8_t, 3>{200, 90, 60}
                                                    : std::array<std::uint8_t, 3>{130, 130, 130};
    std::copy(bgr.begin(), bgr.end(), image.bgr.begin() + static_cast<std::ptrdiff_t>(i));
  }
  SkinDensity density(640, 480);
  ASSERT_EQ(density.factor(), 4);
  Evidence evidence;
  evidence.resize(160, 120);
  density.read(image, evidence);
  density.begin(79.5f, 59.5f, 20.0f);
  density.judge(evidence);
  const auto ratio = [&](int u, int v) {
    return evidence.ratio[static_cast<std::size_t>(v * evidence.stride + u)];
  };
  EXPECT_GT(ratio(80, 60), 2.0f);
  EXPECT_LT(ratio(20, 20), -2.0f);
  EXPECT_LT(ratio(140, 60), -1.0f);
  EXPECT_NEAR(evidence.luma[static_cast<std::size_t>(20 * evidence.stride + 20)], 130.0f, 1.0f);
  // A model that lies on the blue patch does not make blue a colour of hands.
  HandRaster wrong(160, 120);
  wrong.match(one_capsule({0.5f, -0.2f, 1}, {0.5f, 0.2f, 1}, 0.1f, 0.1f), camera(), evidence, {});
  for (int k = 0; k < 60; ++k) density.learn(wrong, 0.05);
  density.judge(evidence);
  EXPECT_LT(ratio(140, 60), 0.0f);
}

}  // namespace
}  // namespace mimesis::vision
