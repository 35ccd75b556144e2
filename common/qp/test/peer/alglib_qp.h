#pragma once
#include "common/qp/dual_qp.h"

namespace mimesis::qp {

/// The same problem by ALGLIB's dense interior-point solver. ALGLIB is GPL: for tests and
/// benchmarks only. An empty vector if it does not converge.
Eigen::VectorXd alglib_minimum(const Problem& problem, double precision = 1e-12);

}  // namespace mimesis::qp
