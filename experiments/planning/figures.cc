#include "experiments/planning/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/model/files.h"
#include "experiments/planning/pictures.h"
#include "nodes/planner/path_search.h"

namespace mimesis::planner {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using plot::Data;
using namespace reproduce;

constexpr int kNodes = 1500;
constexpr int kNeighbours = 4;
constexpr double kWindow_rad = 0.5;  // about the smallest obstacle in C-space

struct Planar {
  kin::ArmModel arm = model::load_arm("planar2.yaml");
  Obstacles obstacles{model::load_scene("planar16.yaml").balls, {}, {}, {}};
  std::vector<kin::Ball> targets;
  VectorXd start = Vector2d(-0.3, -0.2);
  MatrixXd nodes = sample_box(arm.q_min, arm.q_max, kNodes, 1);
  std::vector<MatrixXd> stages;  // of the off-line refinement, inhibited nodes included
  std::vector<std::vector<char>> stage_free;
  MatrixXd refined = nodes;
  std::vector<double> shares;

  Planar() {
    for (int i = 0; i < 6; ++i) targets.push_back({{0.05 + 0.07 * i, 1.38, 0.0}, 0.05});
    CollisionChecker checker(arm, obstacles, 0.0);
    const auto free = [&](const MatrixXd& postures) {
      stages.push_back(postures);
      stage_free.push_back(checker.free_columns(postures));
      return stage_free.back();
    };
    shares = refine_offline(refined, arm.q_min, arm.q_max, free, {.window_rad = kWindow_rad});
  }
  /// The ball around the end of the arm is in one of the target balls.
  bool reaches(const VectorXd& q) const {
    const Vector3d end = kin::end_effector(arm, q).translation();
    return std::ranges::any_of(targets, [&](const kin::Ball& t) {
      return (end - t.center).norm() < t.radius + arm.balls.back().radius;
    });
  }
  std::vector<char> marks(const MatrixXd& all, const std::vector<char>& free) const {
    std::vector<char> out = free;  // 0 inhibited, 1 active, 2 target
    for (Index i = 0; i < all.cols(); ++i) {
      auto& mark = out[static_cast<std::size_t>(i)];
      if (mark == 1 && reaches(all.col(i))) mark = 2;
    }
    return out;
  }
};

const Planar& planar() {
  static const Planar one;
  return one;
}

constexpr const char* kCSpace =
    "set xlabel 'joint 0 [rad]'\nset ylabel 'joint 1 [rad]'\nset xrange [-3:3]\nset yrange [-3:3]";
constexpr const char* kPlane =
    "set xlabel 'x [m]'\nset ylabel 'y [m]'\nset xrange [-1.4:1.6]\nset yrange [-0.9:1.7]";

Panel c_space(const std::string& title, const MatrixXd& nodes, const std::vector<char>& marks) {
  return {title,
          {{points(nodes, marks, 1), dots(kRed)},
           {points(nodes, marks, 0), dots(kBlue)},
           {points(nodes, marks, 2), dots(kGreen)}},
          kCSpace};
}

Report fig_2_7(const PlotDir& dir) {
  const Planar& p = planar();
  Report report;
  const std::vector<char> marks = p.marks(p.nodes, p.stage_free.front());
  const auto share = [&](const std::vector<char>& all, char mark) {
    return static_cast<double>(std::ranges::count(all, mark)) / static_cast<double>(all.size());
  };
  // The same shares of the area, pair by pair on a grid.
  constexpr int kGrid = 240;
  std::vector<char> grid;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const Vector2d unit((i % kGrid + 0.5) / kGrid, (i / kGrid + 0.5) / kGrid);
    const VectorXd q = p.arm.q_min + unit.cwiseProduct(p.arm.q_max - p.arm.q_min);
    const bool free = place(p.arm, q, p.obstacles).gap_m >= 0.0;
    grid.push_back(static_cast<char>(free ? (p.reaches(q) ? 2 : 1) : 0));
  }
  report.near("obstacle balls of the planar scene", static_cast<double>(p.obstacles.balls.size()),
              published(16, "figure 2.7"), 0.0, "1");
  report.near("inhibited nodes", share(marks, 0),
              closed_form(share(grid, 0), "area of the inhibited region"), 0.01, "1",
              "Halton points cover better than 1/sqrt(1500) = 0.026");
  report.near("nodes at the target", share(marks, 2),
              closed_form(share(grid, 2), "area of the target region"), 0.005, "1",
              "Halton points cover better than 1/sqrt(1500) = 0.026");
  report.holds("the initial configuration is free and not at the target",
               place(p.arm, p.start, p.obstacles).gap_m > 0.0 && !p.reaches(p.start),
               published("figure 2.7"));
  Panel workspace = posture_panel("A: workspace", p.arm, p.start, p.obstacles, 1, kPlane);
  Data targets;
  for (const auto& t : p.targets) targets.rows.push_back({t.center.x(), t.center.y(), t.radius});
  workspace.layers.emplace_back(targets, rings(kGreen));
  Panel space = c_space("B: active red, inhibited blue, targets green", p.nodes, marks);
  space.layers.emplace_back(Data{"", {{p.start[0], p.start[1]}}}, dots(kYellow, 1.5));
  draw(report, dir, "fig-2.7", 2, {workspace, space});
  return report;
}

Report fig_2_9(const PlotDir& dir) {
  const Planar& p = planar();
  Report report;
  const MatrixXd &before = p.stages[0], &after = p.stages[1];
  const auto& free = p.stage_free[0];
  // v1 = v2 + v3 by the text's words, for every inhibited node whose shift stays in the window.
  double worst = 0.0;
  Index shown = -1;
  Vector2d means[2];
  int compared = 0;
  for (Index i = 0; i < before.cols(); ++i) {
    if (free[static_cast<std::size_t>(i)]) {
      worst = std::max(worst, (after.col(i) - before.col(i)).norm());
      continue;
    }
    Vector2d sum[2] = {Vector2d::Zero(), Vector2d::Zero()};
    int count[2] = {0, 0};
    for (Index j = 0; j < before.cols(); ++j) {
      if (j == i || ((before.col(j) - before.col(i)).cwiseAbs().array() > kWindow_rad).any())
        continue;
      const std::size_t kind = free[static_cast<std::size_t>(j)] ? 1 : 0;
      sum[kind] += before.col(j);
      ++count[kind];
    }
    if (count[0] == 0 || count[1] == 0) continue;
    const Vector2d v2 = before.col(i) - sum[0] / count[0], v3 = sum[1] / count[1] - before.col(i);
    const Vector2d v1 = v2 + v3, there = before.col(i) + v1;
    if (v1.cwiseAbs().maxCoeff() > kWindow_rad || ((there - p.arm.q_min).array() < 0.0).any() ||
        ((p.arm.q_max - there).array() < 0.0).any())
      continue;
    worst = std::max(worst, (after.col(i) - there).norm());
    ++compared;
    if (shown < 0 || std::abs(count[0] - count[1]) < 3) {
      shown = i;
      for (int k : {0, 1}) means[k] = sum[k] / count[k];
    }
  }
  report.near("shift of a node against v2 + v3", worst, closed_form(0.0, "v1 = v2 + v3 (2.3.2)"),
              1e-12, "rad");
  report.at_least("nodes compared", compared, goal(50), "1", "else it shows little");
  const auto inhibited = [&](std::size_t stage) {
    return static_cast<double>(std::ranges::count(p.stage_free[stage], 0));
  };
  report.holds("one iteration turns inhibited nodes into active ones",
               inhibited(1) < 0.9 * inhibited(0), published("figure 2.9"));
  const Vector2d c = before.col(shown), to = after.col(shown);
  Panel window = c_space("testing window: means and the node's shift", before, free);
  window.settings = fmt::format(
      "set xlabel 'joint 0 [rad]'\nset ylabel 'joint 1 [rad]'\nset xrange [{}:{}]\nset yrange "
      "[{}:{}]",
      c.x() - kWindow_rad, c.x() + kWindow_rad, c.y() - kWindow_rad, c.y() + kWindow_rad);
  const auto one = [](const Vector2d& v) { return Data{"", {{v.x(), v.y()}}}; };
  window.layers.emplace_back(one(means[0]), dots(kBlue, 2.0));
  window.layers.emplace_back(one(means[1]), dots(kRed, 2.0));
  window.layers.emplace_back(one(c), dots("#3aa6b9", 2.0));
  window.layers.emplace_back(Data{"", {{c.x(), c.y()}, {to.x(), to.y()}}}, lines("#000000", 2.0));
  draw(report, dir, "fig-2.9", 2, {c_space("C-space", before, free), window});
  return report;
}

/// Share of the nodes that have an inhibited posture within 0.1 rad.
double at_border(const Planar& p, const MatrixXd& nodes) {
  CollisionChecker checker(p.arm, p.obstacles, 0.0);
  int count = 0;
  for (Index i = 0; i < nodes.cols(); ++i) {
    bool border = false;
    for (int k = 0; k < 8 && !border; ++k) {
      const double angle = k * M_PI / 4.0;
      border = !checker.free(nodes.col(i) + 0.1 * Vector2d(std::cos(angle), std::sin(angle)));
    }
    count += border;
  }
  return static_cast<double>(count) / static_cast<double>(nodes.cols());
}

Report fig_2_10(const PlotDir& dir) {
  const Planar& p = planar();
  Report report;
  report.at_most("iterations of the off-line refinement", static_cast<double>(p.shares.size() - 1),
                 published(6, "figure 2.10"), "1", "until less than 2 % remain inhibited");
  report.at_most("inhibited at the end", p.shares.back(),
                 published(0.02, "2.3.2: less than 2 percent"), "1", "then dropped");
  report.near("nodes kept", static_cast<double>(p.refined.cols()),
              closed_form(kNodes * (1.0 - p.shares.back()), "all but the inhibited ones"), 1e-6,
              "1");
  MatrixXd free_before(2, 0);
  for (Index i = 0; i < p.nodes.cols(); ++i) {
    if (!p.stage_free[0][static_cast<std::size_t>(i)]) continue;
    free_before.conservativeResize(2, free_before.cols() + 1);
    free_before.rightCols(1) = p.nodes.col(i);
  }
  report.holds("the density at the borders of obstacles rises",
               at_border(p, p.refined) > 1.2 * at_border(p, free_before),
               published("2.3.2, figure 2.10"));
  std::vector<Panel> panels;
  for (std::size_t i = 0; i < p.stages.size(); ++i) {
    panels.push_back(
        c_space(fmt::format("{} iterations: {:.1f} % inhibited", i, 100.0 * p.shares[i]),
                p.stages[i], p.stage_free[i]));
  }
  draw(report, dir, "fig-2.10", 4, panels);
  return report;
}

std::size_t link_count(const NeighbourLists& links) {
  std::size_t sum = 0;
  for (const auto& list : links) sum += list.size();
  return sum / 2;
}

int cluster_count(const Linkage& links) {
  const auto index = clusters(links);
  return index.empty() ? 0 : *std::ranges::max_element(index) + 1;
}

double mean_length(const NeighbourLists& links) {
  double sum = 0.0;
  for (const auto& list : links)
    for (const Neighbour& link : list) sum += link.length;
  return 0.5 * sum / static_cast<double>(link_count(links));
}

using Adjacency = Eigen::Matrix<char, Eigen::Dynamic, Eigen::Dynamic>;

/// Neighbour by neighbour: j is among the k nearest of i, or i of j.
Adjacency neighbours_by_rank(const MatrixXd& nodes, int k) {
  const Index n = nodes.cols();
  Adjacency out = Adjacency::Zero(n, n);
  for (Index i = 0; i < n; ++i) {
    std::vector<std::pair<double, Index>> all;
    for (Index j = 0; j < n; ++j)
      if (j != i) all.emplace_back((nodes.col(i) - nodes.col(j)).norm(), j);
    std::ranges::partial_sort(all, all.begin() + k);
    for (int m = 0; m < k; ++m) out(i, all[static_cast<std::size_t>(m)].second) = 1;
  }
  return out.cwiseMax(out.transpose().eval());
}

int differing(const Adjacency& expected, const NeighbourLists& links) {
  Adjacency is = Adjacency::Zero(expected.rows(), expected.cols());
  for (std::size_t i = 0; i < links.size(); ++i)
    for (const Neighbour& link : links[i]) is(static_cast<Index>(i), link.to) = 1;
  return static_cast<int>((is.array() != expected.array()).count()) / 2;
}

Report fig_2_11(const PlotDir& dir) {
  const MatrixXd& nodes = planar().refined;
  Report report;
  std::vector<Panel> panels;
  std::vector<int> count;
  int wrong = 0;
  for (const int k : {2, 6, 20}) {
    const NeighbourLists links = symmetrised(nearest_neighbours(nodes, 2 * k), k);
    wrong += differing(neighbours_by_rank(nodes, k), links);
    count.push_back(cluster_count(links));
    panels.push_back(
        {fmt::format("{} neighbours: {} links, {} clusters", k, link_count(links), count.back()),
         {{link_lines(nodes, links), lines(kBlue, 0.6)}},
         kCSpace});
  }
  report.near("links that are not those of the ranks", wrong,
              closed_form(0.0, "j among the k nearest of i, or i of j"), 0.0, "1", "k = 2, 6, 20");
  report.at_least("clusters with 2 neighbours", count[0], goal(20), "1",
                  "\"many mutually disconnected clusters\"");
  report.holds("fewer clusters with 6 and 20 neighbours",
               count[0] > 5 * count[1] && count[1] >= count[2], published("figure 2.11"));
  draw(report, dir, "fig-2.11", 3, panels);
  return report;
}

Report fig_2_12(const PlotDir& dir) {
  const MatrixXd& nodes = planar().refined;
  Report report;
  const NeighbourLists whole = symmetrised(nearest_neighbours(nodes, 2 * kNeighbours), kNeighbours);
  const NeighbourLists kept = pruned(whole);
  Adjacency expected = neighbours_by_rank(nodes, kNeighbours);
  const Adjacency all = expected;
  for (Index i = 0; i < nodes.cols(); ++i) {
    for (Index j = 0; j < nodes.cols(); ++j) {
      if (!all(i, j)) continue;
      const double ij = (nodes.col(i) - nodes.col(j)).squaredNorm();
      for (Index k = 0; k < nodes.cols(); ++k) {
        if (all(i, k) && all(j, k) &&
            ij > (nodes.col(j) - nodes.col(k)).squaredNorm() +
                     (nodes.col(k) - nodes.col(i)).squaredNorm())
          expected(i, j) = 0;
      }
    }
  }
  report.near("links that the triangles decide otherwise", differing(expected, kept),
              closed_form(0.0, "removed if dij² > djk² + dki² (2.3.2)"), 0.0, "1");
  report.holds("long links are removed: the mean length falls",
               link_count(kept) < link_count(whole) && mean_length(kept) < mean_length(whole),
               published("figure 2.12"));
  draw(report, dir, "fig-2.12", 2,
       {{fmt::format("4 neighbours: {} links", link_count(whole)),
         {{link_lines(nodes, whole), lines(kBlue, 0.6)}},
         kCSpace},
        {fmt::format("long links removed: {} links", link_count(kept)),
         {{link_lines(nodes, kept), lines(kBlue, 0.6)}},
         kCSpace}});
  return report;
}

Report fig_2_13(const PlotDir& dir) {
  const MatrixXd& nodes = planar().refined;
  constexpr int kFew = 2;  // neighbours: the figure has many clusters
  Report report;
  const NeighbourLists extended = nearest_neighbours(nodes, 2 * kFew);
  const NeighbourLists torn = pruned(symmetrised(extended, kFew));
  NeighbourLists joined = torn;
  join_clusters(joined, extended);
  const int before = cluster_count(torn), after = cluster_count(joined);
  report.near("clusters after they are joined", after,
              closed_form(cluster_count(symmetrised(extended, 2 * kFew)),
                          "components of the lists of 2k neighbours"),
              0.0, "1");
  report.holds("new links connect clusters", after < before / 4, published("figure 2.13"));
  NeighbourLists fresh(joined.size());
  const auto index = clusters(torn);
  for (std::size_t i = 0; i < joined.size(); ++i)
    for (const Neighbour& link : joined[i])
      if (index[i] != index[static_cast<std::size_t>(link.to)]) fresh[i].push_back(link);
  draw(report, dir, "fig-2.13", 1,
       {{fmt::format("{} clusters, then {}: {} new links", before, after, link_count(fresh)),
         {{link_lines(nodes, torn), lines(kBlue, 0.6)},
          {link_lines(nodes, fresh), lines(kRed, 1.6)}},
         kCSpace}});
  return report;
}

Report fig_2_14(const PlotDir& dir) {
  const Planar& p = planar();
  Report report;
  const Roadmap roadmap(p.refined, connect(p.refined, kNeighbours));
  std::vector<VectorXd> goals;
  for (Index i = 0; i < p.refined.cols(); ++i)
    if (p.reaches(p.refined.col(i))) goals.push_back(p.refined.col(i));
  std::vector<Panel> panels;
  std::array<double, 3> length{}, postures{};  // sums over the starts, by refinements
  bool touches = false;
  // The figure's start, and others all over the free space.
  std::vector<VectorXd> starts{p.start};
  for (Index i = 0; i < p.refined.cols(); i += 31) starts.push_back(p.refined.col(i));
  constexpr std::array kRefinements{0, 1, 3};
  const PostureCost no_preference;
  for (const VectorXd& start : starts) {
    for (std::size_t r = 0; r < kRefinements.size(); ++r) {
      CollisionChecker checker(p.arm, p.obstacles, 0.0);
      Network network(checker, no_preference);
      network.take(roadmap);
      const int begin = network.add(start, 2 * kNeighbours);
      std::vector<int> ends;
      for (const auto& q : goals) ends.push_back(network.add(q, 2 * kNeighbours));
      int waves = 300;
      const auto path = refine_online(network, network.search(begin, ends, waves), checker, {},
                                      {.online_refinements = kRefinements[r]});
      if (path.empty()) throw std::runtime_error("fig-2.14: no path");
      length[r] += path_length(path);
      postures[r] += static_cast<double>(checker.postures_checked());
      if (&start != starts.data()) continue;
      Data drawn;
      for (std::size_t i = 0; i < path.size(); ++i) {
        drawn.rows.push_back({path[i][0], path[i][1]});
        for (double s = 0.0; i > 0 && s <= 1.0; s += 0.02) {
          const VectorXd q = path[i - 1] + s * (path[i] - path[i - 1]);
          touches = touches || place(p.arm, q, p.obstacles).gap_m < 0.0;
        }
      }
      panels.push_back(
          {fmt::format("{} refinements: {:.3f} rad", kRefinements[r], path_length(path)),
           {{points(p.refined), dots(kGrey, 0.25)},
            {drawn, lines(kRed, 2.0)},
            {drawn, dots(kRed, 0.8)}},
           kCSpace});
    }
  }
  report.holds("the paths touch nothing", !touches, published("2.3.2"),
               "50 postures on each link, pair by pair");
  report.at_most("length after three refinements", length[2] / length[0],
                 closed_form(1.0, "the shortest path is kept"), "1",
                 "of that before, sums over 49 starts: a wave counts links, and the "
                 "denser set has shorter ones; the shortcuts that follow do more");
  report.beside("postures checked by a refinement", (postures[1] - postures[0]) / postures[0],
                goal(1.0), "1",
                "of those of the first plan, which finds the links of the roadmap "
                "certified; a refinement certifies its own");
  draw(report, dir, "fig-2.14", 3, panels);
  return report;
}

}  // namespace

std::vector<Figure> figures() {
  std::vector<Figure> all{
      {"fig-2.7", "Planar arm: workspace and C-space", "M18", {2, 2, 0, 0}, fig_2_7},
      {"fig-2.9", "Shift of inhibited nodes in the testing window", "M18", {1, 1, 0, 1}, fig_2_9},
      {"fig-2.10", "Off-line refinement, iteration by iteration", "M18", {3, 1, 0, 0}, fig_2_10},
      {"fig-2.11", "Symmetric links to 2, 6 and 20 neighbours", "M18", {1, 1, 0, 1}, fig_2_11},
      {"fig-2.12", "Removal of long links", "M18", {1, 1, 0, 0}, fig_2_12},
      {"fig-2.13", "Links between clusters", "M18", {1, 1, 0, 0}, fig_2_13},
      {"fig-2.14", "The path before and after on-line refinement", "M18", {1, 1, 0, 1}, fig_2_14},
  };
  std::ranges::move(bar_figures(), std::back_inserter(all));
  std::ranges::sort(all, {}, [](const Figure& f) { return std::stoi(f.name.substr(6)); });
  return all;
}

}  // namespace mimesis::planner
