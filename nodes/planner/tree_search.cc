#include "nodes/planner/tree_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "common/math/vector_clones.h"

namespace mimesis::planner {
namespace {

constexpr double kDomain = 4.0, kLeastDomain = 1.0, kShrink = 1e-4;  // [steps], [steps], [1]
constexpr double kNearShare = 0.5, kNear = 2.0;  // of the samples are near a node, within [rad]

/// |node − q|² of all nodes, coordinate after coordinate.
MIMESIS_VECTOR_CLONES
void add_squares(const float* coordinate, std::size_t count, float q, float* sums) {
  for (std::size_t i = 0; i < count; ++i) {
    const float d = coordinate[i] - q;
    sums[i] += d * d;
  }
}

class Tree {
 public:
  explicit Tree(Eigen::Index dof) : coordinates_(static_cast<std::size_t>(dof)) {}

  int add(const Eigen::VectorXd& q, int parent) {
    nodes_.push_back({q, parent});
    for (std::size_t j = 0; j < coordinates_.size(); ++j)
      coordinates_[j].push_back(static_cast<float>(q[static_cast<Eigen::Index>(j)]));
    return size() - 1;
  }
  int nearest(const Eigen::VectorXd& q) {
    squares_.assign(nodes_.size(), 0.0f);
    for (std::size_t j = 0; j < coordinates_.size(); ++j) {
      add_squares(coordinates_[j].data(), nodes_.size(),
                  static_cast<float>(q[static_cast<Eigen::Index>(j)]), squares_.data());
    }
    return static_cast<int>(std::min_element(squares_.begin(), squares_.end()) - squares_.begin());
  }
  int size() const { return static_cast<int>(nodes_.size()); }
  const Eigen::VectorXd& node(int i) const { return nodes_[static_cast<std::size_t>(i)].q; }
  double& domain(int i) { return nodes_[static_cast<std::size_t>(i)].domain; }
  /// From node i to the root.
  std::vector<Eigen::VectorXd> branch(int i) const {
    std::vector<Eigen::VectorXd> path;
    for (; i >= 0; i = nodes_[static_cast<std::size_t>(i)].parent) path.push_back(node(i));
    return path;
  }

 private:
  struct Node {
    Eigen::VectorXd q;
    int parent = -1;
    double domain = std::numeric_limits<double>::infinity();  // of postures it is tried for [steps]
  };
  std::vector<Node> nodes_;
  std::vector<std::vector<float>> coordinates_;
  std::vector<float> squares_;
};

using Way = std::vector<Eigen::VectorXd>;

class Trees {
 public:
  Trees(CollisionChecker& checker, const Eigen::VectorXd& start,
        std::span<const Eigen::VectorXd> goals, const TreeSettings& settings)
      : checker_(checker),
        arm_(checker.arm()),
        step_(settings.step_rad),
        most_(settings.max_branches),
        random_(settings.seed),
        from_start_(arm_.dof()),
        from_goals_(arm_.dof()),
        sample_(arm_.dof()) {
    from_start_.add(start, -1);
    for (const auto& goal : goals) from_goals_.add(goal, -1);
  }

  std::optional<Way> grow() {
    bool at_goals = false;  // whose turn it is
    for (; tried_ < most_; ++tried_) {
      const int lead = from_start_.size() - from_goals_.size();
      at_goals = lead == 0 ? !at_goals : lead > 0;
      Tree &tree = at_goals ? from_goals_ : from_start_,
           &other = at_goals ? from_start_ : from_goals_;
      const int tip = branch(tree);
      if (tip < 0) continue;
      const int there = reach(other, tree.node(tip));
      if (there < 0) continue;
      Way path = from_start_.branch(at_goals ? there : tip);
      std::reverse(path.begin(), path.end());
      const Way rest = from_goals_.branch(at_goals ? tip : there);
      // Where they meet both have the node.
      path.insert(path.end(), rest.begin() + 1, rest.end());
      return path;
    }
    return std::nullopt;
  }

 private:
  /// A branch towards a random posture: its new node, or -1.
  int branch(Tree& tree) {
    const bool near_a_node = unit() < kNearShare;
    if (near_a_node) sample_ = tree.node(static_cast<int>(unit() * tree.size()));
    for (Eigen::Index j = 0; j < sample_.size(); ++j) {
      sample_[j] = near_a_node ? std::clamp(sample_[j] + kNear * (2.0 * unit() - 1.0),
                                            arm_.q_min[j], arm_.q_max[j])
                               : arm_.q_min[j] + unit() * (arm_.q_max[j] - arm_.q_min[j]);
    }
    const int near = tree.nearest(sample_);
    const Eigen::VectorXd way = sample_ - tree.node(near);
    const double distance = way.norm();
    double& domain = tree.domain(near);
    if (distance > domain * step_) return -1;
    const Eigen::VectorXd reached = tree.node(near) + std::min(1.0, step_ / distance) * way;
    if (!checker_.certify(tree.node(near), reached)) {
      domain = std::isinf(domain) ? kDomain : std::max(domain * (1.0 - kShrink), kLeastDomain);
      return -1;
    }
    domain *= 1.0 + kShrink;
    return tree.add(reached, near);
  }

  /// Straight from the nearest node to q, step by step: the node at q, or -1.
  int reach(Tree& tree, const Eigen::VectorXd& q) {
    int at = tree.nearest(q);
    const Eigen::VectorXd gap = q - tree.node(at);
    const int steps = std::max(1, static_cast<int>(std::ceil(gap.norm() / step_)));
    for (int i = 1; i <= steps; ++i, ++tried_) {
      const Eigen::VectorXd next = i == steps ? q : tree.node(at) + gap / steps;
      if (!checker_.certify(tree.node(at), next)) return -1;
      at = tree.add(next, at);
    }
    return at;
  }

  double unit() { return std::ldexp(static_cast<double>(random_() >> 11), -53); }

  CollisionChecker& checker_;
  const kin::ArmModel& arm_;
  double step_;
  int most_;
  std::mt19937_64 random_;
  Tree from_start_, from_goals_;
  Eigen::VectorXd sample_;
  int tried_ = 0;
};

}  // namespace

std::optional<Way> join_by_trees(CollisionChecker& checker, const Eigen::VectorXd& start,
                                 std::span<const Eigen::VectorXd> goals,
                                 const TreeSettings& settings) {
  return Trees(checker, start, goals, settings).grow();
}

}  // namespace mimesis::planner
