#include "common/robot/dynamics.h"

#include <cmath>

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

}  // namespace mimesis::robot
