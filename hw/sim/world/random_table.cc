#include "hw/sim/world/random_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "common/error.h"
#include "common/kin/ik.h"
#include "hw/sim/world/collisions.h"

namespace mimesis::world {
namespace {

using Eigen::Vector3d;

/// Whether the arm's safety balls keep this far from bar and boxes.
bool clear(const kin::ArmModel& arm, const kin::Table& table, const Eigen::VectorXd& q,
           double spare_m) {
  std::vector<Eigen::Isometry3d> X;
  kin::forward(arm, q, X);
  Eigen::Matrix3Xd centers;
  kin::ball_centers(arm, X, centers);
  for (std::size_t i = 0; i < arm.balls.size(); ++i) {
    if (std::ranges::find(arm.env_groups, arm.balls[i].group) == arm.env_groups.end()) continue;
    const Vector3d at = centers.col(static_cast<Eigen::Index>(i));
    const double away = arm.balls[i].radius + spare_m;
    const bool touches =
        std::ranges::any_of(
            table.balls,
            [&](const kin::Ball& b) { return (b.center - at).norm() < b.radius + away; }) ||
        std::ranges::any_of(table.boxes,
                            [&](const kin::Box& b) { return signed_distance(b, at) < away; });
    if (touches) return false;
  }
  return true;
}

/// One draw.
template <class Draw>
kin::Table scattered(kin::Table table, const Draw& draw) {
  const auto move = [&table](const std::string& name, const Vector3d& by) {
    for (kin::Box& box : table.boxes) {
      if (box.name != name) continue;
      box.center.head<2>() += by.head<2>();
      box.center.z() += 0.5 * by.z();  // its foot stays where it is
      box.half_extent.z() += 0.5 * by.z();
    }
  };
  const double x = draw(), y = draw();
  table.object += Vector3d(x, y, 0.0);
  move("plinth", {x, y, 0.0});
  for (kin::GoalPlace& goal : table.goals) {
    const double gx = draw(), gy = draw(), gz = draw();
    goal.position += Vector3d(gx, gy, gz);
    move(goal.name + " stand", {gx, gy, gz});
  }
  return table;
}

}  // namespace

std::string out_of_reach(const kin::ArmModel& arm, const kin::Table& table) {
  constexpr double kBelowTop = 0.02, kHigh = 0.09, kStep = 0.01, kSpare = 0.005;  // [m]
  constexpr int kStarts = 20;
  const auto reached = [&](const Vector3d& center) {
    for (int i = 0; i * kStep < kHigh + 0.5 * kStep; ++i) {
      const double up = 0.5 * table.object_height - kBelowTop + i * kStep;
      const kin::IkGoal hand{center + up * Vector3d::UnitZ(),
                             {{Vector3d::UnitZ(), -Vector3d::UnitZ()}}};
      const auto postures = kin::solve_ik_anywhere(arm, hand, kStarts, 1);
      const bool free = std::ranges::any_of(
          postures, [&](const Eigen::VectorXd& q) { return clear(arm, table, q, kSpare); });
      if (!free) return false;
    }
    return true;
  };
  if (!reached(table.object)) return "the object";
  for (const kin::GoalPlace& goal : table.goals) {
    if (goal.name == "high" && !reached(goal.position)) return "the high goal";
  }
  return "";
}

kin::Table random_table(const kin::ArmModel& arm, const kin::Table& usual, std::uint64_t seed) {
  constexpr double kAside = 0.015;  // [m]
  constexpr int kDraws = 100;
  std::mt19937_64 random(seed);
  const auto draw = [&random] {
    return kAside * (2.0 * static_cast<double>(random() >> 11) * 0x1.0p-53 - 1.0);
  };
  std::string missed;
  for (int i = 0; i < kDraws; ++i) {
    kin::Table table = scattered(usual, draw);
    missed = out_of_reach(arm, table);
    if (missed.empty()) return table;
  }
  throw ConfigError(fmt::format("scene: random: in {} draws around the table {} was out of reach",
                                kDraws, missed));
}

}  // namespace mimesis::world
