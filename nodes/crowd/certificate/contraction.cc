#include "nodes/crowd/certificate/contraction.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "common/error.h"

namespace mimesis::crowd {

namespace {

using std::numbers::pi;
constexpr int kMostExact = 600, kMostTried = 30;
constexpr double kZero = 1e-12;  // share of λ_max: rounding of Eigen's zero eigenvalue

double squared_sine4(double angle) { return 4.0 * std::sin(angle) * std::sin(angle); }

/// λ⁺ without the link from i to `other`.
double connectivity_without(const CouplingGraph& graph, int i,
                            const CouplingGraph::Neighbour& other) {
  Eigen::MatrixXd laplacian = graph.laplacian();
  const int j = other.index;
  laplacian(i, i) -= other.weight;
  laplacian(j, j) -= other.weight;
  laplacian(i, j) = laplacian(j, i) = 0.0;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(laplacian, Eigen::EigenvaluesOnly);
  const double value = solver.eigenvalues()[1];
  return value > kZero * solver.eigenvalues().maxCoeff() ? value : 0.0;
}

/// Steps from node 0 to the farthest.
int eccentricity(const CouplingGraph& graph) {
  std::vector<int> steps(static_cast<std::size_t>(graph.size()), -1);
  std::vector<int> open{0};
  steps[0] = 0;
  for (std::size_t next = 0; next < open.size(); ++next) {
    const int i = open[next];
    for (const auto& other : graph.neighbours(i)) {
      int& far = steps[static_cast<std::size_t>(other.index)];
      if (far >= 0) continue;
      far = steps[static_cast<std::size_t>(i)] + 1;
      open.push_back(other.index);
    }
  }
  return steps[static_cast<std::size_t>(open.back())];
}

Extremes bounds(const CouplingGraph& graph) {
  double most = 0.0, least_weight = std::numeric_limits<double>::infinity();
  for (int i = 0; i < graph.size(); ++i) {
    for (const auto& other : graph.neighbours(i)) {
      most = std::max(most, graph.degree(i) + graph.degree(other.index));
      least_weight = std::min(least_weight, other.weight);
    }
  }
  const double least =
      graph.connected() ? 4.0 * least_weight / (2.0 * eccentricity(graph) * graph.size()) : 0.0;
  return {least, most, false};
}

/// πᵀL = 0, Σπ = 1, by elimination without differences [Grassmann, Taksar, Heyman 1985].
/// @pre strongly connected
Eigen::VectorXd left_null(const CouplingGraph& graph) {
  const int n = graph.size();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    for (const auto& other : graph.neighbours(i)) a(i, other.index) = other.weight;
  }
  for (int k = n - 1; k > 0; --k) {
    a.col(k).head(k) /= a.row(k).head(k).sum();
    a.topLeftCorner(k, k) += a.col(k).head(k) * a.row(k).head(k);
  }
  Eigen::VectorXd left = Eigen::VectorXd::Ones(n);
  for (int k = 1; k < n; ++k) left[k] = left.head(k).dot(a.col(k).head(k));
  return left / left.sum();
}

Extremes directed_extremes(const CouplingGraph& graph) {
  Extremes e{.directed = true};
  for (int i = 0; i < graph.size(); ++i) e.most = std::max(e.most, 2.0 * graph.degree(i));
  if (graph.size() > kMostExact || !graph.strongly_connected()) return e;
  const Eigen::VectorXd left = left_null(graph), root = left.cwiseSqrt();
  const Eigen::MatrixXd half =
      root.asDiagonal() * graph.laplacian() * root.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(0.5 * (half + half.transpose()),
                                                              Eigen::EigenvaluesOnly);
  const double value = solver.eigenvalues()[1];
  e.least = value > kZero * e.most ? value : 0.0;
  e.skew = std::sqrt(left.maxCoeff() / left.minCoeff());
  return e;
}

// limit of the search; larger graphs do not occur in one crowd
constexpr int kMostAgents = 1 << 24;

bool meets(Condition condition, double alpha, double beta) {
  return condition == Condition::weak ? weak_condition(alpha, beta)
                                      : theorem6_sum(alpha, beta) < 1.0;
}

}  // namespace

Extremes extremes(Topology topology, int n) {
  if (n < 2 || topology == Topology::none) return {};
  switch (topology) {
    case Topology::chain:
      return {squared_sine4(pi / (2.0 * n)), squared_sine4(pi * (n - 1) / (2.0 * n))};
    case Topology::ring:
      if (n == 2) return extremes(Topology::chain, n);
      return {squared_sine4(pi / n), squared_sine4(pi * (n / 2) / n)};
    case Topology::star:
      return {n == 2 ? 2.0 : 1.0, static_cast<double>(n)};
    case Topology::all_to_all:
      return {static_cast<double>(n), static_cast<double>(n)};
    case Topology::wheel:
      if (n < 4) throw ConfigError("a wheel has at least 4 nodes, not " + std::to_string(n));
      return {1.0 + squared_sine4(pi / (n - 1)), static_cast<double>(n)};
    default:
      throw ConfigError("the spectrum of a weighted graph needs its edges");
  }
}

Extremes extremes(const CouplingGraph& graph) {
  if (graph.topology() != Topology::weighted) return extremes(graph.topology(), graph.size());
  if (graph.size() < 2) return {};
  if (graph.directed()) return directed_extremes(graph);
  if (graph.size() > kMostExact) return bounds(graph);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(graph.laplacian(),
                                                              Eigen::EigenvaluesOnly);
  const Eigen::VectorXd& values = solver.eigenvalues();
  const double most = values[values.size() - 1];
  return {values[1] > kZero * most ? values[1] : 0.0, most};
}

double connectivity_without_link(const CouplingGraph& graph) {
  const int n = graph.size();
  if (n < 3 || graph.directed()) return 0.0;
  switch (graph.topology()) {
    case Topology::none:
    case Topology::chain:
    case Topology::star:
      return 0.0;
    case Topology::ring:
      return extremes(Topology::chain, n).least;
    case Topology::all_to_all:
      return n - 2.0;
    default:
      break;
  }
  if (n > kMostTried) {
    double most = 0.0;
    for (int i = 0; i < n; ++i) {
      for (const auto& other : graph.neighbours(i)) most = std::max(most, other.weight);
    }
    return std::max(0.0, extremes(graph).least - 2.0 * most);
  }
  double least = extremes(graph).least;
  for (int i = 0; i < n; ++i) {
    for (const auto& other : graph.neighbours(i)) {
      if (other.index > i) least = std::min(least, connectivity_without(graph, i, other));
    }
  }
  return least;
}

double theorem6_sum(double alpha, double beta) {
  const double zeta = half_range(alpha), eta = half_range(beta);
  return zeta * zeta + eta * eta;
}

std::optional<int> largest_agents(Topology topology, double beta, Condition condition) {
  const int first = topology == Topology::wheel ? 4 : 2;
  const auto good = [&](int n) { return meets(condition, extremes(topology, n).ratio(), beta); };
  MIMESIS_ASSERT(beta > 0.0 && good(first));
  // α falls as N grows: doubling, then bisection.
  int low = first, high = first;
  while (good(high)) {
    if (high >= kMostAgents) return std::nullopt;
    low = high;
    high *= 2;
  }
  while (high - low > 1) {
    const int middle = low + (high - low) / 2;
    (good(middle) ? low : high) = middle;
  }
  return low;
}

double least_gait_ratio(double alpha) {
  const double zeta = half_range(alpha);
  const double eta = std::sqrt(std::max(0.0, 1.0 - zeta * zeta));
  return half_range(eta);
}

double low_pass_rate(double m, double low_pass_rad_s, double g_least, double g_most,
                     double lambda_least, double lambda_most) {
  return std::min(m * g_least * lambda_least, low_pass_rad_s - m * g_most * lambda_most);
}

double late_rate(double rate_1_s, double stiffness_1_s, double age_s) {
  const double x = stiffness_1_s * age_s, off = 0.5 * x * x * (1.0 + x) * (1.0 + x);
  const double adds = stiffness_1_s * (2.0 * off + x * (1.0 + off));
  double low = 0.0, high = rate_1_s;
  if (!(adds < rate_1_s)) return 0.0;
  for (int i = 0; i < 60; ++i) {
    const double r = 0.5 * (low + high);
    (r <= rate_1_s - adds * std::exp(3.0 * age_s * r) ? low : high) = r;
  }
  return low;
}

double low_pass_mode_rate(double low_pass_rad_s, double slope_1_s) {
  const double inside = 1.0 - 4.0 * slope_1_s / low_pass_rad_s;
  return 0.5 * low_pass_rad_s * (1.0 - std::sqrt(std::max(0.0, inside)));
}

namespace {

double largest_size(const Eigen::Matrix2d& x) {
  const double half = 0.5 * x.trace(), root = half * half - x.determinant();
  return root > 0.0 ? std::abs(half) + std::sqrt(root) : std::sqrt(x.determinant());
}
double largest_size(const Eigen::Matrix3d& x) {
  return Eigen::EigenSolver<Eigen::Matrix3d>(x, false).eigenvalues().cwiseAbs().maxCoeff();
}

template <class Matrix>
double rate_of(const std::function<Matrix(double)>& a) {
  const int steps = std::clamp(static_cast<int>(40.0 * a(0.0).norm()), 256, 8192);
  const double h = 2.0 * pi / steps;
  Matrix x = Matrix::Identity(), to = a(0.0);
  double log_size = 0.0;
  for (int i = 0; i < steps; ++i) {
    const Matrix from = to, mid = a((i + 0.5) * h);
    to = a((i + 1.0) * h);
    const Matrix k1 = from * x, k2 = mid * (x + 0.5 * h * k1), k3 = mid * (x + 0.5 * h * k2),
                 k4 = to * (x + h * k3);
    x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    const double size = x.norm();
    log_size += std::log(size);
    x /= size;
  }
  const double rate = -(log_size + std::log(largest_size(x))) / (2.0 * pi);
  return std::isfinite(rate) ? rate : -std::numeric_limits<double>::infinity();
}

}  // namespace

double periodic_rate(const std::function<Eigen::Matrix2d(double phi_rad)>& a) { return rate_of(a); }
double periodic_rate_of_three(const std::function<Eigen::Matrix3d(double phi_rad)>& a) {
  return rate_of(a);
}

}  // namespace mimesis::crowd
