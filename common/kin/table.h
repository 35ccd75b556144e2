#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/math/convex_part.h"

namespace mimesis::kin {

/// Obstacle ball in W [m].
struct Ball {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0.0;
};

/// The obstacle of the bridge paradigm [M18 2.1.1]: two posts and a bar across them, all of one
/// thickness, in the plane x = const of W.
struct BarShape {
  double x = 0.0;            ///< the bar stands in the plane x = this [m]
  double surface_z = 0.0;    ///< height of the table top [m]
  double half_width = 0.0;   ///< posts stand at y = ±half_width [m]
  double height = 0.0;       ///< lower edge of the bar above the table top [m]
  double ball_radius = 0.0;  ///< half the thickness [m]
  /// Between neighbouring ball centres [m]. The balls cover a rod of radius √(ball_radius² − ¼
  /// max_spacing²).
  double max_spacing = 0.0;
};

/// The bar as a union of safety balls [M18 2.3.2], evenly spaced along posts and bar. The lowest
/// ball of a post rests on the table top.
std::vector<Ball> bar_balls(const BarShape& shape);

/// Middle of the bar's axis in W [m].
Eigen::Vector3d bar_center(const BarShape& shape);

/// Axis-aligned obstacle box in W [m].
struct Box {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_extent = Eigen::Vector3d::Zero();
  std::string name;  ///< for messages to people
};

/// Convex obstacle in W: one of those that a mesh was cut into.
struct Hull {
  math::ConvexPart shape;                 ///< [m]
  std::vector<math::RoundBound> cover{};  ///< balls that hold it
  std::string name{};                     ///< for messages to people; those of one mesh share it
};

/// Where an object's centre shall rest, and how near counts.
struct GoalPlace {
  std::string name;  ///< "high" or "low"
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double radius = 0.0;
};

/// The robot's table in the bridge paradigm [M18 2.1.1], frame W. Read from models/*.yaml by
/// common/model, carried by v1.Scene.
struct Table {
  std::vector<Ball> balls;    ///< the bar, as unions of safety balls, and anything else round
  std::vector<Box> boxes;     ///< table top, goal stands
  std::vector<Hull> hulls{};  ///< of meshes
  Eigen::Vector3d bar_center = Eigen::Vector3d::Zero();  ///< middle of the bar
  double bar_height = 0.0;      ///< lower edge of the bar above the table [m]
  double bar_half_width = 0.0;  ///< half the span along y [m]
  std::vector<GoalPlace> goals;
  Eigen::Vector3d object =
      Eigen::Vector3d::Zero();  ///< centre of the upright cylinder to be grasped
  double object_radius = 0.0;   ///< [m]
  double object_height = 0.0;   ///< [m]
};

}  // namespace mimesis::kin
