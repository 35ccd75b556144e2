// A walk as a stream of set-points must reach the drives as it is.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <span>

#include "common/model/files.h"
#include "common/robot/leg_ik.h"
#include "hw/joints/joints.h"
#include "hw/setpoint_limiter.h"

namespace mimesis::hw {
namespace {

constexpr double kTick_s = 0.005;

/// Walks straight on: 0.1 s on both feet, then a swing of 0.7 s between 0.135 s and 0.765 s of the
/// step as polynomials [docs/walking.md 4]; the pelvis sways.
class Walk {
 public:
  Walk(const robot::Biped& biped, double speed_m_s)
      : biped_(biped),
        ik_{robot::LegIk(biped, robot::kLeft), robot::LegIk(biped, robot::kRight)},
        length_m_(speed_m_s * kStep_s) {}

  Eigen::VectorXd at(double t) const {
    Eigen::VectorXd q = biped_.half_sitting;
    const double faded = std::clamp(t / 2.0, 0.0, 1.0);
    const double begun = faded * faded * faded * (10.0 + faded * (6.0 * faded - 15.0));
    Eigen::Isometry3d X_WB = biped_.X_WB_half_sitting;
    // Half a step behind the mean of the feet at the start, so that it stays between them.
    X_WB.translation().x() += length_m_ * (t / kStep_s - 0.5);
    X_WB.translation().y() += 0.04 * begun * std::sin(M_PI * t / kStep_s);
    for (const robot::Side side : robot::kSides) {
      Eigen::Isometry3d X_WS = Eigen::Isometry3d::Identity();
      X_WS.translation() = foot(side, t);
      const auto result = ik_[side].solve(X_WB.inverse() * X_WS);
      EXPECT_FALSE(result.limited || result.stretched) << t;
      for (std::size_t i = 0; i < 6; ++i) {
        q[biped_.leg[side].dof[i]] = result.q[static_cast<Eigen::Index>(i)];
      }
    }
    return q;
  }

 private:
  static constexpr double kStep_s = 0.8, kLift_m = 0.05;

  Eigen::Vector3d foot(robot::Side side, double t) const {
    const int step = static_cast<int>(std::floor(t / kStep_s));
    const bool swings = (step % 2 == 0) == (side == robot::kRight);
    const double u = std::clamp((t - step * kStep_s - 0.135) / 0.63, 0.0, 1.0);
    const double s = u * u * u * (10.0 + u * (6.0 * u - 15.0));
    // The right foot lands in front at the end of even steps, the left one of odd steps.
    const int landed = side == robot::kRight ? (step + 1) / 2 * 2 - 1 : step / 2 * 2;
    const double from = length_m_ * landed, to = swings ? from + 2.0 * length_m_ : from;
    const double lift = swings ? 64.0 * kLift_m * std::pow(u * (1.0 - u), 3) : 0.0;
    return {from + s * (to - from), 0.5 * robot::sign(side) * biped_.feet_distance_m, lift};
  }

  const robot::Biped& biped_;
  std::array<robot::LegIk, 2> ik_;
  double length_m_;
};

std::span<const double> elements(const Eigen::VectorXd& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}

TEST(WalkStream, PassesTheLimiterUnchanged) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  const Joints joints = load_joints("biped.yaml");
  for (const double speed : {0.1, 0.2, 0.3}) {
    const Walk walk(biped, speed);
    SetpointLimiter limiter(joints.limits, kTick_s);
    Eigen::VectorXd before = walk.at(0.0), rate = Eigen::VectorXd::Zero(before.size());
    limiter.reset(elements(before));
    double fastest = 0.0, hardest = 0.0;
    for (int k = 1; k <= 1600; ++k) {
      const Eigen::VectorXd q = walk.at(kTick_s * k);
      ASSERT_FALSE(limiter.follow(elements(q))) << speed << " m/s, tick " << k;
      ASSERT_LT((limiter.position() - q).cwiseAbs().maxCoeff(), 1e-12);
      const Eigen::VectorXd now = (q - before) / kTick_s;
      fastest = std::max(fastest, (now.cwiseQuotient(joints.limits.v_max)).cwiseAbs().maxCoeff());
      if (k > 1) hardest = std::max(hardest, ((now - rate) / kTick_s).cwiseAbs().maxCoeff());
      before = q;
      rate = now;
    }
    EXPECT_GT(fastest, 0.1) << "it does walk";
    EXPECT_LT(hardest, 0.5 * joints.limits.a_max[0]) << "room for a stabilizer";
    RecordProperty("share_of_v_max_" + std::to_string(speed), std::to_string(fastest));
    RecordProperty("rad_s2_" + std::to_string(speed), std::to_string(hardest));
  }
}

}  // namespace
}  // namespace mimesis::hw
