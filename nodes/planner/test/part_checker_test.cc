// Arms of convex parts: what is certified, against dense sampling of all pairs.
#include "nodes/planner/part_checker.h"

#include <gtest/gtest.h>

#include <random>

#include "common/model/files.h"
#include "nodes/planner/collision.h"

namespace mimesis::planner {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kPartMargin = 0.002;

class Parts : public ::testing::Test {
 protected:
  /// The LWR4 with an octahedron in each of its balls, which then only exclude quickly.
  Parts() : arm_(model::load_arm("lwr4.yaml")) {
    for (kin::SafetyBall& ball : arm_.balls) {
      ball.of_part = true;
      kin::SafetyPart part;
      part.frame = ball.frame;
      part.group = ball.group;
      part.cover = {{ball.center, ball.radius}};
      part.shape.points.resize(6, 3);
      for (int i = 0; i < 6; ++i)
        part.shape.points.row(i) =
            (ball.center + (i % 2 == 0 ? 1.0 : -1.0) * ball.radius * Vector3d::Unit(i / 2))
                .transpose();
      arm_.parts.push_back(std::move(part));
    }
    balls_ = arm_;
    balls_.parts.clear();
    for (kin::SafetyBall& ball : balls_.balls) ball.of_part = false;
    around_.balls = {{{0.45, 0.1, 0.5}, 0.08}, {{-0.3, 0.4, 0.7}, 0.1}};
    around_.boxes = {{{0.3, -0.4, 0.4}, {0.05, 0.1, 0.3}, "post"}};
    kin::Hull wedge;
    wedge.name = "wedge";
    wedge.shape.radius = 0.01;
    wedge.shape.points.resize(4, 3);
    wedge.shape.points << -0.5, -0.4, 0.2, -0.2, -0.4, 0.2, -0.35, -0.1, 0.2, -0.35, -0.3, 0.9;
    wedge.cover = {math::round_bound(wedge.shape)};
    around_.hulls = {wedge};
  }

  double in(double lo, double hi) { return std::uniform_real_distribution(lo, hi)(random_); }
  VectorXd posture() {
    VectorXd q(arm_.dof());
    for (Eigen::Index j = 0; j < q.size(); ++j) q[j] = in(arm_.q_min[j], arm_.q_max[j]);
    return q;
  }

  /// Least distance of all pairs that are checked.
  double clearance(const VectorXd& q) {
    std::vector<Eigen::Isometry3d> X;
    kin::forward(arm_, q, X);
    double least = 1e9;
    const auto at = [&](const kin::SafetyPart& part) {
      return X[static_cast<std::size_t>(part.frame)];
    };
    for (const kin::SafetyPart& a : arm_.parts) {
      if (std::ranges::count(arm_.env_groups, a.group) > 0) {
        for (const kin::Ball& b : around_.balls)
          least = std::min(
              least, math::gap_between(a.shape, {b.center.transpose(), b.radius}, at(a).inverse())
                         .at_most);
        for (const kin::Box& b : around_.boxes) {
          math::ConvexPart box{Eigen::MatrixX3d(8, 3)};
          for (int i = 0; i < 8; ++i)
            box.points.row(i) = (b.center + b.half_extent.cwiseProduct(Vector3d(
                                                i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)))
                                    .transpose();
          least = std::min(least, math::gap_between(a.shape, box, at(a).inverse()).at_most);
        }
        for (const kin::Hull& h : around_.hulls)
          least = std::min(least, math::gap_between(a.shape, h.shape, at(a).inverse()).at_most);
      }
      for (const kin::SafetyPart& b : arm_.parts) {
        if (std::ranges::count(arm_.self_pairs, std::pair(a.group, b.group)) == 0) continue;
        least =
            std::min(least, math::gap_between(a.shape, b.shape, at(a).inverse() * at(b)).at_most);
      }
    }
    return least;
  }

  kin::ArmModel arm_, balls_;
  Obstacles around_;
  std::mt19937_64 random_{3};
};

TEST_F(Parts, DecideWhereTheirBallsTouch) {
  CollisionChecker parts(arm_, around_, kPartMargin), balls(balls_, around_, kPartMargin);
  int more = 0, touching = 0;
  Eigen::MatrixXd many(arm_.dof(), 400);
  for (Eigen::Index i = 0; i < many.cols(); ++i) many.col(i) = posture();
  const std::vector<char> free = parts.free_columns(many);
  for (Eigen::Index i = 0; i < many.cols(); ++i) {
    const VectorXd q = many.col(i);
    const double least = clearance(q);
    if (std::abs(least - kPartMargin) < 2e-5) continue;
    EXPECT_EQ(parts.free(q), least > kPartMargin);
    EXPECT_EQ(free[static_cast<std::size_t>(i)] != 0, least > kPartMargin);
    EXPECT_EQ(parts.contact(q).has_value(), least < kPartMargin);
    EXPECT_TRUE(parts.free(q) || !balls.free(q));
    more += parts.free(q) && !balls.free(q);
    touching += least < kPartMargin;
  }
  EXPECT_GT(more, 5);
  EXPECT_GT(touching, 20);
}

TEST_F(Parts, LinesAreNeverContradictedAndNotRefusedForNothing) {
  CollisionChecker parts(arm_, around_, kPartMargin), balls(balls_, around_, kPartMargin);
  int certified = 0, more = 0, refused = 0;
  for (int i = 0; i < 200; ++i) {
    const VectorXd a = posture(), b = a + in(0.1, 0.6) * (posture() - a);
    const bool free = parts.certify(a, b);
    certified += free;
    more += free && !balls.certify(a, b);
    double least = 1e9;
    for (int k = 0; k <= 60 && least > 0.5 * kPartMargin; ++k)
      least = std::min(least, clearance(a + k / 60.0 * (b - a)));
    if (free) {
      EXPECT_GE(least, kPartMargin - 1e-6);
      EXPECT_TRUE(parts.seems_free(a, b));
    } else {
      ++refused;
      EXPECT_LT(least, kPartMargin + 2e-3) << "dense sampling meets nothing";
    }
  }
  EXPECT_GT(certified, 20);
  EXPECT_GT(more, 3);
  EXPECT_GT(refused, 20);
}

/// With the cells of joints in which pairs are proven once; also of a joint that fails alone.
TEST_F(Parts, StopsAreNeverContradicted) {
  CollisionChecker parts(arm_, around_, kPartMargin);
  int certified = 0;
  VectorXd q = arm_.home;
  for (int i = 0; i < 300; ++i) {
    if (i % 20 == 0) q = posture();
    Stops stops;
    stops.q0 = q;
    stops.v0 = stops.v1 = VectorXd::NullaryExpr(arm_.dof(), [&] { return in(-1.0, 1.0); });
    stops.q1 = q = q + 0.02 * stops.v0;
    stops.a = arm_.a_max;
    stops.delay_s = 0.01;
    stops.alone_s = 0.02;
    stops.before0 = stops.q0 - 0.02 * stops.v0;
    stops.before1 = stops.q1 - 0.02 * stops.v0;
    if (!parts.certify_stops(stops)) continue;
    ++certified;
    for (int k = 0; k < 24; ++k) {
      const double u = in(0.0, 1.0), share = in(0.0, 1.0);
      const bool alone = k % 2 == 0;
      VectorXd at = stops.q0 + in(0.0, 1.0) * (stops.q1 - stops.q0);
      if (!alone) at += in(0.0, 0.01) * stops.v0;
      for (Eigen::Index j = 0; j < at.size(); ++j) {
        const double v = stops.v0[j], a = stops.a[j], t = std::min(u, std::abs(v) / a);
        at[j] += share * std::copysign(std::abs(v) * t - 0.5 * a * t * t, v);
        if (alone && j == k / 2 % arm_.dof()) at[j] += in(-0.02, 0.02) * v;
      }
      EXPECT_GE(clearance(at), kPartMargin - 1e-6);
    }
  }
  EXPECT_GT(certified, 60);
}

/// A tip that meets the base where the arm is folded, within 3 degrees.
TEST(PartChecker, CellsOfJointsHideNothing) {
  kin::ArmModel arm;
  arm.links = {{.a = 0.5}, {.a = 0.5}};
  arm.q_max = Eigen::Vector2d(3.3, 3.3);
  arm.q_min = -arm.q_max;
  arm.groups = {"base", "tip"};
  arm.self_pairs = {{0, 1}};
  for (const int frame : {0, 2}) {
    kin::SafetyPart part;
    part.frame = frame;
    part.group = frame / 2;
    part.shape.points.resize(2, 3);
    part.shape.points.setZero();
    part.shape.points(0, 2) = -0.01;
    part.shape.points(1, 2) = 0.01;
    part.shape.radius = 0.01;
    part.cover = {{Vector3d::Zero(), 0.021}};
    arm.parts.push_back(std::move(part));
  }
  PartChecker checker(arm, {}, kPartMargin);
  const Eigen::Vector2d folded(0.2, M_PI), open(0.2, 1.5), near(0.2, M_PI - 0.2);
  const auto judged = [&](const Eigen::Vector2d& q, double deviation) {
    return checker.judge(q, Eigen::Vector2d::Constant(deviation), {}, nullptr, true);
  };
  using Verdict = PartChecker::Verdict;
  for (int again = 0; again < 40; ++again) {  // more and more cells are known
    EXPECT_NE(judged({0.0, 0.0}, 3.3), Verdict::free);
    EXPECT_EQ(judged(folded, 0.0), Verdict::touches);
    EXPECT_NE(judged(near, 0.3), Verdict::free) << "folded is in it";
    EXPECT_NE(judged(near, 0.2), Verdict::free) << "folded is its corner";
    EXPECT_EQ(judged(near, 0.1), Verdict::free);
    EXPECT_EQ(judged(open, 0.1), Verdict::free);
    EXPECT_NE(judged({0.2, 3.9}, 0.8), Verdict::free) << "it reaches beyond all cells";
  }
  const Eigen::Vector2d left(0.2, -2.0), beyond(0.2, 3.27);
  EXPECT_EQ(checker.torn(open, left, {}), "");
  EXPECT_EQ(checker.torn(open, beyond, {}), "tip touches base wherever joint 2 passes");
  EXPECT_EQ(checker.torn(beyond, left, {}), "tip touches base wherever joint 2 passes");
}

TEST_F(Parts, NamesThePartAndWhatItTouches) {
  around_ = {};
  around_.boxes = {{kin::end_effector(arm_, arm_.home).translation(), {0.05, 0.05, 0.05}, "shelf"}};
  const std::string said =
      CollisionChecker(arm_, around_, kPartMargin).contact(arm_.home).value_or("");
  EXPECT_TRUE(said.starts_with("part ")) << said;
  EXPECT_TRUE(said.ends_with("touches the shelf")) << said;
}

}  // namespace
}  // namespace mimesis::planner
