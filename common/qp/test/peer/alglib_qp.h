#pragma once
#include "common/qp/dual_qp.h"

namespace mimesis::qp {

/// Solution of the problem by ALGLIB's dense interior-point solver; an empty vector if it does not
/// converge. ALGLIB is GPL: for tests and benchmarks only.
Eigen::VectorXd alglib_minimum(const Problem& problem, double precision = 1e-12);

}  // namespace mimesis::qp
