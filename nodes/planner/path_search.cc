#include "nodes/planner/path_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "nodes/planner/smooth_path.h"

namespace mimesis::planner {
namespace {

std::size_t at(int node) { return static_cast<std::size_t>(node); }

/// `links_of(i)`: the links of node i.
template <class LinksOf>
Wave expanded(const LinksOf& links_of, std::span<const char> inhibited,
              std::span<const double> cost, int start, std::span<const int> goals,
              const Interrupt& interrupt) {
  constexpr int kOpen = -1, kInhibited = -2;
  Wave wave{std::vector<double>(inhibited.size(), 0.0), std::vector<int>(inhibited.size()), false};
  std::ranges::transform(inhibited, wave.arrival.begin(),
                         [=](char one) { return one ? kInhibited : kOpen; });
  std::vector<int> passed;  // in the order of their arrival
  passed.reserve(inhibited.size());
  for (const int goal : goals) {
    if (wave.arrival[at(goal)] != kOpen) continue;
    wave.arrival[at(goal)] = 0;
    wave.v[at(goal)] = 1.0;
    passed.push_back(goal);
  }
  for (std::size_t k = 0; k < passed.size() && wave.arrival[at(start)] < 0; ++k) {
    if (k % 256 == 0 && interrupt.now()) return wave;
    const int next = wave.arrival[at(passed[k])] + 1;
    for (const Link& link : links_of(passed[k])) {
      int& arrival = wave.arrival[at(link.to)];
      if (arrival != kOpen) continue;
      arrival = next;
      passed.push_back(link.to);
    }
  }
  wave.reached = wave.arrival[at(start)] >= 0;
  if (!wave.reached) return wave;

  // Only the nodes that the wave passed on its ways to the start matter to a backward search.
  std::vector<int>& ways = passed;
  ways.assign(1, start);
  for (std::size_t k = 0; k < ways.size(); ++k) {
    const int before = wave.arrival[at(ways[k])] - 1;
    for (const Link& link : links_of(ways[k])) {
      if (wave.arrival[at(link.to)] != before || wave.v[at(link.to)] > 0.0) continue;
      wave.v[at(link.to)] = 1.0;
      ways.push_back(link.to);
    }
  }
  // All active neighbours of a node that joins became active one step before.
  for (auto way = ways.rbegin(); way != ways.rend(); ++way) {
    const int i = *way;
    if (wave.arrival[at(i)] == 0) continue;
    double sum = 0.0;
    for (const Link& link : links_of(i)) {
      if (wave.arrival[at(link.to)] != wave.arrival[at(i)] - 1) continue;
      const double c = cost.empty() ? 1.0 : 0.5 * (cost[at(i)] + cost[at(link.to)]);
      const double weight = c == 1.0 ? double{link.weight} : std::pow(double{link.weight}, c);
      sum += wave.v[at(link.to)] * weight;
    }
    wave.v[at(i)] = sum;
  }
  return wave;
}

/// For a node that the wave reached at `arrival`: the neighbour with the most excitation among
/// those that the wave passed one step before; -1: none.
int strongest_before(std::span<const Link> links, const Wave& wave, int arrival) {
  int best = -1;
  for (const Link& link : links) {
    if (wave.arrival[at(link.to)] != arrival - 1) continue;
    if (best < 0 || wave.v[at(link.to)] > wave.v[at(best)]) best = link.to;
  }
  return best;
}

template <class LinksOf>
std::vector<int> followed(const LinksOf& links_of, const Wave& wave, int start) {
  if (!wave.reached) return {};
  std::vector<int> path{start};
  for (int i = start; wave.arrival[at(i)] > 0;)
    path.push_back(i = strongest_before(links_of(i), wave, wave.arrival[at(i)]));
  return path;
}

constexpr int kFewBranches = 500;          // of trees
constexpr std::size_t kStraightTries = 4;  // goals, nearest first, tried on the straight line

/// The postures of one iteration of the on-line refinement: the path nodes and their active
/// neighbours, for each path node and pair of its neighbours the mean of the three, and the middles
/// of path links.
std::vector<Eigen::VectorXd> refined_set(const Network& network, std::span<const int> path,
                                         const Interrupt& interrupt) {
  std::vector<int> kept(path.begin(), path.end());
  for (const int i : path) {
    for (const Link& link : network.links(i)) {
      if (std::find(kept.begin(), kept.end(), link.to) == kept.end()) kept.push_back(link.to);
    }
  }
  std::vector<Eigen::VectorXd> postures;
  for (const int i : kept) postures.push_back(network.node(i));
  for (const int i : path) {
    if (interrupt.now()) break;
    const auto links = network.links(i);
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

/// Free nodes of `postures`, connected again; the path's ends are nodes `start` and `goal` of it.
Roadmap local_roadmap(CollisionChecker& checker, const std::vector<Eigen::VectorXd>& postures,
                      std::size_t path_size, int k) {
  Eigen::MatrixXd nodes(checker.arm().dof(), std::ssize(postures));
  Eigen::Index count = 0;
  for (std::size_t i = 0; i < postures.size(); ++i) {
    if (i < path_size || checker.free(postures[i])) nodes.col(count++) = postures[i];
  }
  nodes.conservativeResize(Eigen::NoChange, count);
  Linkage links = connect(nodes, k, {}, checker.interrupt());
  return {std::move(nodes), std::move(links)};
}

}  // namespace

Wave expand_wave(const Linkage& links, std::span<const char> inhibited,
                 std::span<const double> cost, int start, std::span<const int> goals,
                 const Interrupt& interrupt) {
  return expanded([&](int i) { return links[at(i)]; }, inhibited, cost, start, goals, interrupt);
}

std::vector<int> follow_wave(const Linkage& links, const Wave& wave, int start) {
  return followed([&](int i) { return links[at(i)]; }, wave, start);
}

std::string why_inhibited(CollisionChecker& checker, std::span<const Eigen::VectorXd> postures) {
  std::map<std::string, std::pair<int, std::string>> by_obstacle;  // how often, the first contact
  for (const auto& q : postures) {
    if (checker.interrupt().told()) break;
    const std::string contact = checker.contact(q).value_or("nothing touches");
    const auto verb = contact.find(" touches ");
    auto& [count, first] = by_obstacle[contact.substr(verb == std::string::npos ? 0 : verb)];
    if (count++ == 0) first = contact;
  }
  std::string why = postures.size() == 1
                        ? "the only one is inhibited"
                        : "all " + std::to_string(postures.size()) + " are inhibited";
  std::string before = ": ";
  for (const auto& [obstacle, contacts] : by_obstacle) {
    why += before + contacts.second;
    if (by_obstacle.size() > 1) why += " (" + std::to_string(contacts.first) + ")";
    before = "; ";
  }
  return why;
}

double path_length(std::span<const Eigen::VectorXd> waypoints) {
  double sum = 0.0;
  for (std::size_t i = 1; i < waypoints.size(); ++i)
    sum += (waypoints[i] - waypoints[i - 1]).norm();
  return sum;
}

namespace {

/// What the straight motions touch most; empty if nothing is seen to.
std::string on_the_straight_way(CollisionChecker& checker, const Eigen::VectorXd& start,
                                std::span<const Eigen::VectorXd> goals) {
  constexpr int kParts = 64;
  std::map<std::string, int> touched;
  for (const Eigen::VectorXd& goal : goals) {
    for (int i = 1; i < kParts; ++i) {
      const double share = static_cast<double>(i) / kParts;
      if (const auto contact = checker.contact((1.0 - share) * start + share * goal))
        ++touched[*contact];
    }
  }
  const auto most = std::ranges::max_element(touched, {}, [](const auto& of) { return of.second; });
  return touched.empty() ? "" : "; on the straight way " + most->first;
}

tl::expected<FoundPath, Status> find_one(const Roadmap& roadmap, CollisionChecker& checker,
                                         const Eigen::VectorXd& start,
                                         std::span<const Eigen::VectorXd> goals,
                                         const PostureCost& cost, const SearchSettings& settings,
                                         std::span<const char> free_nodes) {
  Eigen::MatrixXd asked(start.size(), 1 + std::ssize(goals));  // judged at once
  asked.col(0) = start;
  for (std::size_t i = 0; i < goals.size(); ++i)
    asked.col(1 + static_cast<Eigen::Index>(i)) = goals[i];
  const std::vector<char> free = checker.free_columns(asked);
  const Interrupt& interrupt = checker.interrupt();
  if (interrupt.told()) return tl::unexpected(interrupt.reason());
  if (!free.front())
    return tl::unexpected(
        Status{"the start posture is in collision: " + checker.contact(start).value_or("")});
  std::vector<std::size_t> open;  // goals that are free, nearest first
  for (std::size_t i = 0; i < goals.size(); ++i) {
    if (free[i + 1]) open.push_back(i);
  }
  if (goals.empty()) return tl::unexpected(Status{"no posture reaches the goal"});
  if (open.empty())
    return tl::unexpected(Status{"of the postures at the goal " + why_inhibited(checker, goals)});
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

  if (roadmap.size() > 0 && settings.by != Search::trees) {
    Network network(checker, cost);
    network.take(roadmap, free_nodes);
    const int begin = network.add(start, 2 * settings.neighbours);
    std::vector<int> ends;
    for (const std::size_t i : open) {
      if (interrupt.told()) break;
      ends.push_back(network.add(goals[i], 2 * settings.neighbours));
    }
    int waves = settings.max_waves;
    const std::vector<int> path = network.search(begin, ends, waves);
    found.waves = settings.max_waves - waves + 1;
    found.links_checked = network.links_checked();
    found.nodes = network.size();
    if (!path.empty()) found.waypoints = refine_online(network, path, checker, cost, settings);
    found.by = FoundBy::waves;
  }
  if (found.waypoints.empty() && settings.by == Search::waves && !interrupt.told())
    return tl::unexpected(Status{"no wave arrives within the allowed effort"});
  if (found.waypoints.empty()) {
    std::vector<Eigen::VectorXd> ends;
    for (const std::size_t i : open) ends.push_back(goals[i]);
    // With parts it takes long to exhaust all effort: first ask whether there can be a way at all.
    TreeSettings effort{.max_branches = settings.max_branches, .seed = settings.seed};
    if (checker.has_parts()) effort.max_branches = std::min(kFewBranches, effort.max_branches);
    auto path = join_by_trees(checker, start, ends, effort);
    std::string why;
    if (!path && effort.max_branches < settings.max_branches && !interrupt.told()) {
      for (const Eigen::VectorXd& end : ends)
        if (why = checker.torn(start, end); why.empty()) break;
      effort.max_branches = settings.max_branches;
      if (why.empty()) path = join_by_trees(checker, start, ends, effort);
    }
    if (!path) {
      if (interrupt.told()) return tl::unexpected(interrupt.reason());
      return tl::unexpected(Status{why.empty() ? "no path within the allowed effort" +
                                                     on_the_straight_way(checker, start, ends)
                                               : "no path: " + why});
    }
    found.waypoints = std::move(*path);
    found.by = FoundBy::trees;
  }
  found.goal = static_cast<int>(std::find(goals.begin(), goals.end(), found.waypoints.back()) -
                                goals.begin());
  if (settings.shortcuts > 0)
    found.waypoints = shortened(std::move(found.waypoints), certify, settings.shortcuts,
                                settings.seed, interrupt);
  return found;
}

}  // namespace

tl::expected<FoundPath, Status> find_path(const Roadmap& roadmap, CollisionChecker& checker,
                                          const Eigen::VectorXd& start,
                                          std::span<const Eigen::VectorXd> goals,
                                          const PostureCost& cost, const SearchSettings& settings,
                                          std::span<const char> free) {
  auto best = find_one(roadmap, checker, start, goals, cost, settings, free);
  SearchSettings other = settings;
  for (int i = 0; best && best->waypoints.size() > 2 && i < settings.repeats; ++i) {
    if (checker.interrupt().told()) break;
    ++other.seed;
    auto found = find_one(roadmap, checker, start, goals, cost, other, free);
    if (found && path_length(found->waypoints) < path_length(best->waypoints))
      best = std::move(found);
  }
  return best;
}

std::vector<Eigen::VectorXd> refine_online(const Network& whole, std::vector<int> path,
                                           CollisionChecker& checker, const PostureCost& cost,
                                           const SearchSettings& settings) {
  std::vector<Eigen::VectorXd> best = postures_of(whole, path);
  if (settings.online_refinements == 0) return best;
  std::vector<Eigen::VectorXd> set = refined_set(whole, path, checker.interrupt());
  for (int iteration = 0; iteration < settings.online_refinements && !checker.interrupt().now();
       ++iteration) {
    const Roadmap around = local_roadmap(checker, set, path.size(), settings.neighbours);
    Network local(checker, cost);
    local.take(around);
    const int goal =
        static_cast<int>(path.size()) - 1;  // the path's nodes are the first ones of the set
    int waves = settings.max_waves;
    path = local.search(0, std::span(&goal, 1), waves);
    if (path.empty()) break;
    const std::vector<Eigen::VectorXd> found = postures_of(local, path);
    if (path_length(found) < path_length(best)) best = found;
    set = refined_set(local, path, checker.interrupt());
  }
  return best;
}

void Network::take(const Roadmap& roadmap, std::span<const char> free) {
  MIMESIS_ASSERT(size() == 0);
  roadmap_ = &roadmap;
  taken_ = roadmap.size();
  own_links_.assign(at(taken_), -1);
  inhibited_.assign(at(taken_), 0);
  if (!free.empty()) set_judged(free);
  if (!cost_) return;
  node_cost_.assign(at(taken_), 1.0);
  for (int i = 0; i < taken_ && !checker_.interrupt().now(); ++i)
    node_cost_[at(i)] = cost_(roadmap.nodes().col(i));
}

void Network::judge_all() {
  all_judged_ = true;
  if (taken_ == 0) return;
  set_judged(checker_.free_columns(roadmap_->nodes()));
}

void Network::set_judged(std::span<const char> free) {
  MIMESIS_ASSERT(free.size() == at(taken_));
  all_judged_ = true;
  std::ranges::transform(free, inhibited_.begin(), [](char one) { return !one; });
}

/// The m nearest nodes that are not known to be inhibited, nearest first.
std::vector<int> Network::nearest(const Eigen::VectorXd& q, int m) const {
  Eigen::VectorXf squared(size());
  roadmap_->squared_distances(q, squared);
  for (int i = taken_; i < size(); ++i)
    squared[i] = static_cast<float>((added_[at(i - taken_)] - q).squaredNorm());
  std::vector<int> near;
  float farthest = std::numeric_limits<float>::infinity();  // of m
  const auto distance = [&](int i) { return squared[i]; };
  for (int i = 0; i < size(); ++i) {
    if (squared[i] >= farthest || inhibited_[at(i)]) continue;
    if (std::ssize(near) == m) near.pop_back();
    near.insert(std::ranges::upper_bound(near, squared[i], {}, distance), i);
    if (std::ssize(near) == m) farthest = squared[near.back()];
  }
  return near;
}

int Network::add(const Eigen::VectorXd& q, int m) {
  std::vector<int> near = nearest(q, all_judged_ ? m : 2 * m);
  if (!all_judged_ && !near.empty()) {
    Eigen::MatrixXd candidates(q.size(), std::ssize(near));
    for (std::size_t i = 0; i < near.size(); ++i)
      candidates.col(static_cast<Eigen::Index>(i)) = node(near[i]);
    const std::vector<char> free = checker_.free_columns(candidates);
    for (std::size_t i = 0; i < near.size(); ++i) inhibited_[at(near[i])] = !free[i];
    std::erase_if(near, [&](int i) { return inhibited_[at(i)]; });
    if (std::ssize(near) < std::min(m, size())) {
      judge_all();
      near = nearest(q, m);
    }
    near.resize(std::min(near.size(), at(m)));
  }
  const int index = size();
  std::vector<Link> links;
  for (const int i : near) {
    const auto weight = static_cast<float>(std::exp(-(node(i) - q).norm()));
    links.push_back({i, weight});
    own_links(i).push_back({index, weight});
  }
  added_.push_back(q);
  own_links_.push_back(static_cast<int>(changed_.size()));
  changed_.push_back(std::move(links));
  inhibited_.push_back(0);
  if (cost_) node_cost_.push_back(cost_(q));
  return index;
}

std::vector<Link>& Network::own_links(int i) {
  int& own = own_links_[at(i)];
  if (own < 0) {
    own = static_cast<int>(changed_.size());
    const std::span<const Link> links = roadmap_->links()[at(i)];
    changed_.emplace_back(links.begin(), links.end());
  }
  return changed_[at(own)];
}

bool Network::certified(int a, int b) {
  const Pair pair = std::minmax(a, b);
  if (certified_.contains(pair)) return true;
  ++links_checked_;
  if (!checker_.certify(node(pair.first), node(pair.second))) return false;
  certified_.insert(pair);
  return true;
}

void Network::cut(int a, int b) {
  const auto remove = [this](int from, int to) {
    std::erase_if(own_links(from), [to](const Link& link) { return link.to == to; });
  };
  remove(a, b);
  remove(b, a);
}

/// Backward search that certifies as it goes. A link that is not free is cut, and the next
/// neighbour takes its place; a node without any is forgotten. Empty if the start is.
std::vector<int> Network::follow_proven(Wave& wave, int start) {
  std::vector<int> path{start};
  while (!path.empty() && !checker_.interrupt().told()) {
    const int i = path.back();
    int& arrival = wave.arrival[at(i)];
    if (arrival == 0) return path;
    const int next = strongest_before(links(i), wave, arrival);
    if (next < 0) {
      arrival = -1;
      path.pop_back();
    } else if (certified(i, next)) {
      path.push_back(next);
    } else {
      cut(i, next);
    }
  }
  return {};
}

std::vector<int> Network::search(int start, std::span<const int> goals, int& waves) {
  const auto links_of = [this](int i) { return links(i); };
  for (; waves > 0 && !checker_.interrupt().told(); --waves) {
    Wave wave = expanded(links_of, inhibited_, node_cost_, start, goals, checker_.interrupt());
    if (!wave.reached) return {};
    if (!all_judged_) {
      const std::vector<int> path = followed(links_of, wave, start);
      Eigen::MatrixXd postures(checker_.arm().dof(), std::ssize(path));
      for (std::size_t i = 0; i < path.size(); ++i)
        postures.col(static_cast<Eigen::Index>(i)) = node(path[i]);
      if (std::ranges::count(checker_.free_columns(postures), 0) > 0) {
        judge_all();
        continue;
      }
    }
    if (std::vector<int> path = follow_proven(wave, start); !path.empty()) return path;
  }
  return {};
}

}  // namespace mimesis::planner
