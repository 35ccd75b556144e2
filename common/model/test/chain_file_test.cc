// Arms whose joints come from a URDF, against the kinematics of the URDF's own tree.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "common/model/files.h"
#include "common/robot/kinematics.h"
#include "common/testing/refusal.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::model {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

class Chain : public ::testing::Test {
 protected:
  double unit() { return std::uniform_real_distribution(-1.0, 1.0)(random_); }
  /// Often on the grid, so that axes are parallel, meet or are the same.
  double coordinate(double step) {
    return random_() % 2 == 0 ? step * static_cast<double>(static_cast<int>(random_() % 3) - 1)
                              : step * unit();
  }
  std::string triple(double step) {
    std::ostringstream out;
    out.precision(17);
    out << coordinate(step) << ' ' << coordinate(step) << ' ' << coordinate(step);
    return out.str();
  }
  static std::string joint(int i, const std::string& type, const std::string& xyz,
                           const std::string& rpy, const std::string& axis) {
    const std::string n = std::to_string(i), before = std::to_string(i - 1);
    return "<link name='l" + n + "'/><joint name='j" + n + "' type='" + type + "'><parent link='l" +
           before + "'/><child link='l" + n + "'/><origin xyz='" + xyz + "' rpy='" + rpy +
           "'/><axis xyz='" + axis +
           "'/><limit lower='-3' upper='2.5' velocity='1.5' effort='9'/></joint>";
  }
  /// An arm file beside its URDF.
  std::string written(const std::string& joints, int links, int turning, const std::string& more) {
    std::ofstream(folder_ / "arm.urdf")
        << "<robot name='arm'><link name='l0'/>" << joints << "</robot>";
    std::ofstream out(folder_ / "arm.yaml");
    out << "name: arm\nbase_m: [0.1, -0.2, 0.3]\nbase_rpy_rad: [0.3, -0.4, 0.5]\n"
        << "tool_m: [0.01, 0.02, 0.03]\ntool_rpy_rad: [0.5, 0.1, -0.2]\n"
        << "groups: [all]\nobstacle_groups: [all]\nself_pairs: [{a: all, b: all}]\nchain: {urdf: "
           "arm.urdf, base: l0, tip: l"
        << links << ", a_max_rad_s2: [";
    for (int i = 0; i < turning; ++i) out << (i > 0 ? ", 4" : "4");
    out << "]}\nballs:\n";
    for (int i = 0; i <= links; ++i)
      out << "  - {link: l" << i
          << ", group: all, center_m: [0.01, 0.05, -0.03], radius_m: 0.04}\n";
    out << more;
    out.close();
    return folder_ / "arm.yaml";
  }

  testing::TemporaryFolder folder_;
  std::mt19937_64 random_{77};
};

TEST_F(Chain, MovesLikeItsUrdf) {
  for (int trial = 0; trial < 200; ++trial) {
    const int links = 1 + static_cast<int>(random_() % 9);
    std::string joints;
    int turning = 0;
    for (int i = 1; i <= links; ++i) {
      const bool fixed = i > 1 && random_() % 5 == 0;
      turning += !fixed;
      std::string axis = triple(1.0);
      if (axis == "0 0 0" || axis.find_first_not_of("-0 ") == std::string::npos) axis = "0 1 0";
      joints += joint(i,
                      fixed                ? "fixed"
                      : random_() % 4 == 0 ? "prismatic"
                                           : "revolute",
                      triple(0.4), triple(M_PI / 2.0), axis);
    }
    const std::string file = written(joints, links, turning, "");
    const kin::ArmModel arm = load_arm(file);
    ASSERT_EQ(arm.dof(), turning);
    EXPECT_EQ(arm.q_min[0], -3.0);
    EXPECT_EQ(arm.v_max[0], 1.5);
    const robot::RobotTree tree = robot::read_urdf(folder_ / "arm.urdf");
    robot::Kinematics judge(tree);
    const Eigen::Isometry3d X_WB =
        Eigen::Translation3d(0.1, -0.2, 0.3) * Eigen::AngleAxisd(0.5, Vector3d::UnitZ()) *
        Eigen::AngleAxisd(-0.4, Vector3d::UnitY()) * Eigen::AngleAxisd(0.3, Vector3d::UnitX());
    const Eigen::Isometry3d X_TE =
        Eigen::Translation3d(0.01, 0.02, 0.03) * Eigen::AngleAxisd(-0.2, Vector3d::UnitZ()) *
        Eigen::AngleAxisd(0.1, Vector3d::UnitY()) * Eigen::AngleAxisd(0.5, Vector3d::UnitX());
    Eigen::VectorXd q(turning);
    for (double& x : q) x = 3.0 * unit();
    judge.update(X_WB, q);
    const Eigen::Isometry3d expected = judge.X_WL(links) * X_TE;
    EXPECT_LT((kin::end_effector(arm, q).matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 1e-9)
        << trial;
    std::vector<Eigen::Isometry3d> X;
    Eigen::Matrix3Xd centers;
    kin::forward(arm, q, X);
    kin::ball_centers(arm, X, centers);
    for (int i = 0; i <= links; ++i)
      EXPECT_LT((centers.col(i) - judge.X_WL(i) * Vector3d(0.01, 0.05, -0.03)).norm(), 1e-9)
          << trial << ", link " << i;
  }
}

TEST_F(Chain, LimitsAreThoseOfTheJoints) {
  const auto one = [this](const std::string& limits, const std::string& type) {
    std::string turn = joint(1, type, "0 0 0.3", "0 0 0", "0 0 1");
    const std::string usual = "lower='-3' upper='2.5'";
    return load_arm(written(turn.replace(turn.find(usual), usual.size(), limits), 1, 1, ""));
  };
  const kin::ArmModel turning = one("", "continuous");
  EXPECT_TRUE(turning.links[0].endless);
  EXPECT_EQ(turning.q_max[0], 2.0 * M_PI);
  const kin::ArmModel whole = one("lower='-6.283185' upper='6.283185'", "revolute");  // UR10
  EXPECT_FALSE(whole.links[0].endless);
  EXPECT_EQ(whole.q_min[0], -6.283185);
  EXPECT_EQ(one("lower='-9' upper='100'", "revolute").q_max[0], 2.0 * M_PI);
  EXPECT_EQ(one("lower='0' upper='12'", "prismatic").q_max[0], 12.0);  // a rail
  const std::string none = testing::refusal([&] { one("", "revolute"); });
  EXPECT_NE(none.find("joint 'j1' has no range between its limits"), std::string::npos) << none;
}

TEST_F(Chain, SaysWhatIsWrong) {
  const std::string turn = joint(1, "revolute", "0 0 0.3", "0 0 0", "0 0 1");
  const auto says = [](const std::string& file, const std::string& what) {
    const std::string message = testing::refusal([&] { load_arm(file); });
    EXPECT_NE(message.find(what), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  };
  says(written(turn, 1, 2, ""), "2 numbers in a_max_rad_s2, expected 1");
  says(written(turn, 2, 1, ""), "'l2'");
  says(written(joint(1, "continuous", "0 0 0", "0 0 0", "0 0 0"), 1, 1, ""), "axis of no length");
  says(written(turn, 1, 1, "  - {link: elbow, group: all, center_m: [0, 0, 0], radius_m: 0.1}\n"),
       "no link 'elbow'");
  const std::string file = written(turn, 1, 1, "");
  fs::remove(folder_ / "arm.urdf");
  says(file, "no file");
}

}  // namespace
}  // namespace mimesis::model
