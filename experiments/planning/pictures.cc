#include "experiments/planning/pictures.h"

#include <fmt/format.h>

#include <cmath>

namespace mimesis::planner {

void draw(reproduce::Report& report, const reproduce::Figure::PlotDir& dir, const std::string& name,
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
  report.plots.push_back(*dir / (name + ".png"));
  plot::plot_png(report.plots.back(), static_cast<int>(430 * columns),
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

plot::Data link_lines(const Eigen::MatrixXd& nodes, const Linkage& links) {
  plot::Data out;
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (const Link& link : links[i]) {
      if (link.to < static_cast<int>(i)) continue;
      for (const Eigen::Index end :
           {static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(link.to)})
        out.rows.push_back({nodes(0, end), nodes(1, end)});
      out.rows.push_back({NAN, NAN});
    }
  }
  return out;
}

}  // namespace mimesis::planner
