#include "common/model/files.h"
#include "common/reproduce/gnuplot.h"
#include "nodes/walker/figures/figures.h"
#include "nodes/walker/figures/filtered_walk.h"

namespace mimesis::walker {
namespace {

using reproduce::Data;
using reproduce::Report;

constexpr double kSpeed_m_s = 0.3, kArms = 1.0;

void plot(const std::filesystem::path& png, const FilteredWalk& full, const FilteredWalk& legs) {
  Data reference{"reference", {}}, unfiltered{"unfiltered", {}}, legs_only{"legs_only", {}},
      full_body{"full_body", {}};
  for (std::size_t i = 0; i < full.ticks.size(); ++i) {
    const FilteredWalk::Tick &f = full.ticks[i], &l = legs.ticks[i];
    const double t = f.time_s, x = f.planned_m.x();
    reference.rows.push_back({t, x});
    unfiltered.rows.push_back({t, x + f.error_before_m.x()});
    legs_only.rows.push_back({t, x + l.error_after_m.x()});
    full_body.rows.push_back({t, x + f.error_after_m.x()});
  }
  reproduce::plot_png(png, 1000, 560, {reference, unfiltered, legs_only, full_body},
                      R"(set xlabel 'time [s]'; set ylabel 'x_{ZMP} [m]'
set xrange [4:8]; set key top left; set grid
plot $reference with lines lw 3 lc rgb '#1f4fd0' title 'x_{ZMP}^{reference}', \
  $unfiltered with lines lw 2 dt 4 lc rgb '#2ca02c' title 'x_{ZMP}^{unfiltered}', \
  $legs_only with lines lw 2 dt 4 lc rgb '#c020c0' title 'x_{ZMP}^{DF (legs only)}', \
  $full_body with lines lw 2 dt 4 lc rgb '#ff8c00' title 'x_{ZMP}^{DF (full body)}'
)");
}

Report figure(const std::optional<std::filesystem::path>& plot_dir) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  const FilteredWalk full = filtered_walk(biped, kSpeed_m_s, kArms, {}),
                     legs = filtered_walk(biped, kSpeed_m_s, kArms, {.legs_only = true}),
                     twice = filtered_walk(biped, kSpeed_m_s, kArms, {.iterations = 2});
  const Eigen::Vector2d before = full.rms_before_m(), once = full.rms_after_m(),
                        second = twice.rms_after_m(), frozen = legs.rms_after_m();
  const std::string curves = "fig. 3.43 shows curves without figures; ";
  const std::string measured = curves + "8x and 4x were measured in a trial of this method";
  Report report;
  for (const int axis : {0, 1}) {
    const std::string name = axis == 0 ? "x" : "y";
    report.rows.push_back(
        reproduce::at_least("rms ZMP error in " + name + ", unfiltered / full body",
                            before[axis] / once[axis], axis == 0 ? 6.0 : 3.0, "1", measured));
    report.rows.push_back(reproduce::at_least(
        "rms ZMP error in " + name + ", legs only / full body", frozen[axis] / once[axis], 1.3, "1",
        curves + "the magenta curve is clearly worse than the orange one"));
    report.rows.push_back(reproduce::at_least(
        "rms ZMP error in " + name + ", unfiltered / legs only", before[axis] / frozen[axis], 1.5,
        "1", curves + "the green curve is clearly worse than the magenta one"));
    report.rows.push_back(reproduce::at_most(
        "rms ZMP error in " + name + ", full body, two iterations", 1e3 * second[axis],
        axis == 0 ? 1.5 : 1.0, "mm", curves + "1.2 and 0.5 mm were measured in a trial"));
  }
  report.rows.push_back(
      reproduce::holds("every leg reaches its planned sole",
                       full.unreachable + legs.unreachable + twice.unreachable == 0));
  if (plot_dir) {
    report.plots.push_back(*plot_dir / "fig-3.43.png");
    plot(report.plots.back(), full, legs);
  }
  return report;
}

}  // namespace

void add_filter_figure(std::vector<reproduce::Figure>& to) {
  to.push_back({.name = "fig-3.43",
                .title =
                    "ZMP in walking direction: planned, unfiltered, filter of the legs only and "
                    "of the full body",
                .source = "M18",
                .run = figure});
}

}  // namespace mimesis::walker
