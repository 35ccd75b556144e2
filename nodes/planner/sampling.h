#pragma once
#include <Eigen/Core>
#include <cstdint>

namespace mimesis::planner {

/// Points 1..count of the Halton sequence in [0, 1)ⁿ, n ≤ 12, shifted on the torus by a vector
/// drawn from `seed`: even coverage at any count, another set for another seed. Columns are points.
Eigen::MatrixXd halton(int n, int count, std::uint64_t seed);

/// The same, scaled to [lo, hi] per coordinate.
Eigen::MatrixXd sample_box(const Eigen::VectorXd& lo, const Eigen::VectorXd& hi, int count,
                           std::uint64_t seed);

}  // namespace mimesis::planner
