// Planning of the drawer task: the generated training data [M18 3.3].
#include <algorithm>
#include <cmath>

#include "common/plot/gnuplot.h"
#include "experiments/motion/figures.h"
#include "nodes/synthesizer/sequence/trials.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using plot::Data;
using plot::plot_png;
using reproduce::at_most;
using reproduce::closed_form;
using reproduce::holds;
using reproduce::near;
using reproduce::published;
using reproduce::Report;
using PlotDir = std::optional<std::filesystem::path>;

// Linear regression of y on x.
struct Regression {
  double slope = 0.0, r_squared = 0.0, p = 1.0;
};

// Probability of a larger |t| with an even number of degrees of freedom: the finite sum of
// Student's distribution (Abramowitz and Stegun 26.7.4).
double two_sided_p(double t, int degrees) {
  const double cos2 = degrees / (degrees + t * t), sine = std::sqrt(1.0 - cos2);
  double term = 1.0, sum = 1.0;
  for (int i = 2; i < degrees; i += 2) sum += term *= cos2 * (i - 1.0) / i;
  return 1.0 - sine * sum;
}

Regression regression(const VectorXd& x, const VectorXd& y) {
  const VectorXd a = x.array() - x.mean(), b = y.array() - y.mean();
  Regression r;
  r.slope = a.dot(b) / a.squaredNorm();
  r.r_squared = r.slope * a.dot(b) / b.squaredNorm();
  const int degrees = static_cast<int>(x.size()) - 2;
  r.p = two_sided_p(std::sqrt(r.r_squared * degrees / (1.0 - r.r_squared)), degrees);
  return r;
}

Report planning(const PlotDir& plot_dir) {
  const auto plans = draw_plans({.paces = {}});
  const auto n = static_cast<Index>(plans.size());
  VectorXd initial(n), first(n), second(n), last(n), depth(n);
  Data bars{"bars", {}};
  for (Index i = 0; i < n; ++i) {
    const TrialPlan& p = plans[static_cast<std::size_t>(i)];
    initial(i) = p.initial_distance_m();
    first(i) = p.normal_length_m;
    second(i) = p.reaching_length_m;
    last(i) = p.final_distance_m;
    depth(i) = p.object_depth_m;
    bars.rows.push_back({static_cast<double>(i + 1), depth(i), last(i), second(i), first(i)});
  }
  Report report;
  const Regression normal = regression(initial, first), reaching = regression(initial, second);
  report.rows.push_back(near("first action on initial distance: R²", normal.r_squared,
                             closed_form(0.08, "put in, M18 3.3.1"), 1e-6, "1"));
  report.rows.push_back(near("first action on initial distance: p", normal.p,
                             published(0.429, "M18 3.3.1"), 0.005, "1"));
  report.rows.push_back(near("second action on initial distance: R²", reaching.r_squared,
                             published(0.95, "M18 3.3.1"), 0.05, "1"));
  report.rows.push_back(near("second action on initial distance: log10 p", std::log10(reaching.p),
                             published(std::log10(1.4e-6), "M18 3.3.1"), 1.5, "1"));
  report.rows.push_back(
      near("nearest start", initial.minCoeff(), closed_form(2.34, "put in, M18 3.7"), 1e-6, "m"));
  report.rows.push_back(
      near("farthest start", initial.maxCoeff(), closed_form(2.94, "put in, M18 3.7"), 1e-6, "m"));
  report.rows.push_back(
      near("final distance, mean", last.mean(), closed_form(0.6, "put in, M18 3.4.2"), 0.02, "m"));
  report.rows.push_back(at_most("final distance, largest deviation",
                                (last.array() - last.mean()).abs().maxCoeff(), 0.05, "m",
                                "\"almost constant\""));
  report.rows.push_back(
      holds("final distance rises with the object's depth",
            regression(depth, last).slope > 0.0 && regression(depth, last).p < 0.05,
            closed_form("put in, M18 3.3.1")));
  report.rows.push_back(near("share of the first step: mean of half of action 1 over D - 0.6 m",
                             (0.5 * first.array() / (initial.array() - 0.6)).mean(),
                             closed_form(0.385, "put in, M18 3.4.2"), 0.02, "1"));
  if (plot_dir) {
    const auto png = *plot_dir / "fig-3.7.png";
    plot_png(png, 900, 480, {bars},
             "set style data histograms; set style histogram rowstacked\n"
             "set style fill solid 0.85 noborder; set boxwidth 0.7\n"
             "set xlabel 'trial, by initial distance'; set ylabel 'm from the object'\n"
             "set key outside right top invert; set yrange [0:*]\n"
             "plot $bars using 2:xtic(1) lc rgb '#3a66b0' title 'panel to object', "
             "'' using 3 lc rgb '#c8371e' title 'standing', "
             "'' using 4 lc rgb '#e8b820' title 'action 2', "
             "'' using 5 lc rgb '#2b8c4a' title 'action 1'\n");
    report.plots.push_back(png);
  }
  return report;
}

}  // namespace

void add_drawer_plan_figures(std::vector<reproduce::Figure>& to) {
  to.push_back({"fig-3.7",
                "how the way to the drawer is divided (generated trials)",
                "M18",
                {.published = 3, .closed_form = 6, .goal = 1},
                planning});
}

}  // namespace mimesis::synthesizer
