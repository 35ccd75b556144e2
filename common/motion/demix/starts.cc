#include "common/motion/demix/starts.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numeric>

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Harmonics in the order in which they are used, from 0.
std::vector<Index> ranking(const MatrixXd& data, bool by_energy) {
  const Index half = data.rows() / 2;
  const Eigen::VectorXd energy =
      data.topRows(half).rowwise().squaredNorm() + data.bottomRows(half).rowwise().squaredNorm();
  std::vector<Index> order(static_cast<std::size_t>(half));
  std::iota(order.begin(), order.end(), 0);
  if (by_energy) {
    std::ranges::stable_sort(order, [&](Index a, Index b) { return energy[a] > energy[b]; });
  }
  return order;
}

/// @param order  places in the ranking, from 1
Start harmonics(const std::vector<int>& order, const std::vector<Index>& ranks) {
  const auto half = static_cast<Index>(ranks.size());
  Start out{MatrixXd::Zero(2 * half, static_cast<Index>(order.size())), true};
  for (Index k = 0; k < out.sources.cols(); ++k) {
    const auto place = static_cast<std::size_t>(order[static_cast<std::size_t>(k)] - 1);
    out.sources(ranks[place % ranks.size()], k) = 1.0;
  }
  return out;
}

/// The first `doubled` harmonics twice, then the following ones once.
std::vector<int> with_pairs(Index count, Index doubled) {
  std::vector<int> order;
  for (int h = 1; static_cast<Index>(order.size()) < count; ++h) {
    order.push_back(h);
    if (h <= doubled && static_cast<Index>(order.size()) < count) order.push_back(h);
  }
  return order;
}

Start principal_components(const MatrixXd& data, Index count) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(data * data.transpose());
  return {solver.eigenvectors().rightCols(count).rowwise().reverse(), false};
}

}  // namespace

std::vector<Start> starts(const MatrixXd& data, Index count, bool tied, bool by_energy) {
  if (count == 0) return {{MatrixXd(data.rows(), 0), false}};
  const std::vector<Index> ranks = ranking(data, by_energy);
  std::vector<Start> out;
  out.push_back(harmonics(with_pairs(count, 0), ranks));
  if (!tied) return out;
  for (Index doubled = 1; doubled <= (count + 1) / 2; ++doubled) {
    if (with_pairs(count, doubled) == with_pairs(count, doubled - 1)) break;
    out.push_back(harmonics(with_pairs(count, doubled), ranks));
  }
  out.push_back(principal_components(data, count));
  return out;
}

}  // namespace mimesis::demix
