#include "experiments/planning/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mimesis::planner {

void draw(reproduce::Report& report, const reproduce::PlotDir& dir, const std::string& name,
          std::size_t columns, const std::vector<Panel>& panels) {
  if (!dir) return;
  std::filesystem::create_directories(*dir);
  const std::size_t lines = (panels.size() + columns - 1) / columns;
  std::vector<plot::Data> data;
  std::string script = fmt::format(
      "set multiplot layout {},{}\nset key off\nset size ratio -1\nset style fill solid 0.6\n",
      lines, columns);
  for (const Panel& panel : panels) {
    script += "set title " + plot::quoted(panel.title) + "\n" + panel.settings + "\nplot ";
    for (std::size_t i = 0; i < panel.layers.size(); ++i) {
      plot::Data rows = panel.layers[i].first;
      rows.name = "d" + std::to_string(data.size());
      if (rows.rows.empty()) rows.rows = {{NAN, NAN, NAN, NAN}};
      script += (i > 0 ? ", $" : "$") + rows.name + " " + panel.layers[i].second;
      data.push_back(std::move(rows));
    }
    script += "\n";
  }
  plot::plot_png(report.picture(*dir / (name + ".png")), static_cast<int>(430 * columns),
                 static_cast<int>(400 * lines), data, script + "unset multiplot");
}

std::string dots(const char* color, double size) {
  return fmt::format("using 1:2 with points pt 7 ps {} lc rgb '{}'", size, color);
}
std::string rings(const char* color) {
  return fmt::format("using 1:2:3 with circles fs transparent solid 0.35 lc rgb '{}'", color);
}
std::string lines(const char* color, double width) {
  return fmt::format("using 1:2 with lines lw {} lc rgb '{}'", width, color);
}

plot::Data points(const Eigen::MatrixXd& nodes, const std::vector<char>& marks, char wanted) {
  plot::Data out;
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    if (marks.empty() || marks[static_cast<std::size_t>(i)] == wanted)
      out.rows.push_back({nodes(0, i), nodes(1, i)});
  }
  return out;
}

plot::Data link_lines(const Eigen::MatrixXd& nodes, const NeighbourLists& links) {
  plot::Data out;
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (const Neighbour& link : links[i]) {
      if (link.to < static_cast<int>(i)) continue;
      for (const Eigen::Index end :
           {static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(link.to)})
        out.rows.push_back({nodes(0, end), nodes(1, end)});
      out.rows.push_back({NAN, NAN});
    }
  }
  return out;
}

PlacedBalls place(const kin::ArmModel& arm, const Eigen::VectorXd& q, const Obstacles& obstacles) {
  PlacedBalls out;
  std::vector<Eigen::Isometry3d> X;
  Eigen::Matrix3Xd centers;
  kin::forward(arm, q, X);
  kin::ball_centers(arm, X, centers);
  std::vector<kin::SafetyBall> all = arm.balls;
  for (const kin::Ball& held : obstacles.held)
    all.push_back({arm.dof(), -1, arm.X_LE * held.center, held.radius});
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Eigen::Vector3d p = X[static_cast<std::size_t>(all[i].frame)] * all[i].center;
    const bool held = all[i].group < 0;
    double gap = INFINITY;
    if (held || std::ranges::count(arm.env_groups, all[i].group) > 0) {
      for (const kin::Ball& o : obstacles.balls)
        gap = std::min(gap, (p - o.center).norm() - all[i].radius - o.radius);
      const auto off = [&](const kin::Box& box) {
        gap = std::min(gap, ((p - box.center).cwiseAbs() - box.half_extent).cwiseMax(0.0).norm() -
                                all[i].radius);
      };
      std::ranges::for_each(obstacles.boxes, off);
      if (!held) std::ranges::for_each(obstacles.supports, off);
    }
    out.balls.push_back({p, all[i].radius});
    out.touches.push_back(gap < 0.0);
    out.gap_m = std::min(out.gap_m, gap);
  }
  for (std::size_t a = 0; a < arm.balls.size(); ++a) {
    for (std::size_t b = 0; b < arm.balls.size(); ++b) {
      const std::pair groups(arm.balls[a].group, arm.balls[b].group);
      if (std::ranges::count(arm.self_pairs, groups) == 0) continue;
      out.gap_m = std::min(out.gap_m, (out.balls[a].center - out.balls[b].center).norm() -
                                          out.balls[a].radius - out.balls[b].radius);
    }
  }
  return out;
}

Panel posture_panel(const std::string& title, const kin::ArmModel& arm, const Eigen::VectorXd& q,
                    const Obstacles& obstacles, Eigen::Index up, const std::string& settings) {
  const PlacedBalls placed = place(arm, q, obstacles);
  plot::Data free, touching, around, boxes;
  for (std::size_t i = 0; i < placed.balls.size(); ++i) {
    const auto& [c, r] = placed.balls[i];
    (placed.touches[i] ? touching : free).rows.push_back({c.x(), c[up], r});
  }
  for (const kin::Ball& o : obstacles.balls)
    around.rows.push_back({o.center.x(), o.center[up], o.radius});
  for (const auto* list : {&obstacles.boxes, &obstacles.supports}) {
    for (const kin::Box& b : *list) {
      if (b.name == "closed passage") continue;
      boxes.rows.push_back({b.center.x(), b.center[up], b.half_extent.x(), b.half_extent[up]});
    }
  }
  return {title,
          {{boxes, fmt::format("using 1:2:3:4 with boxxyerror lc rgb '{}'", kGrey)},
           {around, rings(kYellow)},
           {free, rings(kBlue)},
           {touching, rings(kRed)}},
          settings};
}

}  // namespace mimesis::planner
