#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "common/plot/gnuplot.h"
#include "experiments/fields/figures.h"
#include "nodes/cognition/neural_field.h"

namespace mimesis::cognition {
namespace {

using plot::Data;
using namespace reproduce;

constexpr double kDt_s = 0.001, kConstant_s = 10.0;
constexpr double kNever = std::numeric_limits<double>::quiet_NaN();

/// One field with a Gaussian input (σ = 5) at `site` for `pulse_s`, over constant `preshape` at two
/// sites.
struct Probe {
  double amplitude = 0.0, pulse_s = 0.2, preshape = 0.0;
  NeuralField<double> field = NeuralField<double>(FieldParams{}, kDt_s);
  static constexpr double kPg = 32.0, kFg = 96.0;

  void step(double t_s) {
    const double pg = preshape + (t_s >= 0.0 && t_s < pulse_s ? amplitude : 0.0);
    for (std::size_t i = 0; i < field.input().size(); ++i) {
      const auto x = static_cast<double>(i);
      field.input()[i] = pg * std::exp(-0.5 * std::pow((x - kPg) / 5.0, 2)) +
                         preshape * std::exp(-0.5 * std::pow((x - kFg) / 5.0, 2));
    }
    field.step();
  }
  double peak() const { return std::ranges::max(field.activity()); }

  /// Runs [from_s, to_s) and returns the first time with u > 0.
  double run(double from_s, double to_s) {
    double crossing_s = kNever;
    for (long i = std::lround(from_s / kDt_s); i < std::lround(to_s / kDt_s); ++i) {
      step(static_cast<double>(i) * kDt_s);
      if (std::isnan(crossing_s) && peak() > 0.0) crossing_s = static_cast<double>(i + 1) * kDt_s;
    }
    return crossing_s;
  }
};

/// Smallest amplitude that ignites, by bisection; what counts is activity at 2 s.
double threshold(double pulse_s) {
  double lo = 0.0, hi = 6.0;
  while (hi - lo > 1e-3) {
    const double middle = 0.5 * (lo + hi);
    Probe probe{.amplitude = middle, .pulse_s = pulse_s};
    probe.run(0.0, 2.0);
    (probe.peak() > 0.0 ? hi : lo) = middle;
  }
  return hi;
}

Data curve(const std::string& name, Probe probe, double from_s, double to_s) {
  Data d{name, {}};
  for (long i = std::lround(from_s / kDt_s); i < std::lround(to_s / kDt_s); ++i) {
    probe.step(static_cast<double>(i) * kDt_s);
    d.rows.push_back({static_cast<double>(i + 1), probe.peak()});
  }
  return d;
}

Report bistability(const PlotDir&) {
  Report report;
  Probe rest, pulse{.amplitude = 6.0};
  rest.run(0.0, 2.0);
  report.near("activity at rest", rest.peak(), closed_form(-3.0, "h of eq. 2.1"), 0.01, "1");
  pulse.run(0.0, 2.0);
  const auto wide = std::ranges::count_if(pulse.field.activity(), [](double u) { return u > 0; });
  report.near("peak 2 s after a pulse of 6 for 200 ms", pulse.peak(), prototype(6.76, "fields.md"),
              0.02, "1");
  report.near("neurons above 0 in that peak", static_cast<double>(wide),
              prototype(9.0, "fields.md"), 0.0, "1");
  report.at_most("its max |du/dt| at 2 s", pulse.field.speed_1_s(), 1.0, "1/s",
                 "a pattern that stays moves by less than 1e-3 per ms");
  const double brief = threshold(0.2);
  report.near("threshold amplitude, 200 ms", brief, prototype(2.26, "fields.md"), 0.03, "1");
  report.near("threshold amplitude, constant input", threshold(kConstant_s),
              prototype(2.18, "fields.md"), 0.03, "1");
  Probe below{.amplitude = 0.95 * brief};
  below.run(0.0, 0.7);
  report.at_most("activity 500 ms after a pulse of 0.95 threshold", below.peak(), -2.9, "1",
                 "back at rest");
  return report;
}

void plot_preshape(const std::filesystem::path& png, double preshape, double input) {
  Probe probe{.amplitude = input, .pulse_s = kConstant_s, .preshape = preshape};
  probe.run(-1.0, -0.06);
  Data surface{"surface", {}};
  for (long i = -60; i <= 150; ++i) {
    probe.step(static_cast<double>(i) * kDt_s);
    if (i % 6 != 0) continue;
    const auto u = probe.field.activity();
    for (std::size_t x = 0; x < u.size(); x += 2) {
      surface.rows.push_back({static_cast<double>(x), static_cast<double>(i), u[x]});
    }
    surface.rows.emplace_back();  // a blank line ends a scan
  }
  std::ostringstream script;
  script
      << "set multiplot\nset size 0.56,1\nset origin 0,0\nunset key\nset border 31 lc rgb "
         "'#909090'\n"
         "set title 'A   u(x, t), input at PG from t = 0' font 'sans,12'\nset xtics ('PG' 32, 'FG' "
         "96)\n"
         "set ylabel 't [ms]' offset -1,-1\nset zlabel 'u' rotate\nset zrange [-5:15]\nset "
         "ticslevel 0\n"
         "set view 52,30\nset hidden3d\nset xrange [0:127]\nset yrange [-60:150]\n"
         "splot $surface using 1:2:3 with lines lc rgb '#1f4e9c' lw 0.8\n"
         "set size 0.44,1\nset origin 0.56,0\nset border 3\nset key top left opaque\nunset "
         "hidden3d\n"
         "set title 'B   most active neuron' font 'sans,12'\nset xtics autofreq\nset xlabel 't "
         "[ms]'\n"
         "set ylabel 'max u' offset 0,0\nset xrange [-60:150]\nset yrange [-4:14]\n"
         "set arrow from 0,graph 0 to 0,graph 1 nohead lt 7 dt 3\n"
         "plot 0 lt 7 dt 2 notitle, $with using 1:2 with lines lt 1 title 'with preshape', "
         "$without using 1:2 with lines lt 1 dt 2 title 'without', "
         "$alone using 1:2 with lines lt 7 title 'preshape alone'\nunset multiplot";
  const auto late = [&](const char* name, double amplitude, double level) {
    return curve(name, {.amplitude = amplitude, .pulse_s = kConstant_s, .preshape = level}, -1.0,
                 0.15);
  };
  std::vector<Data> data = {surface};
  data.push_back(late("with", input, preshape));
  data.push_back(late("without", input, 0.0));
  data.push_back(late("alone", 0.0, preshape));
  plot::plot_png(png, 1100, 460, data, script.str());
}

Report preshape(const PlotDir& plot_dir) {
  constexpr double kThreshold = 2.18;  // constant input, see field-bistability
  const double level = 0.5 * kThreshold, input = 1.25 * kThreshold;
  Report report;
  Probe alone{.preshape = level};
  const double never = alone.run(-1.5, 1.5);
  report.near("activity under preshape alone", alone.peak(), prototype(-1.91, "fields.md"), 0.05,
              "1");
  report.holds("preshape alone never crosses 0", std::isnan(never), published("M18 2.2.2"));

  Probe plain{.amplitude = input, .pulse_s = kConstant_s};
  Probe ready{.amplitude = input, .pulse_s = kConstant_s, .preshape = level};
  const double plain_s = plain.run(-1.0, 1.0), ready_s = ready.run(-1.0, 1.0);
  report.near("crossing without preshape", 1000 * plain_s, prototype(54.0, "fields.md"), 3.0, "ms");
  report.near("crossing with preshape", 1000 * ready_s, prototype(19.0, "fields.md"), 3.0, "ms");
  report.at_least("speed-up", plain_s / ready_s, 2.5, "1",
                  "preshape drastically alters the time course (text of 2.2.2)");
  const double loser = ready.field.activity()[static_cast<std::size_t>(Probe::kFg)];
  report.at_most("activity of the alternative FG in the end", loser,
                 published(alone.peak(), "M18 2.2.2"), "1",
                 "suppressed below its preshape (panel A)");
  if (plot_dir) plot_preshape(report.picture(*plot_dir / "fig-2.4.png"), level, input);
  return report;
}

}  // namespace

void add_field_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("field-bistability", "One field holds what a transient input ignited (eq. 2.1)",
                  "M18", Declared{.closed_form = 1, .prototype = 4, .goal = 2}, bistability);
  to.emplace_back("fig-2.4", "A decision, and how preshape speeds it up", "M18",
                  Declared{.published = 2, .prototype = 3, .goal = 1}, preshape);
}

}  // namespace mimesis::cognition
