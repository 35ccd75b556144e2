#include "nodes/planner/roadmap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include "common/error.h"
#include "common/math/vector_clones.h"

namespace mimesis::planner {
namespace {

constexpr std::array<int, 12> kPrimes{2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37};

/// Digits of `index` in base `base`, mirrored at the point.
double radical_inverse(int index, int base) {
  double value = 0.0, digit = 1.0 / base;
  for (; index > 0; index /= base, digit /= base) value += digit * (index % base);
  return value;
}

bool nearer(const Neighbour& a, const Neighbour& b) {
  return a.length != b.length ? a.length < b.length : a.to < b.to;
}

bool has_link(const std::vector<Neighbour>& list, int to) {
  return std::any_of(list.begin(), list.end(), [to](const Neighbour& l) { return l.to == to; });
}

void insert_sorted(std::vector<Neighbour>& list, const Neighbour& link) {
  list.insert(std::upper_bound(list.begin(), list.end(), link, nearer), link);
}

/// Length of link (i, j), or a negative number if there is none.
double length_of(const std::vector<Neighbour>& list, int to) {
  for (const Neighbour& link : list) {
    if (link.to == to) return link.length;
  }
  return -1.0;
}

/// Frees list by list, which takes a tenth of a millisecond.
void release(NeighbourLists lists, const Interrupt& interrupt) {
  for (auto& list : lists) {
    if (interrupt.now()) return interrupt.keep(std::move(lists));
    std::vector<Neighbour>().swap(list);
  }
}

bool long_side_of_a_triangle(const NeighbourLists& links, std::size_t i, const Neighbour& link) {
  for (const Neighbour& side : links[i]) {
    const double other = length_of(links[static_cast<std::size_t>(side.to)], link.to);
    if (other < 0.0) continue;
    if (link.length * link.length > side.length * side.length + other * other) return true;
  }
  return false;
}

/// squared[i] = |row i of by_joint − q|²
template <class Scalar>
[[gnu::always_inline]] inline void squares(const Eigen::MatrixX<Scalar>& by_joint, const double* q,
                                           Scalar* squared) {
  const Eigen::Index count = by_joint.rows();
  std::fill_n(squared, count, Scalar{0});
  for (Eigen::Index joint = 0; joint < by_joint.cols(); ++joint) {
    const Scalar* x = by_joint.data() + joint * count;
    const auto here = static_cast<Scalar>(q[joint]);
    for (Eigen::Index i = 0; i < count; ++i) squared[i] += (x[i] - here) * (x[i] - here);
  }
}
MIMESIS_VECTOR_CLONES void all_squares(const Eigen::MatrixXd& by_joint, const double* q,
                                       double* squared) {
  squares(by_joint, q, squared);
}
MIMESIS_VECTOR_CLONES void all_squares(const Eigen::MatrixXf& by_joint, const double* q,
                                       float* squared) {
  squares(by_joint, q, squared);
}

}  // namespace

Linkage::Linkage(const NeighbourLists& lists, const Interrupt& interrupt) {
  for (const auto& list : lists) begin_.push_back(begin_.back() + list.size());
  links_.reserve(begin_.back());
  for (const auto& list : lists) {
    if (interrupt.now()) {
      *this = {};
      return;
    }
    for (const Neighbour& link : list)
      links_.push_back({link.to, static_cast<float>(std::exp(-link.length))});
  }
}

void Roadmap::squared_distances(const Eigen::VectorXd& q, Eigen::VectorXf& squared) const {
  all_squares(by_joint_, q.data(), squared.data());
}

Eigen::MatrixXd halton(int n, int count, std::uint64_t seed, const Interrupt& interrupt) {
  MIMESIS_ASSERT(n >= 1 && n <= static_cast<int>(kPrimes.size()));
  std::mt19937_64 random(seed);
  Eigen::MatrixXd points = Eigen::MatrixXd::Zero(n, count);
  for (int row = 0; row < n; ++row) {
    const double shift = std::ldexp(static_cast<double>(random() >> 11), -53);
    for (int i = 0; i < count; ++i) {
      if (i % 64 == 0 && interrupt.now()) return points;
      const double sum = radical_inverse(i + 1, kPrimes[static_cast<std::size_t>(row)]) + shift;
      points(row, i) = sum < 1.0 ? sum : sum - 1.0;
    }
  }
  return points;
}

Eigen::MatrixXd sample_box(const Eigen::VectorXd& lo, const Eigen::VectorXd& hi, int count,
                           std::uint64_t seed, const Interrupt& interrupt) {
  const Eigen::MatrixXd unit = halton(static_cast<int>(lo.size()), count, seed, interrupt);
  return ((hi - lo).asDiagonal() * unit).colwise() + lo;
}

NeighbourLists nearest_neighbours(const Eigen::MatrixXd& nodes, int m, const Interrupt& interrupt) {
  const auto count = static_cast<std::size_t>(nodes.cols());
  const std::size_t keep =
      std::min(static_cast<std::size_t>(std::max(m, 0)), count > 0 ? count - 1 : 0);
  NeighbourLists lists(count);
  const Eigen::MatrixXd by_joint = nodes.transpose();
  Eigen::VectorXd squared(nodes.cols());
  std::vector<Neighbour> heap;  // the `keep` nearest so far, farthest on top
  for (std::size_t i = 0; i < count && keep > 0 && !interrupt.now(); ++i) {
    all_squares(by_joint, nodes.col(static_cast<Eigen::Index>(i)).data(), squared.data());
    heap.clear();
    for (std::size_t j = 0; j < count; ++j) {
      if (j == i) continue;
      const Neighbour candidate{static_cast<int>(j), squared[static_cast<Eigen::Index>(j)]};
      if (heap.size() < keep) {
        heap.push_back(candidate);
        std::push_heap(heap.begin(), heap.end(), nearer);
      } else if (nearer(candidate, heap.front())) {
        std::pop_heap(heap.begin(), heap.end(), nearer);
        heap.back() = candidate;
        std::push_heap(heap.begin(), heap.end(), nearer);
      }
    }
    std::sort_heap(heap.begin(), heap.end(), nearer);
    for (Neighbour& link : heap) link.length = std::sqrt(link.length);
    lists[i] = heap;
  }
  return lists;
}

NeighbourLists symmetrised(const NeighbourLists& lists, int k, const Interrupt& interrupt) {
  NeighbourLists links(lists.size());
  for (std::size_t i = 0; i < lists.size() && !interrupt.now(); ++i) {
    const auto end = lists[i].begin() + std::min<std::ptrdiff_t>(k, std::ssize(lists[i]));
    for (auto link = lists[i].begin(); link != end; ++link) {
      auto& there = links[static_cast<std::size_t>(link->to)];
      if (!has_link(links[i], link->to)) insert_sorted(links[i], *link);
      if (!has_link(there, static_cast<int>(i))) {
        insert_sorted(there, {static_cast<int>(i), link->length});
      }
    }
  }
  return links;
}

NeighbourLists pruned(const NeighbourLists& links, const Interrupt& interrupt) {
  NeighbourLists kept(links.size());
  for (std::size_t i = 0; i < links.size() && !interrupt.now(); ++i) {
    for (const Neighbour& link : links[i]) {
      if (!long_side_of_a_triangle(links, i, link)) kept[i].push_back(link);
    }
  }
  return kept;
}

std::vector<int> clusters(const Linkage& links, std::span<const char> inhibited) {
  const auto off = [&](std::size_t i) { return !inhibited.empty() && inhibited[i] != 0; };
  std::vector<int> cluster(links.size(), -1);
  std::vector<std::size_t> open;
  int count = 0;
  for (std::size_t seed = 0; seed < links.size(); ++seed) {
    if (cluster[seed] >= 0 || off(seed)) continue;
    cluster[seed] = count;
    open.assign(1, seed);
    while (!open.empty()) {
      const std::size_t i = open.back();
      open.pop_back();
      for (const Link& link : links[i]) {
        const auto j = static_cast<std::size_t>(link.to);
        if (cluster[j] >= 0 || off(j)) continue;
        cluster[j] = count;
        open.push_back(j);
      }
    }
    ++count;
  }
  return cluster;
}

void join_clusters(NeighbourLists& links, const NeighbourLists& extended,
                   const std::function<bool(int, int)>& accept, const Interrupt& interrupt) {
  if (interrupt.told()) return;
  const std::vector<int> cluster = clusters(Linkage(links, interrupt));
  struct Connector {
    int from = 0;
    Neighbour link;
  };
  std::map<std::pair<int, int>, Connector>
      shortest;  // by pair of clusters: ordered, hence reproducible
  for (std::size_t i = 0; i < extended.size() && !interrupt.now(); ++i) {
    for (const Neighbour& link : extended[i]) {
      const int a = cluster[i], b = cluster[static_cast<std::size_t>(link.to)];
      if (a == b) continue;
      const auto known = shortest.find(std::minmax(a, b));
      if (known != shortest.end() && known->second.link.length <= link.length) continue;
      if (accept && !accept(static_cast<int>(i), link.to)) continue;
      shortest.insert_or_assign(std::minmax(a, b), Connector{static_cast<int>(i), link});
    }
  }
  for (const auto& [pair, connector] : shortest) {
    insert_sorted(links[static_cast<std::size_t>(connector.from)], connector.link);
    insert_sorted(links[static_cast<std::size_t>(connector.link.to)],
                  {connector.from, connector.link.length});
  }
}

Linkage connect(const Eigen::MatrixXd& nodes, int k, const std::function<bool(int, int)>& accept,
                const Interrupt& interrupt) {
  NeighbourLists extended = nearest_neighbours(nodes, 2 * k, interrupt);
  NeighbourLists symmetric = symmetrised(extended, k, interrupt);
  NeighbourLists links = pruned(symmetric, interrupt);
  release(std::move(symmetric), interrupt);
  for (std::size_t i = 0; accept && i < links.size() && !interrupt.now(); ++i) {
    std::erase_if(links[i], [&](const Neighbour& link) {
      if (link.to < static_cast<int>(i))
        return !has_link(links[static_cast<std::size_t>(link.to)], static_cast<int>(i));
      return !accept(static_cast<int>(i), link.to);
    });
  }
  join_clusters(links, extended, accept, interrupt);
  release(std::move(extended), interrupt);
  Linkage packed(links, interrupt);
  release(std::move(links), interrupt);
  return packed;
}

Roadmap build_roadmap(CollisionChecker& checker, const Eigen::MatrixXd& more,
                      const RoadmapSettings& settings) {
  const kin::ArmModel& arm = checker.arm();
  Eigen::MatrixXd nodes(arm.dof(), settings.nodes + more.cols());
  nodes.leftCols(settings.nodes) =
      sample_box(arm.q_min, arm.q_max, settings.nodes, settings.seed, checker.interrupt());
  if (more.cols() > 0) nodes.rightCols(more.cols()) = more;
  return refined_roadmap(checker, std::move(nodes), settings);
}

Roadmap refined_roadmap(CollisionChecker& checker, Eigen::MatrixXd nodes,
                        const RoadmapSettings& settings) {
  const kin::ArmModel& arm = checker.arm();
  std::vector<double> inhibited_share = refine_offline(
      nodes, arm.q_min, arm.q_max,
      [&](const Eigen::MatrixXd& postures) { return checker.free_columns(postures); },
      settings.refinement, checker.interrupt());
  if (checker.interrupt().told()) return {};
  Linkage links = connect(
      nodes, settings.neighbours,
      [&](int i, int j) { return checker.certify(nodes.col(i), nodes.col(j)); },
      checker.interrupt());
  if (checker.interrupt().told()) return {};
  return {std::move(nodes), std::move(links), std::move(inhibited_share)};
}

}  // namespace mimesis::planner
