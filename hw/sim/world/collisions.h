#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/kin/arm.h"
#include "common/kin/table.h"

namespace mimesis::world {

/// Solid cylinder about the z axis of its own frame O, whose origin is the centre.
struct Cylinder {
  Eigen::Isometry3d X_WO = Eigen::Isometry3d::Identity();
  double radius = 0.0;  ///< [m]
  double height = 0.0;  ///< [m]
};

/// From the distances along independent directions, each negative inside.
inline double combine(double a, double b) {
  if (a <= 0.0 && b <= 0.0) return std::max(a, b);
  return std::hypot(std::max(a, 0.0), std::max(b, 0.0));
}

/// Distance of point `p` from the surface, negative inside [m].
inline double signed_distance(const kin::Box& box, const Eigen::Vector3d& p) {
  const Eigen::Vector3d d = (p - box.center).cwiseAbs() - box.half_extent;
  return d.maxCoeff() <= 0.0 ? d.maxCoeff() : d.cwiseMax(0.0).norm();
}
inline double signed_distance(const Cylinder& cylinder, const Eigen::Vector3d& p) {
  const Eigen::Vector3d p_O = cylinder.X_WO.inverse() * p;
  return combine(p_O.head<2>().norm() - cylinder.radius, std::abs(p_O.z()) - cylinder.height / 2);
}

/// Angle between the cylinder's axis and the vertical, [0, π/2] [rad].
inline double tilt(const Cylinder& cylinder) {
  const Eigen::Vector3d axis = cylinder.X_WO.linear().col(2);
  return std::atan2(axis.head<2>().norm(), std::abs(axis.z()));
}

/// Height of the lowest point: z − ½h cos θ − r sin θ at tilt θ [m].
inline double lowest_point(const Cylinder& cylinder) {
  const double theta = tilt(cylinder);
  return cylinder.X_WO.translation().z() - cylinder.height / 2 * std::cos(theta) -
         cylinder.radius * std::sin(theta);
}

/// Balls inside the cylinder that touch its surface: five along the axis, and points (radius 0),
/// twelve on each rim. A flat face that touches none of them cuts the rims by less than r·(1 − cos
/// 15°).
inline std::vector<kin::Ball> covering_balls(const Cylinder& cylinder) {
  constexpr int kAlongAxis = 5, kOnRim = 12;
  std::vector<kin::Ball> balls;
  const double half = std::max(cylinder.height / 2 - cylinder.radius, 0.0);
  for (int i = 0; i < kAlongAxis; ++i) {
    const double z = half * (2.0 * i / (kAlongAxis - 1) - 1.0);
    balls.push_back({cylinder.X_WO * Eigen::Vector3d(0, 0, z), cylinder.radius});
  }
  for (const double z : {-cylinder.height / 2, cylinder.height / 2}) {
    for (int i = 0; i < kOnRim; ++i) {
      const double phi = 2.0 * M_PI * i / kOnRim;
      const Eigen::Vector3d rim(cylinder.radius * std::cos(phi), cylinder.radius * std::sin(phi),
                                z);
      balls.push_back({cylinder.X_WO * rim, 0.0});
    }
  }
  return balls;
}

/// The object as the collision check sees it.
struct ObjectInScene {
  Cylinder cylinder;
  bool held = false;             ///< if so, the object belongs to the hand
  bool between_fingers = false;  ///< if so, the hand may touch it
  bool falling = false;          ///< if so, contacts do not count
};

/// One body overlaps another.
struct Contact {
  std::string name;    ///< "fore ball 8 with bar"
  double depth = 0.0;  ///< of the deepest pair of balls [m]
};

/// Counts collisions of arm and object with the table, with each other and of the arm with itself,
/// by safety balls [M18 2.3.2]: two bodies collide if a ball of one is nearer to a ball (or box) of
/// the other than the sum of the radii; a ball of a convex part only if the part does, too. Bodies
/// are the arm's groups, the object, the bar, each box and each hull. A contact of two bodies
/// counts once, from the first overlap until they part.
class CollisionMonitor {
 public:
  CollisionMonitor(const kin::ArmModel& arm, const kin::Table& table)
      : arm_(arm),
        table_(table),
        object_(static_cast<int>(arm.groups.size())),
        bar_(object_ + 1),
        first_box_(object_ + 2) {
    for (const kin::SafetyBall& ball : arm_.balls) {
      if (ball.frame == arm_.dof()) hand_ = ball.group;
    }
    for (std::size_t i = 0; i < arm_.balls.size(); ++i) {
      const int group = arm_.balls[i].group;
      parts_.push_back(
          {group, Eigen::Vector3d::Zero(), arm_.balls[i].radius,
           arm_.groups[static_cast<std::size_t>(group)] + " ball " + std::to_string(i)});
    }
    std::size_t next = 0;  // the balls of parts are in the order of parts
    for (std::size_t k = 0; k < arm_.parts.size(); ++k) {
      for (std::size_t i = 0; i < arm_.parts[k].cover.size(); ++next) {
        if (!arm_.balls[next].of_part) continue;
        parts_[next].shape = static_cast<int>(k);
        ++i;
      }
    }
  }

  /// `X`: frames of the arm (kin::forward). O(balls of the arm × balls and boxes of the table).
  void update(const std::vector<Eigen::Isometry3d>& X, const ObjectInScene& object) {
    now_.clear();
    push_ = {};
    place(X, object);
    for (const Part& part : parts_) meet_table(part);
    meet_itself();
    if (!object.falling) meet_object(object);
    count_episodes();
  }

  int count() const { return count_; }               ///< contacts since the start
  const std::string& last() const { return last_; }  ///< name of the newest one
  /// The deepest contact of the arm with the object that is not held, in the last update; depth 0
  /// if none.
  const Contact& push() const { return push_; }

 private:
  // The held object may be pressed this deep into a box.
  static constexpr double kSupport_m = 0.003;
  static constexpr double kFar_m = 1e3;
  static constexpr double kRelease_m = 0.001;  // a contact ends when the bodies are this far apart

  struct Part {  // a ball of a moving body
    int body;
    Eigen::Vector3d center;
    double radius;
    std::string name;
    int shape = -1;  // of the arm's parts: that which the ball covers some of
  };
  struct Overlap {
    double depth;  // > 0: overlap
    std::string name;
  };

  void place(const std::vector<Eigen::Isometry3d>& X, const ObjectInScene& object) {
    X_ = X;
    kin::ball_centers(arm_, X, centers_);
    parts_.resize(arm_.balls.size());
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      parts_[i].center = centers_.col(static_cast<Eigen::Index>(i));
    }
    if (!object.held) return;
    for (const kin::Ball& ball : covering_balls(object.cylinder)) {
      parts_.push_back({object_, ball.center, ball.radius, "object"});
    }
  }
  /// The depth of a ball in `other`, in W; of a ball of a part only if the part is in it.
  double depth_of(const Part& part, double ball_depth, const math::ConvexPart& other) const {
    if (part.shape < 0 || ball_depth < -kRelease_m) return ball_depth;
    const kin::SafetyPart& shape = arm_.parts[static_cast<std::size_t>(part.shape)];
    const Eigen::Isometry3d& X_WF = X_[static_cast<std::size_t>(shape.frame)];
    const double gap = math::gap_between(shape.shape, other, X_WF.inverse()).at_most;
    return gap > 1e-6 ? std::min(ball_depth, -gap) : ball_depth;
  }
  /// What a ball stands for, in W.
  math::ConvexPart shape_of(const Part& part) const {
    if (part.shape < 0) return {part.center.transpose(), part.radius};
    const kin::SafetyPart& shape = arm_.parts[static_cast<std::size_t>(part.shape)];
    const Eigen::Isometry3d& X_WF = X_[static_cast<std::size_t>(shape.frame)];
    const Eigen::Matrix3Xd points = X_WF * shape.shape.points.transpose().colwise().homogeneous();
    return {points.transpose(), shape.shape.radius};
  }
  static math::ConvexPart hull_of(const std::vector<kin::Ball>& points, double radius) {
    math::ConvexPart hull{Eigen::MatrixX3d(std::ssize(points), 3), radius};
    for (Eigen::Index i = 0; i < hull.points.rows(); ++i)
      hull.points.row(i) = points[static_cast<std::size_t>(i)].center.transpose();
    return hull;
  }
  static math::ConvexPart hull_of(const kin::Box& box) {
    std::vector<kin::Ball> corners(8);
    for (int i = 0; i < 8; ++i)
      corners[static_cast<std::size_t>(i)].center =
          box.center + box.half_extent.cwiseProduct(
                           Eigen::Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
    return hull_of(corners, 0.0);
  }
  void meet_table(const Part& part) {
    const bool is_object = part.body == object_;
    if (!is_object && std::find(arm_.env_groups.begin(), arm_.env_groups.end(), part.body) ==
                          arm_.env_groups.end()) {
      return;
    }
    for (const kin::Ball& ball : table_.balls) {
      const double depth = part.radius + ball.radius - (part.center - ball.center).norm();
      note(part.body, bar_, depth_of(part, depth, {ball.center.transpose(), ball.radius}),
           part.name, "bar");
    }
    for (std::size_t k = 0; k < table_.boxes.size(); ++k) {
      const kin::Box& box = table_.boxes[k];
      double depth = part.radius - signed_distance(box, part.center);
      if (part.shape >= 0) depth = depth_of(part, depth, hull_of(box));
      note(part.body, first_box_ + static_cast<int>(k), depth - (is_object ? kSupport_m : 0.0),
           part.name, box.name);
    }
    for (std::size_t k = 0; k < table_.hulls.size(); ++k) {
      const kin::Hull& hull = table_.hulls[k];
      double depth = -kFar_m;  // of the ball in those that hold the hull
      for (const math::RoundBound& ball : hull.cover)
        depth = std::max(depth, part.radius + ball.radius - (part.center - ball.center).norm());
      if (depth >= -kRelease_m) {
        const math::ConvexPart ball{part.center.transpose(), part.radius};
        const Eigen::Isometry3d same = Eigen::Isometry3d::Identity();
        depth = std::min(depth, -math::gap_between(ball, hull.shape, same).at_most);
        depth = depth_of(part, depth, hull.shape);
      }
      note(part.body, first_box_ + static_cast<int>(table_.boxes.size() + k),
           depth - (is_object ? kSupport_m : 0.0), part.name, hull.name);
    }
  }
  void meet_itself() {
    for (const auto& [a, b] : arm_.self_pairs) {
      for (const Part& first : parts_) {
        if (first.body != a) continue;
        for (const Part& second : parts_) {
          if (second.body != b) continue;
          double depth = first.radius + second.radius - (first.center - second.center).norm();
          if (depth >= -kRelease_m && (first.shape >= 0 || second.shape >= 0))
            depth = first.shape >= 0 ? depth_of(first, depth, shape_of(second))
                                     : depth_of(second, depth, shape_of(first));
          note(a, b, depth, first.name, second.name);
        }
      }
    }
  }
  void meet_object(const ObjectInScene& object) {
    const bool hand_may_touch = object.held || object.between_fingers;
    for (std::size_t i = 0; i < arm_.balls.size(); ++i) {
      const Part& part = parts_[i];
      if (hand_may_touch && part.body == hand_) continue;
      double depth = part.radius - signed_distance(object.cylinder, part.center);
      if (part.shape >= 0)
        depth = depth_of(part, depth, hull_of(covering_balls(object.cylinder), 0.0));
      note(part.body, object_, depth, part.name, "object");
      if (!object.held && depth > push_.depth) push_ = {part.name, depth};
    }
  }
  void note(int body, int other, double depth, const std::string& name,
            const std::string& other_name) {
    if (depth < -kRelease_m) return;
    Overlap& overlap = now_.try_emplace({body, other}, Overlap{-kRelease_m, {}}).first->second;
    if (depth >= overlap.depth) overlap = {depth, name + " with " + other_name};
  }
  void count_episodes() {
    for (auto& [pair, touching] : touching_) touching = touching && now_.contains(pair);
    for (const auto& [pair, overlap] : now_) {
      bool& touching = touching_[pair];
      if (touching || overlap.depth <= 0.0) continue;
      touching = true;
      ++count_;
      last_ = overlap.name;
    }
  }

  kin::ArmModel arm_;
  kin::Table table_;
  int object_, bar_, first_box_;  // numbers of the bodies after the arm's groups
  int hand_ = -1;                 // the group that the last link carries
  std::vector<Part> parts_;       // arm, then the held object
  std::vector<Eigen::Isometry3d> X_;
  Eigen::Matrix3Xd centers_;
  std::map<std::pair<int, int>, Overlap> now_;  // deepest overlap or nearest miss of two bodies
  std::map<std::pair<int, int>, bool> touching_;
  int count_ = 0;
  std::string last_;
  Contact push_;
};

}  // namespace mimesis::world
