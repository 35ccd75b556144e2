#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "common/error.h"
#include "nodes/planner/collision.h"
#include "nodes/planner/roadmap.h"

namespace mimesis::planner {

/// Excitation of a wave that started at the goals.
struct Wave {
  std::vector<double> v;     ///< excitation vᵢ on the ways to the start, else 0 [1]
  std::vector<int> arrival;  ///< time step at which the wave reached i, negative: never
  bool reached = false;      ///< it reached the start
};

/// Wave expansion [M18 2.3.2]: v = 1 at the goals at t = 0; each step an inactive node i that is
/// not inhibited and has active neighbours becomes active with vᵢ(t) = Σⱼ vⱼ(t−1) w(i, j), w(i, j)
/// = exp(−cᵢⱼ d(i, j)); active nodes do not interact. Stops when the start is active. cᵢⱼ =
/// (cost[i] + cost[j]) / 2 is 1 everywhere, or less in regions that F5 prefers (the cost reading of
/// pre-selection: a cheaper link is a stronger one); `cost` may be empty. O(links). Interrupted, it
/// does not reach the start.
Wave expand_wave(const Linkage& links, std::span<const char> inhibited,
                 std::span<const double> cost, int start, std::span<const int> goals,
                 const Interrupt& interrupt = {});

/// Backward search: from the start always to the maximally excited neighbour among those the wave
/// passed one step before, down to a goal. Empty if the wave did not reach the start.
std::vector<int> follow_wave(const Linkage& links, const Wave& wave, int start);

/// What looks for a way where the straight line is not free.
enum class Search : std::uint8_t {
  waves,  ///< waves on the roadmap alone
  trees,  ///< two trees alone
  both,   ///< trees where waves do not arrive
};
/// What a path was found by.
enum class FoundBy : std::uint8_t { line, waves, trees };

struct SearchSettings {
  Search by = Search::both;
  int neighbours = 4;          ///< k for nodes added to the roadmap [1]
  int online_refinements = 2;  ///< iterations around the found path [1]
  int max_waves = 300;         ///< effort: each wave that fails costs one link [1]
  int max_branches = 50'000;   ///< effort of the trees where the network is torn [1]
  int shortcuts = 150;         ///< attempts to shorten the path [1]
  int repeats = 0;             ///< more searches, with the next seeds; the shortest path counts [1]
  std::uint64_t seed = 1;
};

/// A path of certified straight parts in joint space.
struct FoundPath {
  std::vector<Eigen::VectorXd> waypoints;  ///< [rad]
  int goal = 0;                            ///< which of the goals it ends in
  int waves = 0;                           ///< sent; 0: none were needed, or no roadmap given
  FoundBy by = FoundBy::line;
  int links_checked = 0;
  int nodes = 0;  ///< number of nodes of the network at the end
};

/// Link cost of postures: 1, or less in regions that F5 prefers (see wave.h). May be empty.
using PostureCost = std::function<double(const Eigen::VectorXd&)>;

/// Finds a path from `start` to any of `goals` that `checker` certifies:
/// straight line if free, else waves on the roadmap, links of the found path certified, failing
/// ones cut, until a whole path stands; on-line refinement around it [M18 2.3.2]; shortcuts. Where
/// the network is torn or there is none, trees (join_by_trees) search without it, if they may.
/// Failure: a reason in words (start or goals in collision and with what, effort exhausted). When
/// the checker is interrupted, the search ends with the path that it has, or fails.
/// @param free  the nodes of the roadmap, as free_columns of the checker judges them; empty: a node
///   is judged when a path needs it
tl::expected<FoundPath, Status> find_path(const Roadmap& roadmap, CollisionChecker& checker,
                                          const Eigen::VectorXd& start,
                                          std::span<const Eigen::VectorXd> goals,
                                          const PostureCost& cost, const SearchSettings& settings,
                                          std::span<const char> free = {});

/// Why none of these postures is free: "all 8 are inhibited: ball 12 (fore) touches the bar",
/// with a count for each obstacle if there are several.
std::string why_inhibited(CollisionChecker& checker, std::span<const Eigen::VectorXd> postures);

/// Σ |qᵢ₊₁ − qᵢ| [rad].
double path_length(std::span<const Eigen::VectorXd> waypoints);

/// A roadmap in use for one query: nodes are added; nodes are judged and links certified when a
/// path needs them, or cut. Nothing of the roadmap is copied but what changes.
class Network {
 public:
  Network(CollisionChecker& checker, const PostureCost& cost) : checker_(checker), cost_(cost) {}

  /// All nodes and links of a roadmap, which must outlive the network; before any node is added.
  /// @param free  as in find_path
  void take(const Roadmap& roadmap, std::span<const char> free = {});
  void take(Roadmap&&, std::span<const char> = {}) = delete;
  /// Adds a node that is free and links it with its `m` nearest active nodes. Returns its index.
  int add(const Eigen::VectorXd& q, int m);
  /// Waves, each with a backward search along links that are proven free, until one gets to a goal;
  /// links that are not are cut. The first node of a path that is not free has all nodes judged.
  /// Empty if the wave does not arrive or `waves` are used up.
  std::vector<int> search(int start, std::span<const int> goals, int& waves);

  Eigen::VectorXd node(int i) const {
    return i < taken_ ? Eigen::VectorXd(roadmap_->nodes().col(i))
                      : added_[static_cast<std::size_t>(i - taken_)];
  }
  std::span<const Link> links(int i) const {
    const int own = own_links_[static_cast<std::size_t>(i)];
    if (own < 0) return roadmap_->links()[static_cast<std::size_t>(i)];
    return changed_[static_cast<std::size_t>(own)];
  }
  int size() const { return taken_ + static_cast<int>(added_.size()); }
  int links_checked() const { return links_checked_; }

 private:
  using Pair = std::pair<int, int>;
  std::vector<int> follow_proven(Wave& wave, int start);
  bool certified(int a, int b);
  void cut(int a, int b);
  std::vector<Link>& own_links(int i);
  void judge_all();
  void set_judged(std::span<const char> free);
  std::vector<int> nearest(const Eigen::VectorXd& q, int m) const;
  CollisionChecker& checker_;
  const PostureCost& cost_;
  const Roadmap* roadmap_ = nullptr;
  int taken_ = 0;
  std::vector<Eigen::VectorXd> added_;
  std::vector<int> own_links_;  // of each node the index in changed_, -1: as in the roadmap
  std::vector<std::vector<Link>> changed_;
  std::vector<char> inhibited_;  // as far as they are judged
  bool all_judged_ = false;
  std::vector<double> node_cost_;
  std::set<Pair> certified_;
  int links_checked_ = 0;
};

/// On-line refinement [M18 2.3.2, fig. 2.14]: plans again among means of the path's nodes and their
/// neighbours, `online_refinements` times; keeps the shortest path.
std::vector<Eigen::VectorXd> refine_online(const Network& whole, std::vector<int> path,
                                           CollisionChecker& checker, const PostureCost& cost,
                                           const SearchSettings& settings);

struct TreeSettings {
  double step_rad = 2.0;      ///< longest branch that is tried at once [rad]
  int max_branches = 50'000;  ///< effort: branches tried [1]
  std::uint64_t seed = 1;
};

/// Path of certified straight parts from `start` to one of `goals`: by one posture, if one of the
/// few that are tried will do, else by two trees that grow towards random postures and towards each
/// other (RRT-Connect, Kuffner & LaValle 2000). A node whose branches failed is tried for near
/// postures only (dynamic domain, Yershova et al. 2005). Branches are sampled; those of a path are
/// certified when it is found, and cut off if they touch. Where the roadmap is torn, the trees are
/// the new nodes that are "introduced whenever needed" [M18 2.3.2]. Empty if the effort is
/// exhausted, or the checker interrupted. Equal arguments give equal bits.
std::optional<std::vector<Eigen::VectorXd>> join_by_trees(CollisionChecker& checker,
                                                          const Eigen::VectorXd& start,
                                                          std::span<const Eigen::VectorXd> goals,
                                                          const TreeSettings& settings);

}  // namespace mimesis::planner
