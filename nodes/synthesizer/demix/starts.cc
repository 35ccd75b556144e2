#include "nodes/synthesizer/demix/starts.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

Start harmonics(const std::vector<int>& order, Index half) {
  Start out{MatrixXd::Zero(2 * half, static_cast<Index>(order.size())), true};
  for (Index k = 0; k < out.sources.cols(); ++k) {
    out.sources((order[static_cast<std::size_t>(k)] - 1) % half, k) = 1.0;
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

Start principal_components(const MatrixXd& data, const MatrixXd& given, Index count) {
  MatrixXd rest = data;
  if (given.cols() > 0) {
    const MatrixXd basis =
        given.householderQr().householderQ() * MatrixXd::Identity(given.rows(), given.cols());
    rest -= basis * (basis.transpose() * data);
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(rest * rest.transpose());
  return {solver.eigenvectors().rightCols(count).rowwise().reverse(), false};
}

}  // namespace

std::vector<Start> starts(const MatrixXd& data, const MatrixXd& given, Index count, bool tied) {
  const Index half = data.rows() / 2;
  if (count == 0) return {{MatrixXd(data.rows(), 0), false}};
  std::vector<Start> out;
  out.push_back(harmonics(with_pairs(count, 0), half));
  if (!tied) return out;
  for (Index doubled = 1; doubled <= (count + 1) / 2; ++doubled) {
    if (with_pairs(count, doubled) == with_pairs(count, doubled - 1)) break;
    out.push_back(harmonics(with_pairs(count, doubled), half));
  }
  out.push_back(principal_components(data, given, count));
  return out;
}

}  // namespace mimesis::demix
