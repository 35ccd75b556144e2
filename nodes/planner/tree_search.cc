#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "common/math/vector_clones.h"
#include "nodes/planner/path_search.h"

namespace mimesis::planner {
namespace {

constexpr double kDomain = 4.0, kLeastDomain = 1.0, kShrink = 1e-4;  // [steps], [steps], [1]
constexpr double kNearShare = 0.5, kNear = 2.0;  // of the samples are near a node, within [rad]
constexpr int kDetours = 16;                     // postures tried before trees grow
// Trees of few joints soon fill their space: the least postures judged, over 40 seeds.
constexpr Eigen::Index kFewJoints = 3;
constexpr double kNearOfFew = 3.0;
constexpr int kDetoursOfFew = 4;

using Ints = std::int32_t __attribute__((vector_size(4 * kLanes), aligned(4 * kLanes)));
/// On the stack, unlike VectorXd.
using Posture = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, BatchChecker::kMostJoints, 1>;

/// Uniform in [0, 1): splitmix64, which needs no warming up.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double operator()() {
    std::uint64_t x = state_ += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1.0p-53;
  }

 private:
  std::uint64_t state_;
};

struct Coordinate {
  Lanes of_nodes;
};

/// Index of the node nearest to q, the first of several. A block has all coordinates of kLanes
/// nodes.
MIMESIS_VECTOR_CLONES
int nearest(const std::vector<Coordinate>& blocks, const Posture& q) {
  const auto n = static_cast<std::size_t>(q.size());
  Lanes least = std::numeric_limits<float>::infinity() - Lanes{};
  Ints block{};
  for (std::size_t b = 0; b * n < blocks.size(); ++b) {
    Lanes squares{};
    for (std::size_t j = 0; j < n; ++j) {
      const Lanes d =
          blocks[b * n + j].of_nodes - static_cast<float>(q[static_cast<Eigen::Index>(j)]);
      squares += d * d;
    }
    const Ints nearer = squares < least;
    least = nearer ? squares : least;
    block = nearer ? static_cast<std::int32_t>(b) - Ints{} : block;
  }
  int best = 0;
  for (int lane = 1; lane < kLanes; ++lane) {
    const float here = least[lane], there = least[best];
    if (here < there || (here == there && block[lane] < block[best])) best = lane;
  }
  return kLanes * block[best] + best;
}

class Tree {
 public:
  explicit Tree(Eigen::Index n) {
    nodes_.reserve(64);
    blocks_.reserve(8 * static_cast<std::size_t>(n));
  }
  int add(const Posture& q, int parent) {
    const std::size_t lane = nodes_.size() % kLanes, n = static_cast<std::size_t>(q.size());
    if (lane == 0) {
      blocks_.resize(blocks_.size() + n, {std::numeric_limits<float>::infinity() - Lanes{}});
    }
    for (std::size_t j = 0; j < n; ++j) {
      blocks_[blocks_.size() - n + j].of_nodes[static_cast<int>(lane)] =
          static_cast<float>(q[static_cast<Eigen::Index>(j)]);
    }
    nodes_.push_back({q, parent});
    return size() - 1;
  }
  int nearest_to(const Posture& q) const { return nearest(blocks_, q); }
  int size() const { return static_cast<int>(nodes_.size()); }
  const Posture& node(int i) const { return nodes_[static_cast<std::size_t>(i)].q; }
  int parent(int i) const { return nodes_[static_cast<std::size_t>(i)].parent; }
  double& domain(int i) { return nodes_[static_cast<std::size_t>(i)].domain; }
  /// Forgets node i, which is not a root, and all that hangs on it.
  void cut(int i) {
    for (auto k = static_cast<std::size_t>(i); k < nodes_.size(); ++k) {
      Node& node = nodes_[k];
      if (k != static_cast<std::size_t>(i) &&
          (node.parent < i || !nodes_[static_cast<std::size_t>(node.parent)].cut))
        continue;
      node.cut = true;
      const auto n = static_cast<std::size_t>(node.q.size());
      blocks_[k / kLanes * n].of_nodes[static_cast<int>(k % kLanes)] =
          std::numeric_limits<float>::infinity();
    }
  }
  /// From node i to the root.
  std::vector<Eigen::VectorXd> branch(int i) const {
    std::vector<Eigen::VectorXd> path;
    for (; i >= 0; i = parent(i)) path.emplace_back(node(i));
    return path;
  }

 private:
  struct Node {
    Posture q;
    int parent = -1;
    double domain = std::numeric_limits<double>::infinity();  // of postures it is tried for [steps]
    bool cut = false;
  };
  std::vector<Node> nodes_;
  std::vector<Coordinate> blocks_;
};

using Way = std::vector<Eigen::VectorXd>;

class Trees {
 public:
  Trees(CollisionChecker& checker, const Eigen::VectorXd& start,
        std::span<const Eigen::VectorXd> goals, const TreeSettings& settings)
      : checker_(checker),
        arm_(checker.arm()),
        step_(settings.step_rad),
        near_(arm_.dof() <= kFewJoints ? kNearOfFew : kNear),
        detours_(arm_.dof() <= kFewJoints ? kDetoursOfFew : kDetours),
        most_(settings.max_branches),
        unit_(settings.seed),
        start_(start),
        goals_(goals),
        from_start_(arm_.dof()),
        from_goals_(arm_.dof()),
        sample_(arm_.dof()) {}

  /// A way by one posture only. Some of those that are tried are near the middle, some have each
  /// joint near where it starts or ends, some are anywhere.
  std::optional<Way> detour() {
    for (; tried_ < std::min(detours_, most_) && !stopped(); ++tried_) {
      const Eigen::VectorXd& goal = goals_[static_cast<std::size_t>(tried_) % goals_.size()];
      for (Eigen::Index j = 0; j < sample_.size(); ++j) {
        const double middle = 0.5 * (start_[j] + goal[j]), u = unit_();
        double q = 0.0;
        switch (tried_ % 4) {
          case 0:
            q = middle + 1.5 * (2.0 * u - 1.0);
            break;
          case 1:
            q = middle + 2.0 * (2.0 * u - 1.0);
            break;
          case 2:
            q = u < 0.5 ? start_[j] + (2.0 * u - 0.5) : goal[j] + (2.0 * u - 1.5);
            break;
          default:
            q = arm_.q_min[j] + u * (arm_.q_max[j] - arm_.q_min[j]);
        }
        sample_[j] = std::clamp(q, arm_.q_min[j], arm_.q_max[j]);
      }
      if (checker_.seems_free(start_, sample_) && checker_.seems_free(goal, sample_) &&
          checker_.certify(start_, sample_) && checker_.certify(sample_, goal))
        return Way{start_, sample_, goal};
    }
    return std::nullopt;
  }

  std::optional<Way> grow() {
    from_start_.add(start_, -1);
    for (const auto& goal : goals_) from_goals_.add(goal, -1);
    bool at_goals = false;  // whose turn it is
    for (; tried_ < most_ && !stopped(); ++tried_) {
      const int lead = from_start_.size() - from_goals_.size();
      at_goals = lead == 0 ? !at_goals : lead > 0;
      Tree &tree = at_goals ? from_goals_ : from_start_,
           &other = at_goals ? from_start_ : from_goals_;
      const int tip = branch(tree);
      if (tip < 0) continue;
      const int there = reach(other, tree.node(tip));
      if (there < 0) continue;
      if (!certify_branch(tree, tip) || !certify_branch(other, there)) continue;
      Way path = from_start_.branch(at_goals ? there : tip);
      std::reverse(path.begin(), path.end());
      Way rest = from_goals_.branch(at_goals ? tip : there);
      // Where they meet both have the node.
      std::move(rest.begin() + 1, rest.end(), std::back_inserter(path));
      return path;
    }
    return std::nullopt;
  }

 private:
  bool stopped() const { return checker_.interrupt().now(); }
  bool certify_branch(Tree& tree, int i) {
    for (; tree.parent(i) >= 0; i = tree.parent(i)) {
      if (checker_.certify(tree.node(tree.parent(i)), tree.node(i))) continue;
      tree.cut(i);
      return false;
    }
    return true;
  }
  /// A branch towards a random posture: its new node, or -1.
  int branch(Tree& tree) {
    const bool near_a_node = unit_() < kNearShare;
    if (near_a_node) sample_ = tree.node(static_cast<int>(unit_() * tree.size()));
    for (Eigen::Index j = 0; j < sample_.size(); ++j) {
      sample_[j] = near_a_node ? std::clamp(sample_[j] + near_ * (2.0 * unit_() - 1.0),
                                            arm_.q_min[j], arm_.q_max[j])
                               : arm_.q_min[j] + unit_() * (arm_.q_max[j] - arm_.q_min[j]);
    }
    const int near = tree.nearest_to(sample_);
    const Posture way = sample_ - tree.node(near);
    const double distance = way.norm();
    double& domain = tree.domain(near);
    if (distance > domain * step_) return -1;
    const Posture reached = tree.node(near) + std::min(1.0, step_ / distance) * way;
    if (!checker_.seems_free(tree.node(near), reached)) {
      domain = std::isinf(domain) ? kDomain : std::max(domain * (1.0 - kShrink), kLeastDomain);
      return -1;
    }
    domain *= 1.0 + kShrink;
    return tree.add(reached, near);
  }

  /// Straight from the nearest node to q, step by step: the node at q, or -1.
  int reach(Tree& tree, const Posture& q) {
    int at = tree.nearest_to(q);
    const Posture gap = q - tree.node(at);
    const int steps = std::max(1, static_cast<int>(std::ceil(gap.norm() / step_)));
    for (int i = 1; i <= steps; ++i, ++tried_) {
      const Posture next = i == steps ? q : Posture(tree.node(at) + gap / steps);
      if (!checker_.seems_free(tree.node(at), next)) return -1;
      at = tree.add(next, at);
    }
    return at;
  }

  CollisionChecker& checker_;
  const kin::ArmModel& arm_;
  double step_, near_;
  int detours_;
  int most_;
  Random unit_;
  const Eigen::VectorXd& start_;
  std::span<const Eigen::VectorXd> goals_;
  Tree from_start_, from_goals_;
  Posture sample_;
  int tried_ = 0;
};

}  // namespace

std::optional<Way> join_by_trees(CollisionChecker& checker, const Eigen::VectorXd& start,
                                 std::span<const Eigen::VectorXd> goals,
                                 const TreeSettings& settings) {
  Trees trees(checker, start, goals, settings);
  auto way = trees.detour();
  return way ? way : trees.grow();
}

}  // namespace mimesis::planner
