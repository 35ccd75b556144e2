#include "nodes/planner/grasp.h"

#include <algorithm>
#include <cmath>

#include "nodes/planner/collision.h"

namespace mimesis::planner {
namespace {

constexpr double kGateHalfThickness = 0.01;  // [m]
constexpr double kStanding = 0.002;          // overlap of an object and what it stands on [m]
constexpr double kFar = 2.0;                 // beyond the reach of the arm [m]

}  // namespace

std::vector<kin::IkGoal> grasp_goals(Grip grip, const Eigen::Vector3d& center, double height_m,
                                     double depth_m) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  if (grip == Grip::precision) {
    return {{center + (0.5 * height_m - depth_m) * up, {{Eigen::Vector3d::UnitZ(), -up}}}};
  }
  return {{center, {{Eigen::Vector3d::UnitY(), up}}}, {center, {{Eigen::Vector3d::UnitY(), -up}}}};
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
  for (const auto& box : table.boxes) {
    const Eigen::Vector3d d = ((box.center - center).cwiseAbs() - box.half_extent).cwiseMax(0.0);
    if (d.head<2>().norm() < r && d.z() < half - kStanding) return in_words(box);
  }
  return std::nullopt;
}

std::vector<kin::Box> closed_passages(const kin::Table& table, Transport transport) {
  const Eigen::Vector3d& bar = table.bridge_center;
  const auto slab = [&](double y_lo, double y_hi, double z_lo, double z_hi) {
    return kin::Box{{bar.x(), 0.5 * (y_lo + y_hi), 0.5 * (z_lo + z_hi)},
                    {kGateHalfThickness, 0.5 * (y_hi - y_lo), 0.5 * (z_hi - z_lo)},
                    "closed passage"};
  };
  if (transport == Transport::above) return {slab(-kFar, kFar, bar.z() - kFar, bar.z())};
  const double left = bar.y() + table.bridge_half_width, right = bar.y() - table.bridge_half_width;
  return {slab(-kFar, kFar, bar.z(), bar.z() + kFar), slab(left, kFar, bar.z() - kFar, bar.z()),
          slab(-kFar, right, bar.z() - kFar, bar.z())};
}

}  // namespace mimesis::planner
