// Curves to a script for gnuplot.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "common/error.h"
#include "common/plot/gnuplot.h"
#include "tools/mimesis/log/plot.h"

namespace mimesis::tool {
namespace {

constexpr std::size_t kLineTypes = 8;  // that the style of gnuplot.cc tells apart
constexpr int kPanelHeight = 320, kFirstPanelHeight = 460;  // [px]

/// Curves that share an axis.
struct Panel {
  std::vector<std::size_t> curves;  ///< indexes
};

/// Of curves with one panel; what has words is apart.
std::string axis_of(const Curve& curve) {
  if (!curve.discrete) return "unit " + curve.quantity.unit;
  std::string words = "words";
  for (const auto& [value, word] : curve.words) {
    words = word == "true" || word == "false" ? "boolean" : "words " + curve.quantity.name;
  }
  return words;
}

std::vector<Panel> panels_of(const std::vector<Curve>& curves) {
  std::vector<Panel> panels;
  std::vector<std::string> axes;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const std::string axis = axis_of(curves[i]);
    const auto at = static_cast<std::size_t>(std::ranges::find(axes, axis) - axes.begin());
    if (at == axes.size()) {
      axes.push_back(axis);
      panels.emplace_back();
    }
    panels[at].curves.push_back(i);
  }
  return panels;
}

std::string y_label(const std::vector<Curve>& curves, const Panel& panel, bool derivative) {
  std::set<std::string> names;
  for (const std::size_t i : panel.curves) names.insert(curves[i].quantity.name);
  const std::string& unit = curves[panel.curves.front()].quantity.unit;
  std::string name = names.size() == 1 ? *names.begin() : "";
  if (derivative && !name.empty()) name = "d/dt " + name;
  if (unit.empty()) return name;
  return name.empty() ? unit : name + " [" + unit + "]";
}

/// What all labels have in common stands in the title: "bridge/arm.".
std::string common_topic(const std::vector<Curve>& curves) {
  const std::string& first = curves.front().label;
  const std::size_t slash = first.rfind('/');
  const std::string topic = first.substr(0, first.find('.', slash == first.npos ? 0 : slash) + 1);
  const bool all = std::ranges::all_of(
      curves, [&](const Curve& curve) { return curve.label.starts_with(topic); });
  return all ? topic : "";
}

/// Values of an axis with names, and room above and below.
std::string word_tics(const std::vector<Curve>& curves, const Panel& panel) {
  std::map<int, std::string> words;
  for (const std::size_t i : panel.curves)
    words.insert(curves[i].words.begin(), curves[i].words.end());
  std::string tics;
  for (const auto& [value, word] : words) {
    tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ", plot::quoted(word), value);
  }
  return fmt::format("set ytics ({})\nset yrange [{}:{}]\n", tics, words.begin()->first - 0.3,
                     words.rbegin()->first + 0.3);
}

/// Equal ones for all panels, so that their times stand above each other [characters].
std::size_t left_margin(const std::vector<Curve>& curves) {
  std::size_t longest = 8;  // of numbers
  for (const Curve& curve : curves) {
    for (const auto& [value, word] : curve.words) longest = std::max(longest, word.size());
  }
  return longest + 4;
}
std::size_t right_margin(const std::vector<Curve>& curves, const std::string& topic) {
  std::size_t longest = 0;
  for (const Curve& curve : curves) longest = std::max(longest, curve.label.size() - topic.size());
  return longest + 8;
}

/// Look of the curves of a panel. Where fields have several elements, equal ones of each have one
/// colour, and each field has its dashes: set-points lie upon what followed them.
struct Look {
  std::size_t colour, dash;
};
std::vector<Look> looks(const std::vector<Curve>& curves, const Panel& panel) {
  std::map<std::size_t, std::size_t> sizes;  // of fields
  for (const std::size_t i : panel.curves) ++sizes[curves[i].field];
  const bool by_field =
      sizes.size() > 1 && std::ranges::any_of(sizes, [](const auto& s) { return s.second > 1; });
  std::map<std::size_t, std::size_t> dashes, elements;
  std::vector<Look> all;
  for (std::size_t n = 0; n < panel.curves.size(); ++n) {
    const std::size_t field = curves[panel.curves[n]].field;
    const std::size_t dash = dashes.try_emplace(field, dashes.size()).first->second;
    const std::size_t element = elements[field]++;
    all.push_back(by_field ? Look{element % kLineTypes, dash}
                           : Look{n % kLineTypes, n / kLineTypes});
  }
  return all;
}

std::string curve_style(const Curve& curve, PlotStyle style, const Look& look) {
  if (style == PlotStyle::dots || curve.samples < 2) {
    return fmt::format("points linetype {} pointtype 7 pointsize 0.4", look.colour + 1);
  }
  return fmt::format("{} linetype {} linewidth 1.4 dashtype {}",
                     style == PlotStyle::steps || curve.discrete ? "steps" : "lines",
                     look.colour + 1, look.dash + 1);
}

/// gnuplot chooses it, but for curves that are constant.
std::string value_range(const std::vector<Curve>& curves, const Panel& panel) {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const std::size_t i : panel.curves) {
    least = std::min(least, curves[i].least);
    greatest = std::max(greatest, curves[i].greatest);
  }
  if (least < greatest) return "set autoscale y\n";
  const double middle = least == greatest ? least : 0.0;
  const double half = std::max(1.0, 0.1 * std::abs(middle));
  return fmt::format("set yrange [{}:{}]\n", middle - half, middle + half);
}

std::string draw_panel(const std::vector<Curve>& curves, const Panel& panel,
                       const PlotOptions& options, const std::string& topic) {
  std::string script =
      "set ylabel " + plot::quoted(y_label(curves, panel, options.derivative)) + "\n";
  if (curves[panel.curves.front()].discrete) {
    script += word_tics(curves, panel);
  } else {
    script += value_range(curves, panel);
    script += "set ytics autofreq\nset offsets 0, 0, graph 0.05, graph 0.05\n";
  }
  const auto look = looks(curves, panel);
  std::string plots;
  for (std::size_t n = 0; n < panel.curves.size(); ++n) {
    const Curve& curve = curves[panel.curves[n]];
    plots += fmt::format("{} $curve{} using 1:2 with {} title {}", n == 0 ? "" : ", \\\n ",
                         panel.curves[n], curve_style(curve, options.style, look[n]),
                         plot::quoted(curve.label.substr(topic.size())));
  }
  return script + "plot" + plots + "\n";
}

}  // namespace

void draw_curves(const std::vector<Curve>& curves, const PlotOptions& options) {
  const auto panels = panels_of(curves);
  const std::string topic = common_topic(curves);
  std::vector<plot::Data> data;
  double first_s = std::numeric_limits<double>::infinity(), last_s = -first_s;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    plot::Data d{fmt::format("curve{}", i), {}};
    for (const auto& p : curves[i].thinning.points()) {
      d.rows.push_back({p.time_s, p.value});
      first_s = std::min(first_s, p.time_s);
      last_s = std::max(last_s, p.time_s);
    }
    if (d.rows.empty()) d.rows.push_back({0.0, std::numeric_limits<double>::quiet_NaN()});
    data.push_back(std::move(d));
  }
  const std::string title =
      !options.title.empty() || topic.empty() ? options.title : topic.substr(0, topic.size() - 1);
  std::string script = fmt::format(
      "set key at graph 1.01, graph 1.02 left top Left reverse\n"
      "set grid back linetype 1 linecolor rgb '#e0e0e0' linewidth 1 dashtype 1\n"
      "set lmargin {}\nset rmargin {}\n{}",
      left_margin(curves), right_margin(curves, topic),
      first_s < last_s ? fmt::format("set xrange [{}:{}]\n", first_s, last_s) : "");
  script += fmt::format("set multiplot layout {},1{}\n", panels.size(),
                        title.empty() ? "" : " title " + plot::quoted(title));
  for (const Panel& panel : panels) {
    if (&panel == &panels.back()) script += "set xlabel 'time from the start of the log [s]'\n";
    script += draw_panel(curves, panel, options, topic);
  }
  script += "unset multiplot\n";
  const int height = options.height_px > 0
                         ? options.height_px
                         : kFirstPanelHeight + kPanelHeight * (static_cast<int>(panels.size()) - 1);
  const bool svg = std::filesystem::path(options.output).extension() == ".svg";
  (svg ? plot::plot_svg : plot::plot_png)(options.output, options.width_px, height, data, script);
}

}  // namespace mimesis::tool
