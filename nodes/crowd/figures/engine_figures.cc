// Nobody overlaps, everybody arrives; how the time of a step grows with the crowd.
#include <algorithm>
#include <chrono>
#include <ctime>
#include <memory>
#include <string>

#include "common/parallel/team.h"
#include "common/reproduce/gnuplot.h"
#include "nodes/crowd/figures/crowds.h"
#include "nodes/crowd/figures/figures.h"

namespace mimesis::crowd {
namespace {

using reproduce::Data;
using reproduce::near;
using reproduce::Report;
using reproduce::Row;
using PlotDir = std::optional<std::filesystem::path>;

/// Steps until all have arrived, at most `until_s`; ways of every tenth agent for the plot.
struct Passage {
  double least_gap_m = 1e9, time_s = 0.0;
  int overlaps = 0, arrived = 0;
  std::vector<Data> ways;
};

Passage pass(Crowd crowd, double until_s, int drawn) {
  Passage p;
  for (int i = 0; i < drawn; ++i) p.ways.push_back({"way" + std::to_string(i), {}});
  for (int step = 0; crowd.time_s() < until_s; ++step) {
    if (step % 25 == 0) {
      for (int i = 0; i < drawn; ++i) {
        const auto row = static_cast<std::size_t>(i * crowd.size() / drawn);
        p.ways[static_cast<std::size_t>(i)].rows.push_back({crowd.x_m()[row], crowd.y_m()[row]});
      }
      p.arrived = arrived(crowd, 0.5);
      if (p.arrived == crowd.size()) break;
    }
    crowd.step();
    p.overlaps += crowd.contacts().overlapping;
    p.least_gap_m = std::min(p.least_gap_m, crowd.contacts().least_gap_m);
    p.time_s = crowd.time_s();
  }
  return p;
}

void report_passage(const Passage& p, int all, double free_s, Report& report) {
  report.rows.push_back(near("agents that arrive", p.arrived, all, 0.0, "1"));
  report.rows.push_back(near("overlaps, over all steps", p.overlaps, 0.0, 0.0, "1"));
  report.rows.push_back(reproduce::at_least("least gap between discs", p.least_gap_m, 0.0, "m",
                                            "discs do not overlap"));
  report.rows.push_back(reproduce::at_most("time until the last arrives", p.time_s, 2.0 * free_s,
                                           "s", "twice the time of who is alone"));
}

void plot_ways(const std::filesystem::path& png, const std::string& title, const Passage& p) {
  std::string script =
      "set size ratio -1\nset grid\nset xlabel 'x [m]'\nset ylabel 'y [m]'\n"
      "set title '" +
      title + "'\nplot ";
  for (std::size_t i = 0; i < p.ways.size(); ++i) {
    script += (i > 0 ? ", $" : "$") + p.ways[i].name + " with lines lw 1 lc palette frac " +
              std::to_string(static_cast<double>(i) / static_cast<double>(p.ways.size())) +
              " notitle";
  }
  reproduce::plot_png(png, 800, 800, p.ways, "unset colorbox\n" + script);
}

Report circle(const PlotDir& dir) {
  const Passage p = pass(ring_crowd(250), 180.0, 50);
  Report report;
  report_passage(p, 250, 80.0 / (0.22 * 6.0), report);
  if (dir) {
    report.plots.push_back(*dir / "circle-250.png");
    plot_ways(report.plots.back(), "250 agents change places across a circle; ways of 50", p);
  }
  return report;
}

Report head_on(const PlotDir&) {
  const Passage p = pass(head_on_crowd(1000), 60.0, 0);
  Report report;
  report_passage(p, 2000, 10.0 / (0.22 * 6.0), report);
  return report;
}

/// Seconds of a step, the best of some: of processor time on one thread, else of wall time.
double step_s(Crowd crowd, int threads) {
  using Clock = std::chrono::steady_clock;
  const int steps = std::max(1, 200'000 / crowd.size());  // so many at a time, for coarse clocks
  const auto team = threads > 1 ? std::make_unique<parallel::Team>(threads) : nullptr;
  for (int i = 0; i < 3; ++i) crowd.step(team.get());
  double best = 1e9;
  const auto begin = Clock::now();
  for (int tries = 0; tries < 5 || Clock::now() - begin < std::chrono::milliseconds(300); ++tries) {
    const auto wall = Clock::now();
    const std::clock_t processor = std::clock();
    for (int i = 0; i < steps; ++i) crowd.step(team.get());
    const double wall_s = std::chrono::duration<double>(Clock::now() - wall).count();
    const double processor_s = static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC;
    best = std::min(best, threads > 1 || processor_s == 0.0 ? wall_s : processor_s);
    if (tries > 2 && Clock::now() - begin > std::chrono::seconds(4)) break;
  }
  return best / steps;
}

Report scaling(const PlotDir& dir) {
  Report report;
  std::vector<Data> data;
  const std::pair<const char*, Crowd (*)(int)> kinds[] = {{"full dynamics", crossing_crowd},
                                                          {"formation only", formation_crowd}};
  for (const auto& [kind, make] : kinds) {
    for (const int threads : {1, 2}) {
      Data curve{(make == crossing_crowd ? "full" : "formation") + std::to_string(threads), {}};
      for (int n = 100; n <= 1'000'000; n *= 10) {
        const double s = step_s(make(n), threads);
        curve.rows.push_back({static_cast<double>(n), n / s * 1e-6});
        const std::string what = std::string(kind) + ", " + std::to_string(n) + " agents, " +
                                 std::to_string(threads) + (threads > 1 ? " cores" : " core");
        const bool goal = threads == 1 && n == (make == crossing_crowd ? 10'000 : 1'000'000);
        if (goal) {
          report.rows.push_back(reproduce::at_least(what + ": steps a second", 1.0 / s, 60.0, "Hz",
                                                    "real time at 60 Hz, of processor time"));
        }
        const Row row{what,
                      n / s * 1e-6,
                      {},
                      0.0,
                      "M agent-steps/s",
                      true,
                      "measured here, the best step; bench_crowd has the medians"};
        report.rows.push_back(row);
      }
      data.push_back(curve);
    }
  }
  report.rows.push_back({"memory of an agent",
                         crossing_crowd(100).bytes_per_agent(),
                         {},
                         0.0,
                         "B",
                         true,
                         "without the cells of the grid"});
  // RVO2 2.0.3, one thread, reference/crowd.md: the better of its two scenarios.
  data.push_back({"peer", {{1e3, 1.51}, {1e4, 1.06}, {1e5, 1.76}}});
  if (dir) {
    report.plots.push_back(*dir / "crowd-scaling.png");
    reproduce::plot_png(
        report.plots.back(), 900, 600, data,
        "set logscale xy\nset grid\nset key top right\nset xlabel 'agents'\n"
        "set ylabel 'million agent-steps per second'\nset format x '10^%L'\n"
        "set title 'Steps of crowds; dashed: what 60 Hz need'\nset yrange [0.05:1000]\n"
        "plot $full1 with linespoints ls 1 title 'full dynamics, 1 core', $full2 with linespoints "
        "ls 2 title '2 cores', $formation1 with linespoints ls 3 title 'formation only, 1 core', "
        "$formation2 with linespoints ls 4 title '2 cores', $peer with points pt 7 lc rgb 'black' "
        "title 'RVO2 2.0.3, 1 core (reported)', 60e-6*x with lines dt 2 lc rgb '#606060' notitle");
  }
  return report;
}

}  // namespace

void add_engine_figures(std::vector<reproduce::Figure>& to) {
  to.push_back({"circle-250", "250 agents change places across a circle", "M18", circle});
  to.push_back({"head-on", "1000 pairs meet head on", "M18", head_on});
  to.push_back({"crowd-scaling", "Agent-steps per second from 1e2 to 1e6 agents", "own", scaling});
}

}  // namespace mimesis::crowd
