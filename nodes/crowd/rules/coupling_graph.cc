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
  return {n, topology, unit_edges(topology, n), false};
}

CouplingGraph CouplingGraph::weighted(int n, std::span<const Edge> edges, bool directed) {
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
    const std::pair<int, int> pair =
        directed ? std::pair(e.i, e.j) : std::pair<int, int>(std::minmax(e.i, e.j));
    if (!seen.insert(pair).second) throw ConfigError(what + " is given twice");
    if (e.weight > 0.0) kept.push_back(e);
  }
  return {n, Topology::weighted, kept, directed};
}

CouplingGraph::CouplingGraph(int n, Topology topology, std::span<const Edge> edges, bool directed)
    : n_(n), directed_(directed), topology_(topology), first_(static_cast<std::size_t>(n) + 1, 0) {
  for (const Edge& e : edges) {
    ++first_[static_cast<std::size_t>(e.i) + 1];
    if (!directed) ++first_[static_cast<std::size_t>(e.j) + 1];
  }
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  neighbours_.resize(directed ? edges.size() : 2 * edges.size());
  std::vector<int> next(first_.begin(), first_.end() - 1);
  const auto put = [&](int i, int j, double w) {
    neighbours_[static_cast<std::size_t>(next[static_cast<std::size_t>(i)]++)] = {j, w};
  };
  for (const Edge& e : edges) {
    put(e.i, e.j, e.weight);
    if (!directed) put(e.j, e.i, e.weight);
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

int CouplingGraph::reach(int from, bool hear) const {
  std::vector<std::vector<int>> next(static_cast<std::size_t>(n_));
  for (int i = 0; i < n_; ++i) {
    for (const Neighbour& other : neighbours(i)) {
      next[static_cast<std::size_t>(hear ? other.index : i)].push_back(hear ? i : other.index);
    }
  }
  std::vector<char> reached(static_cast<std::size_t>(n_), 0);
  std::vector<int> open{from};
  reached[static_cast<std::size_t>(from)] = 1;
  for (std::size_t k = 0; k < open.size(); ++k) {
    for (const int other : next[static_cast<std::size_t>(open[k])]) {
      if (!std::exchange(reached[static_cast<std::size_t>(other)], 1)) open.push_back(other);
    }
  }
  return static_cast<int>(open.size());
}

bool CouplingGraph::connected() const {
  if (n_ < 2 || complete() || reach(0, true) == n_) return true;
  if (!directed_) return false;
  // Whoever is heard by all is heard by agent 0: search on among those whom it hears.
  std::vector<int> open{0};
  std::vector<char> seen(static_cast<std::size_t>(n_), 0);
  while (!open.empty()) {
    const int i = open.back();
    open.pop_back();
    if (std::exchange(seen[static_cast<std::size_t>(i)], 1)) continue;
    if (reach(i, true) == n_) return true;
    for (const Neighbour& other : neighbours(i)) open.push_back(other.index);
  }
  return false;
}

bool CouplingGraph::strongly_connected() const {
  return n_ < 2 || complete() || (reach(0, true) == n_ && (!directed_ || reach(0, false) == n_));
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
