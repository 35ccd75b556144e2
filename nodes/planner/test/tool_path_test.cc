// Ways of the tool: their geometry in closed form; what is planned, against dense sampling by the
// arm's kinematics.
#include "nodes/planner/tool_path.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "common/model/files.h"
#include "nodes/planner/move_plan.h"

namespace mimesis::planner {
namespace {

using Eigen::Isometry3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(ToolPath, LinesAndArcsAreWhereTheyAre) {
  constexpr double kPi = std::numbers::pi, kNear = 1e-12;
  Isometry3d X(Eigen::AngleAxisd(0.3, Vector3d::UnitY()));
  X.translation() = Vector3d(0.3, 0.0, 0.5);
  // Straight in x, then three quarters of a circle about (0.5, 0.1, 0.5).
  const auto path =
      ToolPath::make(X, {{{}, {0.5, 0.0, 0.5}}, {Vector3d(0.6, 0.1, 0.5), {0.4, 0.1, 0.5}}});
  ASSERT_TRUE(path);
  EXPECT_NEAR(path->length_m(), 0.2 + 1.5 * kPi * 0.1, kNear);
  EXPECT_TRUE(path->at(0.05).isApprox(Vector3d(0.35, 0.0, 0.5), kNear));
  EXPECT_TRUE(path->at(0.2 + 0.5 * kPi * 0.1).isApprox(Vector3d(0.6, 0.1, 0.5), kNear));
  EXPECT_TRUE(path->at(0.2 + kPi * 0.1).isApprox(Vector3d(0.5, 0.2, 0.5), kNear));
  EXPECT_TRUE(path->at(path->length_m()).isApprox(Vector3d(0.4, 0.1, 0.5), kNear));
  EXPECT_NEAR(path->distance({0.4, 0.0, 0.53}), 0.03, kNear);
  EXPECT_NEAR(path->distance({0.5, 0.27, 0.5}), 0.07, kNear) << "outside of the arc";
  EXPECT_NEAR(path->distance({0.5, 0.1, 0.5}), 0.1, kNear) << "its centre";
  EXPECT_NEAR(path->distance({0.5, 0.2, 0.54}), 0.04, kNear) << "above its plane";
  // In the quarter that the arc leaves out the line and the arc's end are nearest.
  const Vector3d gap(0.42, 0.04, 0.5);
  EXPECT_NEAR(path->distance(gap), 0.04, kNear);
  EXPECT_NEAR(path->angle(X.linear() * Eigen::AngleAxisd(0.02, Vector3d::UnitX())), 0.02, 1e-9);
}

TEST(ToolPath, SaysWhichPieceIsNone) {
  Isometry3d X = Isometry3d::Identity();
  const auto why = [&](const std::vector<ToolPiece>& pieces) {
    const auto path = ToolPath::make(X, pieces);
    return path ? std::string("is one") : path.error().reason;
  };
  const Vector3d a(0.1, 0.0, 0.0), b(0.2, 0.0, 0.0);
  EXPECT_EQ(why({{{}, a}, {{}, a}}), "piece 2 of the tool's way has no length");
  EXPECT_EQ(why({{a, b}}), "piece 1 of the tool's way has its three points on a line");
  EXPECT_EQ(why({{Vector3d::Zero(), b}}),
            "piece 1 of the tool's way has its three points on a line");
  EXPECT_EQ(why({{a, Vector3d::Zero()}}),
            "piece 1 of the tool's way ends where it begins: a circle is two arcs");
}

class ToolWay : public ::testing::Test {
 protected:
  /// Largest distance from the way and angle, of points on a Bézier curve.
  std::pair<double, double> off(const ToolPath& path, const MatrixXd& curve) const {
    std::pair<double, double> most{0.0, 0.0};
    for (int i = 0; i <= 40; ++i) {
      MatrixXd p = curve;
      for (Eigen::Index left = p.cols() - 1; left > 0; --left)
        for (Eigen::Index k = 0; k < left; ++k)
          p.col(k) += i / 40.0 * (p.col(k + 1) - p.col(k)).eval();
      const Isometry3d X = kin::end_effector(arm_, p.col(0));
      most.first = std::max(most.first, path.distance(X.translation()));
      most.second = std::max(most.second, path.angle(X.linear()));
    }
    return most;
  }
  tl::expected<TaskPlan, Status> plan(const Move& move) const {
    return plan_request(arm_, {}, {table_, start_, move}, {});
  }

  const kin::ArmModel arm_ = model::load_arm("lwr4.yaml");
  kin::Table table_;
  VectorXd start_ = (VectorXd(7) << 0.0, -0.9, 0.0, 1.0, 0.0, -0.6, 0.0).finished();
  Isometry3d X_WE_ = kin::end_effector(arm_, start_);
};

TEST_F(ToolWay, MotionsKeepToTheirToleranceAndEndAtTheEnd) {
  const Vector3d p = X_WE_.translation();
  const std::vector<std::vector<ToolPiece>> ways{
      {{{}, p + Vector3d(0.0, 0.25, 0.0)}},
      {{{}, p + Vector3d(0.0, 0.1, -0.1)}, {{}, p + Vector3d(-0.1, 0.1, -0.1)}},
      {{p + Vector3d(-0.08, 0.08, 0.0), p + Vector3d(-0.16, 0.0, 0.0)}},
      {{{}, p + Vector3d(0.0, -0.15, 0.0)},
       {p + Vector3d(-0.1, -0.2, 0.05), p + Vector3d(-0.15, -0.05, 0.1)}}};
  for (std::size_t i = 0; i < ways.size(); ++i) {
    for (const double tolerance : {1e-3, 3e-4}) {
      Move move;
      move.tool = ways[i];
      move.tolerance.position_m = tolerance;
      const auto found = plan(move);
      ASSERT_TRUE(found) << i << ": " << found.error().reason;
      ASSERT_EQ(found->motions.size(), 1u);
      const PlannedMotion& motion = found->motions.front();
      const auto path = ToolPath::make(X_WE_, move.tool);
      double most_m = 0.0, most_rad = 0.0;
      for (const MatrixXd& curve : motion.curves) {
        const auto [off_m, off_rad] = off(*path, curve);
        most_m = std::max(most_m, off_m);
        most_rad = std::max(most_rad, off_rad);
      }
      EXPECT_LE(most_m, tolerance) << i;
      EXPECT_GE(most_m, 0.02 * tolerance) << i << ": the tolerance is used";
      EXPECT_LE(most_rad, ToolTolerance{}.angle_rad) << i;
      const Isometry3d end = kin::end_effector(arm_, motion.trajectory.position.rightCols(1));
      EXPECT_LE((end.translation() - move.tool.back().to).norm(), 2e-5) << i;
      // All of the way, not a short cut: each of its points is near the motion.
      for (double s = 0.0; s <= path->length_m(); s += 0.01) {
        double least = 1e9;
        for (const auto& q : motion.trajectory.position.colwise())
          least = std::min(least, (kin::end_effector(arm_, q).translation() - path->at(s)).norm());
        EXPECT_LE(least, 0.006) << i << " at " << s;
      }
    }
  }
}

TEST_F(ToolWay, ACurveThatLeavesItIsNotTakenForOneThatKeepsToIt) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> in(-1.0, 1.0);
  const auto path = ToolPath::make(X_WE_, {{{}, X_WE_.translation() + Vector3d(0.0, 0.2, 0.0)}});
  int kept = 0, left = 0;
  for (int i = 0; i < 400; ++i) {
    MatrixXd curve(7, i % 2 ? 2 : 5);
    for (auto q : curve.colwise())
      q = start_ + 2e-3 * VectorXd::NullaryExpr(7, [&] { return in(random); });
    const auto [off_m, off_rad] = off(*path, curve);
    const ToolTolerance wider{1.05 * off_m + 1e-6, 1.0}, narrower{0.95 * off_m, 1.0},
        turned{1.0, 0.95 * off_rad};
    kept += keeps_to(arm_, *path, wider, curve);
    left += !keeps_to(arm_, *path, narrower, curve) && !keeps_to(arm_, *path, turned, curve);
  }
  EXPECT_EQ(left, 400);
  EXPECT_EQ(kept, 400);
}

TEST_F(ToolWay, FailuresSayHowFarItGoesAndWhy) {
  const Vector3d p = X_WE_.translation();
  const auto why = [&](const Vector3d& by) {
    Move move;
    move.tool = {{{}, p + by}};
    const auto found = plan(move);
    return found ? std::string("found") : found.error().reason;
  };
  const std::string far = why({1.0, 0.0, 0.0});
  EXPECT_TRUE(far.starts_with("the tool's way fails after ")) << far;
  EXPECT_NE(far.find(" of 1000 mm: no posture near the last one"), std::string::npos) << far;
  table_.boxes = {{p + Vector3d(0.0, 0.3, 0.0), {0.05, 0.05, 0.05}, "shelf"}};
  const std::string blocked = why({0.0, 0.3, 0.0});
  EXPECT_NE(blocked.find("touches the shelf"), std::string::npos) << blocked;
  table_.boxes.front().center = p;
  EXPECT_EQ(why({0.0, 0.3, 0.0}).find("the tool's way fails after 0 of 300 mm: "), 0u);
}

}  // namespace
}  // namespace mimesis::planner
