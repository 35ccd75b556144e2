#pragma once
#include <Eigen/Core>
#include <span>
#include <string_view>
#include <vector>

namespace mimesis::crowd {

enum class Topology { none, chain, ring, star, wheel, all_to_all, weighted };

/// "chain", "ring", ... as scenario files write them.
std::string_view to_string(Topology topology);

/// Edge; i ≠ j, from 0. In a directed graph it is Aᵢⱼ alone: i hears j.
struct Edge {
  int i = 0, j = 0;
  double weight = 1.0;
};

/// Coupling between agents with the weights A_ij ≥ 0 of an adjacency matrix, symmetric unless it is
/// made directed [M18 fig. 4.4, A.1]. All-to-all is not stored: its users take mean fields, O(N).
class CouplingGraph {
 public:
  struct Neighbour {
    int index;
    double weight;
  };

  /// Unit weights. Star and wheel have node 0 in the middle; a ring of two is the chain.
  /// @param n  ≥ 0; fewer than two nodes have no edges
  /// @throws ConfigError for n < 0, a wheel of fewer than four, and Topology::weighted
  static CouplingGraph make(Topology topology, int n);
  /// @throws ConfigError for an index outside [0, n), a loop, an edge given twice, and a weight
  ///         that is negative or not finite. Weight 0 is no edge.
  static CouplingGraph weighted(int n, std::span<const Edge> edges, bool directed = false);

  int size() const { return n_; }
  Topology topology() const { return topology_; }
  /// Every pair with weight one: use mean fields; `neighbours` is empty.
  bool complete() const { return topology_ == Topology::all_to_all; }
  std::span<const Neighbour> neighbours(int i) const;
  /// Σⱼ Aᵢⱼ
  double degree(int i) const;
  /// Somebody is heard by all, directly or through others; without directions all by all.
  bool connected() const;
  bool directed() const { return directed_; }
  /// All are heard by all [M18 eq. 4.28].
  bool strongly_connected() const;

  /// L = diag(A1) − A [M18 A.1], N×N. For certificates: O(N²) memory.
  Eigen::MatrixXd laplacian() const;

 private:
  CouplingGraph(int n, Topology topology, std::span<const Edge> edges, bool directed);
  /// Number of agents that hear `from`, or that it hears, itself too.
  int reach(int from, bool hear) const;

  int n_;
  bool directed_;
  Topology topology_;
  std::vector<int> first_;  // index of the first neighbour of i, n + 1 values
  std::vector<Neighbour> neighbours_;
};

}  // namespace mimesis::crowd
