#include <gtest/gtest.h>

#include "hw/sim/body/test/bodies.h"
#include "hw/sim/body/walk_judge.h"

namespace mimesis::hw::sim {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

class FallJudgeTest : public ::testing::Test {
 protected:
  /// Judged with the trunk turned by `tilt_rad` about `axis` from where the set-points have it.
  std::string how(double height_m, double tilt_rad, const Vector3d& axis,
                  robot::Side loaded = robot::kLeft) {
    const robot::Biped& biped = robot_.biped;
    robot::Kinematics wished(biped.tree);
    wished.update(Eigen::Isometry3d::Identity(), set_point_);
    const Eigen::Matrix3d R_ST = wished.X_WL(biped.leg[loaded].sole).linear().transpose() *
                                 wished.X_WL(biped.trunk).linear();
    return judge_.how({0.0, 0.0, height_m * biped.com_height_m},
                      AngleAxisd(tilt_rad, axis).toRotationMatrix() * R_ST, set_point_, loaded);
  }

  const TestRobot robot_ = test_robot();
  Eigen::VectorXd set_point_ = robot_.biped.half_sitting;
  FallJudge judge_{robot_.biped, Vector3d::UnitZ()};
};

TEST_F(FallJudgeTest, ByTheHeightOfTheCentreOfMass) {
  EXPECT_EQ(how(1.0, 0.0, Vector3d::UnitX()), "");
  EXPECT_EQ(how(0.61, 0.0, Vector3d::UnitX()), "");
  EXPECT_NE(how(0.59, 0.0, Vector3d::UnitX()).find("centre of mass at"), std::string::npos);
  FallJudge slope(robot_.biped, Vector3d(0.6, 0.0, 0.8));  // above the ground, not above z = 0
  const double height_m = robot_.biped.com_height_m;
  EXPECT_EQ(slope.how({height_m, 0.0, 0.0}, Eigen::Matrix3d::Identity(), set_point_, robot::kLeft)
                .find("centre of mass"),
            std::string::npos);
  EXPECT_NE(
      slope.how({-height_m, 0.0, height_m}, Eigen::Matrix3d::Identity(), set_point_, robot::kLeft)
          .find("centre of mass"),
      std::string::npos);
}

TEST_F(FallJudgeTest, ByTheTiltOfTheTrunkAgainstItsSetPoints) {
  for (const Vector3d& axis :
       {Vector3d(1.0, 0.0, 0.0), Vector3d(0.0, 1.0, 0.0), Vector3d(-0.6, 0.8, 0.0)}) {
    EXPECT_EQ(how(1.0, 0.88, axis), "");
    EXPECT_NE(how(1.0, 0.92, axis).find("trunk tilted by"), std::string::npos);
  }
  EXPECT_EQ(how(1.0, 3.0, Vector3d::UnitZ()), "") << "a heading is no tilt";
}

/// Bent by 1.2 rad at the hips as it was told to, it has not fallen; upright instead, it would
/// have.
TEST_F(FallJudgeTest, WhoBendsAsToldHasNotFallen) {
  for (const char* joint : {"left_hip_pitch", "right_hip_pitch"}) {
    set_point_[robot_.biped.tree.require_joint(joint)] -= 1.2;
  }
  set_point_[robot_.biped.tree.require_joint("waist_pitch")] += 0.4;  // and bows in the waist
  EXPECT_EQ(how(1.0, 0.0, Vector3d::UnitX()), "");
  EXPECT_NE(judge_.how({0.0, 0.0, 1.0}, Eigen::Matrix3d::Identity(), set_point_, robot::kLeft), "");
}

/// Legs that differ: the sole with the weight on it is level.
TEST_F(FallJudgeTest, LevelIsTheLoadedSole) {
  set_point_[robot_.biped.tree.require_joint("left_ankle_pitch")] += 1.0;
  EXPECT_EQ(how(1.0, 0.0, Vector3d::UnitX(), robot::kLeft), "");
  EXPECT_EQ(how(1.0, 0.0, Vector3d::UnitX(), robot::kRight), "");
  EXPECT_EQ(judge_.how({0.0, 0.0, 1.0}, Eigen::Matrix3d::Identity(), set_point_, robot::kRight),
            "");
  EXPECT_NE(judge_.how({0.0, 0.0, 1.0}, Eigen::Matrix3d::Identity(), set_point_, robot::kLeft), "");
}

}  // namespace
}  // namespace mimesis::hw::sim
