#include "experiments/motion/svd.h"

#include <Eigen/SVD>

namespace mimesis::synthesizer {

Svd thin_svd(const Eigen::MatrixXd& a) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

}  // namespace mimesis::synthesizer
