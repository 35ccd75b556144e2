#include "nodes/planner/task_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "nodes/planner/test/demo.h"

namespace mimesis::planner {
namespace {

const Task kAboveHigh{Grip::precision, Transport::above, "high"};
const Task kBelowLow{Grip::full, Transport::below, "low"};

/// Heights of the hand above the bar where it passes its plane.
std::vector<double> crossings(const TaskPlan& plan) {
  const Eigen::Vector3d bar = demo().table.bar_center;
  std::vector<double> heights;
  for (const auto& motion : plan.motions) {
    if (motion.phase != Phase::transport) continue;
    for (Eigen::Index k = 1; k < motion.trajectory.samples(); ++k) {
      const Eigen::Vector3d a =
          kin::end_effector(demo().arm, motion.trajectory.position.col(k - 1)).translation();
      const Eigen::Vector3d b =
          kin::end_effector(demo().arm, motion.trajectory.position.col(k)).translation();
      if ((a.x() < bar.x()) != (b.x() < bar.x())) {
        heights.push_back(b.z() - bar.z());
        EXPECT_LT(std::abs(b.y() - bar.y()), demo().table.bar_half_width) << "between the posts";
      }
    }
  }
  return heights;
}

/// Gap between a ball and the table with what stands on it, without the planner's checker.
double gap_m(const Eigen::Vector3d& center, double radius) {
  double least = 1.0;
  for (const kin::Ball& ball : demo().table.balls) {
    least = std::min(least, (center - ball.center).norm() - ball.radius - radius);
  }
  for (const kin::Box& box : demo().table.boxes) {
    const Eigen::Vector3d off = (center - box.center).cwiseAbs() - box.half_extent;
    least = std::min(least,
                     (off.maxCoeff() < 0.0 ? off.maxCoeff() : off.cwiseMax(0.0).norm()) - radius);
  }
  return least;
}

/// Neither the arm touches the table or itself at posture q, nor what it holds: the rims of a
/// cylinder whose frame in E is `held`.
void expect_free(const Eigen::VectorXd& q, const std::optional<Eigen::Isometry3d>& held) {
  const kin::ArmModel& arm = demo().arm;
  std::vector<Eigen::Isometry3d> frames;
  Eigen::Matrix3Xd at;
  kin::forward(arm, q, frames);
  kin::ball_centers(arm, frames, at);
  for (std::size_t i = 0; i < arm.balls.size(); ++i) {
    const kin::SafetyBall& a = arm.balls[i];
    const Eigen::Vector3d p = at.col(static_cast<Eigen::Index>(i));
    if (std::ranges::count(arm.env_groups, a.group) > 0) {
      EXPECT_GT(gap_m(p, a.radius), 0.0) << "ball " << i;
    }
    for (std::size_t j = 0; j < arm.balls.size(); ++j) {
      const kin::SafetyBall& b = arm.balls[j];
      if (std::ranges::count(arm.self_pairs, std::pair(a.group, b.group)) == 0) continue;
      EXPECT_GT((p - at.col(static_cast<Eigen::Index>(j))).norm(), a.radius + b.radius)
          << "balls " << i << " and " << j;
    }
  }
  if (!held) return;
  const Eigen::Isometry3d X_WO = kin::end_effector(arm, q) * *held;
  for (int k = 0; k < 32; ++k) {
    const double around = 2.0 * std::numbers::pi * k / 16, r = demo().table.object_radius;
    const double up = (k < 16 ? 0.5 : -0.5) * demo().table.object_height;
    // 1 mm: it is lifted from one place and put on another
    EXPECT_GT(gap_m(X_WO * Eigen::Vector3d(r * std::cos(around), r * std::sin(around), up), 0.0),
              -1e-3)
        << "the object";
  }
}

void expect_whole(const TaskPlan& plan, const Eigen::Vector3d& goal) {
  const Demo& d = demo();
  Eigen::VectorXd at = d.arm.home;
  std::vector<Phase> phases;
  const Eigen::VectorXd grasp = plan.motions[1].trajectory.position.rightCols(1);
  const Eigen::Isometry3d upright(Eigen::Translation3d(d.table.object));
  const Eigen::Isometry3d X_EO = kin::end_effector(d.arm, grasp).inverse() * upright;
  for (const auto& motion : plan.motions) {
    const auto& q = motion.trajectory.position;
    EXPECT_LT((q.col(0) - at).norm(), 1e-9) << "each motion begins where the one before ends";
    at = q.rightCols(1);
    if (phases.empty() || phases.back() != motion.phase) phases.push_back(motion.phase);
    const bool holds = motion.phase == Phase::transport;
    for (Eigen::Index k = 0; k < q.cols(); ++k) {
      expect_free(q.col(k), holds ? std::optional(X_EO) : std::nullopt);
    }
    EXPECT_TRUE((q.colwise() - d.arm.q_min).minCoeff() >= 0.0 &&
                (q.colwise() - d.arm.q_max).maxCoeff() <= 0.0);
  }
  EXPECT_EQ(phases, (std::vector{Phase::reach, Phase::approach, Phase::transport, Phase::retreat}));

  // The object's centre, fixed in the hand since the grasp, ends at the goal.
  const Eigen::VectorXd release =
      plan.motions[plan.motions.size() - 2].trajectory.position.rightCols(1);
  const Eigen::Isometry3d X_WO = kin::end_effector(d.arm, release) * X_EO;
  EXPECT_LT((X_WO.translation() - goal).norm(), 1e-3);
  EXPECT_GT(X_WO.linear()(2, 2), 0.999) << "it stands as it stood";
}

TEST(TaskPlan, PrecisionGripAboveTheBarToTheHighGoal) {
  const auto plan = demo().plan(kAboveHigh);
  ASSERT_TRUE(plan) << plan.error().reason;
  expect_whole(*plan, demo().table.goals[0].position);
  const auto heights = crossings(*plan);
  ASSERT_FALSE(heights.empty());
  for (const double height : heights) EXPECT_GT(height, 0.0);
  const Eigen::VectorXd grasp = plan->motions[1].trajectory.position.rightCols(1);
  EXPECT_LT(kin::end_effector(demo().arm, grasp).linear().col(2).z(), -0.999) << "from above";
}

TEST(TaskPlan, FullGripBelowTheBarToTheLowGoal) {
  const auto plan = demo().plan(kBelowLow);
  ASSERT_TRUE(plan) << plan.error().reason;
  expect_whole(*plan, demo().table.goals[1].position);
  const auto heights = crossings(*plan);
  ASSERT_FALSE(heights.empty());
  for (const double height : heights) EXPECT_LT(height, 0.0);
  const Eigen::VectorXd grasp = plan->motions[1].trajectory.position.rightCols(1);
  EXPECT_NEAR(kin::end_effector(demo().arm, grasp).linear().col(2).z(), 0.0, 1e-3)
      << "from the side";
}

TEST(TaskPlan, FullGripBelowReachesTheHighGoalToo) {
  const auto plan = demo().plan({Grip::full, Transport::below, "high"});
  ASSERT_TRUE(plan) << plan.error().reason;
  expect_whole(*plan, demo().table.goals[0].position);
  for (const double height : crossings(*plan)) EXPECT_LT(height, 0.0);
}

/// Wherever the drives are stopped, at every sample of the plans and at the pace at which the
/// bridge catches up, the arm comes to rest touching nothing: each joint with its own deceleration.
double apart(const std::vector<Eigen::VectorXd>& a, const std::vector<Eigen::VectorXd>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]).norm();
  return sum / static_cast<double>(a.size());
}

TEST(TaskPlan, GoesWhereF5PreSelects) {
  Task task = kAboveHigh;
  const auto usual = carried_postures(demo().plan(task).value(), 12);
  const Eigen::VectorXd &first = usual.front(), &last = usual.back();
  const Eigen::Vector3d bar = demo().table.bar_center;
  EXPECT_LT(kin::end_effector(demo().arm, first).translation().x(), bar.x());
  EXPECT_GT(kin::end_effector(demo().arm, last).translation().x(), bar.x());
  std::vector<Eigen::VectorXd> other;  // of another elbow
  for (std::uint64_t seed = 3; seed < 12 && other.empty(); ++seed) {
    TaskSettings settings = demo().settings;
    settings.roadmap.seed = seed;
    Eigen::VectorXd start = demo().arm.home;
    start[2] += seed % 2 == 0 ? 1.2 : -1.2;
    const auto plan = plan_task(demo().arm, demo().table, demo().roadmap, start, task, settings);
    if (plan && apart(carried_postures(*plan, 12), usual) > 1.0)
      other = carried_postures(*plan, 12);
  }
  ASSERT_FALSE(other.empty());
  task.preselected = other;
  const auto led = carried_postures(demo().plan(task).value(), 12);
  EXPECT_LT(apart(led, other), 0.5 * apart(led, usual));
}

TEST(TaskPlan, CanBeStoppedByTheDrivesEverywhere) {
  const Demo& d = demo();
  for (const Task& task : {kAboveHigh, kBelowLow, Task{Grip::full, Transport::below, "high"}}) {
    const auto plan = d.plan(task);
    ASSERT_TRUE(plan) << plan.error().reason;
    const Eigen::VectorXd grasp = plan->motions[1].trajectory.position.rightCols(1);
    const Eigen::Isometry3d X_EO = kin::end_effector(d.arm, grasp).inverse() *
                                   Eigen::Isometry3d(Eigen::Translation3d(d.table.object));
    double farthest_rad = 0.0;
    for (const auto& motion : plan->motions) {
      const auto held = motion.phase == Phase::transport ? std::optional(X_EO) : std::nullopt;
      for (Eigen::Index k = 0; k < motion.trajectory.samples(); ++k) {
        const Eigen::VectorXd q = motion.trajectory.position.col(k);
        for (const double pace : {1.0, 1.2}) {
          const Eigen::VectorXd v = pace * motion.trajectory.velocity.col(k);
          const Eigen::ArrayXd rest_s = v.array().abs() / d.arm.a_max.array();
          for (int part = 1; part <= 8; ++part) {
            const Eigen::ArrayXd t = rest_s.min(part / 8.0 * rest_s.maxCoeff());
            const Eigen::VectorXd stopping =
                q.array() + v.array() * t - 0.5 * v.array().sign() * d.arm.a_max.array() * t * t;
            farthest_rad = std::max(farthest_rad, (stopping - q).norm());
            expect_free(stopping, held);
            // One drive hung up to 20 ms ago, before the others were told.
            for (Eigen::Index j = 0; j < q.size() && k % 8 == 0 && part % 4 == 0; ++j) {
              Eigen::VectorXd one = stopping;
              one[j] = motion.trajectory.position(j, std::max<Eigen::Index>(0, k - 4));
              expect_free(one, held);
            }
          }
        }
      }
    }
    EXPECT_GT(farthest_rad, 0.1) << "it does move";
  }
}

TEST(TaskPlan, KeepsAWiderDistanceWhereThereIsRoom) {
  Demo d = demo();
  const auto wide = d.plan(kBelowLow);
  d.settings.wide_margin_m = 0.0;
  const auto narrow = d.plan(kBelowLow);
  ASSERT_TRUE(wide && narrow);
  const PlannedMotion& transport = wide->motions[3];
  ASSERT_EQ(transport.margin_m, 0.01);
  CollisionChecker checker(d.arm, transport.obstacles, 0.01);
  for (const auto& curve : transport.curves) EXPECT_TRUE(checker.certify_curve(curve));
  for (const auto& motion : narrow->motions) EXPECT_EQ(motion.margin_m, d.settings.margin_m);
}

TEST(TaskPlan, TellsWhatIsInTheWayOfOtherCombinations) {
  const auto above_low = demo().plan({Grip::precision, Transport::above, "low"});
  ASSERT_FALSE(above_low);
  EXPECT_NE(
      above_low.error().reason.find(" postures at the low goal are free, but the straight way "),
      std::string::npos)
      << above_low.error().reason;
  Demo far = demo();
  far.settings.approach_m = 3.0;  // from beyond the reach of the arm, a third of it, too
  const auto approach = far.plan(kAboveHigh);
  ASSERT_FALSE(approach);
  EXPECT_NE(
      approach.error().reason.find(" postures at the object are free, but the straight way to "
                                   "it (3000 mm) fails at "),
      std::string::npos)
      << approach.error().reason;
  const auto nowhere = demo().plan({Grip::full, Transport::below, "middle"});
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().reason, "the scene has no goal 'middle'");
}

TEST(TaskPlan, BlockedGoalNamesTheObstacle) {
  Demo d = demo();
  d.table.balls.push_back({d.table.goals[0].position, 0.06});
  const auto plan = d.plan(kAboveHigh);
  ASSERT_FALSE(plan);
  EXPECT_EQ(
      plan.error().reason,
      "the high goal is blocked: the object would touch the obstacle ball at (680, -120, 300) mm");

  d.table.balls.pop_back();
  d.table.boxes.push_back(
      {{0.68, -0.12, 0.40}, {0.05, 0.05, 0.05}, "ceiling"});  // too low by 10 mm
  EXPECT_EQ(d.plan(kAboveHigh).error().reason,
            "the high goal is blocked: the object would touch the ceiling");
}

TEST(TaskPlan, GoalOutOfReach) {
  Demo d = demo();
  d.table.goals[0].position.x() = 1.5;
  const auto plan = d.plan(kAboveHigh);
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().reason, "no posture reaches the high goal");
}

TEST(TaskPlan, WalledOffGoalIsNotConnected) {
  Demo d = demo();
  d.table.boxes.push_back({{0.53, 0.0, 1.0}, {0.01, 1.5, 1.5}, "wall"});
  const auto plan = d.plan(kBelowLow);
  ASSERT_FALSE(plan);
}

TEST(TaskPlan, PutsTheObjectDownUprightWhateverTheSeed) {
  Demo d = demo();
  for (std::uint64_t seed = 2; seed < 6; ++seed) {
    d.settings.roadmap.seed = d.settings.search.seed = seed;
    const auto plan = d.plan(kBelowLow);
    ASSERT_TRUE(plan) << seed << ": " << plan.error().reason;
    expect_whole(*plan, d.table.goals[1].position);
  }
}

TEST(TaskPlan, LeansTheHandWhereItCannotPointStraightDown) {
  const Demo& d = demo();
  kin::Table table = d.table;
  const Eigen::Vector3d by(-0.035, 0.035, 0.0);
  table.object += by;
  for (kin::Box& box : table.boxes) box.center += (box.name == "plinth" ? 1.0 : 0.0) * by;
  TaskSettings upright = d.settings;
  upright.lean_rad = 0.0;
  const auto refused = plan_task(d.arm, table, d.roadmap, d.arm.home, kAboveHigh, upright);
  ASSERT_FALSE(refused);
  const auto plan = plan_task(d.arm, table, d.roadmap, d.arm.home, kAboveHigh, d.settings);
  ASSERT_TRUE(plan) << plan.error().reason << "; upright: " << refused.error().reason;
  const auto up_in_E = [&](const Eigen::VectorXd& q) -> Eigen::Vector3d {
    return kin::end_effector(d.arm, q).linear().row(2);
  };
  const Eigen::Vector3d held = up_in_E(plan->motions[1].trajectory.position.rightCols<1>());
  EXPECT_GT(std::acos(-held.z()), 0.05);
  EXPECT_LT(std::acos(-held.z()), d.settings.lean_rad + 1e-3);
  const Eigen::Vector3d put = up_in_E(plan->motions.back().trajectory.position.leftCols<1>());
  EXPECT_GT(put.dot(held), std::cos(1e-3)) << "the object stands as it stood";
}

TEST(MovedObstacles, AreThoseThatMovedFartherThanTheTolerance) {
  kin::Table planned = demo().table, now = planned;
  EXPECT_TRUE(moved_obstacles(planned, now, 1e-3).balls.empty());
  now.balls[3].center.x() += 0.9e-3;
  now.boxes[1].center.y() += 0.9e-3;
  now.balls.erase(now.balls.begin());
  EXPECT_TRUE(moved_obstacles(planned, now, 1e-3).balls.empty());
  EXPECT_TRUE(moved_obstacles(planned, now, 1e-3).boxes.empty());
  now.balls[5].radius += 2e-3;
  now.boxes[0].half_extent.z() += 2e-3;
  EXPECT_EQ(moved_obstacles(planned, now, 1e-3).balls.size(), 1u);
  EXPECT_EQ(moved_obstacles(planned, now, 1e-3).boxes.size(), 1u);
}

TEST(KeepsClear, RefusesABallOnTheWayThatIsLeft) {
  const Demo& d = demo();
  const auto plan = d.plan(kBelowLow);
  ASSERT_TRUE(plan) << plan.error().reason;
  const auto hand_in_the_middle_of = [&](std::size_t i) -> Eigen::Vector3d {
    const auto& q = plan->motions[i].trajectory.position;
    return kin::end_effector(d.arm, q.col(q.cols() / 2)).translation();
  };
  const std::size_t transport = 3;
  const Obstacles on_the_reach{{{hand_in_the_middle_of(0), 0.01}}, {}, {}, {}};
  EXPECT_FALSE(keeps_clear(d.arm, d.table, *plan, 0, on_the_reach, 1e-3));
  const Obstacles on_the_way{{{hand_in_the_middle_of(transport), 0.01}}, {}, {}, {}};
  EXPECT_FALSE(keeps_clear(d.arm, d.table, *plan, transport, on_the_way, 1e-3));
  const Obstacles elsewhere{{{{-0.9, 0.0, 0.5}, 0.05}}, {}, {}, {}};
  EXPECT_TRUE(keeps_clear(d.arm, d.table, *plan, 0, elsewhere, 1e-3));
}

TEST(KeepsClear, LetsTheObjectStandOnWhatMovedButNotEnterIt) {
  const Demo& d = demo();
  const auto plan = d.plan(kAboveHigh);
  ASSERT_TRUE(plan) << plan.error().reason;
  const std::size_t lowering = 4;
  ASSERT_FALSE(plan->motions[lowering].obstacles.supports.empty());
  const kin::Box& stand = d.table.boxes[2];
  ASSERT_EQ(stand.name, "high stand");
  const auto with = [&](const Eigen::Vector3d& shift, double higher) {
    kin::Box box = stand;
    box.center += shift;
    box.half_extent.z() += 0.5 * higher;
    box.center.z() += 0.5 * higher;
    return keeps_clear(d.arm, d.table, *plan, lowering, {{}, {box}, {}, {}}, 1e-3);
  };
  EXPECT_TRUE(with({0.003, -0.002, 0.0}, 0.0)) << "the object still stands on it";
  EXPECT_TRUE(with({0.0, 0.0, -0.03}, 0.0)) << "lower: it is let go above";
  for (const double higher : {0.004, 0.01, 0.03})
    EXPECT_FALSE(with(Eigen::Vector3d::Zero(), higher)) << higher;
  // The lift of the object from its plinth: a thin shelf over it, and one beside the object.
  const auto shelf = [&](const Eigen::Vector3d& from_object) {
    const kin::Box box{d.table.object + from_object, {0.01, 0.01, 0.002}, "shelf"};
    return keeps_clear(d.arm, d.table, *plan, 2, {{}, {box}, {}, {}}, 1e-3);
  };
  EXPECT_FALSE(shelf({0.028, 0.0, -0.02}));
  EXPECT_TRUE(shelf({0.0, 0.06, -0.05}));
}

TEST(RefreshedRoadmap, IsTheSameAfterNoiseAndMovesOnlyWhatIsTouched) {
  const Demo& d = demo();
  const auto known = std::make_shared<const Roadmap>(d.roadmap);
  kin::Table noisy = d.table;
  for (kin::Ball& ball : noisy.balls) ball.center.array() += 1e-3;
  EXPECT_EQ(refreshed_roadmap(known, d.arm, noisy, d.settings), known);

  kin::Table moved = d.table;
  for (int i = 0; i < 8; ++i) moved.balls.push_back({{-0.4, -0.4 + 0.1 * i, 0.5}, 0.1});
  const auto fresh = refreshed_roadmap(known, d.arm, moved, d.settings);
  ASSERT_NE(fresh, known);
  CollisionChecker checker(d.arm, {moved.balls, moved.boxes, {}, {}}, d.settings.margin_m);
  for (const char free : checker.free_columns(fresh->nodes())) EXPECT_TRUE(free);
  EXPECT_GT(fresh->nodes().cols(), known->nodes().cols() * 97 / 100);
  Eigen::Index stayed = 0;
  for (Eigen::Index i = 0; i < known->nodes().cols(); ++i) {
    const bool was_free = checker.free(known->nodes().col(i));
    const bool there =
        (fresh->nodes().colwise() - known->nodes().col(i)).colwise().norm().minCoeff() == 0.0;
    EXPECT_EQ(there, was_free) << i;
    stayed += there;
  }
  EXPECT_GT(stayed, known->nodes().cols() / 2);
  const auto plan = plan_task(d.arm, moved, *fresh, d.arm.home, kBelowLow, d.settings);
  EXPECT_TRUE(plan) << plan.error().reason;
}

TEST(PreparedRoadmap, HasCertifiedLinksOfKnownWeightOnly) {
  const Demo& d = demo();
  CollisionChecker checker(d.arm, {d.table.balls, d.table.boxes, {}, {}}, d.settings.margin_m);
  long links = 0;
  for (std::size_t i = 0; i < d.roadmap.links().size(); ++i) {
    for (const Link& link : d.roadmap.links()[i]) {
      const auto& nodes = d.roadmap.nodes();
      const auto here = static_cast<Eigen::Index>(i);
      ++links;
      EXPECT_TRUE(checker.certify(nodes.col(std::min<Eigen::Index>(here, link.to)),
                                  nodes.col(std::max<Eigen::Index>(here, link.to))));
      EXPECT_FLOAT_EQ(link.weight,
                      static_cast<float>(std::exp(-(nodes.col(here) - nodes.col(link.to)).norm())));
    }
  }
  EXPECT_GT(links, 3 * d.roadmap.nodes().cols());
  const std::vector<int> cluster = clusters(d.roadmap.links());
  long largest = 0;
  for (const int one : cluster) largest = std::max(largest, std::ranges::count(cluster, one));
  EXPECT_GT(largest, d.roadmap.nodes().cols() * 95 / 100);
}

TEST(TaskPlan, SameSeedSameBits) {
  const Demo again;
  EXPECT_EQ(again.roadmap.nodes(), demo().roadmap.nodes());
  const auto a = demo().plan(kAboveHigh), b = again.plan(kAboveHigh);
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->motions.size(), b->motions.size());
  for (std::size_t i = 0; i < a->motions.size(); ++i) {
    EXPECT_EQ(a->motions[i].trajectory.position, b->motions[i].trajectory.position);
  }
}

TEST(ClosedPassages, LeaveTheDecidedOneOpen) {
  const auto& table = demo().table;
  const auto inside = [](const std::vector<kin::Box>& boxes, const Eigen::Vector3d& p) {
    for (const auto& box : boxes) {
      if (((p - box.center).cwiseAbs().array() <= box.half_extent.array()).all()) return true;
    }
    return false;
  };
  const Eigen::Vector3d over = table.bar_center + Eigen::Vector3d(0, 0, 0.2);
  const Eigen::Vector3d under = table.bar_center - Eigen::Vector3d(0, 0, 0.2);
  const Eigen::Vector3d beside = under + Eigen::Vector3d(0, 0.5, 0);
  const auto above = closed_passages(table, Transport::above),
             below = closed_passages(table, Transport::below);
  EXPECT_FALSE(inside(above, over));
  EXPECT_TRUE(inside(above, under) && inside(above, beside));
  EXPECT_FALSE(inside(below, under));
  EXPECT_TRUE(inside(below, over) && inside(below, beside));
}

TEST(CylinderBalls, CoverTheWholeCylinder) {
  const double r = 0.022, h = 0.12;
  const auto balls = cylinder_balls({0.4, 0.1, 0.2}, r, h);
  for (double z = -0.5; z <= 0.5; z += 0.01) {
    const Eigen::Vector3d rim(0.4 + r, 0.1, 0.2 + z * h);
    double least = 1.0;
    for (const auto& ball : balls)
      least = std::min(least, (rim - ball.center).norm() - ball.radius);
    EXPECT_LE(least, 1e-12) << z;
  }
}

}  // namespace
}  // namespace mimesis::planner
