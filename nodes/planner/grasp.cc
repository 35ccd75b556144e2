#include "nodes/planner/grasp.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "nodes/planner/collision.h"

namespace mimesis::planner {
namespace {

/// A step to the next posture that is longer than this is a jump to another branch of solutions
/// [rad].
constexpr double kJump = 0.35;
constexpr double kGateHalfThickness = 0.01;  // [m]
constexpr double kStanding = 0.002;          // overlap of an object and its support [m]
constexpr double kFar = 2.0;                 // beyond the reach of the arm [m]

}  // namespace

std::optional<std::vector<Eigen::VectorXd>> straight_way(const kin::ArmModel& arm,
                                                         const Eigen::VectorXd& start,
                                                         const kin::IkGoal& goal, double step_m,
                                                         const Interrupt& interrupt) {
  const Eigen::Vector3d from = kin::end_effector(arm, start).translation();
  const Eigen::Vector3d whole = goal.position_in_W - from;
  const int steps = std::max(1, static_cast<int>(std::ceil(whole.norm() / step_m)));
  std::vector<Eigen::VectorXd> way{start};
  for (int i = 1; i <= steps; ++i) {
    const auto q = kin::solve_ik(arm, {from + whole * i / steps, goal.axes}, way.back(),
                                 {.interrupt = interrupt});
    if (!q || (*q - way.back()).cwiseAbs().maxCoeff() > kJump) return std::nullopt;
    way.push_back(*q);
  }
  return way;
}

std::vector<Eigen::VectorXd> reaching_postures(const kin::ArmModel& arm,
                                               const Eigen::VectorXd& start,
                                               const kin::IkGoal& goal, int count,
                                               const Interrupt& interrupt) {
  const Eigen::Vector3d from = kin::end_effector(arm, start).translation();
  const Eigen::Vector3d whole = goal.position_in_W - from;
  std::vector<Eigen::VectorXd> way;
  for (int i = 1; i <= count; ++i) {
    const kin::IkGoal part{from + whole * i / count,
                           i == count ? goal.axes : decltype(goal.axes){}};
    const auto q =
        kin::solve_ik(arm, part, way.empty() ? start : way.back(), {.interrupt = interrupt});
    if (!q) break;
    way.push_back(*q);
  }
  return way;
}

std::vector<kin::IkGoal> grasp_goals(Grip grip, const Eigen::Vector3d& center, double height_m,
                                     double depth_m, const Eigen::Vector3d& lean) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Eigen::AngleAxisd turn(lean.norm(), lean.stableNormalized());
  if (grip == Grip::precision) {
    return {{center + (0.5 * height_m - depth_m) * up, {{turn * Eigen::Vector3d::UnitZ(), -up}}}};
  }
  const Eigen::Vector3d y = turn * Eigen::Vector3d::UnitY();
  return {{center, {{y, up}}}, {center, {{y, -up}}}};
}

std::vector<Eigen::Vector3d> leans(Grip grip, double most_rad) {
  std::vector<Eigen::Vector3d> all{Eigen::Vector3d::Zero()};
  const Eigen::Vector3d other =
      grip == Grip::precision ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  for (const double angle : {0.5 * most_rad, most_rad}) {
    if (most_rad <= 0.0) break;
    for (const double side : {angle, -angle}) {
      all.emplace_back(side * Eigen::Vector3d::UnitX());
      all.emplace_back(side * other);
    }
  }
  return all;
}

kin::IkGoal moved_hand(const kin::ArmModel& arm, const Eigen::VectorXd& q,
                       const Eigen::Vector3d& by_W) {
  const Eigen::Isometry3d X_WE = kin::end_effector(arm, q);
  return {X_WE.translation() + by_W,
          {{Eigen::Vector3d::UnitZ(), X_WE.linear().col(2)},
           {Eigen::Vector3d::UnitX(), X_WE.linear().col(0)}}};
}

std::vector<kin::Ball> cylinder_balls(const Eigen::Vector3d& center, double radius_m,
                                      double height_m) {
  const int count = std::max(1, static_cast<int>(std::ceil(height_m / radius_m)));
  const double spacing = height_m / count;
  std::vector<kin::Ball> balls;
  for (int i = 0; i < count; ++i) {
    const double z = (i + 0.5) * spacing - 0.5 * height_m;
    balls.push_back({center + Eigen::Vector3d(0.0, 0.0, z), std::hypot(radius_m, 0.5 * spacing)});
  }
  return balls;
}

std::optional<std::string> place_blocked(const kin::Table& table, const Eigen::Vector3d& center) {
  const double r = table.object_radius, half = 0.5 * table.object_height;
  for (const auto& ball : table.balls) {
    const Eigen::Vector3d d = (ball.center - center).cwiseAbs();
    const double beside = std::max(0.0, d.head<2>().norm() - r), over = std::max(0.0, d.z() - half);
    if (std::hypot(beside, over) < ball.radius) {
      return "the obstacle ball at " + in_mm(ball.center);
    }
  }
  for (const kin::Hull& hull : table.hulls) {
    constexpr int kSides = 16;
    constexpr double kAround = 1.02;  // 1 / cos(π/16): the prism holds the cylinder
    math::ConvexPart prism{Eigen::MatrixX3d(2 * kSides, 3)};
    for (int i = 0; i < 2 * kSides; ++i) {
      const double angle = 2.0 * M_PI * (i / 2) / kSides;
      prism.points.row(i) =
          center + Eigen::Vector3d(kAround * r * std::cos(angle), kAround * r * std::sin(angle),
                                   (i % 2 ? 1.0 : -1.0) * (half - kStanding));
    }
    const Eigen::Isometry3d same = Eigen::Isometry3d::Identity();
    if (math::gap_between(prism, hull.shape, same).at_least <= 0.0) return "the " + hull.name;
  }
  for (const auto& box : table.boxes) {
    const Eigen::Vector3d d = ((box.center - center).cwiseAbs() - box.half_extent).cwiseMax(0.0);
    if (d.head<2>().norm() < r && d.z() < half - kStanding) return in_words(box);
  }
  return std::nullopt;
}

std::vector<kin::Box> closed_passages(const kin::Table& table, Transport transport) {
  const Eigen::Vector3d& bar = table.bar_center;
  const auto slab = [&](double y_lo, double y_hi, double z_lo, double z_hi) {
    return kin::Box{{bar.x(), 0.5 * (y_lo + y_hi), 0.5 * (z_lo + z_hi)},
                    {kGateHalfThickness, 0.5 * (y_hi - y_lo), 0.5 * (z_hi - z_lo)},
                    "closed passage"};
  };
  if (transport == Transport::above) return {slab(-kFar, kFar, bar.z() - kFar, bar.z())};
  const double left = bar.y() + table.bar_half_width, right = bar.y() - table.bar_half_width;
  return {slab(-kFar, kFar, bar.z(), bar.z() + kFar), slab(left, kFar, bar.z() - kFar, bar.z()),
          slab(-kFar, right, bar.z() - kFar, bar.z())};
}

}  // namespace mimesis::planner
