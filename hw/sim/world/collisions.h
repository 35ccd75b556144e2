#pragma once
#include <Eigen/Geometry>
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

/// Distance of point `p` from the surface, negative inside [m].
double signed_distance(const kin::Box& box, const Eigen::Vector3d& p);
double signed_distance(const Cylinder& cylinder, const Eigen::Vector3d& p);

/// Angle between the cylinder's axis and the vertical, [0, π/2] [rad].
double tilt(const Cylinder& cylinder);

/// Height of the lowest point: z − ½h cos θ − r sin θ at tilt θ [m].
double lowest_point(const Cylinder& cylinder);

/// Balls inside the cylinder that touch its surface: five along the axis, and points (radius 0),
/// twelve on each rim. A flat face that touches none of them cuts the rims by less than r·(1 − cos
/// 15°).
std::vector<kin::Ball> covering_balls(const Cylinder& cylinder);

/// The object as the collision check sees it.
struct ObjectInScene {
  Cylinder cylinder;
  bool held = false;             ///< if so, the object belongs to the hand
  bool between_fingers = false;  ///< if so, the hand may touch it
  bool falling = false;          ///< if so, contacts do not count
};

/// One body overlaps another.
struct Contact {
  std::string name;    ///< "fore ball 8 with bridge"
  double depth = 0.0;  ///< of the deepest pair of balls [m]
};

/// Counts collisions of arm and object with the table, with each other and of the arm with itself,
/// by safety balls [M18 2.3.2]: two bodies collide if a ball of one is nearer to a ball (or box) of
/// the other than the sum of the radii. Bodies are the arm's groups, the object, the bridge and
/// each box. A contact of two bodies counts once, from the first overlap until they part.
class CollisionMonitor {
 public:
  CollisionMonitor(const kin::ArmModel& arm, const kin::Table& table);

  /// `X`: frames of the arm (kin::forward). O(balls of the arm × balls and boxes of the table).
  void update(const std::vector<Eigen::Isometry3d>& X, const ObjectInScene& object);

  int count() const { return count_; }               ///< contacts since the start
  const std::string& last() const { return last_; }  ///< name of the newest one
  /// The deepest contact of the arm with the object that is not held, in the last update; depth 0
  /// if none.
  const Contact& push() const { return push_; }

 private:
  struct Part {  // a ball of a moving body
    int body;
    Eigen::Vector3d center;
    double radius;
    std::string name;
  };
  struct Overlap {
    double depth;  // > 0: overlap
    std::string name;
  };

  void place(const std::vector<Eigen::Isometry3d>& X, const ObjectInScene& object);
  void meet_table(const Part& part);
  void meet_itself();
  void meet_object(const ObjectInScene& object);
  void note(int body, int other, double depth, const std::string& name,
            const std::string& other_name);
  void count_episodes();

  kin::ArmModel arm_;
  kin::Table table_;
  int object_, bridge_, first_box_;  // numbers of the bodies after the arm's groups
  int hand_ = -1;                    // the group that the last link carries
  std::vector<Part> parts_;          // arm, then the held object
  Eigen::Matrix3Xd centers_;
  std::map<std::pair<int, int>, Overlap> now_;  // deepest overlap or nearest miss of two bodies
  std::map<std::pair<int, int>, bool> touching_;
  int count_ = 0;
  std::string last_;
  Contact push_;
};

}  // namespace mimesis::world
