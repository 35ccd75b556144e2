#include "nodes/cognition/bundles.h"

namespace mimesis::cognition {

int Bundles::add(const Eigen::MatrixXd& motion) {
  int nearest = -1;
  double least_rad = radius_rad_;
  for (std::size_t i = 0; i < all_.size(); ++i) {
    const Eigen::MatrixXd& mean = all_[i].mean;
    if (mean.rows() != motion.rows() || mean.cols() != motion.cols()) return -1;
    const double apart_rad = (mean - motion).colwise().norm().mean();
    if (apart_rad > least_rad) continue;
    least_rad = apart_rad;
    nearest = static_cast<int>(i);
  }
  if (nearest < 0 && all_.size() == most_) return -1;
  if (nearest < 0) {
    nearest = static_cast<int>(all_.size());
    all_.push_back({Eigen::MatrixXd::Zero(motion.rows(), motion.cols()), 0});
  }
  Bundle& bundle = all_[static_cast<std::size_t>(nearest)];
  bundle.mean += (motion - bundle.mean) / ++bundle.motions;
  return nearest;
}

}  // namespace mimesis::cognition
