#include "common/robot/bodies.h"

#include "common/math/so3.h"

namespace mimesis::robot {
namespace {

using Eigen::Isometry3d, Eigen::Matrix3d, Eigen::Vector3d;

/// Rotation whose z column is `axis`; a permutation if that is an axis of coordinates, so that
/// nothing is rounded.
Matrix3d frame_with_z(const Vector3d& axis) {
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (axis[k] != 1.0) continue;
    Matrix3d R;
    R << Vector3d::Unit((k + 1) % 3), Vector3d::Unit((k + 2) % 3), axis;
    return R;
  }
  return Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axis).toRotationMatrix();
}

void add_inertia(const Inertia& inertia, const Isometry3d& X_BodyLink, Body& body) {
  const Vector3d com = X_BodyLink * inertia.com_m;
  const Matrix3d R = X_BodyLink.linear();
  body.mass += inertia.mass_kg;
  body.first += inertia.mass_kg * com;
  body.inertia += R * inertia.about_com_kg_m2 * R.transpose() -
                  inertia.mass_kg * math::hat(com) * math::hat(com);
}

}  // namespace

std::vector<Body> bodies_of(const RobotTree& tree) {
  std::vector<Body> bodies(static_cast<std::size_t>(tree.dof()) + 1);
  std::vector<Isometry3d> X_BodyLink(tree.links().size(), Isometry3d::Identity());
  std::vector<int> body_of(tree.links().size(), 0);
  for (std::size_t l = 0; l < tree.links().size(); ++l) {
    const Link& link = tree.links()[l];
    if (l > 0) {
      const auto parent = static_cast<std::size_t>(link.parent);
      X_BodyLink[l] = X_BodyLink[parent] * link.X_PJ;
      body_of[l] = body_of[parent];
    }
    if (link.dof >= 0) {
      Body& body = bodies[static_cast<std::size_t>(link.dof) + 1];
      const Matrix3d R_LJ = frame_with_z(link.axis);
      body.link = static_cast<int>(l);
      body.parent = body_of[l];
      body.slides = link.type == JointType::kPrismatic;
      body.R_PJ = X_BodyLink[l].linear() * R_LJ;
      body.p_PJ = X_BodyLink[l].translation();
      body.axis_L = link.axis;
      body_of[l] = link.dof + 1;
      X_BodyLink[l] = Isometry3d(R_LJ.transpose());
    }
    add_inertia(link.inertia, X_BodyLink[l], bodies[static_cast<std::size_t>(body_of[l])]);
  }
  for (std::size_t i = bodies.size(); i-- > 0;) {
    Body& body = bodies[i];
    body.first_L = i == 0 ? body.first : Vector3d(frame_with_z(body.axis_L) * body.first);
    body.subtree_mass += body.mass;
    if (i > 0) bodies[static_cast<std::size_t>(body.parent)].subtree_mass += body.subtree_mass;
  }
  return bodies;
}

}  // namespace mimesis::robot
