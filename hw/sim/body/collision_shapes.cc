#include "hw/sim/body/collision_shapes.h"

#include <tinyxml2.h>

#include <algorithm>
#include <dart/collision/CollisionFilter.hpp>
#include <dart/collision/CollisionObject.hpp>
#include <dart/collision/CollisionResult.hpp>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/ShapeNode.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/simulation/World.hpp>
#include <sstream>

#include "common/error.h"

namespace mimesis::hw::sim {
namespace {

using dart::dynamics::BodyNode;
using dart::dynamics::ShapeFrame;
using dart::dynamics::ShapeNode;
using Eigen::Vector3d;

constexpr double kFriction = 0.5;

ShapeNode& box_on(BodyNode& body, const Vector3d& size_m, const Eigen::Isometry3d& X_NB) {
  auto* node =
      body.createShapeNodeWith<dart::dynamics::CollisionAspect, dart::dynamics::DynamicsAspect>(
          std::make_shared<dart::dynamics::BoxShape>(size_m));
  node->setRelativeTransform(X_NB);
  node->getDynamicsAspect()->setFrictionCoeff(kFriction);
  return *node;
}

Vector3d numbers(const tinyxml2::XMLElement* element, const char* name) {
  Vector3d out = Vector3d::Zero();
  if (element == nullptr || element->Attribute(name) == nullptr) return out;
  std::istringstream text(element->Attribute(name));
  for (double& x : out) text >> x;
  return out;
}

struct UrdfBox {
  Vector3d size_m;
  Eigen::Isometry3d X_LB = Eigen::Isometry3d::Identity();
};

/// Boxes among the links' shapes for collisions, by link.
std::unordered_map<std::string, UrdfBox> urdf_boxes(const std::string& file) {
  tinyxml2::XMLDocument document;
  if (document.LoadFile(file.c_str()) != tinyxml2::XML_SUCCESS) {
    throw ConfigError(file + ": " + document.ErrorStr() + ", expected a URDF file");
  }
  std::unordered_map<std::string, UrdfBox> boxes;
  auto* robot = document.FirstChildElement("robot");
  for (auto* link = robot != nullptr ? robot->FirstChildElement("link") : nullptr; link != nullptr;
       link = link->NextSiblingElement("link")) {
    auto* shape = link->FirstChildElement("collision");
    auto* geometry = shape != nullptr ? shape->FirstChildElement("geometry") : nullptr;
    auto* box = geometry != nullptr ? geometry->FirstChildElement("box") : nullptr;
    if (box == nullptr || link->Attribute("name") == nullptr) continue;
    const Vector3d rpy = numbers(shape->FirstChildElement("origin"), "rpy");
    UrdfBox found{.size_m = numbers(box, "size")};
    found.X_LB.translation() = numbers(shape->FirstChildElement("origin"), "xyz");
    found.X_LB.linear() = math::rotation_of_rpy(rpy);
    boxes.emplace(link->Attribute("name"), found);
  }
  return boxes;
}

void count(Collisions& of, double depth_m, const std::string& a, const std::string& b) {
  if (depth_m <= of.deepest_m && !of.deepest_between.empty()) return;
  of.deepest_m = std::max(depth_m, of.deepest_m);
  of.deepest_between = a + " and " + b;
}

}  // namespace

/// Pairs that may touch, and whose balls do.
class CollisionShapes::Filter : public dart::collision::CollisionFilter {
 public:
  explicit Filter(const CollisionShapes& obstacles) : my_(obstacles) {}
  bool ignoresCollision(const dart::collision::CollisionObject* first,
                        const dart::collision::CollisionObject* second) const override {
    const auto a = my_.index_.find(first->getShapeFrame());
    const auto b = my_.index_.find(second->getShapeFrame());
    const bool ground_a = a == my_.index_.end(), ground_b = b == my_.index_.end();
    if (ground_a && ground_b) return true;
    if (ground_a || ground_b) return !my_.parts_[ground_a ? b->second : a->second].sole;
    if (!my_.touch_[a->second][b->second]) return true;
    const Part &p = my_.parts_[a->second], &q = my_.parts_[b->second];
    const double reach = p.radius_m + q.radius_m;
    return (p.shape->getWorldTransform().translation() - q.shape->getWorldTransform().translation())
               .squaredNorm() > reach * reach;
  }

 private:
  const CollisionShapes& my_;
};

CollisionShapes::CollisionShapes(const robot::Biped& biped, const std::string& urdf_file,
                                 const std::optional<DrawerSettings>& drawer, DartBody& body)
    : body_(body) {
  add_links(biped, urdf_file);
  if (drawer && drawer->collides) add_furniture(*drawer);
  for (std::size_t i = 0; i < parts_.size(); ++i) index_.emplace(parts_[i].shape, i);
  pair_up(biped);
  body.world->getConstraintSolver()->getCollisionOption().collisionFilter =
      std::make_shared<Filter>(*this);
}

void CollisionShapes::add_links(const robot::Biped& biped, const std::string& urdf_file) {
  const auto radius = [](const ShapeNode& node) {
    return 0.5 * static_cast<const dart::dynamics::BoxShape&>(*node.getShape()).getSize().norm();
  };
  for (const robot::Biped::Leg& leg : biped.leg) {  // they have their soles already
    ShapeNode* sole = body_.at(leg.foot).node->getShapeNode(0);
    parts_.push_back({biped.tree.link(leg.foot).name, leg.foot, true, false, radius(*sole), sole});
  }
  const auto boxes = urdf_boxes(urdf_file);
  for (std::size_t i = 0; i < biped.tree.links().size(); ++i) {
    const int link = static_cast<int>(i);
    const auto box = boxes.find(biped.tree.link(link).name);
    const bool foot = std::ranges::any_of(biped.leg, [&](const auto& l) { return l.foot == link; });
    if (box == boxes.end() || foot) continue;
    const DartLink& at = body_.at(link);
    ShapeNode& node = box_on(*at.node, box->second.size_m, at.X_NL * box->second.X_LB);
    parts_.push_back({biped.tree.link(link).name, link, false, false, radius(node), &node});
  }
}

void CollisionShapes::add_furniture(const DrawerSettings& s) {
  const auto furniture = dart::dynamics::Skeleton::create("furniture");
  const auto add = [&](const char* name) {
    dart::dynamics::BodyNode::Properties properties;
    dart::dynamics::FreeJoint::Properties joint;
    joint.mName = properties.mName = name;
    return furniture->createJointAndBodyNodePair<dart::dynamics::FreeJoint>(nullptr, joint,
                                                                            properties);
  };
  const auto [cabinet, cabinet_body] = add("cabinet");
  const auto [drawer, drawer_body] = add("drawer");
  cabinet_ = cabinet;
  drawer_ = drawer;
  for (const Board& board : boards(s)) {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.translation() = 0.5 * (board.low_m + board.high_m);
    const Vector3d size_m = board.high_m - board.low_m;
    ShapeNode& node = box_on(board.moves ? *drawer_body : *cabinet_body, size_m, X);
    parts_.push_back({board.name, -1, false, board.handle, 0.5 * size_m.norm(), &node});
  }
  R_WD_ = Eigen::AngleAxisd(s.yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
  from_W_m_.fill({s.front_x_m, s.front_y_m, 0.0});
  to_W_m_ = from_W_m_;
  furniture->setMobile(false);
  body_.world->addSkeleton(furniture);
  move(1.0, 1.0);
}

/// Links that follow each other, but for links without a box, do not touch.
void CollisionShapes::pair_up(const robot::Biped& biped) {
  touch_.assign(parts_.size(), std::vector<bool>(parts_.size(), false));
  const auto boxed = [&](int link) {
    return std::ranges::any_of(parts_, [&](const Part& p) { return p.link == link; });
  };
  const auto before = [&](int link) {
    for (link = biped.tree.link(link).parent; link >= 0 && !boxed(link);) {
      link = biped.tree.link(link).parent;
    }
    return link;
  };
  // a hand, its fingers and the forearm are one
  const auto in_hand = [&](int link) {
    return std::ranges::any_of(biped.hand, [&](int hand) {
      return hand >= 0 && biped.tree.carries(biped.tree.link(hand).parent, link);
    });
  };
  const auto near = [&](int a, int b) {
    return before(a) == b || before(b) == a || (in_hand(a) && before(before(a)) == b) ||
           (in_hand(b) && before(before(b)) == a);
  };
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const Part &a = parts_[i], &b = parts_[k];
      bool touches = a.link >= 0 || b.link >= 0;
      if (a.link >= 0 && b.link >= 0) touches = a.link != b.link && !near(a.link, b.link);
      if ((a.handle && b.link >= 0 && in_hand(b.link)) ||
          (b.handle && a.link >= 0 && in_hand(a.link))) {
        touches = false;
      }
      touch_[i][k] = touch_[k][i] = touches;
    }
  }
}

void CollisionShapes::aim(const DrawerNow& drawer) {
  if (cabinet_ == nullptr) return;
  to_W_m_ = {drawer.front_W_m, drawer.front_W_m - drawer.opened_m * R_WD_.col(0)};
}

void CollisionShapes::move(double share, double duration_s) {
  if (cabinet_ == nullptr) return;
  dart::dynamics::FreeJoint* joints[] = {cabinet_, drawer_};
  for (std::size_t i = 0; i < 2; ++i) {
    const Vector3d way_W_m = to_W_m_[i] - from_W_m_[i];
    Eigen::Isometry3d X_WD = Eigen::Isometry3d::Identity();
    X_WD.linear() = R_WD_;
    X_WD.translation() = from_W_m_[i] + share * way_W_m;
    joints[i]->setTransform(X_WD);
    joints[i]->setLinearVelocity(way_W_m / duration_s);
  }
}

void CollisionShapes::arrive() { from_W_m_ = to_W_m_; }

const CollisionShapes::Part* CollisionShapes::part(const ShapeFrame* frame) const {
  const auto found = index_.find(frame);
  return found != index_.end() ? &parts_[found->second] : nullptr;
}

void CollisionShapes::read(std::vector<ContactForce>& forces) {
  forces.clear();
  bool self = false, furniture = false;
  for (const auto& contact : body_.world->getLastCollisionResult().getContacts()) {
    const Part* a = part(contact.collisionObject1->getShapeFrame());
    const Part* b = part(contact.collisionObject2->getShapeFrame());
    if (a == nullptr || b == nullptr) continue;  // a foot on the ground
    const bool own = a->link >= 0 && b->link >= 0;
    (own ? self : furniture) = true;
    count(own ? self_ : furniture_, contact.penetrationDepth, a->name, b->name);
    if (a->link >= 0 && !a->sole) forces.push_back({a->link, contact.point, contact.force});
    if (b->link >= 0 && !b->sole) forces.push_back({b->link, contact.point, -contact.force});
  }
  self_.steps += self;
  furniture_.steps += furniture;
}

}  // namespace mimesis::hw::sim
