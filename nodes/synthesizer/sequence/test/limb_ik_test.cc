#include <gtest/gtest.h>

#include "common/math/so3.h"
#include "nodes/synthesizer/sequence/limbs.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Vector3d;
using mocap::kLeft;
using mocap::kRight;

mocap::BodyPose posed(const mocap::Body& body, int first, const LimbAngles& limb,
                      const Eigen::Matrix3d& R_W_root, const Vector3d& root) {
  std::array<double, mocap::kBodyRows> angles{};
  auto put = [&](int joint, const Vector3d& v) {
    for (std::size_t i = 0; i < 3; ++i)
      angles[static_cast<std::size_t>(3 * joint) + i] = v(static_cast<int>(i));
  };
  put(0, math::log_so3(R_W_root));
  for (int i = 0; i < 3; ++i) put(first + i, limb.axis_angle_rad[static_cast<std::size_t>(i)]);
  return forward_kinematics(body, angles, root);
}

TEST(LimbIk, FeetStandWhereTheyAreTold) {
  const auto body = mocap::standard_body();
  const Vector3d root(0.3, 0.02, 0.90);
  const Eigen::Matrix3d R = math::exp_so3({0.04, 0.1, -0.08});
  for (const auto side : {kLeft, kRight}) {
    const FootPose foot{{0.55, side == kLeft ? 0.1 : -0.1, 0.12}, 0.1, -0.3};
    const auto leg = leg_angles(body, side, R, root, foot.p_W_ankle, foot_rotation(foot));
    EXPECT_EQ(leg.short_by_m, 0.0);
    const int hip = side == kLeft ? mocap::kLeftHip : mocap::kRightHip;
    const auto pose = posed(body, hip, leg, R, root);
    const auto ankle = static_cast<std::size_t>(hip + 2);
    EXPECT_LT((pose.p_WJ[ankle] - foot.p_W_ankle).norm(), 5e-6);
    EXPECT_LT((pose.R_WJ[ankle] - foot_rotation(foot)).norm(), 1e-5);
    // toes up at a negative pitch; the knee is before the line from hip to ankle
    EXPECT_GT(pose.point(hip + 2, body.toe_m[side]).z(),
              pose.point(hip + 2, body.heel_m[side]).z());
    const Vector3d h = pose.p_WJ[ankle - 2], k = pose.p_WJ[ankle - 1], a = pose.p_WJ[ankle];
    EXPECT_GT((k - h - (a - h) * (k - h).dot(a - h) / (a - h).squaredNorm()).x(), 0.01);
    EXPECT_GT(leg.axis_angle_rad[1].y(), 0.0);
  }
}

TEST(LimbIk, HandsReachTheirTargetsWithElbowsDown) {
  const auto body = mocap::standard_body();
  for (const auto side : {kLeft, kRight}) {
    const double sign = side == kLeft ? 1.0 : -1.0;
    const int shoulder = side == kLeft ? mocap::kLeftShoulder : mocap::kRightShoulder;
    const auto rest = posed(body, shoulder, {}, Eigen::Matrix3d::Identity(), {0, 0, 1});
    const auto s = static_cast<std::size_t>(shoulder);
    const Vector3d target(0.4, 0.1 * sign, 1.1);
    const auto arm = arm_angles(body, side, rest.R_WJ[mocap::kChest], rest.p_WJ[s], target,
                                {-0.5, 0.4 * sign, -0.7});
    const auto pose = posed(body, shoulder, arm, Eigen::Matrix3d::Identity(), {0, 0, 1});
    EXPECT_LT((pose.point(shoulder + 2, body.hand_m[side]) - target).norm(), 1e-9);
    EXPECT_LT(pose.p_WJ[s + 1].z(), 0.5 * (pose.p_WJ[s].z() + target.z()) - 0.05);
    EXPECT_GT(pose.p_WJ[s + 1].y() * sign, 0.1);  // outwards
  }
}

TEST(LimbIk, FarTargetsStretchTheLimbAndSaySo) {
  const auto body = mocap::standard_body();
  const auto leg = leg_angles(body, kLeft, Eigen::Matrix3d::Identity(), {0, 0, 2.0},
                              {0, 0.085, 0.08}, Eigen::Matrix3d::Identity());
  EXPECT_NEAR(leg.short_by_m, 2.0 - 0.05 - 0.08 - 0.835, 1e-9);
  EXPECT_GT(leg.axis_angle_rad[1].y(), 0.0);  // never straight, and never backward
  EXPECT_LT(leg.axis_angle_rad[1].norm(), 0.05);
}

TEST(FootPath, RollsOverHeelAndToeWithoutSlidingOrSinking) {
  const auto body = mocap::standard_body();
  const FootPath path(
      body, kLeft,
      {{0.0, 0.09, 0.0, 0.1, 0.4, 0.7, -0.3, 0.6}, {1.5, 0.09, 1.1, 1.2, 1.5, 1.8, -0.3, 0.6}},
      0.05, 0.1);
  auto point = [&](double t, const Vector3d& p) {
    const FootPose f = path.at(t).pose;
    return Vector3d(f.p_W_ankle + foot_rotation(f) * p);
  };
  const Vector3d heel = point(0.0, body.heel_m[kLeft]), toe = point(0.3, body.toe_m[kLeft]);
  for (double t = 0.0; t < 1.1; t += 0.01) {
    if (t <= 0.4) {
      EXPECT_LT((point(t, body.heel_m[kLeft]) - heel).norm(), 1e-12) << t;
    }
    if (t >= 0.1 && t <= 0.7) {
      EXPECT_LT((point(t, body.toe_m[kLeft]) - toe).norm(), 1e-12) << t;
    }
    EXPECT_GT(point(t, body.heel_m[kLeft]).z(), -1e-12) << t;
    EXPECT_GT(point(t, body.toe_m[kLeft]).z(), -1e-12) << t;
  }
  // no jump in speed where the foot leaves and where it lands
  for (const double t : {0.7, 1.1}) {
    const double h = 1e-3;
    const Vector3d before = (point(t, toe) - point(t - h, toe)) / h,
                   after = (point(t + h, toe) - point(t, toe)) / h;
    EXPECT_LT((after - before).norm(), 0.3) << t;
  }
  EXPECT_EQ(path.at(0.9).contact, Contact::swing);
}

}  // namespace
}  // namespace mimesis::synthesizer
