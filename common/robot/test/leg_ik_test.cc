#include "common/robot/leg_ik.h"

#include <gtest/gtest.h>

#include <random>

#include "common/math/so3.h"
#include "common/robot/kinematics.h"
#include "common/robot/test/test_bipeds.h"
#include "common/testing/refusal.h"

namespace mimesis::robot {
namespace {

using Eigen::Isometry3d, Eigen::Matrix3d, Eigen::Vector3d, Eigen::VectorXd;
using Vector6d = Eigen::Matrix<double, 6, 1>;

class Leg {
 public:
  Leg(const Biped& biped, Side side)
      : biped_(biped), leg_(biped.leg[side]), kinematics_(biped.tree), q_(biped.half_sitting) {
    const VectorXd all_lower = biped.tree.lower(), all_upper = biped.tree.upper();
    for (Eigen::Index i = 0; i < 6; ++i) {
      lower[i] = all_lower[leg_.dof[static_cast<std::size_t>(i)]];
      upper[i] = all_upper[leg_.dof[static_cast<std::size_t>(i)]];
    }
  }
  Isometry3d sole(const Vector6d& q) {
    for (std::size_t i = 0; i < 6; ++i) q_[leg_.dof[i]] = q[static_cast<Eigen::Index>(i)];
    kinematics_.update(Isometry3d::Identity(), q_);
    return kinematics_.X_WL(leg_.sole);
  }
  Isometry3d hip() {
    return kinematics_.X_WL(biped_.tree.require_link(biped_.tree.moved(leg_.dof[0]).name));
  }
  Vector6d lower, upper;

 private:
  const Biped& biped_;
  const Biped::Leg& leg_;
  Kinematics kinematics_;
  VectorXd q_;
};

std::vector<Biped> robots() {
  std::vector<Biped> all{hrp2_like(), odd_biped()};
  if (auto other = jvrc1()) all.push_back(std::move(*other));
  return all;
}

/// Bend of the knee at which the leg is longest [rad].
double straight_knee(Leg& leg, const Vector3d& ankle_S) {
  Vector6d q = Vector6d::Zero();
  double best = 0.0, longest = 0.0;
  for (double knee = -0.5; knee < 0.5; knee += 1e-4) {
    q[3] = knee;
    const double length = (leg.sole(q) * ankle_S - leg.hip().translation()).norm();
    if (length > longest) longest = length, best = knee;
  }
  return best;
}

TEST(LegIk, RoundTripsThroughEveryPosture) {
  for (const Biped& biped : robots()) {
    for (const Side side : kSides) {
      const LegIk ik(biped, side);
      Leg leg(biped, side);
      const double straight = straight_knee(leg, biped.leg[side].ankle_S_m);
      std::mt19937 random(7);
      std::uniform_real_distribution<double> unit(0.0, 1.0);
      int counted = 0;
      for (int n = 0; n < 2000; ++n) {
        Vector6d q;
        for (Eigen::Index i = 0; i < 6; ++i) {
          q[i] = leg.lower[i] + unit(random) * (leg.upper[i] - leg.lower[i]);
        }
        const double bends = leg.upper[3] > -leg.lower[3] ? 1.0 : -1.0;
        if (bends * (q[3] - straight) < 0.02) continue;  // the other way the knee does not bend
        const Isometry3d X_BS = leg.sole(q);
        const LegIk::Result result = ik.solve(X_BS);
        // A deep squat with the toes at the hip has the mirrored posture within its limits as well
        if ((result.q - q).cwiseAbs().maxCoeff() < 1e-9) ++counted;
        ASSERT_FALSE(result.stretched) << biped.tree.name() << ' ' << q.transpose();
        ASSERT_FALSE(result.limited) << biped.tree.name() << ' ' << q.transpose();
        ASSERT_LT((leg.sole(result.q).matrix() - X_BS.matrix()).cwiseAbs().maxCoeff(), 1e-9)
            << biped.tree.name() << ' ' << q.transpose() << " : " << result.q.transpose();
        ASSERT_NEAR(result.bend_rad, bends * (result.q[3] - straight), 1e-4);  // the grid above
      }
      EXPECT_GT(counted, 1700) << biped.tree.name();
    }
  }
}

TEST(LegIk, HalfSittingIsFound) {
  for (const Biped& biped : robots()) {
    for (const Side side : kSides) {
      const LegIk ik(biped, side);
      Leg leg(biped, side);
      Vector6d q;
      for (Eigen::Index i = 0; i < 6; ++i) {
        q[i] = biped.half_sitting[biped.leg[side].dof[static_cast<std::size_t>(i)]];
      }
      EXPECT_LT((ik.solve(leg.sole(q)).q - q).norm(), 1e-9) << biped.tree.name();
    }
  }
}

TEST(LegIk, PointsAtWhatItCannotReach) {
  for (const Biped& biped : robots()) {
    for (const Side side : kSides) {
      const LegIk ik(biped, side);
      Leg leg(biped, side);
      Vector6d q = Vector6d::Zero();
      const Vector3d hip = (leg.sole(q), leg.hip().translation());
      const Vector3d ankle_S = biped.leg[side].ankle_S_m;
      Isometry3d X_BS = Isometry3d::Identity();
      X_BS.translation() = hip + Vector3d(0.3, sign(side) * 0.05, -1.5);
      const LegIk::Result result = ik.solve(X_BS, 0.05);
      EXPECT_TRUE(result.stretched);
      EXPECT_FALSE(result.limited);
      EXPECT_NEAR(result.bend_rad, 0.05, 1e-12);
      const Isometry3d reached = leg.sole(result.q);
      EXPECT_LT((reached.linear() - X_BS.linear()).norm(), 1e-9);
      const Vector3d wished = X_BS * ankle_S - hip, got = reached * ankle_S - hip;
      EXPECT_LT(wished.normalized().cross(got.normalized()).norm(), 1e-9);
      EXPECT_LT(got.norm(), wished.norm());
      EXPECT_NEAR(std::abs(result.q[3] - straight_knee(leg, ankle_S)), 0.05, 2e-4);
    }
  }
}

TEST(LegIk, NeverGivesMoreThanTheLimitsOrNoNumber) {
  for (const Biped& biped : robots()) {
    const LegIk ik(biped, kLeft);
    Leg leg(biped, kLeft);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int n = 0; n < 2000; ++n) {
      Isometry3d X = Isometry3d::Identity();
      X.linear() = math::exp_so3(3.0 * Vector3d(unit(random), unit(random), unit(random)));
      X.translation() = 1.2 * Vector3d(unit(random), unit(random), unit(random));
      const LegIk::Result result = ik.solve(X);
      ASSERT_TRUE(result.q.allFinite());
      ASSERT_TRUE((result.q.array() >= leg.lower.array()).all());
      ASSERT_TRUE((result.q.array() <= leg.upper.array()).all());
      const bool there = (leg.sole(result.q).matrix() - X.matrix()).norm() < 1e-8;
      ASSERT_EQ(there, !result.stretched && !result.limited) << biped.tree.name();
    }
    Isometry3d at_hip = leg.hip();  // the ankle in the hip
    at_hip.linear().setIdentity();
    at_hip.translation() -= biped.leg[kLeft].ankle_S_m;
    EXPECT_TRUE(ik.solve(at_hip).stretched);
    EXPECT_TRUE(ik.solve(at_hip).q.allFinite());
  }
}

/// Legs without a closed form: axes that miss each other, or are askew.
std::vector<Biped> other_robots() {
  std::vector<Biped> all;
  const Vector3d none = Vector3d::Zero(), shift(0.03, 0.02, -0.04);
  const Vector3d tilted = Vector3d(-0.2, 0.1, -1.0).normalized();
  all.push_back(odd_biped("left_2", Vector3d::UnitZ(), shift));                      // hip
  all.push_back(odd_biped("left_2", tilted, none));                                  // hip askew
  all.push_back(odd_biped("left_3", Vector3d(0.1, 1.0, -0.1).normalized(), none));   // knee askew
  all.push_back(odd_biped("left_4", Vector3d::UnitX(), Vector3d(0.01, 0.0, 0.02)));  // ankle
  return all;
}

TEST(LegIk, FindsEveryPostureOfOtherLegsFromNearby) {
  for (const Biped& biped : other_robots()) {
    const LegIk ik(biped, kLeft);
    ASSERT_FALSE(ik.closed_form());
    Leg leg(biped, kLeft);
    std::mt19937 random(11);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    int from_far = 0, all = 0;
    for (int n = 0; n < 2000; ++n) {
      Vector6d q, near;
      for (Eigen::Index i = 0; i < 6; ++i) {
        q[i] = leg.lower[i] + unit(random) * (leg.upper[i] - leg.lower[i]);
        if (i == 3) q[i] = -0.15 - 1.8 * unit(random);  // bent, by more than near can be beside it
        near[i] = q[i] + 0.1 * (unit(random) - 0.5);
      }
      const Isometry3d X_BS = leg.sole(q);
      const LegIk::Result result = ik.solve(X_BS, 0.01, &near);
      ASSERT_FALSE(result.stretched) << q.transpose();
      ASSERT_LT((leg.sole(result.q).matrix() - X_BS.matrix()).cwiseAbs().maxCoeff(), 1e-12);
      const LegIk::Result again = ik.solve(X_BS, 0.01, &near);
      ASSERT_EQ(result.q, again.q) << "same inputs, same bits";
      const LegIk::Result far = ik.solve(X_BS);
      ++all;
      from_far += !far.stretched &&
                  (leg.sole(far.q).matrix() - X_BS.matrix()).cwiseAbs().maxCoeff() < 1e-12;
    }
    EXPECT_GT(from_far, 0.9 * all) << "from half-sitting, however far";
  }
}

TEST(LegIk, HoldsTheKneeOfOtherLegsAtTheEndOfItsRange) {
  for (const Biped& biped : other_robots()) {
    const LegIk ik(biped, kLeft);
    Leg leg(biped, kLeft);
    const Vector3d ankle_S = biped.leg[kLeft].ankle_S_m;
    Vector6d q = Vector6d::Zero();
    q[3] = -0.6;
    const Isometry3d start = leg.sole(q);
    double before = 0.0;
    for (double down = 0.0; down < 0.5; down += 0.01) {
      const LegIk::Result result =
          ik.solve(Isometry3d(Eigen::Translation3d(0.0, 0.0, -down)) * start, 0.05, &q);
      q = result.q;
      const Isometry3d reached = leg.sole(q);
      EXPECT_LT((reached.linear() - start.linear()).norm(), 1e-9) << "turned as asked";
      EXPECT_GE(result.bend_rad, 0.05 - 1e-12) << "on its side";
      const double low = (reached * ankle_S).z();
      if (result.stretched) {
        EXPECT_NEAR(result.bend_rad, 0.05, 1e-12);
        if (before != 0.0) {
          EXPECT_NEAR(low, before, 2e-3) << "as far as the leg is long";
        }
        before = low;
      } else {
        EXPECT_NEAR((reached.translation() - start.translation()).z(), -down, 1e-12);
      }
    }
    EXPECT_NE(before, 0.0);
  }
}

/// A hip whose axes miss each other by 10 µm is no closed form's, and nearly one.
TEST(LegIk, BothWaysAgreeWhereBothApply) {
  const Biped exact = odd_biped(),
              other = odd_biped("left_2", -Vector3d::UnitZ(), Vector3d(1e-5, 0, 0));
  const LegIk closed(exact, kLeft), numeric(other, kLeft);
  EXPECT_TRUE(closed.closed_form());
  EXPECT_FALSE(numeric.closed_form());
  Leg leg(exact, kLeft);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int n = 0; n < 500; ++n) {
    Vector6d q;
    for (double& x : q) x = 0.3 * unit(random);
    q[3] = -0.7 + 0.5 * unit(random);
    const Isometry3d X_BS = leg.sole(q);
    EXPECT_LT((closed.solve(X_BS).q - numeric.solve(X_BS).q).cwiseAbs().maxCoeff(), 2e-4);
    EXPECT_NEAR(closed.solve(X_BS).bend_rad, numeric.solve(X_BS).bend_rad, 2e-4);
  }
}

TEST(LegIk, RefusesAKneeThatDoesNotBend) {
  const auto refusal = [](const char* joint, const Vector3d& axis, const Vector3d& shift) {
    return testing::refusal([&] {
      const Biped biped = odd_biped(joint, axis, shift);
      const LegIk ik(biped, kLeft);
    });
  };
  EXPECT_EQ(refusal("left_2", Vector3d::UnitZ(), Vector3d::Zero()), "");
  // the knee's axis along the shank turns it about itself
  EXPECT_NE(refusal("left_3", Vector3d(0.02, 0.01, -0.4).normalized(), Vector3d::Zero())
                .find("joint 'left_3': expected a knee"),
            std::string::npos);
}

}  // namespace
}  // namespace mimesis::robot
