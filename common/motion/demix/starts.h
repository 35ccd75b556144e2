#pragma once
#include <Eigen/Core>
#include <vector>

namespace mimesis::demix {

/// Where an alternation may begin.
struct Start {
  Eigen::MatrixXd sources;  ///< spectra, 2·half × count, unit columns
  bool search = true;       ///< delays are looked for; else they begin at 0
};

/// Starts for `count` sources of `data`. Free delays: harmonics 1..count [M18 3.3.3]: starts with
/// overtones or other harmonics were seen to end worse. Tied: weights have signs, so that two
/// sources of the same harmonic reach every phase of it, and how many harmonics deserve two is not
/// known beforehand; and the principal components.
/// @param by_energy  the strongest harmonics of the data instead of the lowest: for data that is
///   what given sources leave
std::vector<Start> starts(const Eigen::MatrixXd& data, Eigen::Index count, bool tied,
                          bool by_energy);

}  // namespace mimesis::demix
