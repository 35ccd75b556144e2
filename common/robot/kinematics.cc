#include "common/robot/kinematics.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "common/error.h"
#include "common/math/so3.h"

namespace mimesis::robot {

Kinematics::Kinematics(const RobotTree& tree)
    : tree_(&tree),
      X_WL_(tree.links().size(), Eigen::Isometry3d::Identity()),
      axis_W_(3, tree.dof()) {
  update(Eigen::Isometry3d::Identity(), Eigen::VectorXd::Zero(tree.dof()));
}

void Kinematics::update(const Eigen::Isometry3d& X_WB, const Eigen::Ref<const Eigen::VectorXd>& q) {
  MIMESIS_ASSERT(q.size() == tree_->dof());
  X_WL_[0] = X_WB;
  for (std::size_t i = 1; i < X_WL_.size(); ++i) {
    const Link& link = tree_->links()[i];
    Eigen::Isometry3d& X = X_WL_[i];
    X = X_WL_[static_cast<std::size_t>(link.parent)] * link.X_PJ;
    if (link.dof < 0) continue;
    axis_W_.col(link.dof) = X.linear() * link.axis;
    if (link.type == JointType::revolute) {
      X.linear() = X.linear() * math::exp_so3(q[link.dof] * link.axis);
    } else {
      X.translation() += q[link.dof] * axis_W_.col(link.dof);
    }
  }
}

Eigen::Vector3d Kinematics::com() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double mass = 0.0;
  for (std::size_t i = 0; i < X_WL_.size(); ++i) {
    const Inertia& inertia = tree_->links()[i].inertia;
    sum += inertia.mass_kg * (X_WL_[i] * inertia.com_m);
    mass += inertia.mass_kg;
  }
  MIMESIS_ASSERT(mass > 0.0);
  return sum / mass;
}

void Kinematics::jacobian(int link, const Eigen::Vector3d& p_W, Eigen::Ref<Jacobian> out) const {
  MIMESIS_ASSERT(out.cols() == 6 + tree_->dof());
  out.setZero();
  out.leftCols<6>().setIdentity();
  out.block<3, 3>(0, 3) = -math::hat(p_W - X_WL_[0].translation());
  for (int i = link; i > 0; i = tree_->link(i).parent) {
    const Link& carrier = tree_->link(i);
    if (carrier.dof < 0) continue;
    const Eigen::Vector3d axis = axis_W_.col(carrier.dof);
    auto column = out.col(6 + carrier.dof);
    if (carrier.type == JointType::revolute) {
      column.head<3>() = axis.cross(p_W - X_WL(i).translation());
      column.tail<3>() = axis;
    } else {
      column.head<3>() = axis;
    }
  }
}

std::optional<Eigen::Vector3d> meeting_point(std::span<const Line> lines, double tolerance_m) {
  // Least squares of the distances: Σ (1 − d dᵀ)(x − p) = 0
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Line& line : lines) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - line.direction * line.direction.transpose();
    A += across;
    b += across * line.point;
  }
  if (A.determinant() < 1e-9) return {};
  const Eigen::Vector3d x = A.ldlt().solve(b);
  for (const Line& line : lines) {
    if (line.direction.cross(x - line.point).norm() > tolerance_m) return {};
  }
  return x;
}

}  // namespace mimesis::robot
