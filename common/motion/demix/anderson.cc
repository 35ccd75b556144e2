#include "common/motion/demix/anderson.h"

#include <Eigen/Cholesky>

namespace mimesis::demix {

void Anderson::clear() {
  value_.clear();
  residual_.clear();
}

Eigen::MatrixXd Anderson::next(const Eigen::MatrixXd& x, const Eigen::MatrixXd& gx) {
  value_.emplace_back(gx.reshaped());
  residual_.emplace_back((gx - x).reshaped());
  if (value_.size() > memory_) {
    value_.pop_front();
    residual_.pop_front();
  }
  const auto past = static_cast<Eigen::Index>(value_.size()) - 1;
  if (past == 0) return gx;
  // min ‖rₙ − ΔR γ‖, next = gₙ − ΔG γ
  Eigen::MatrixXd dr(gx.size(), past), dg(gx.size(), past);
  for (Eigen::Index i = 0; i < past; ++i) {
    const auto j = static_cast<std::size_t>(i);
    dr.col(i) = residual_[j + 1] - residual_[j];
    dg.col(i) = value_[j + 1] - value_[j];
  }
  Eigen::MatrixXd normal = dr.transpose() * dr;
  normal.diagonal().array() += 1e-10 * normal.trace() + 1e-300;
  const Eigen::VectorXd gamma = normal.ldlt().solve(dr.transpose() * residual_.back());
  const Eigen::VectorXd mixed = value_.back() - dg * gamma;
  return mixed.reshaped(gx.rows(), gx.cols());
}

}  // namespace mimesis::demix
