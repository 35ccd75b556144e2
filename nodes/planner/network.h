#pragma once
#include <functional>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "nodes/planner/path_search.h"

namespace mimesis::planner {

/// A roadmap in use for one query: nodes come, links are certified when a path wants them, or cut.
class Network {
 public:
  Network(CollisionChecker& checker, const PostureCost& cost) : checker_(checker), cost_(cost) {}

  /// Takes over all nodes and links of a roadmap; nodes that are not free now are inhibited.
  void take(const Roadmap& roadmap);
  /// Adds a node that is free and links it with its `m` nearest active nodes. Returns its index.
  int add(const Eigen::VectorXd& q, int m);
  /// Waves and backward searches until every link of the path is certified; links that are not are
  /// cut. Empty if the wave does not arrive or `waves` are used up.
  std::vector<int> search(int start, std::span<const int> goals, int& waves);
  /// New free nodes around the links cut since the last call, and around random nodes of the
  /// clusters of start and goals; the latter are linked half to their own cluster, half out of it.
  void grow(int start, std::span<const int> goals, int m, std::mt19937_64& random);

  const Eigen::VectorXd& node(int i) const { return nodes_[static_cast<std::size_t>(i)]; }
  const std::vector<Link>& links(int i) const { return links_[static_cast<std::size_t>(i)]; }
  int size() const { return static_cast<int>(nodes_.size()); }
  int links_checked() const { return links_checked_; }

 private:
  using Pair = std::pair<int, int>;
  bool certified(int a, int b);
  void cut(int a, int b);
  using Accept = std::function<bool(int)>;
  std::vector<Link> nearest(const Eigen::VectorXd& q, int m, const Accept& accept) const;
  int add(const Eigen::VectorXd& q, std::vector<Link> links);
  std::optional<Eigen::VectorXd> free_near(const Eigen::VectorXd& center, double sigma,
                                           std::mt19937_64& random);
  void grow_at_cut_links(int m, std::mt19937_64& random);
  void grow_regions(int start, std::span<const int> goals, int m, std::mt19937_64& random);

  CollisionChecker& checker_;
  const PostureCost& cost_;
  std::vector<Eigen::VectorXd> nodes_;
  Linkage links_;
  std::vector<char> inhibited_;
  std::vector<double> node_cost_;
  std::set<Pair> certified_;
  std::vector<Pair> cut_;  // since the last growth
  int links_checked_ = 0;
};

}  // namespace mimesis::planner
