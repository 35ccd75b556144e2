// Crowds of 16, 36 and 49 that order themselves [M18 4.4.2, 4; fig. 4.10; M10].
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "common/plot/gnuplot.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/formation_runs.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using namespace reproduce;

constexpr double kRadius_m = 0.25;

Gait walk() {
  return {.name = "walk",
          .eigenfrequency_rad_s = 5.7,
          .mean_m_rad = 0.2,
          .cosine_m_rad = {0.0, 0.04},
          .sine_m_rad = {0.01}};
}

Group square(int columns) {
  Group group;
  group.count = columns * columns;
  group.radius_m = kRadius_m;
  group.formation = {.shape = Shape::grid, .spacing_m = 1.5, .across_m = 1.2, .columns = columns};
  return group;
}

HeadingRule lanes() { return {.kind = HeadingKind::lane, .gain = 0.6, .ahead_m = 2.0}; }

/// Rules II, III and IV: the ones that are certified.
Rules ordering(int n, double length_1_m, double phase_1_s) {
  Rules rules;
  rules.length = {{Topology::all_to_all}, length_1_m / n, 0.45};
  rules.phase = {{Topology::all_to_all}, phase_1_s / n, 0.0};
  rules.heading = lanes();
  return rules;
}

/// From disorder: agents in each other's way walk round each other first.
FormationRun sixteen() {
  FormationRun run{square(4), walk(), {}, 90.0, 3};
  run.group.start = {.arrangement = Arrangement::box, .length_m = 9.0, .width_m = 7.0};
  Rules first = ordering(16, 0.3, 1.0);
  first.phase = {};
  first.heading.avoid = true;
  run.stages = {{0.0, first}, {30.0, ordering(16, 0.32, 1.0)}};
  return run;
}

FormationRun thirty_six() {
  FormationRun run{square(6), walk(), {}, 60.0, 2};
  run.group.start = {.arrangement = Arrangement::grid,
                     .spacing_m = 2.0,
                     .across_m = 1.4,
                     .columns = 6,
                     .jitter_m = 0.4};
  run.stages = {{0.0, ordering(36, 0.4, 0.8)}};
  return run;
}

/// First by the frequency of steps, then by their length and in step.
FormationRun forty_nine(double length_1_m) {
  FormationRun run{square(7), walk(), {}, 80.0, 1};
  run.group.start = {.arrangement = Arrangement::grid,
                     .spacing_m = 2.2,
                     .across_m = 1.6,
                     .columns = 7,
                     .jitter_m = 0.5};
  Rules first;
  first.frequency = {{Topology::all_to_all}, 1.0 / 49.0, 150.0, 0.0};
  first.heading = lanes();
  run.stages = {{0.0, first}, {12.0, ordering(49, length_1_m, 0.8)}};
  return run;
}

void rows_of(const std::string& name, const FormationOutcome& o, Report& report) {
  report.at_most(name + "in formation within 1 cm at", o.formed_s, 60.0, "s",
                 "and still at the end");
  const double last_s = std::log(kNear_m / kFormed_m) / o.expected_length_1_s;
  report.near(name + "from 10 to 1 cm", o.formed_s - o.near_s,
              closed_form(last_s, "ln 10 / m_z ω⟨g⟩N"), 0.1 * last_s, "s",
              "phases are not quite in step yet");
  report.near(name + "rate of the formation error", o.length_rate_1_s,
              closed_form(o.expected_length_1_s, "m_z ω⟨g⟩N"), 0.01 * o.expected_length_1_s, "1/s");
  report.near(name + "rate of the dispersion of phases", o.phase_rate_1_s,
              closed_form(o.expected_phase_1_s, "kN"), 0.01 * o.expected_phase_1_s, "1/s");
}

Data agents(const std::string& name, const Snapshot& s) {
  Data out{name, {}};
  for (std::size_t i = 0; i < s.z_m.size(); ++i) {
    out.rows.push_back({s.z_m[i], s.lane_m[i], s.phase_rad[i], 0.45 * std::cos(s.heading_rad[i]),
                        0.45 * std::sin(s.heading_rad[i])});
  }
  return out;
}

Data errors(const std::string& name, const FormationOutcome& o) {
  Data out{name, {}};
  for (const auto& s : o.samples) {
    out.rows.push_back({s.time_s, s.error_m, s.lane_error_m, s.dispersion});
  }
  return out;
}

std::string top_view(const std::string& data, const std::string& title, double half_m) {
  std::ostringstream s;
  s << "set title '" << title << "'\nset xrange [" << -half_m << ':' << half_m << "]\nset yrange ["
    << -half_m << ':' << half_m << "]\nplot $" << data << " using 1:2:(" << kRadius_m
    << "):3 with circles lc palette fs solid 0.85 notitle, $" << data
    << " using 1:2:4:5 with vectors nohead lw 1.4 lc rgb '#202020' notitle\n";
  return s.str();
}

constexpr const char* kViews =
    "set style fill solid 1 noborder\nset size ratio -1\nset grid\nset xlabel 'along, from the "
    "middle [m]'\nset ylabel 'across "
    "[m]'\nset cbrange [0:6.2832]\nset palette defined (0 '#1f4e9c', 1.57 '#2b8c4a', 3.14 "
    "'#d08a10', 4.71 '#c8371e', 6.2832 '#1f4e9c')\nset cblabel 'phase [rad]'\n";

std::string mark(double at_s, const std::string& what, int id) {
  std::ostringstream s;
  s << "set arrow " << id << " from " << at_s << ", graph 0 to " << at_s
    << ", graph 1 nohead dt 2 lc rgb '#606060'\nset label " << id << " '" << what << "' at " << at_s
    << ", graph 0.05 rotate by 90 offset -0.6,0\n";
  return s.str();
}

constexpr const char* kErrors =
    "set size noratio\nset logscale y\nset format y '%.0e'\nset yrange [1e-7:30]\nset xlabel "
    "'time [s]'\nset ylabel 'error'\nset key top right\n";

void plot(const std::filesystem::path& png, const std::string& title, const FormationRun& run,
          const FormationOutcome& o) {
  std::vector<Data> data{errors("e", o)};
  double half_m = 0.0;
  for (std::size_t i = 0; i < o.snapshots.size(); ++i) {
    data.push_back(agents("s" + std::to_string(i), o.snapshots[i]));
    for (const double z : o.snapshots[i].z_m) half_m = std::max(half_m, std::abs(z) + 1.0);
    for (const double y : o.snapshots[i].lane_m) half_m = std::max(half_m, std::abs(y) + 1.0);
  }
  std::ostringstream s;
  s << "set multiplot layout " << (o.snapshots.size() > 2 ? "2,2" : "1,3") << " title '" << title
    << "'\n"
    << kViews;
  for (std::size_t i = 0; i < o.snapshots.size(); ++i) {
    std::ostringstream name;
    name << "t = " << std::lround(o.snapshots[i].time_s) << " s";
    s << top_view("s" + std::to_string(i), name.str(), half_m);
  }
  s << kErrors << "set title 'errors'\nset xrange [0:" << run.until_s << "]\n";
  if (run.stages.size() > 1) s << mark(run.stages.back().at_s, "rules II, III, IV", 1);
  s << "plot $e using 1:2 with lines title 'along [m]', $e using 1:3 with lines title 'across "
       "[m]', $e using 1:4 with lines title 'R of phases', 0.01 with lines dt 3 lw 1 lc rgb "
       "'#404040' title '1 cm'\nunset multiplot";
  const bool square = o.snapshots.size() > 2;
  plot::plot_png(png, square ? 1150 : 1500, square ? 860 : 460, data, s.str());
}

Report of_sixteen(const PlotDir& dir) {
  const FormationRun r = sixteen();
  const FormationOutcome o = run(r);
  Report report;
  rows_of("", o, report);
  report.near("agents in another's disc while they avoid, sum over steps", o.overlapping, goal(0),
              0, "1");
  report.at_least("least distance of centres while they avoid", o.least_distance_m,
                  2.0 * kRadius_m - 1e-6, "m", "two radii");
  if (dir)
    plot(report.picture(*dir / "formation-16.png"),
         "16 agents: around each other, then into formation", r, o);
  return report;
}

Report of_thirty_six(const PlotDir& dir) {
  const FormationRun r = thirty_six();
  const FormationOutcome o = run(r);
  Report report;
  rows_of("", o, report);
  if (dir)
    plot(report.picture(*dir / "formation-36.png"), "36 agents order themselves and fall into step",
         r, o);
  return report;
}

Report of_forty_nine(const PlotDir& dir) {
  Report report;
  std::vector<FormationOutcome> all;
  for (const double m : {0.16, 0.4}) {
    const FormationRun r = forty_nine(m);
    all.push_back(run(r));
    std::ostringstream name;
    name << "m_z N = " << m << "/m: ";
    rows_of(name.str(), all.back(), report);
  }
  if (dir) {
    report.plots.push_back(*dir / "formation-49.png");
    const auto& views = all[1].snapshots;
    std::ostringstream s;
    s << "set multiplot layout 2,2 title '49 agents: by step frequency until 12 s, then by step "
         "length and in step'\n"
      << kViews << top_view("a", "t = 0 s", 8.5) << top_view("b", "t = 12 s", 8.5)
      << top_view("c", "t = 80 s, m_z N = 0.4/m", 8.5) << kErrors
      << "set title 'error along, two strengths of distance to step length'\nset xrange [0:80]\n"
      << mark(12.0, "rules II, III, IV", 1)
      << "plot $e0 using 1:2 with lines ls 5 title 'm_z N = 0.16/m', $e1 using 1:2 with lines ls 1 "
         "title 'm_z N = 0.4/m', $e1 using 1:4 with lines ls 3 title 'R of phases', 0.01 with "
         "lines dt 3 lw 1 lc rgb '#404040' title '1 cm'\nunset multiplot";
    plot::plot_png(report.plots.back(), 1150, 860,
                   {agents("a", views[0]), agents("b", views[1]), agents("c", views[2]),
                    errors("e0", all[0]), errors("e1", all[1])},
                   s.str());
  }
  return report;
}

}  // namespace

void add_formation_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("formation-16", "16 agents order themselves out of a crowd", "M18",
                  Declared{.closed_form = 3, .goal = 3}, of_sixteen);
  to.emplace_back("formation-36", "36 agents order themselves in step", "M10",
                  Declared{.closed_form = 3, .goal = 1}, of_thirty_six);
  to.emplace_back("formation-49", "49 agents, two strengths of step-length control", "M18",
                  Declared{.closed_form = 6, .goal = 2}, of_forty_nine);
}

}  // namespace mimesis::crowd
