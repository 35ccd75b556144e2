#pragma once
#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

namespace mimesis::planner {

/// Link to a neighbouring node.
struct Link {
  int to = 0;
  double length = 0.0;  ///< d(i, j), Euclidean in joint space [rad]
};

/// links[i]: the neighbours of node i, nearest first. Symmetric: every link is stored at both ends.
using Linkage = std::vector<std::vector<Link>>;

/// The m nearest neighbours of every column of `nodes`, nearest first, exact (ties by index). O(N²
/// n).
Linkage nearest_neighbours(const Eigen::MatrixXd& nodes, int m);

/// Keeps the first k of every list and adds the reverse of every link that has none.
Linkage symmetrised(const Linkage& lists, int k);

/// Removes every link (i, j) that is the long side of an obtuse triangle of links:
/// d_ij² > d_jk² + d_ki² for some common neighbour k. All candidates are found before any is
/// removed.
Linkage pruned(const Linkage& links);

/// Cluster index of every node, clusters numbered by their lowest node. Nodes with `inhibited[i]`
/// (empty: none) belong to no cluster: -1.
std::vector<int> clusters(const Linkage& links, std::span<const char> inhibited = {});

/// Adds, for every pair of disjoint clusters that the extended lists connect, their shortest such
/// link.
void join_clusters(Linkage& links, const Linkage& extended);

/// The connection structure of the roadmap [M18 2.3.2]: 2k nearest neighbours stored, the first k
/// of them symmetrised, triangles pruned, clusters joined.
Linkage connect(const Eigen::MatrixXd& nodes, int k);

}  // namespace mimesis::planner
