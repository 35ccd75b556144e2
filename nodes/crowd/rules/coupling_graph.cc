#include "nodes/crowd/rules/coupling_graph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "common/error.h"

namespace mimesis::crowd {
namespace {

constexpr std::array<std::string_view, 7> kNames = {"none",  "chain",      "ring",    "star",
                                                    "wheel", "all_to_all", "weighted"};

std::vector<Edge> unit_edges(Topology topology, int n) {
  std::vector<Edge> edges;
  const bool spokes = topology == Topology::star || topology == Topology::wheel;
  if (topology == Topology::chain || topology == Topology::ring) {
    for (int i = 0; i + 1 < n; ++i) edges.push_back({i, i + 1});
    if (topology == Topology::ring && n > 2) edges.push_back({n - 1, 0});
  }
  if (spokes) {
    for (int i = 1; i < n; ++i) edges.push_back({0, i});
  }
  if (topology == Topology::wheel) {
    for (int i = 1; i + 1 < n; ++i) edges.push_back({i, i + 1});
    edges.push_back({n - 1, 1});
  }
  return edges;
}

}  // namespace

std::string_view to_string(Topology topology) {
  return kNames.at(static_cast<std::size_t>(topology));
}

CouplingGraph CouplingGraph::make(Topology topology, int n) {
  if (n < 0) throw ConfigError("a coupling graph of " + std::to_string(n) + " nodes");
  if (topology == Topology::weighted) {
    throw ConfigError("a weighted coupling graph is made of its edges");
  }
  if (topology == Topology::wheel && n < 4) {
    throw ConfigError("a wheel has at least 4 nodes, not " + std::to_string(n));
  }
  return {n, topology, unit_edges(topology, n)};
}

CouplingGraph CouplingGraph::weighted(int n, std::span<const Edge> edges) {
  if (n < 0) throw ConfigError("a coupling graph of " + std::to_string(n) + " nodes");
  std::set<std::pair<int, int>> seen;
  std::vector<Edge> kept;
  for (const Edge& e : edges) {
    const std::string what = "edge " + std::to_string(e.i) + " - " + std::to_string(e.j);
    if (std::min(e.i, e.j) < 0 || std::max(e.i, e.j) >= n) {
      throw ConfigError(what + ": nodes are 0 to " + std::to_string(n - 1));
    }
    if (e.i == e.j) throw ConfigError(what + ": a node is not coupled to itself");
    if (!std::isfinite(e.weight) || e.weight < 0.0) {
      throw ConfigError(what + ": weight " + std::to_string(e.weight) +
                        " must be finite and not negative, for contraction");
    }
    if (!seen.insert(std::minmax(e.i, e.j)).second) throw ConfigError(what + " is given twice");
    if (e.weight > 0.0) kept.push_back(e);
  }
  return {n, Topology::weighted, kept};
}

CouplingGraph::CouplingGraph(int n, Topology topology, std::span<const Edge> edges)
    : n_(n), topology_(topology), first_(static_cast<std::size_t>(n) + 1, 0) {
  for (const Edge& e : edges) {
    ++first_[static_cast<std::size_t>(e.i) + 1];
    ++first_[static_cast<std::size_t>(e.j) + 1];
  }
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  neighbours_.resize(2 * edges.size());
  std::vector<int> next(first_.begin(), first_.end() - 1);
  const auto put = [&](int i, int j, double w) {
    neighbours_[static_cast<std::size_t>(next[static_cast<std::size_t>(i)]++)] = {j, w};
  };
  for (const Edge& e : edges) {
    put(e.i, e.j, e.weight);
    put(e.j, e.i, e.weight);
  }
}

std::span<const CouplingGraph::Neighbour> CouplingGraph::neighbours(int i) const {
  const auto k = static_cast<std::size_t>(i);
  const auto begin = static_cast<std::size_t>(first_[k]);
  return {neighbours_.data() + begin, static_cast<std::size_t>(first_[k + 1]) - begin};
}

double CouplingGraph::degree(int i) const {
  if (complete()) return n_ - 1;
  double sum = 0.0;
  for (const Neighbour& other : neighbours(i)) sum += other.weight;
  return sum;
}

bool CouplingGraph::connected() const {
  if (n_ < 2 || complete()) return true;
  std::vector<char> reached(static_cast<std::size_t>(n_), 0);
  std::vector<int> open{0};
  reached[0] = 1;
  int count = 1;
  while (!open.empty()) {
    const int i = open.back();
    open.pop_back();
    for (const Neighbour& other : neighbours(i)) {
      if (std::exchange(reached[static_cast<std::size_t>(other.index)], 1)) continue;
      open.push_back(other.index);
      ++count;
    }
  }
  return count == n_;
}

Eigen::MatrixXd CouplingGraph::laplacian() const {
  if (complete()) {
    return n_ * Eigen::MatrixXd::Identity(n_, n_) - Eigen::MatrixXd::Ones(n_, n_);
  }
  Eigen::MatrixXd laplacian = Eigen::MatrixXd::Zero(n_, n_);
  for (int i = 0; i < n_; ++i) {
    laplacian(i, i) = degree(i);
    for (const Neighbour& other : neighbours(i)) laplacian(i, other.index) = -other.weight;
  }
  return laplacian;
}

}  // namespace mimesis::crowd
