#pragma once
#include <Eigen/Core>
#include <deque>

namespace mimesis::demix {

/// Anderson's acceleration of a fixed point iteration x ← g(x): the next x is the affine
/// combination of the last values g(xᵢ) whose residuals g(xᵢ) − xᵢ cancel best. [Walker & Ni 2011]
class Anderson {
 public:
  explicit Anderson(int memory) : memory_(static_cast<std::size_t>(memory)) {}
  /// @param x   where the iteration was @param gx  g(x), of the same size
  Eigen::MatrixXd next(const Eigen::MatrixXd& x, const Eigen::MatrixXd& gx);
  std::size_t size() const { return value_.size(); }  ///< values in memory
  void clear();

 private:
  std::size_t memory_;
  std::deque<Eigen::VectorXd> value_, residual_;
};

}  // namespace mimesis::demix
