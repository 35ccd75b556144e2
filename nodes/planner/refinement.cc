#include "nodes/planner/refinement.h"

#include <algorithm>
#include <span>

namespace mimesis::planner {
namespace {

struct Mean {
  Eigen::VectorXd sum;
  int count = 0;
};

Mean mean_in_window(const Eigen::MatrixXd& nodes, std::span<const char> inhibited, char wanted,
                    Eigen::Index center, double window) {
  Mean mean{Eigen::VectorXd::Zero(nodes.rows()), 0};
  for (Eigen::Index j = 0; j < nodes.cols(); ++j) {
    if (j == center || inhibited[static_cast<std::size_t>(j)] != wanted) continue;
    bool inside = true;
    for (Eigen::Index row = 0; row < nodes.rows() && inside; ++row) {
      inside = std::abs(nodes(row, j) - nodes(row, center)) <= window;
    }
    if (!inside) continue;
    mean.sum += nodes.col(j);
    ++mean.count;
  }
  return mean;
}

Eigen::VectorXd shift(const Eigen::MatrixXd& nodes, std::span<const char> inhibited, Eigen::Index i,
                      double window) {
  Eigen::VectorXd v = Eigen::VectorXd::Zero(nodes.rows());
  const Mean others = mean_in_window(nodes, inhibited, 1, i, window);
  const Mean active = mean_in_window(nodes, inhibited, 0, i, window);
  if (others.count > 0) v += nodes.col(i) - others.sum / others.count;
  if (active.count > 0) v += active.sum / active.count - nodes.col(i);
  const double longest = v.cwiseAbs().maxCoeff();
  if (longest > window) v *= window / longest;
  return v;
}

}  // namespace

std::vector<double> refine_offline(Eigen::MatrixXd& nodes, const Eigen::VectorXd& lo,
                                   const Eigen::VectorXd& hi, const FreePosture& free,
                                   const RefinementSettings& settings) {
  const auto count = static_cast<std::size_t>(nodes.cols());
  std::vector<char> inhibited(count);
  for (std::size_t i = 0; i < count; ++i)
    inhibited[i] = !free(nodes.col(static_cast<Eigen::Index>(i)));

  std::vector<double> shares;
  for (int iteration = 0;; ++iteration) {
    const auto bad = std::count(inhibited.begin(), inhibited.end(), 1);
    shares.push_back(static_cast<double>(bad) /
                     static_cast<double>(std::max<std::size_t>(count, 1)));
    if (shares.back() < settings.inhibited_share || iteration >= settings.max_iterations) break;
    Eigen::MatrixXd moved = nodes;
    for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
      if (!inhibited[static_cast<std::size_t>(i)]) continue;
      moved.col(i) = (nodes.col(i) + shift(nodes, inhibited, i, settings.window_rad))
                         .cwiseMax(lo)
                         .cwiseMin(hi);
    }
    nodes.swap(moved);
    for (std::size_t i = 0; i < count; ++i) {
      if (inhibited[i]) inhibited[i] = !free(nodes.col(static_cast<Eigen::Index>(i)));
    }
  }

  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    if (!inhibited[static_cast<std::size_t>(i)]) nodes.col(kept++) = nodes.col(i);
  }
  nodes.conservativeResize(Eigen::NoChange, kept);
  return shares;
}

}  // namespace mimesis::planner
