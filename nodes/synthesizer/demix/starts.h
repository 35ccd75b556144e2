#pragma once
#include <Eigen/Core>
#include <vector>

namespace mimesis::demix {

/// Where an alternation may begin.
struct Start {
  Eigen::MatrixXd sources;  ///< spectra, 2·half × count, unit columns
  bool search = true;       ///< delays are looked for; else they begin at 0
};

/// Starts for `count` sources beside the `given` ones (spectra, columns). Free delays: harmonics
/// 1..count [M18 3.3.3], which no other start was seen to beat. Tied: weights have signs, so that
/// two sources of the same harmonic reach every phase of it, and how many harmonics deserve two is
/// not known beforehand; and the principal components of what the given sources leave.
std::vector<Start> starts(const Eigen::MatrixXd& data, const Eigen::MatrixXd& given,
                          Eigen::Index count, bool tied);

}  // namespace mimesis::demix
