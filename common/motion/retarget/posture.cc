#include "common/motion/retarget/posture.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace mimesis::retarget {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

Posture advance(const Posture& posture, const Eigen::Ref<const VectorXd>& step) {
  Posture out = posture;
  out.X_WB.translation() += step.head<3>();
  // By way of a quaternion: a rotation stays one after thousands of steps
  const Eigen::Matrix3d R = math::exp_so3(step.segment<3>(3)) * posture.X_WB.linear();
  out.X_WB.linear() = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  out.q += step.tail(posture.q.size());
  return out;
}

VectorXd difference(const Posture& from, const Posture& to) {
  VectorXd step(6 + from.q.size());
  step << to.X_WB.translation() - from.X_WB.translation(),
      math::log_so3(to.X_WB.linear() * from.X_WB.linear().transpose()), to.q - from.q;
  return step;
}

GoalErrors errors(const robot::Kinematics& kinematics, const std::vector<Goal>& goals) {
  Index rows = 0;
  for (const Goal& g : goals) {
    rows += (g.position_weight > 0.0 ? 3 : 0) + (g.orientation_weight > 0.0 ? 3 : 0);
  }
  const Index columns = 6 + kinematics.tree().dof();
  GoalErrors out{VectorXd(rows), MatrixXd(rows, columns)};
  robot::Jacobian J(6, columns);
  Index row = 0;
  for (const Goal& g : goals) {
    const Eigen::Isometry3d X_WE = kinematics.X_WL(g.link) * g.X_LE;
    kinematics.jacobian(g.link, X_WE.translation(), J);
    if (g.position_weight > 0.0) {
      out.error.segment<3>(row) = g.position_weight * (g.X_WE.translation() - X_WE.translation());
      out.jacobian.middleRows<3>(row) = g.position_weight * J.topRows<3>();
      row += 3;
    }
    if (g.orientation_weight > 0.0) {
      out.error.segment<3>(row) =
          g.orientation_weight * math::log_so3(g.X_WE.linear() * X_WE.linear().transpose());
      out.jacobian.middleRows<3>(row) = g.orientation_weight * J.bottomRows<3>();
      row += 3;
    }
  }
  return out;
}

NullSpace::NullSpace(const MatrixXd& jacobian, const std::vector<bool>& locked)
    : jacobian_(jacobian) {
  const Index n = jacobian.cols();
  std::vector<Index> free;
  for (Index c = 0; c < n; ++c) {
    if (locked[static_cast<std::size_t>(c)]) {
      jacobian_.col(c).setZero();
    } else {
      free.push_back(c);
    }
  }
  const auto count = static_cast<Index>(free.size());
  MatrixXd transposed(count, jacobian.rows());
  for (Index i = 0; i < count; ++i) {
    transposed.row(i) = jacobian.col(free[static_cast<std::size_t>(i)]).transpose();
  }
  // What is perpendicular to all rows of J: the last columns of Q of Jᵀ = Q R
  Eigen::ColPivHouseholderQR<MatrixXd> qr(transposed);
  qr.setThreshold(1e-10);
  const Index rank = qr.rank();
  MatrixXd last = MatrixXd::Zero(count, count - rank);
  last.bottomRows(count - rank).setIdentity();
  last.applyOnTheLeft(qr.householderQ());
  basis_ = MatrixXd::Zero(n, count - rank);
  for (Index i = 0; i < count; ++i) basis_.row(free[static_cast<std::size_t>(i)]) = last.row(i);
}

VectorXd NullSpace::reach(const VectorXd& wanted, double damping) const {
  MatrixXd square = jacobian_ * jacobian_.transpose();
  square.diagonal().array() += damping;
  return jacobian_.transpose() * square.ldlt().solve(wanted);
}

LimitBarrier::LimitBarrier(const robot::RobotTree& tree)
    : lower_(tree.lower()), upper_(tree.upper()), margin_(lower_.size()) {
  for (Index i = 0; i < margin_.size(); ++i) {
    margin_[i] = std::min(0.15, 0.2 * (upper_[i] - lower_[i]));
  }
}

namespace {

constexpr double kNearest = 0.02;  // of the margin

double barrier(double share) {
  const double d = std::max(share, kNearest);
  return d >= 1.0 ? 0.0 : d - 1.0 - std::log(d) + (1.0 - 1.0 / d) * (share - d);
}

}  // namespace

double LimitBarrier::value(const VectorXd& q) const {
  double sum = 0.0;
  for (Index i = 0; i < q.size(); ++i) {
    sum += barrier((q[i] - lower_[i]) / margin_[i]) + barrier((upper_[i] - q[i]) / margin_[i]);
  }
  return sum;
}

void LimitBarrier::derivatives(const VectorXd& q, VectorXd& first, VectorXd& second) const {
  first.setZero(q.size());
  second.setZero(q.size());
  for (Index i = 0; i < q.size(); ++i) {
    for (const double sign : {1.0, -1.0}) {  // towards the lower, the upper limit
      const double distance = sign > 0.0 ? q[i] - lower_[i] : upper_[i] - q[i];
      const double d = std::max(distance / margin_[i], kNearest);
      if (d >= 1.0) continue;
      first[i] += sign * (1.0 - 1.0 / d) / margin_[i];
      second[i] += 1.0 / (d * d * margin_[i] * margin_[i]);
    }
  }
}

}  // namespace mimesis::retarget
