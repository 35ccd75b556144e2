#include "hw/sim/body/head_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "common/testing/no_malloc.h"

namespace mimesis::hw::sim {
namespace {

using Eigen::Vector3d;

constexpr double kStep_s = 0.005;
const Vector3d kAway(0.0, 5.0, 0.0);

/// A head 1.3 m high that looks along x, its lens at (0.1, 0, 1.4).
HeadCamera::Scene scene(const Vector3d& handle_W_m, const Vector3d& object_W_m) {
  HeadCamera::Scene s{Eigen::Isometry3d::Identity(), handle_W_m, object_W_m, {kAway, kAway}};
  s.X_WH.translation() = Vector3d(0.0, 0.0, 1.3);
  return s;
}
const Vector3d kHandle(0.6, 0.14, 0.92), kObject(0.75, 0.0, 0.90);

/// All sights of this time, with the times at which they arrived.
std::vector<std::pair<double, HeadSight>> watch(const HeadCameraSettings& settings,
                                                const HeadCamera::Scene& s, double duration_s) {
  HeadCamera camera(settings);
  std::vector<std::pair<double, HeadSight>> out;
  const int steps = static_cast<int>(std::lround(duration_s / kStep_s));
  for (int k = 0; k < steps; ++k) {
    camera.look(k * kStep_s, s);
    while (const HeadSight* sight = camera.arrived(k * kStep_s))
      out.push_back({k * kStep_s, *sight});
  }
  return out;
}

TEST(HeadCamera, GivesThirtyImagesASecondFiftyMillisecondsLate) {
  const auto sights = watch({}, scene(kHandle, kObject), 10.0);
  EXPECT_NEAR(static_cast<double>(sights.size()), 30.0 * (10.0 - 0.05), 1.0);
  for (const auto& [at_s, sight] : sights) EXPECT_NEAR(at_s - sight.taken_s, 0.05, 1e-9);
  for (std::size_t i = 1; i < sights.size(); ++i) {
    EXPECT_NEAR(sights[i].second.taken_s - sights[i - 1].second.taken_s, 1.0 / 30.0, kStep_s);
  }
}

TEST(HeadCamera, ShowsWhereThingsWereWhenTheImageWasTaken) {
  HeadCamera camera({.noise_m = 0.0});
  HeadCamera::Scene s = scene(kHandle, kObject);
  camera.look(0.0, s);
  s.handle_W_m.x() += 0.1;
  for (double t = kStep_s; t < 0.0499; t += kStep_s) {
    camera.look(t, s);
    EXPECT_EQ(camera.arrived(t), nullptr) << t;
  }
  const HeadSight* sight = camera.arrived(0.05);
  ASSERT_NE(sight, nullptr);
  EXPECT_TRUE(sight->handle_H_m->isApprox(kHandle - Vector3d(0.0, 0.0, 1.3)));
}

/// Mean and variance of n normal numbers spread by sigma/sqrt(n) and sigma^2 sqrt(2/n).
TEST(HeadCamera, NoiseIsNormalIndependentAndOfItsSeed) {
  const auto sights = watch({.noise_m = 0.005}, scene(kHandle, kObject), 200.0);
  const double n = static_cast<double>(sights.size());
  Vector3d mean = Vector3d::Zero(), squares = Vector3d::Zero();
  double next = 0.0, across = 0.0;
  Vector3d last = Vector3d::Zero();
  for (const auto& [at_s, sight] : sights) {
    const Vector3d e = *sight.handle_H_m - (kHandle - Vector3d(0.0, 0.0, 1.3));
    const Vector3d o = *sight.object_H_m - (kObject - Vector3d(0.0, 0.0, 1.3));
    mean += e / n;
    squares += e.cwiseAbs2() / n;
    next += e.x() * last.x() / n;
    across += e.x() * o.x() / n;
    last = e;
  }
  const double sigma = 0.005, bound = 4.0 / std::sqrt(n);
  EXPECT_LT(mean.cwiseAbs().maxCoeff(), bound * sigma);
  for (const double square : squares) {
    EXPECT_NEAR(square, sigma * sigma, std::numbers::sqrt2 * bound * sigma * sigma);
  }
  EXPECT_LT(std::abs(next), bound * sigma * sigma);
  EXPECT_LT(std::abs(across), bound * sigma * sigma);
  const auto again = watch({.seed = 1}, scene(kHandle, kObject), 1.0),
             other = watch({.seed = 2}, scene(kHandle, kObject), 1.0);
  EXPECT_EQ(*again[3].second.handle_H_m, *sights[3].second.handle_H_m);
  EXPECT_NE(*other[3].second.handle_H_m, *sights[3].second.handle_H_m);
}

TEST(HeadCamera, DoesNotSeeThroughAHand) {
  const Vector3d lens(0.1, 0.0, 1.4), side(0.0, 0.06, 0.0);
  const auto sees = [&](const Vector3d& hand) {
    HeadCamera::Scene s = scene(kHandle, kObject);
    s.hand_W_m[1] = hand;
    const HeadSight sight = watch({}, s, 0.1).front().second;
    return std::pair(sight.handle_H_m.has_value(), sight.object_H_m.has_value());
  };
  const Vector3d between = 0.5 * (lens + kHandle);
  const Vector3d across = (kHandle - lens).cross(Vector3d::UnitZ()).normalized();
  EXPECT_EQ(sees(between), std::pair(false, true));
  EXPECT_EQ(sees(between - 0.055 * across), std::pair(false, true));
  EXPECT_EQ(sees(between - 0.065 * across), std::pair(true, true));
  EXPECT_EQ(sees(kHandle), std::pair(false, true)) << "in the hand";
  EXPECT_EQ(sees(kHandle + 0.07 * (kHandle - lens).normalized()), std::pair(true, true))
      << "behind";
  EXPECT_EQ(sees(kObject), std::pair(true, false));
}

TEST(HeadCamera, SeesWhatIsInItsFieldOfView) {
  const auto sees = [](double azimuth_rad, double below_rad) {
    const Vector3d lens(0.1, 0.0, 1.4);
    const Eigen::Matrix3d down =
        Eigen::AngleAxisd(0.6, Vector3d::UnitY()).toRotationMatrix();  // the lens looks down
    const Vector3d ray(1.0, std::tan(azimuth_rad), -std::tan(below_rad));
    return watch({}, scene(lens + down * ray, kObject), 0.1).front().second.handle_H_m.has_value();
  };
  EXPECT_TRUE(sees(0.0, 0.0));
  EXPECT_TRUE(sees(0.69, 0.0));
  EXPECT_FALSE(sees(0.71, 0.0));
  EXPECT_FALSE(sees(-0.71, 0.0));
  EXPECT_TRUE(sees(0.0, 0.59));
  EXPECT_FALSE(sees(0.0, 0.61));
  EXPECT_FALSE(sees(0.0, -0.61));
  const Vector3d behind(-1.0, 0.0, 1.4);
  EXPECT_FALSE(watch({}, scene(behind, kObject), 0.1).front().second.handle_H_m.has_value());
}

TEST(HeadCamera, DoesNotAllocate) {
  HeadCamera camera({});
  const HeadCamera::Scene s = scene(kHandle, kObject);
  testing::NoMalloc guard;
  for (int k = 0; k < 1000; ++k) {
    camera.look(k * kStep_s, s);
    camera.arrived(k * kStep_s);
  }
}

}  // namespace
}  // namespace mimesis::hw::sim
