#include "nodes/planner/network.h"

#include <algorithm>
#include <cmath>

#include "nodes/planner/wave.h"

namespace mimesis::planner {
namespace {

constexpr int kGrowLinks = 60;       // cut links, newest first, that get new nodes in one growth
constexpr int kGrowNodes = 40;       // random nodes of each region that do
constexpr double kGrowSigma = 0.35;  // spread around them [rad]

double unit(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -53);
}

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void Network::take(const Roadmap& roadmap) {
  links_ = roadmap.links;
  for (Eigen::Index i = 0; i < roadmap.nodes.cols(); ++i) {
    nodes_.emplace_back(roadmap.nodes.col(i));
    inhibited_.push_back(!checker_.free(nodes_.back()));
    node_cost_.push_back(cost_ ? cost_(nodes_.back()) : 1.0);
  }
}

std::vector<Link> Network::nearest(const Eigen::VectorXd& q, int m, const Accept& accept) const {
  std::vector<Link> all;
  for (int i = 0; i < size(); ++i) {
    if (!inhibited_[at(i)] && accept(i)) all.push_back({i, (nodes_[at(i)] - q).norm()});
  }
  const auto end = all.begin() + std::min<std::ptrdiff_t>(m, std::ssize(all));
  std::partial_sort(all.begin(), end, all.end(), [](const Link& a, const Link& b) {
    return a.length != b.length ? a.length < b.length : a.to < b.to;
  });
  all.erase(end, all.end());
  return all;
}

int Network::add(const Eigen::VectorXd& q, int m) {
  return add(q, nearest(q, m, [](int) { return true; }));
}

int Network::add(const Eigen::VectorXd& q, std::vector<Link> links) {
  const int index = size();
  for (const Link& link : links) links_[at(link.to)].push_back({index, link.length});
  nodes_.push_back(q);
  links_.push_back(std::move(links));
  inhibited_.push_back(0);
  node_cost_.push_back(cost_ ? cost_(q) : 1.0);
  return index;
}

bool Network::certified(int a, int b) {
  const Pair pair = std::minmax(a, b);
  if (certified_.contains(pair)) return true;
  ++links_checked_;
  if (!checker_.certify(nodes_[at(pair.first)], nodes_[at(pair.second)])) return false;
  certified_.insert(pair);
  return true;
}

void Network::cut(int a, int b) {
  const auto remove = [this](int from, int to) {
    std::erase_if(links_[at(from)], [to](const Link& link) { return link.to == to; });
  };
  remove(a, b);
  remove(b, a);
  cut_.emplace_back(a, b);
}

std::vector<int> Network::search(int start, std::span<const int> goals, int& waves) {
  for (; waves > 0; --waves) {
    const std::vector<int> path =
        follow_wave(links_, expand_wave(links_, inhibited_, node_cost_, start, goals), start);
    if (path.empty()) return {};
    bool whole = true;
    for (std::size_t i = 1; i < path.size(); ++i) {
      if (certified(path[i - 1], path[i])) continue;
      cut(path[i - 1], path[i]);
      whole = false;
    }
    if (whole) return path;
  }
  return {};
}

std::optional<Eigen::VectorXd> Network::free_near(const Eigen::VectorXd& center, double sigma,
                                                  std::mt19937_64& random) {
  const kin::ArmModel& arm = checker_.arm();
  Eigen::VectorXd q = center;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    // Sum of uniforms: near enough to a Gaussian, and the same with every standard library.
    double sum = 0.0;
    for (int i = 0; i < 4; ++i) sum += unit(random);
    q[j] += sigma * std::sqrt(3.0) * (sum - 2.0);
  }
  q = q.cwiseMax(arm.q_min).cwiseMin(arm.q_max);
  if (!checker_.free(q)) return std::nullopt;
  return q;
}

void Network::grow_at_cut_links(int m, std::mt19937_64& random) {
  const std::vector<Pair> torn = std::exchange(cut_, {});
  const std::size_t from = torn.size() > kGrowLinks ? torn.size() - kGrowLinks : 0;
  for (std::size_t i = from; i < torn.size(); ++i) {
    const Eigen::VectorXd a = node(torn[i].first), b = node(torn[i].second);
    const double sigma = 0.25 * (a - b).norm() / std::sqrt(static_cast<double>(a.size()));
    if (const auto q = free_near(0.5 * (a + b), sigma, random)) add(*q, m);
  }
}

void Network::grow_regions(int start, std::span<const int> goals, int m, std::mt19937_64& random) {
  std::vector<int> cluster = clusters(links_, inhibited_);
  std::vector<int> regions{cluster[at(start)]};
  for (const int goal : goals) regions.push_back(cluster[at(goal)]);
  std::sort(regions.begin(), regions.end());
  regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
  for (const int region : regions) {
    std::vector<int> members;
    for (int i = 0; i < size(); ++i) {
      if (cluster[at(i)] == region) members.push_back(i);
    }
    for (int i = 0; i < kGrowNodes; ++i) {
      const auto pick =
          static_cast<std::size_t>(unit(random) * static_cast<double>(members.size()));
      const auto q = free_near(node(members[pick]), kGrowSigma, random);
      if (!q) continue;
      std::vector<Link> links = nearest(*q, m / 2, [&](int j) { return cluster[at(j)] == region; });
      const std::vector<Link> out =
          nearest(*q, m / 2, [&](int j) { return cluster[at(j)] != region; });
      links.insert(links.end(), out.begin(), out.end());
      add(*q, std::move(links));
      cluster.push_back(region);
    }
  }
}

void Network::grow(int start, std::span<const int> goals, int m, std::mt19937_64& random) {
  grow_at_cut_links(m, random);
  grow_regions(start, goals, m, random);
}

}  // namespace mimesis::planner
