#include "nodes/synthesizer/dynamics/lanes.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cstring>
#include <random>

#include "common/math/so3.h"
#include "nodes/synthesizer/dynamics/posture.h"

namespace mimesis::synthesizer {
namespace {

Eigen::Vector3d wide(Vec3 v) { return {double(v.x), double(v.y), double(v.z)}; }
Eigen::Matrix3d wide(const Mat3& m) {
  Eigen::Matrix3d r;
  r << wide(m.x), wide(m.y), wide(m.z);
  return r;
}
Vec3 narrow(const Eigen::Vector3d& v) { return {float(v.x()), float(v.y()), float(v.z())}; }

class Random {
 public:
  double operator()(double low, double high) {
    return low + (high - low) * double(engine_() >> 11) * 0x1p-53;
  }
  Eigen::Vector3d axis() {
    Eigen::Vector3d v;
    do v = {(*this)(-1, 1), (*this)(-1, 1), (*this)(-1, 1)};
    while (v.norm() > 1.0 || v.norm() < 0.1);
    return v.normalized();
  }

 private:
  std::mt19937_64 engine_{7};
};

TEST(Lanes, ExponentialMapIsRodrigues) {
  Random random;
  for (int n = 0; n < 20'000; ++n) {
    const Vec3 w = narrow(random(0.0, 6.28) * random.axis());
    ASSERT_LT((wide(exp_lane(w)) - math::exp_so3(wide(w))).cwiseAbs().maxCoeff(), 2e-6);
  }
  EXPECT_EQ(wide(exp_lane({0, 0, 0})), Eigen::Matrix3d::Identity());
  const Vec3 w{1e-5F, 0, -2e-5F};
  EXPECT_LT((wide(exp_lane(w)) - math::exp_so3(wide(w))).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Lanes, LogarithmInvertsNearItsReference) {
  Random random;
  for (int n = 0; n < 20'000; ++n) {
    const Vec3 w = narrow(random(0.0, 3.0) * random.axis());
    ASSERT_LT((wide(log_lane(exp_lane(w), w)) - wide(w)).norm(), 5e-6) << wide(w).norm();
  }
  const Vec3 far{0, -4.5F, 0};  // more than half a turn: as the row has it
  EXPECT_LT((wide(log_lane(exp_lane(far), {0, -4.2F, 0})) - wide(far)).norm(), 5e-6);
  for (int n = 0; n < 2000; ++n) {
    const double y = random(0, 1), x = random(-1, 1);
    ASSERT_NEAR(double(atan2_lane(float(y), float(x))),
                std::atan2(double(float(y)), double(float(x))), 4e-7);
  }
}

LegLane random_leg(Random& random) {
  LegLane leg;
  leg.hip = {0.0F, 0.1F, -0.05F};
  leg.hip_angle = narrow(random(0, 0.6) * random.axis());
  leg.knee_angle = {0.05F, float(random(0.1, 1.2)), -0.03F};
  leg.ankle_angle = narrow(random(0, 0.4) * random.axis());
  leg.R_P = exp_lane(narrow(random(0, 0.3) * random.axis()));
  leg.R_T = leg.R_P * exp_lane(leg.hip_angle);
  leg.R_S = leg.R_T * exp_lane(leg.knee_angle);
  leg.R_F = leg.R_S * exp_lane(leg.ankle_angle);
  leg.knee = leg.hip + leg.R_T * Vec3{0, 0, -0.41F};
  leg.ankle = leg.knee + leg.R_S * Vec3{0, 0, -0.42F};
  return leg;
}

TEST(Lanes, TheLegReachesTheTargetAndTheFootTurnsByTheYawAlone) {
  Random random;
  int reached = 0;
  for (int n = 0; n < 5000; ++n) {
    const LegLane was = random_leg(random);
    LegLane leg = was;
    const Vec3 target = was.ankle + Vec3{float(random(-0.08, 0.08)), float(random(-0.08, 0.08)),
                                         float(random(-0.03, 0.03))};
    const float yaw = float(random(-0.5, 0.5));
    place_foot(target, std::cos(yaw), std::sin(yaw), leg);
    // the angles say the same as the points
    const Mat3 R_T = was.R_P * exp_lane(leg.hip_angle), R_S = R_T * exp_lane(leg.knee_angle);
    const Mat3 R_F = R_S * exp_lane(leg.ankle_angle);
    const Vec3 knee = was.hip + R_T * Vec3{0, 0, -0.41F};
    const Vec3 ankle = knee + R_S * Vec3{0, 0, -0.42F};
    ASSERT_LT((wide(knee) - wide(leg.knee)).norm(), 1e-5);
    ASSERT_LT((wide(ankle) - wide(leg.ankle)).norm(), 1e-5);
    ASSERT_LT((wide(R_F) - math::exp_so3({0.0, 0.0, double(yaw)}) * wide(was.R_F)).norm(), 3e-5);
    const double wanted = (wide(target) - wide(was.hip)).norm(),
                 length = (wide(leg.ankle) - wide(was.hip)).norm();
    if (wanted < 0.826) {
      ASSERT_LT((wide(leg.ankle) - wide(target)).norm(), 5e-6);
      ++reached;
    } else {  // less than wanted, in its direction, and never straight
      ASSERT_LT(length, std::min(wanted + 5e-6, 0.83));
      ASSERT_GT(length, 0.826);
      ASSERT_LT((wide(leg.ankle) - wide(was.hip)).cross(wide(target) - wide(was.hip)).norm(), 5e-6);
    }
  }
  EXPECT_GT(reached, 3000);
}

LegLane standing_leg(float flexion, float swing) {
  LegLane leg;
  leg.hip = {0.0F, 0.1F, 0.9F};
  leg.hip_angle = {0.0F, swing - 0.5F * flexion, 0.0F};
  leg.knee_angle = {0.0F, flexion, 0.0F};
  leg.ankle_angle = {0.0F, -swing - 0.5F * flexion, 0.0F};
  leg.R_P = exp_lane({0.0F, 0.0F, 0.0F});
  leg.R_T = exp_lane(leg.hip_angle);
  leg.R_S = leg.R_T * exp_lane(leg.knee_angle);
  leg.R_F = leg.R_S * exp_lane(leg.ankle_angle);
  leg.knee = leg.hip + leg.R_T * Vec3{0, 0, -0.41F};
  leg.ankle = leg.knee + leg.R_S * Vec3{0, 0, -0.42F};
  return leg;
}

/// A knee is no ball: a leg whose foot is placed anywhere, of any posture, also one that bends
/// backward, neither bends backward nor snaps.
TEST(Lanes, TheKneeFlexesAboutItsOwnAxisAndSlowly) {
  constexpr float kStep = 1e-4F;                                   // m
  const float steepest = 1.0F / std::sqrt(0.5F * 0.003F * 0.83F);  // rad/m, as place_foot() says
  for (const float flexion : {-0.2F, -0.03F, 0.0F, 0.01F, 0.05F, 0.1F, 0.2F, 0.5F, 1.0F}) {
    for (const float swing : {-0.5F, -0.2F, 0.0F, 0.2F, 0.5F}) {
      const LegLane was = standing_leg(flexion, swing);
      for (const Vec3 way : {Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}, Vec3{0, 0, -1}}) {
        float before = 0.0F;
        for (int n = 0; n <= 1000; ++n) {
          LegLane leg = was;
          place_foot(was.ankle + (kStep * static_cast<float>(n)) * way, 1.0F, 0.0F, leg);
          ASSERT_GT(leg.knee_angle.y, 0.0F) << flexion << ' ' << swing << ' ' << n;
          ASSERT_LT(std::abs(leg.knee_angle.x) + std::abs(leg.knee_angle.z), 1e-5F);
          if (n > 0) {
            ASSERT_LT(std::abs(leg.knee_angle.y - before), 1.05F * steepest * kStep)
                << flexion << ' ' << swing << ' ' << n;
          }
          before = leg.knee_angle.y;
        }
      }
    }
  }
}

TEST(Lanes, ALegThatIsNearlyStraightIsOneAndAHalfMillimetresShort) {
  LegLane leg = standing_leg(0.0F, 0.0F);
  const Vec3 straight = leg.ankle;
  place_foot(straight, 1.0F, 0.0F, leg);
  EXPECT_NEAR(double(leg.ankle.z - straight.z), 0.0015, 1e-5);
  EXPECT_GT(leg.knee_angle.y, 0.1F);
}

TEST(Lanes, SolesAreTheLowerEndRounded) {
  EXPECT_FLOAT_EQ(sole_lane(0.02F, 0.02F), 0.02F);  // flat
  EXPECT_NEAR(sole_lane(0.0F, 0.05F), 0.001, 1e-7);
  EXPECT_NEAR(sole_lane(0.05F, 0.0F), 0.001, 1e-7);
  float before = sole_lane(-0.01F, 0.0F), slope = 1.0F;
  for (int n = 1; n <= 200; ++n) {  // of a slope that changes gradually
    const float now = sole_lane(-0.01F + 1e-4F * static_cast<float>(n), 0.0F);
    ASSERT_LT(std::abs((now - before) * 1e4F - slope), 0.06F);
    slope = (now - before) * 1e4F;
    before = now;
  }
  EXPECT_FLOAT_EQ(heel_share_lane(0.0F, 0.0F), 0.5F);
  EXPECT_FLOAT_EQ(heel_share_lane(0.0F, 0.03F), 1.0F);
  EXPECT_FLOAT_EQ(heel_share_lane(0.03F, 0.0F), 0.0F);
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void posture_avx2(const BodyLanes& body, const Lane* angle,
                                          RotationLanes& rotation, PointLanes& point) {
  posture_lanes(body, angle, rotation, point);
}
#endif

TEST(Lanes, AllInstructionSetsGiveTheSameBits) {
  Random random;
  alignas(64) Lane angle[mocap::kBodyRows];
  for (auto& row : angle) {
    for (float& a : row) a = float(random(-2.0, 2.0));
  }
  const BodyLanes body(mocap::standard_body());
  RotationLanes widest, plain;
  PointLanes widest_points, plain_points;
  posture(body, angle, widest, widest_points);      // the width that this machine chooses
  posture_lanes(body, angle, plain, plain_points);  // the test's own instruction set
  EXPECT_EQ(std::memcmp(&widest, &plain, sizeof plain), 0);
  EXPECT_EQ(std::memcmp(&widest_points, &plain_points, sizeof plain_points), 0);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) {
    posture_avx2(body, angle, widest, widest_points);
    EXPECT_EQ(std::memcmp(&widest, &plain, sizeof plain), 0);
    EXPECT_EQ(std::memcmp(&widest_points, &plain_points, sizeof plain_points), 0);
  }
#endif
}

}  // namespace
}  // namespace mimesis::synthesizer
