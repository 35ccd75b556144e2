#include "nodes/planner/path_search.h"

#include <algorithm>
#include <numeric>

#include "nodes/planner/network.h"
#include "nodes/planner/shortcut.h"

namespace mimesis::planner {
namespace {

constexpr std::size_t kStraightTries = 4;  // goals, nearest first, tried on the straight line

/// The postures of one iteration of the on-line refinement: the path nodes and their active
/// neighbours, for each path node and pair of its neighbours the mean of the three, and the middles
/// of path links.
std::vector<Eigen::VectorXd> refined_set(const Network& network, std::span<const int> path) {
  std::vector<int> kept(path.begin(), path.end());
  for (const int i : path) {
    for (const Link& link : network.links(i)) {
      if (std::find(kept.begin(), kept.end(), link.to) == kept.end()) kept.push_back(link.to);
    }
  }
  std::vector<Eigen::VectorXd> postures;
  for (const int i : kept) postures.push_back(network.node(i));
  for (const int i : path) {
    const auto& links = network.links(i);
    for (std::size_t a = 0; a < links.size(); ++a) {
      for (std::size_t b = a + 1; b < links.size(); ++b) {
        postures.push_back(
            (network.node(i) + network.node(links[a].to) + network.node(links[b].to)) / 3.0);
      }
    }
  }
  for (std::size_t i = 1; i < path.size(); ++i) {
    postures.push_back(0.5 * (network.node(path[i - 1]) + network.node(path[i])));
  }
  return postures;
}

std::vector<Eigen::VectorXd> postures_of(const Network& network, std::span<const int> path) {
  std::vector<Eigen::VectorXd> postures;
  for (const int i : path) postures.push_back(network.node(i));
  return postures;
}

/// Nodes of `postures` that are free, connected anew; the path's ends are nodes `start` and `goal`
/// of it.
Roadmap local_roadmap(CollisionChecker& checker, const std::vector<Eigen::VectorXd>& postures,
                      std::size_t path_size, int k) {
  Roadmap local;
  local.nodes.resize(checker.arm().dof(), static_cast<Eigen::Index>(postures.size()));
  Eigen::Index count = 0;
  for (std::size_t i = 0; i < postures.size(); ++i) {
    if (i < path_size || checker.free(postures[i])) local.nodes.col(count++) = postures[i];
  }
  local.nodes.conservativeResize(Eigen::NoChange, count);
  local.links = connect(local.nodes, k);
  return local;
}

/// Plans again in the refined neighbourhood of the path; keeps what is shorter.
std::vector<Eigen::VectorXd> refine_online(const Network& whole, std::vector<int> path,
                                           CollisionChecker& checker, const PostureCost& cost,
                                           const SearchSettings& settings) {
  std::vector<Eigen::VectorXd> best = postures_of(whole, path);
  std::vector<Eigen::VectorXd> set = refined_set(whole, path);
  for (int iteration = 0; iteration < settings.online_refinements; ++iteration) {
    Network local(checker, cost);
    local.take(local_roadmap(checker, set, path.size(), settings.neighbours));
    const int goal =
        static_cast<int>(path.size()) - 1;  // the path's nodes are the first ones of the set
    int waves = settings.max_waves;
    path = local.search(0, std::span(&goal, 1), waves);
    if (path.empty()) break;
    const std::vector<Eigen::VectorXd> found = postures_of(local, path);
    if (path_length(found) < path_length(best)) best = found;
    set = refined_set(local, path);
  }
  return best;
}

std::string why_blocked(CollisionChecker& checker, std::span<const Eigen::VectorXd> goals) {
  if (goals.empty()) return "no posture reaches the goal";
  const auto contact = checker.contact(goals.front());
  return "every posture at the goal is in collision, e.g. " +
         contact.value_or("outside the limits");
}

}  // namespace

double path_length(std::span<const Eigen::VectorXd> waypoints) {
  double sum = 0.0;
  for (std::size_t i = 1; i < waypoints.size(); ++i)
    sum += (waypoints[i] - waypoints[i - 1]).norm();
  return sum;
}

tl::expected<FoundPath, Status> find_path(const Roadmap& roadmap, CollisionChecker& checker,
                                          const Eigen::VectorXd& start,
                                          std::span<const Eigen::VectorXd> goals,
                                          const PostureCost& cost, const SearchSettings& settings) {
  if (const auto contact = checker.contact(start)) {
    return tl::unexpected(Status{"the start posture is in collision: " + *contact});
  }
  std::vector<std::size_t> open;  // goals that are free, nearest first
  for (std::size_t i = 0; i < goals.size(); ++i) {
    if (checker.free(goals[i])) open.push_back(i);
  }
  if (open.empty()) return tl::unexpected(Status{why_blocked(checker, goals)});
  std::stable_sort(open.begin(), open.end(), [&](std::size_t a, std::size_t b) {
    return (goals[a] - start).norm() < (goals[b] - start).norm();
  });

  const auto certify = [&](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    return checker.certify(a, b);
  };
  FoundPath found;
  for (std::size_t i = 0; i < std::min(kStraightTries, open.size()); ++i) {
    if (!certify(start, goals[open[i]])) continue;
    found.waypoints = {start, goals[open[i]]};
    found.goal = static_cast<int>(open[i]);
    return found;
  }

  Network network(checker, cost);
  network.take(roadmap);
  const int begin = network.add(start, 2 * settings.neighbours);
  std::vector<int> ends;
  for (const std::size_t i : open) ends.push_back(network.add(goals[i], 2 * settings.neighbours));

  std::mt19937_64 random(settings.seed);
  int waves = settings.max_waves;
  std::vector<int> path = network.search(begin, ends, waves);
  for (int rescue = 0; path.empty() && rescue < settings.rescues && waves > 0; ++rescue) {
    network.grow(begin, ends, 2 * settings.neighbours, random);
    path = network.search(begin, ends, waves);
  }
  if (path.empty()) {
    return tl::unexpected(Status{waves > 0 ? "start and goal are not connected by free postures"
                                           : "no path within the allowed effort"});
  }
  found.waves = settings.max_waves - waves + 1;
  found.links_checked = network.links_checked();
  found.nodes = network.size();
  found.goal = static_cast<int>(open[static_cast<std::size_t>(
      std::find(ends.begin(), ends.end(), path.back()) - ends.begin())]);
  found.waypoints = shortened(refine_online(network, path, checker, cost, settings), certify,
                              settings.shortcuts, settings.seed);
  return found;
}

}  // namespace mimesis::planner
