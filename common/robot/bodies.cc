#include "common/robot/bodies.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/error.h"
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
  return math::rotation_onto(Vector3d::UnitZ(), axis);
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
      body.slides = link.type == JointType::prismatic;
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

PartMass::PartMass(const RobotTree& tree, std::span<const int> dofs, bool with_root) {
  const std::vector<Body> all = bodies_of(tree);
  if (with_root) {
    root_ = all[0].first;
    mass_ = all[0].mass;
  }
  joint_.resize(dofs.size());
  std::iota(joint_.begin(), joint_.end(), Eigen::Index{0});
  const auto dof = [&](Eigen::Index joint) { return dofs[static_cast<std::size_t>(joint)]; };
  std::ranges::sort(joint_, {}, dof);  // parents first
  std::vector<int> here(all.size(), -1);
  for (const Eigen::Index joint : joint_) {
    const auto i = static_cast<std::size_t>(dof(joint)) + 1;
    Body body = all[i];
    MIMESIS_ASSERT(body.parent == 0 || here[static_cast<std::size_t>(body.parent)] >= 0);
    body.parent = body.parent == 0 ? -1 : here[static_cast<std::size_t>(body.parent)];
    here[i] = static_cast<int>(bodies_.size());
    body.subtree_mass = body.mass;
    mass_ += body.mass;
    bodies_.push_back(body);
  }
  for (std::size_t i = bodies_.size(); i-- > 0;) {
    if (bodies_[i].parent < 0) continue;
    bodies_[static_cast<std::size_t>(bodies_[i].parent)].subtree_mass += bodies_[i].subtree_mass;
  }
  moment_.resize(bodies_.size());
}

Eigen::Vector3d PartMass::first_moment(const Eigen::Ref<const Eigen::VectorXd>& q) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) moment_[i] = bodies_[i].first;
  Eigen::Vector3d sum = root_;
  for (std::size_t i = bodies_.size(); i-- > 0;) {
    const Body& body = bodies_[i];
    const double at = q[joint_[i]];
    Eigen::Vector3d moment = moment_[i];  // in J
    if (body.slides) {
      moment.z() += at * body.subtree_mass;
    } else {
      const double c = std::cos(at), s = std::sin(at), x = moment.x();
      moment.x() = c * x - s * moment.y();
      moment.y() = s * x + c * moment.y();
    }
    const Eigen::Vector3d in_parent = body.R_PJ * moment + body.subtree_mass * body.p_PJ;
    (body.parent < 0 ? sum : moment_[static_cast<std::size_t>(body.parent)]) += in_parent;
  }
  return sum;
}

}  // namespace mimesis::robot
