// What the full control system makes of the mixtures of training trials: sizes of the first two
// actions and reach [M18 3.8.3, fig. 3.41].
#include <algorithm>
#include <cmath>

#include "experiments/walk/figures/list.h"
#include "experiments/walk/figures/study_rows.h"

namespace mimesis::walk {
namespace {

constexpr double kBin_mm = 1.0, kMost_mm = 12.0;

struct Quantity {
  const char* name;
  double (*error_m)(const Outcome&);
};
constexpr std::array kQuantities = {
    Quantity{"size of action 1", normal_error},
    Quantity{"size of action 2", reaching_error},
    Quantity{"reach", reach_error},
};

std::vector<double> sizes_of(const std::vector<Outcome>& outcomes, const Quantity& q) {
  return values_of(outcomes, [&](const Outcome& o) { return std::abs(q.error_m(o)); });
}

/// Trials per millimetre of error; the last bin holds what is larger, or never came about.
std::vector<double> histogram(const std::vector<double>& errors_m) {
  std::vector<double> count(static_cast<std::size_t>(kMost_mm / kBin_mm), 0.0);
  for (const double e : errors_m) {
    const double bin = 1e3 * e / kBin_mm;
    const double last = static_cast<double>(count.size()) - 1.0;
    ++count[static_cast<std::size_t>(bin < last ? bin : last)];
  }
  return count;
}

std::filesystem::path plot(const std::filesystem::path& dir, DrawerStudy& study) {
  std::vector<plot::Data> data;
  std::string script =
      "set multiplot layout 1,3\nset style fill solid 0.6 noborder\nset yrange [0:*]\nset ytics "
      "2\nset xlabel "
      "'error [mm]'\nset xrange [0:12]\nset arrow 1 from 10, graph 0 to 10, graph 1 nohead dt 2 lc "
      "rgb '#404040'\nset label 1 'bound of the text' at 9.8, graph 0.45 right\n";
  for (std::size_t k = 0; k < kQuantities.size(); ++k) {
    script += "set title " + plot::quoted(kQuantities[k].name) + "\n";
    if (k == 0) script += "set ylabel 'trials'\n";
    if (k == 1) script += "unset ylabel\n";
    std::string curves;
    for (std::size_t i = 0; i < kSources.size(); ++i) {
      const std::vector<double> count =
          histogram(sizes_of(study.resynthesis(kSources[i]), kQuantities[k]));
      plot::Data d{"h" + std::to_string(k) + std::to_string(i), {}};
      for (std::size_t b = 0; b < count.size(); ++b) {
        d.rows.push_back(
            {(static_cast<double>(b) + 0.2 + 0.3 * static_cast<double>(i)) * kBin_mm, count[b]});
      }
      data.push_back(d);
      curves += (i ? ", $" : "$") + d.name + " with boxes lt " + std::to_string(i + 1) +
                " title '" + kSources[i].text() + "'";
    }
    script += "set boxwidth 0.28\nplot " + curves + "\n";
  }
  const auto file = dir / "fig-3.41.png";
  plot::plot_png(file, 1200, 380, data, script + "unset multiplot\n");
  return file;
}

}  // namespace

reproduce::Report accuracy(const std::optional<std::filesystem::path>& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  reproduce::Report report;
  for (const Sources& s : kSources) {
    const auto outcomes = study.resynthesis(s);
    report.rows.push_back(reproduce::near(s.text() + " sources: falls", falls(outcomes), 0, 0, "1",
                                          "none is told of"));
    std::vector<double> all;
    for (const Quantity& q : kQuantities) {
      const std::vector<double> e = sizes_of(outcomes, q);
      all.insert(all.end(), e.begin(), e.end());
      report.rows.push_back(reproduce::within(s.text() + " sources: " + q.name + ", largest error",
                                              largest(outcomes, q.error_m), kMostError_m, "m",
                                              "\"always below 10 mm\" [M18 3.8.3]"));
    }
    const auto small =
        static_cast<double>(std::ranges::count_if(all, [](double e) { return e < 0.005; }));
    report.rows.push_back(reproduce::at_least(s.text() + " sources: share of errors below 5 mm",
                                              small / static_cast<double>(all.size()), 0.5, "1",
                                              "\"often below 5 mm\" [M18 3.8.3]"));
  }
  if (plot_dir) report.plots.push_back(plot(*plot_dir, study));
  return report;
}

}  // namespace mimesis::walk
