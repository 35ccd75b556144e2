#include "common/robot/dynamics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/error.h"
#include "common/math/so3.h"

namespace mimesis::robot {
using Eigen::Isometry3d, Eigen::Matrix3d, Eigen::Vector3d;

Dynamics::Dynamics(const RobotTree& tree)
    : tree_(&tree), bodies_(bodies_of(tree)), state_(bodies_.size()) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    state_[i].R = bodies_[i].R_PJ;  // its z column never changes
    state_[i].p = bodies_[i].p_PJ;
  }
}

void Dynamics::place(std::size_t i, const RobotMotion& motion) {
  const Body& body = bodies_[i];
  State& state = state_[i];
  const double q = motion.q[static_cast<Eigen::Index>(i) - 1];
  if (body.slides) {
    state.p = body.p_PJ + q * body.R_PJ.col(2);
  } else {
    const double c = std::cos(q), s = std::sin(q);
    state.R.col(0) = c * body.R_PJ.col(0) + s * body.R_PJ.col(1);
    state.R.col(1) = c * body.R_PJ.col(1) - s * body.R_PJ.col(0);
  }
}

void Dynamics::accelerate(const RobotMotion& motion) {
  const Matrix3d R_BW = motion.X_WB.linear().transpose();
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    State& state = state_[i];
    if (i == 0) {
      state.w = R_BW * motion.omega_W;
      state.alpha = R_BW * motion.alpha_W;
      state.a = R_BW * Vector3d(motion.a_W + kGravity * Vector3d::UnitZ());
    } else {
      place(i, motion);
      const State& parent = state_[static_cast<std::size_t>(body.parent)];
      const auto d = static_cast<Eigen::Index>(i) - 1;
      const double dq = motion.dq[d], ddq = motion.ddq[d];
      const Vector3d a_P = parent.a + parent.alpha.cross(state.p) +
                           parent.w.cross(Vector3d(parent.w.cross(state.p)));
      state.w = state.R.transpose() * parent.w;
      state.alpha = state.R.transpose() * parent.alpha;
      state.a = state.R.transpose() * a_P;
      if (body.slides) {  // Coriolis: 2 ω × ẑ q̇
        state.a += Vector3d(2.0 * state.w.y() * dq, -2.0 * state.w.x() * dq, ddq);
      } else {  // ω × ẑ q̇
        state.alpha += Vector3d(state.w.y() * dq, -state.w.x() * dq, ddq);
        state.w.z() += dq;
      }
    }
    // Newton and Euler about the frame's origin, h: first moment of mass
    const Vector3d& h = body.first;
    state.force =
        body.mass * state.a + state.alpha.cross(h) + state.w.cross(Vector3d(state.w.cross(h)));
    state.moment = body.inertia * state.alpha + state.w.cross(Vector3d(body.inertia * state.w)) +
                   h.cross(state.a);
  }
}

template <bool kTorques>
Wrench Dynamics::collect(const RobotMotion& motion, double* torque) {
  accelerate(motion);
  for (std::size_t i = bodies_.size(); --i > 0;) {
    const State& state = state_[i];
    State& parent = state_[static_cast<std::size_t>(bodies_[i].parent)];
    if constexpr (kTorques) torque[i - 1] = bodies_[i].slides ? state.force.z() : state.moment.z();
    const Vector3d f = state.R * state.force;
    parent.force += f;
    parent.moment += state.R * state.moment + state.p.cross(f);
  }
  Wrench ground;
  ground.force = motion.X_WB.linear() * state_[0].force;
  ground.moment =
      motion.X_WB.linear() * state_[0].moment + motion.X_WB.translation().cross(ground.force);
  return ground;
}

Wrench Dynamics::inverse_dynamics(const RobotMotion& motion, Eigen::Ref<Eigen::VectorXd> torque) {
  MIMESIS_ASSERT(motion.q.size() == tree_->dof() && torque.size() == tree_->dof());
  MIMESIS_ASSERT(motion.dq.size() == tree_->dof() && motion.ddq.size() == tree_->dof());
  return collect<true>(motion, torque.data());
}

Wrench Dynamics::ground_wrench(const RobotMotion& motion) {
  MIMESIS_ASSERT(motion.q.size() == tree_->dof());
  MIMESIS_ASSERT(motion.dq.size() == tree_->dof() && motion.ddq.size() == tree_->dof());
  return collect<false>(motion, nullptr);
}

void Dynamics::com_jacobian(const Kinematics& kinematics, Eigen::Ref<Eigen::Matrix3Xd> out) const {
  MIMESIS_ASSERT(&kinematics.tree() == tree_ && out.cols() == 6 + tree_->dof());
  MIMESIS_ASSERT(bodies_[0].subtree_mass > 0.0);
  const double per_mass = 1.0 / bodies_[0].subtree_mass;
  // Until a body is processed, its column holds the first moment of the links it carries, about the
  // origin of W; the base's is column 5.
  const auto column = [&](std::size_t i) { return out.col(static_cast<Eigen::Index>(i) + 5); };
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Isometry3d& X_WL = kinematics.X_WL(bodies_[i].link);
    column(i) = X_WL.linear() * bodies_[i].first_L + bodies_[i].mass * X_WL.translation();
  }
  for (std::size_t i = bodies_.size(); --i > 0;) {
    const Body& body = bodies_[i];
    const Isometry3d& X_WL = kinematics.X_WL(body.link);
    const Vector3d first = column(i), axis = X_WL.linear() * body.axis_L;
    column(static_cast<std::size_t>(body.parent)) += first;
    if (body.slides) {
      column(i) = body.subtree_mass * per_mass * axis;
    } else {
      column(i) = per_mass * axis.cross(Vector3d(first - body.subtree_mass * X_WL.translation()));
    }
  }
  const Vector3d com = per_mass * out.col(5);
  out.leftCols<3>().setIdentity();
  out.middleCols<3>(3) = -math::hat(com - kinematics.X_WL(0).translation());
}

Eigen::Vector2d zmp_of(const Wrench& ground, double ground_z) {
  const Vector3d &f = ground.force, &n = ground.moment;
  MIMESIS_ASSERT(f.z() > 0.0);
  return {(ground_z * f.x() - n.y()) / f.z(), (ground_z * f.y() + n.x()) / f.z()};
}

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
