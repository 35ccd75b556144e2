#include "nodes/planner/collision.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/model/files.h"
#include "common/testing/no_malloc.h"
#include "nodes/planner/roadmap.h"
#include "nodes/planner/test/arms.h"

namespace mimesis::planner {
namespace {

constexpr double kMargin = 0.002;

/// Least clearance of a posture, written out as one would on paper.
double clearance(const kin::ArmModel& arm, const Obstacles& obstacles, const Eigen::VectorXd& q) {
  std::vector<Eigen::Isometry3d> X;
  kin::forward(arm, q, X);
  const auto center = [&](const kin::SafetyBall& b) -> Eigen::Vector3d {
    return X[static_cast<std::size_t>(b.frame)] * b.center;
  };
  double least = 1e9;
  const auto against_obstacles = [&](const Eigen::Vector3d& p, double r) {
    for (const auto& o : obstacles.balls)
      least = std::min(least, (p - o.center).norm() - r - o.radius);
    for (const auto& o : obstacles.boxes) {
      const Eigen::Vector3d outside = ((p - o.center).cwiseAbs() - o.half_extent).cwiseMax(0.0);
      least = std::min(least, outside.norm() - r);
    }
  };
  for (const auto& ball : arm.balls) {
    if (arm.groups[static_cast<std::size_t>(ball.group)] != "base")
      against_obstacles(center(ball), ball.radius);
  }
  for (const auto& held : obstacles.held) {
    against_obstacles(X.back() * (arm.X_LE * held.center), held.radius);
  }
  std::vector<kin::SafetyBall> own = arm.balls;
  for (const auto& held : obstacles.held)
    own.push_back({arm.dof(), own.back().group, arm.X_LE * held.center, held.radius});
  for (const auto& [a, b] : arm.self_pairs) {
    for (const auto& i : own) {
      for (const auto& j : own) {
        if (i.group != a || j.group != b) continue;
        least = std::min(least, (center(i) - center(j)).norm() - i.radius - j.radius);
      }
    }
  }
  return least;
}

/// Certificates given, refused, and refused although all they cover keeps more than the margin.
struct Judged {
  int certified = 0, refused = 0, for_nothing = 0;
  /// @param least  distance that sampling finds @param spare  beyond the margin: must be certified
  void add(Eigen::Index i, bool given, double least, double spare) {
    EXPECT_TRUE(!given || least >= kMargin) << i << ": " << least;
    ++(given ? certified : refused);
    for_nothing += !given && least > kMargin + spare;
  }
};

Obstacles bar() {
  const auto table = model::load_table("bar_table.yaml");
  return {table.balls, table.boxes, {}, {}};
}

/// The arm of a file; "sliding": one whose third and fifth joints slide, by up to 0.4 m.
kin::ArmModel arm_named(const std::string& name) {
  const bool slides = name.starts_with("sliding ");
  auto arm = model::load_arm(slides ? name.substr(8) : name);
  for (const std::size_t j : {2u, 4u}) {
    if (!slides) break;
    arm.links[j].slides = true;
    arm.q_min[static_cast<Eigen::Index>(j)] = -0.1;
    arm.q_max[static_cast<Eigen::Index>(j)] = 0.3;
  }
  return arm;
}

TEST(CollisionChecker, AgreesWithAllPairsOnRandomPostures) {
  for (const std::string name :
       {"lwr4.yaml", "rx90.yaml", "sliding lwr4.yaml", "sliding rx90.yaml"}) {
    SCOPED_TRACE(name);
    auto arm = arm_named(name);
    arm.X_WB = Eigen::Translation3d(0.01, 0.02, 0.0) *
               Eigen::AngleAxisd(0.1, Eigen::Vector3d(0.6, 0.8, 0.0));
    Obstacles obstacles = bar();
    obstacles.held = {{{0.0, 0.03, 0.0}, 0.04}};
    CollisionChecker checker(arm, obstacles, kMargin);
    const Eigen::MatrixXd postures = sample_box(arm.q_min, arm.q_max, 4003, 5);
    const std::vector<char> many = checker.free_columns(postures);
    int touching = 0;
    for (Eigen::Index i = 0; i < postures.cols(); ++i) {
      const double least = clearance(arm, obstacles, postures.col(i));
      const bool free = checker.free(postures.col(i));
      ASSERT_EQ(many[static_cast<std::size_t>(i)] != 0, free) << i;
      ASSERT_EQ(checker.contact(postures.col(i)).has_value(), !free) << i;
      ASSERT_TRUE(std::abs(least - kMargin) < 2e-5 || (least > kMargin) == free) << i;
      ASSERT_TRUE(!free || least >= kMargin) << i;
      touching += !free;
    }
    EXPECT_GT(touching, 400);
    EXPECT_LT(touching, 3600);
  }
}

TEST(CollisionChecker, HeldBallsCountAgainstObstaclesButNotAgainstTheirSupports) {
  const auto arm = planar_arm();
  const Eigen::Vector2d stretched(0.0, 0.0);  // hand at (1.8, 0, 0)
  const kin::Box shelf{{1.9, 0.2, 0.0}, {0.05, 0.05, 0.05}, "shelf"};
  Obstacles obstacles;
  obstacles.boxes = {shelf};
  EXPECT_TRUE(CollisionChecker(arm, obstacles, kMargin).free(stretched));
  obstacles.held = {{{0.1, 0.1, 0.0}, 0.06}};  // reaches up to y = 0.16
  CollisionChecker carrying(arm, obstacles, kMargin);
  EXPECT_FALSE(carrying.free(stretched));
  EXPECT_EQ(carrying.contact(stretched), "the held object touches the shelf");
  obstacles.boxes.clear();
  obstacles.supports = {shelf};
  EXPECT_TRUE(CollisionChecker(arm, obstacles, kMargin).free(stretched));
}

TEST(CollisionChecker, NamesBallAndObstacle) {
  const auto arm = planar_arm();
  CollisionChecker checker(arm, {{{{1.8, 0.0, 0.0}, 0.05}}, {}, {}, {}}, kMargin);
  EXPECT_EQ(checker.contact(Eigen::Vector2d(0.0, 0.0)),
            "ball 17 (fore) touches the obstacle ball at (1800, 0, 0) mm");
}

/// Dense sampling can only refute a certificate: none of the certified motions may touch anything.
TEST(Certificate, NeverContradictedByDenseSampling) {
  for (const std::string name : {"lwr4.yaml", "sliding lwr4.yaml"}) {
    SCOPED_TRACE(name);
    const auto arm = arm_named(name);
    const Obstacles obstacles = bar();
    CollisionChecker checker(arm, obstacles, kMargin);
    const Eigen::MatrixXd postures = sample_box(arm.q_min, arm.q_max, 600, 6);
    Judged lines;
    for (Eigen::Index i = 0; i + 1 < postures.cols(); i += 2) {
      const double share = i % 4 == 0 ? 1.0 : 0.3;  // long lines bend
      const Eigen::VectorXd a = postures.col(i), b = a + share * (postures.col(i + 1) - a);
      double least = 1e9;
      for (int k = 0; k <= 200; ++k)
        least = std::min(least, clearance(arm, obstacles, a + k / 200.0 * (b - a)));
      lines.add(i, checker.certify(a, b), least, 1e-3);
    }
    EXPECT_GT(lines.certified, 50);
    EXPECT_GT(lines.refused, 50);
    EXPECT_EQ(lines.for_nothing, 0) << "what keeps 1 mm more than the margin is always certified";
  }
}

/// A whole line judged as one part: what a ball meets somewhere on it must not be overlooked.
TEST(BatchChecker, OverlooksNothingOnLongLines) {
  for (const std::string name :
       {"lwr4.yaml", "rx90.yaml", "sliding lwr4.yaml", "sliding rx90.yaml"}) {
    SCOPED_TRACE(name);
    auto arm = arm_named(name);
    arm.X_WB = Eigen::Translation3d(0.1, -0.2, 0.3) *
               Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.6, 0.8, 0.0));
    arm.self_pairs = {{0, 1}};
    arm.env_groups = {0, 1, 2, 3};
    constexpr int kLines = 1000;
    const Eigen::MatrixXd postures = sample_box(arm.q_min, arm.q_max, kLines, 21),
                          draws = halton(arm.dof() + 3, kLines, 22);
    for (Eigen::Index i = 0; i < kLines; ++i) {
      const Eigen::VectorXd q = postures.col(i), draw = draws.col(i);
      Eigen::VectorXd d(arm.dof());
      for (Eigen::Index j = 0; j < d.size(); ++j) {
        d[j] = 1.6 * (draw[j] - 0.5);
        if (arm.links[static_cast<std::size_t>(j)].slides)
          d[j] *= 0.5 * std::min(arm.q_max[j] - q[j], q[j] - arm.q_min[j]);
      }
      std::vector<Eigen::Isometry3d> X;
      kin::forward(arm, q + (i % 2 == 0 ? 1.0 : 2.0 * draw[arm.dof()] - 1.0) * d, X);
      const auto frame = [&](Eigen::Index k) {
        return static_cast<int>(draw[arm.dof() + k] * (arm.dof() + 1));
      };
      const int a = std::min(frame(1), frame(2)), b = std::max(frame(1), frame(2));
      const Eigen::Vector3d in_a(0.1, -0.2, 0.05), in_b(-0.1, 0.1, 0.2),
          p_a = X[static_cast<std::size_t>(a)] * in_a, p_b = X[static_cast<std::size_t>(b)] * in_b;
      BatchChecker::Postures line{};
      for (std::size_t j = 0; j < arm.links.size(); ++j) {
        line.q[j] = static_cast<float>(q[static_cast<Eigen::Index>(j)]) - Lanes{};
        line.deviation[j] = static_cast<float>(d[static_cast<Eigen::Index>(j)]) - Lanes{};
      }
      arm.balls = {{b, 0, in_b, 0.01}};
      BatchChecker in_the_way(arm, {{{p_b, 0.01}}, {}, {}, {}}, 0.0);
      const auto met = in_the_way.judge_lines(line);
      ASSERT_NE(met.touches | met.near, 0u) << i;
      arm.balls = {{a, 0, in_a, 0.5 * (p_a - p_b).norm()}, {b, 1, in_b, 0.5 * (p_a - p_b).norm()}};
      BatchChecker folding(arm, {}, 1e-3);
      const auto folded = folding.judge_lines(line);
      ASSERT_NE(folded.touches | folded.near, 0u) << i;
    }
  }
}

/// An obstacle pushed 1.5 mm into the path of a ball must be found, wherever on the path it is.
TEST(Certificate, RejectsAPath1500MicrometresInAnObstacle) {
  const auto arm = planar_arm();
  const Eigen::Vector2d a(-0.9, 0.4), b(0.8, -0.5);
  for (int k = 0; k <= 40; ++k) {
    const double u = k / 40.0;
    std::vector<Eigen::Isometry3d> X;
    kin::forward(arm, a + u * (b - a), X);
    const Eigen::Vector3d tip = X[2].translation(), outwards = tip.normalized();
    const auto ball_at = [&](double gap) {
      return Obstacles{{{tip + (0.06 + 0.004 + gap) * outwards, 0.004}}, {}, {}, {}};
    };
    // The tip is farthest out at u only roughly: the path may come nearer elsewhere, never farther.
    EXPECT_FALSE(CollisionChecker(arm, ball_at(-0.0015), 0.0).certify(a, b)) << u;
    EXPECT_TRUE(CollisionChecker(arm, ball_at(0.1), 0.0).certify(a, b)) << u;
  }
}

TEST(Certificate, BoundsPairsOfOwnBallsByTheirRelativeMotion) {
  auto arm = planar_arm();
  arm.self_pairs = {{0, 1}};
  arm.balls = {{1, 0, {-0.5, 0.0, 0.0}, 0.06}, {2, 1, {0.0, 0.0, 0.0}, 0.06}};
  CollisionChecker checker(arm, {}, kMargin);
  // Turning the shoulder moves both balls far, but not against each other.
  const Eigen::Vector2d a(-2.0, 2.2), b(2.0, 2.2);
  EXPECT_TRUE(checker.certify(a, b));
  EXPECT_LE(checker.postures_checked(), kLanes) << "one batch";
  // Folding the elbow: they are 0.5² + 0.8² − 2·0.5·0.8·cos(π − q₂) apart.
  EXPECT_TRUE(checker.certify(Eigen::Vector2d(0, 0), Eigen::Vector2d(0, 2.7)));
  arm.balls[0].radius = 0.5;  // 0.5 + 0.06 > 0.43 at q₂ = 2.7
  EXPECT_FALSE(
      CollisionChecker(arm, {}, kMargin).certify(Eigen::Vector2d(0, 0), Eigen::Vector2d(0, 2.7)));
}

TEST(Certificate, OfABezierCurveIsThatOfItsShapeNotOfItsEnds) {
  const auto arm = planar_arm();
  Eigen::MatrixXd bulge(2, 3);
  bulge << 0.0, 0.5, 1.0, 0.0, 2.6, 0.0;
  Eigen::MatrixXd straight(2, 2);
  straight << 0.0, 1.0, 0.0, 0.0;
  std::vector<Eigen::Isometry3d> X;
  kin::forward(arm, Eigen::Vector2d(0.5, 0.0), X);  // the middle of the straight line
  const Obstacles obstacle{{{X[2].translation(), 0.02}}, {}, {}, {}};
  CollisionChecker checker(arm, obstacle, kMargin);
  EXPECT_FALSE(checker.certify_curve(straight));
  EXPECT_FALSE(checker.certify(straight.col(0), straight.col(1)));
  EXPECT_TRUE(checker.certify_curve(bulge));
}

/// The posture of joint-wise stops from q at v, t after their begin, with decelerations a.
Eigen::VectorXd stopping(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                         const Eigen::VectorXd& a, double t) {
  Eigen::VectorXd at = q;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double u = std::min(t, std::abs(v[j]) / a[j]);
    at[j] += v[j] * u - std::copysign(0.5 * a[j] * u * u, v[j]);
  }
  return at;
}

/// Stops that begin anywhere on the line, slower and harder ones too.
TEST(Certificate, OfStopsIsNeverContradictedByDenseSampling) {
  const auto arm = model::load_arm("lwr4.yaml");
  const Obstacles obstacles = bar();
  CollisionChecker checker(arm, obstacles, kMargin);
  const Eigen::MatrixXd postures = sample_box(arm.q_min, arm.q_max, 120, 11),
                        shares = sample_box(-arm.v_max, arm.v_max, 120, 12);
  Judged stops;
  for (Eigen::Index i = 0; i < postures.cols(); ++i) {
    const Eigen::VectorXd v = 0.6 * shares.col(i), q0 = postures.col(i), q1 = q0 + 0.01 * v;
    double least = 1e9;
    for (const double pace : {0.2, 0.6, 1.0}) {
      for (const double harder : {1.0, 4.0}) {
        for (const double w : {0.0, 0.5, 1.0}) {
          for (const double delay : {0.0, 0.012, 0.025}) {
            for (double t = 0.0; t < 0.3; t += 0.03) {
              const auto q =
                  stopping(q0 + w * (q1 - q0) + delay * pace * v, pace * v, harder * arm.a_max, t);
              least = std::min(least, clearance(arm, obstacles, q));
            }
          }
        }
      }
    }
    stops.add(i, checker.certify_stops({q0, v, q1, v, arm.a_max, 0.025, 0.0, 0.0, {}, {}}), least,
              2e-3);
  }
  EXPECT_GT(stops.certified, 40);
  EXPECT_GT(stops.refused, 10);
  EXPECT_LE(stops.for_nothing, 1);
}

/// Wherever a stop leads, or one of which a joint fails alone: an obstacle that is only just met
/// there, ahead of the outermost ball, is not overlooked.
TEST(Certificate, OfStopsRefusesWhatIsJustMetAtAnyOfThem) {
  const auto arm = model::load_arm("lwr4.yaml");
  constexpr double kJust = 3e-4, kAlone = 0.02;
  const kin::SafetyBall& outermost = arm.balls.back();
  const auto place = [&](const Eigen::VectorXd& q) {
    std::vector<Eigen::Isometry3d> X;
    kin::forward(arm, q, X);
    return Eigen::Vector3d(X[static_cast<std::size_t>(outermost.frame)] * outermost.center);
  };
  const Eigen::MatrixXd postures = sample_box(arm.q_min, arm.q_max, 200, 15),
                        shares = sample_box(-arm.v_max, arm.v_max, 200, 16),
                        draws =
                            sample_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), 200, 17);
  for (Eigen::Index i = 0; i < postures.cols(); ++i) {
    const Eigen::VectorXd v = 0.6 * shares.col(i), q0 = postures.col(i), q1 = q0 + 0.01 * v;
    const double softest = i % 2 == 0 ? 1.0 : draws(0, i);  // of its way, or that of a harder one
    const double t = i % 4 < 2 ? 1.0 : 0.3 * draws(1, i);   // at rest, or on the way there
    Eigen::VectorXd there = stopping(q1, v, arm.a_max / softest, t);
    const Eigen::Index alone = i % 7;
    if (i % 3 == 0) there[alone] = stopping(q1 + kAlone * v, v, arm.a_max / softest, t)[alone];
    const Eigen::Vector3d from = place(q0), to = place(there), ahead = (to - from).normalized();
    if ((to - from).norm() < 0.02) continue;
    constexpr double kSmall = 1e-3;
    const double reach = outermost.radius + kSmall + kMargin - kJust;
    const Obstacles obstacle{{{to + reach * ahead, kSmall}}, {}, {}, {}};
    CollisionChecker checker(arm, obstacle, kMargin);
    Stops stops{q0, v, q1, v, arm.a_max, 0.0, 0.0, 0.0, {}, {}};
    if (i % 3 == 0) {
      stops.alone_s = kAlone;
      stops.before0 = q0 - kAlone * v;
      stops.before1 = q1 - kAlone * v;
    }
    EXPECT_FALSE(checker.certify_stops(stops)) << i;
  }
}

/// One joint stands or brakes sooner than the others, or later.
TEST(Certificate, OfStopsOfOneDriveAloneIsNeverContradictedByDenseSampling) {
  const auto arm = model::load_arm("lwr4.yaml");
  const Obstacles obstacles = bar();
  CollisionChecker checker(arm, obstacles, kMargin);
  const Eigen::MatrixXd postures = sample_box(arm.q_min, arm.q_max, 120, 13),
                        shares = sample_box(-arm.v_max, arm.v_max, 120, 14);
  constexpr double kAlone = 0.02;
  Judged alone;
  int only_together = 0;
  for (Eigen::Index i = 0; i < postures.cols(); ++i) {
    const Eigen::VectorXd v = 0.6 * shares.col(i), q0 = postures.col(i), q1 = q0 + 0.01 * v;
    double least = 1e9;
    for (const double w : {0.0, 0.5, 1.0}) {
      const Eigen::VectorXd q = q0 + w * (q1 - q0);
      for (double t = 0.0; t < 0.3; t += 0.03) {
        const Eigen::VectorXd others = stopping(q, v, arm.a_max, t);
        for (Eigen::Index j = 0; j < v.size(); ++j) {
          Eigen::VectorXd one = others;
          for (const double sooner : {-kAlone, -0.5 * kAlone, 0.0, kAlone}) {
            const Eigen::VectorXd there = q - sooner * v;
            one[j] = there[j];  // it stands
            least = std::min(least, clearance(arm, obstacles, one));
            one[j] = stopping(there, v, arm.a_max, t)[j];
            least = std::min(least, clearance(arm, obstacles, one));
          }
        }
      }
    }
    Stops stops{q0, v, q1, v, arm.a_max, 0.0, 0.0, 0.0, {}, {}};
    const bool together = checker.certify_stops(stops);
    stops.alone_s = kAlone;
    stops.before0 = q0 - kAlone * v;
    stops.before1 = q1 - kAlone * v;
    const bool certified = checker.certify_stops(stops);
    alone.add(i, certified, least, 5e-3);
    ASSERT_TRUE(together || !certified);
    only_together += together && !certified;
  }
  EXPECT_GT(alone.certified, 40);
  EXPECT_GT(only_together, 0);
  EXPECT_LE(alone.for_nothing, 1);
}

TEST(CollisionChecker, DoesNotAllocate) {
  const auto arm = model::load_arm("lwr4.yaml");
  CollisionChecker checker(arm, bar(), kMargin);
  const Eigen::VectorXd a = arm.home, b = arm.home.array() + 0.1;
  const bool warm = checker.certify(a, b);
  testing::NoMalloc guard;
  EXPECT_EQ(checker.certify(a, b), warm);
  EXPECT_TRUE(checker.free(a));
}

}  // namespace
}  // namespace mimesis::planner
