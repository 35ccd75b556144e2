#include "common/robot/link_shapes.h"

#include "common/math/so3.h"
#include "common/robot/urdf_model.h"

namespace mimesis::robot {
namespace {

using Eigen::Vector3d;
constexpr double kRod_m = 0.045;

BodyPart part_of(const Biped& biped, int link) {
  const RobotTree& tree = biped.tree;
  const auto limb = [&](Side side) {
    if (tree.carries(tree.moved_link(biped.leg[side].dof[kHipFirst]), link)) return true;
    // an arm: what carries the hand, or hangs on it, but not on both sides' way to the trunk
    const int hand = biped.hand[side], opposite = biped.hand[other(side)];
    if (hand < 0) return false;
    for (int at = link; at >= 0; at = tree.link(at).parent) {
      if (tree.carries(at, hand)) return opposite < 0 || !tree.carries(at, opposite);
    }
    return false;
  };
  return limb(kLeft) ? BodyPart::left : limb(kRight) ? BodyPart::right : BodyPart::trunk;
}

std::vector<LinkShape> rods(const Biped& biped) {
  std::vector<LinkShape> shapes;
  for (std::size_t i = 1; i < biped.tree.links().size(); ++i) {
    const Link& link = biped.tree.links()[i];
    const Vector3d bone = link.X_PJ.translation();
    if (bone.norm() < 0.01 || link.inertia.mass_kg <= 0.0) continue;  // frames have no bones
    LinkShape rod{.link = link.parent,
                  .part = part_of(biped, static_cast<int>(i)),
                  .radius_m = kRod_m,
                  .length_m = bone.norm()};
    rod.X_LP.translation() = 0.5 * bone;
    rod.X_LP.linear() = math::rotation_onto(Vector3d::UnitZ(), bone);
    shapes.push_back(rod);
  }
  for (const Side side : kSides) {
    const Biped::Leg& leg = biped.leg[side];
    LinkShape sole{.link = leg.sole, .part = part_of(biped, leg.sole), .sole = true};
    sole.edges_m << leg.max_S_m - leg.min_S_m, 0.03;
    sole.X_LP.translation() << 0.5 * (leg.max_S_m + leg.min_S_m), 0.015;
    shapes.push_back(sole);
  }
  return shapes;
}

}  // namespace

std::vector<LinkShape> link_shapes(const Biped& biped, const std::string& urdf_file) {
  const auto model = parse_urdf(urdf_file);
  std::vector<LinkShape> shapes;
  for (std::size_t i = 0; i < biped.tree.links().size(); ++i) {
    const auto link = model->getLink(biped.tree.links()[i].name);
    if (link == nullptr) continue;  // a frame that only we know
    const auto index = static_cast<int>(i);
    for (const auto& visual : link->visual_array) {
      if (visual == nullptr || visual->geometry == nullptr) continue;
      LinkShape shape{
          .link = index, .part = part_of(biped, index), .X_LP = pose_of(visual->origin)};
      if (const auto* box = dynamic_cast<const urdf::Box*>(visual->geometry.get())) {
        shape.edges_m << box->dim.x, box->dim.y, box->dim.z;
      } else if (const auto* ball = dynamic_cast<const urdf::Sphere*>(visual->geometry.get())) {
        shape.radius_m = ball->radius;
      } else if (const auto* rod = dynamic_cast<const urdf::Cylinder*>(visual->geometry.get())) {
        shape.radius_m = rod->radius;
        shape.length_m = rod->length;
      } else {
        continue;
      }
      shapes.push_back(shape);
    }
  }
  return shapes.empty() ? rods(biped) : shapes;
}

}  // namespace mimesis::robot
