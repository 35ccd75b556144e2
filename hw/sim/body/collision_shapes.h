#pragma once
#include <optional>
#include <unordered_map>

#include "hw/sim/body/dart_body.h"
#include "hw/sim/body/drawer.h"

namespace dart::dynamics {
class FreeJoint;
class ShapeFrame;
class ShapeNode;
}  // namespace dart::dynamics
namespace mimesis::hw::sim {

/// What the robot can knock against beside the ground: itself and a piece of furniture with a
/// drawer. Links have the boxes of their URDF; spheres at joints lie within what they join, and
/// meshes are left out. Links that follow each other do not touch, and a hand closes about the
/// handle instead of touching it. Private to BodyWorld.
class CollisionShapes {
 public:
  /// Adds the shapes to the world. `drawer`: empty: no furniture.
  /// @throws ConfigError if the URDF cannot be read
  CollisionShapes(const robot::Biped& biped, const std::string& urdf_file,
                  const std::optional<DrawerSettings>& drawer, DartBody& body);

  /// The furniture goes there evenly in the next `steps` steps of the world.
  void aim(const DrawerNow& drawer);
  /// Before a step of the world, at this share of the way; `duration_s` for the whole way.
  void move(double share, double duration_s);
  /// The furniture has arrived.
  void arrive();
  /// After a step of the world: forces on links other than the feet's by the ground; counts them.
  void read(std::vector<ContactForce>& forces);

  const Collisions& self() const { return self_; }
  const Collisions& furniture() const { return furniture_; }

 private:
  class Filter;
  struct Part {
    std::string name;
    int link = -1;  ///< -1: furniture
    bool sole = false, handle = false;
    double radius_m = 0.0;  ///< of a ball about it
    dart::dynamics::ShapeNode* shape = nullptr;
  };
  void add_links(const robot::Biped& biped, const std::string& urdf_file);
  void add_furniture(const DrawerSettings& drawer);
  void pair_up(const robot::Biped& biped);
  const Part* part(const dart::dynamics::ShapeFrame* frame) const;

  DartBody& body_;
  std::vector<Part> parts_;
  std::unordered_map<const dart::dynamics::ShapeFrame*, std::size_t> index_;
  std::vector<std::vector<bool>> touch_;  ///< of pairs of parts
  dart::dynamics::FreeJoint *cabinet_ = nullptr, *drawer_ = nullptr;
  Eigen::Matrix3d R_WD_ = Eigen::Matrix3d::Identity();
  std::array<Eigen::Vector3d, 2> from_W_m_, to_W_m_;  ///< cabinet, drawer: middle of the front
  Collisions self_, furniture_;
};

}  // namespace mimesis::hw::sim
