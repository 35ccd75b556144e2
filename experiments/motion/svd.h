#pragma once
#include <Eigen/Core>

namespace mimesis::synthesizer {

/// A = U diag(s) Vᵀ with as many columns as the smaller side of A, s falling.
struct Svd {
  Eigen::MatrixXd U;
  Eigen::VectorXd s;
  Eigen::MatrixXd V;
};

/// By Jacobi rotations. Compiled once: Eigen's decomposition takes 20 s wherever it is used.
Svd thin_svd(const Eigen::MatrixXd& a);

}  // namespace mimesis::synthesizer
