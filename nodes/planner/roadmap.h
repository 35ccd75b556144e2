#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "nodes/planner/collision.h"
#include "nodes/planner/smooth_path.h"

namespace mimesis::planner {

/// Points 1..count of the Halton sequence in [0, 1)ⁿ, n ≤ 12, shifted on the torus by a vector
/// drawn from `seed`: even coverage at any count, another set for another seed. Columns are points.
/// Here and below: interrupted, the rest of the result is empty or 0.
Eigen::MatrixXd halton(int n, int count, std::uint64_t seed, const Interrupt& interrupt = {});

/// The points of halton(), scaled to [lo, hi] per coordinate.
Eigen::MatrixXd sample_box(const Eigen::VectorXd& lo, const Eigen::VectorXd& hi, int count,
                           std::uint64_t seed, const Interrupt& interrupt = {});

struct Neighbour {
  int to = 0;
  double length = 0.0;  ///< d(i, j), Euclidean in joint space [rad]
};

/// lists[i]: the neighbours of node i, nearest first.
using NeighbourLists = std::vector<std::vector<Neighbour>>;

struct Link {
  int to = 0;
  float weight = 0.0f;  ///< exp(−length) [1]
};

/// The links of a finished roadmap, one node's behind the other's as waves read them, nearest
/// first. Symmetric: every link is stored at both ends.
class Linkage {
 public:
  Linkage() = default;
  Linkage(const NeighbourLists& lists, const Interrupt& interrupt = {});

  std::span<const Link> operator[](std::size_t i) const {
    return {links_.data() + begin_[i], begin_[i + 1] - begin_[i]};
  }
  std::size_t size() const { return begin_.size() - 1; }

 private:
  std::vector<std::size_t> begin_{0};
  std::vector<Link> links_;
};

/// The m nearest neighbours of every column of `nodes`, nearest first, exact (ties by index). O(N²
/// n).
NeighbourLists nearest_neighbours(const Eigen::MatrixXd& nodes, int m,
                                  const Interrupt& interrupt = {});

/// Keeps the first k of every list and adds the reverse of every link that has none.
NeighbourLists symmetrised(const NeighbourLists& lists, int k, const Interrupt& interrupt = {});

/// Removes every link (i, j) that is the long side of an obtuse triangle of links:
/// d_ij² > d_jk² + d_ki² for some common neighbour k. All candidates are found before any is
/// removed.
NeighbourLists pruned(const NeighbourLists& links, const Interrupt& interrupt = {});

/// Cluster index of every node, clusters numbered by their lowest node. Nodes with `inhibited[i]`
/// (empty: none) belong to no cluster: -1.
std::vector<int> clusters(const Linkage& links, std::span<const char> inhibited = {});

/// Adds, for every pair of disjoint clusters that the extended lists connect, their shortest such
/// link that is accepted (empty: all are).
void join_clusters(NeighbourLists& links, const NeighbourLists& extended,
                   const std::function<bool(int, int)>& accept = {},
                   const Interrupt& interrupt = {});

/// The connection structure of the roadmap [M18 2.3.2]: 2k nearest neighbours stored, the first k
/// of them symmetrised, triangles pruned, links that are not accepted cut (empty: none), clusters
/// joined.
Linkage connect(const Eigen::MatrixXd& nodes, int k,
                const std::function<bool(int, int)>& accept = {}, const Interrupt& interrupt = {});

struct RoadmapSettings {
  int nodes = 2500;    ///< sampled over the joint limits; the thesis: two to three thousand [1]
  int neighbours = 4;  ///< k [1]
  std::uint64_t seed = 1;
  RefinementSettings refinement;
};

/// Network of postures that covers the joint space [M18 2.3.2]. Every node was free when it was
/// built, every link certified; what has moved since then is checked when a path needs it.
class Roadmap {
 public:
  Roadmap() = default;
  /// @param inhibited_share  per iteration of the off-line refinement [1]
  Roadmap(Eigen::MatrixXd nodes, Linkage links, std::vector<double> inhibited_share = {})
      : nodes_(std::move(nodes)),
        by_joint_(nodes_.transpose().cast<float>()),
        links_(std::move(links)),
        inhibited_share_(std::move(inhibited_share)) {}

  const Eigen::MatrixXd& nodes() const { return nodes_; }  ///< n × N [rad]
  int size() const { return static_cast<int>(nodes_.cols()); }
  const Linkage& links() const { return links_; }
  const std::vector<double>& inhibited_share() const { return inhibited_share_; }
  /// |node − q|² of all nodes, in single precision, into the first N of `squared` [rad²].
  void squared_distances(const Eigen::VectorXd& q, Eigen::VectorXf& squared) const;

 private:
  Eigen::MatrixXd nodes_;
  Eigen::MatrixXf by_joint_;  // N × n, for distances to all nodes at once
  Linkage links_;
  std::vector<double> inhibited_share_;
};

/// Samples, adds `more` postures (columns; from inverse kinematics), refines against the obstacles
/// of `checker`, connects. Equal arguments give equal bits. If the checker is interrupted, the
/// roadmap is of no use.
Roadmap build_roadmap(CollisionChecker& checker, const Eigen::MatrixXd& more,
                      const RoadmapSettings& settings);

/// The last part of it: refines the nodes against the obstacles of `checker`, connects.
Roadmap refined_roadmap(CollisionChecker& checker, Eigen::MatrixXd nodes,
                        const RoadmapSettings& settings);

}  // namespace mimesis::planner
