#include "experiments/pattern/figures.h"

#include "common/model/files.h"
#include "common/plot/gnuplot.h"
#include "nodes/walker/testing/filtered_walk.h"

namespace mimesis::walker {

namespace {

using plot::Data;
using reproduce::Report;

constexpr double kSpeed_m_s = 0.3, kArms = 1.0;

void plot(const std::filesystem::path& png, const FilteredWalk& full, const FilteredWalk& legs) {
  Data reference{"reference", {}}, unfiltered{"unfiltered", {}}, legs_only{"legs_only", {}},
      full_body{"full_body", {}};
  for (std::size_t i = 0; i < full.ticks.size(); ++i) {
    const FilteredWalk::Tick& tick = full.ticks[i];
    const double x = tick.planned_m.x();
    const auto add = [&](Data& to, double error) {
      to.rows.push_back({tick.time_s, x + error, 1e3 * error});
    };
    add(reference, 0.0);
    add(unfiltered, tick.error_before_m.x());
    add(legs_only, legs.ticks[i].error_after_m.x());
    add(full_body, tick.error_after_m.x());
  }
  plot::plot_png(png, 1000, 900, {reference, unfiltered, legs_only, full_body},
                 R"(set multiplot layout 2,1
set xrange [4:8]; set grid
set style line 11 lw 3 lc rgb '#1f4fd0'
set style line 12 lw 2 dt 4 lc rgb '#2ca02c'
set style line 13 lw 2 dt 4 lc rgb '#c020c0'
set style line 14 lw 2 dt 4 lc rgb '#ff8c00'
set ylabel 'x of the ZMP [m]'; set key top left
plot $reference using 1:2 with lines ls 11 title 'reference', \
  $unfiltered using 1:2 with lines ls 12 title 'unfiltered', \
  $legs_only using 1:2 with lines ls 13 title 'filter (legs only)', \
  $full_body using 1:2 with lines ls 14 title 'filter (full body)'
set xlabel 'time [s]'; set ylabel 'difference from the reference [mm]'; unset key
plot $reference using 1:3 with lines ls 11, $unfiltered using 1:3 with lines ls 12, \
  $legs_only using 1:3 with lines ls 13, $full_body using 1:3 with lines ls 14
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
  report.rows.push_back(reproduce::holds(
      "every leg reaches its planned sole",
      full.unreachable + legs.unreachable + twice.unreachable == 0, reproduce::goal()));
  if (plot_dir) {
    report.plots.push_back(*plot_dir / "fig-3.43.png");
    plot(report.plots.back(), full, legs);
  }
  return report;
}

}  // namespace

std::vector<reproduce::Figure> figures() {
  return {{.name = "fig-3.43",
           .title = "ZMP in walking direction: planned, unfiltered, filter of the legs only and "
                    "of the full body",
           .source = "M18",
           .rows = {.goal = 9},
           .compute = figure}};
}

}  // namespace mimesis::walker
