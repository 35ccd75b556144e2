// No agents overlap, all arrive.
#include <algorithm>

#include "experiments/crowd/crowds.h"
#include "experiments/crowd/figures.h"

namespace mimesis::crowd {
namespace {

using namespace reproduce;

/// Steps until all have arrived, at most `until_s`.
struct Passage {
  double least_gap_m = 1e9, time_s = 0.0;
  int overlaps = 0, arrived = 0;
};

Passage pass(Crowd crowd, double until_s) {
  Passage p;
  for (int step = 0; crowd.time_s() < until_s; ++step) {
    if (step % 25 == 0) {
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
  report.near("agents that arrive", p.arrived, goal(all), 0.0, "1");
  report.near("overlaps, over all steps", p.overlaps, goal(0), 0.0, "1");
  report.at_least("least gap between discs", p.least_gap_m, 0.0, "m", "discs do not overlap");
  report.at_most("time until the last arrives", p.time_s, 2.0 * free_s, "s",
                 "twice the time of who is alone");
}

Report circle(const PlotDir&) {
  const Passage p = pass(ring_crowd(250), 180.0);
  Report report;
  report_passage(p, 250, 80.0 / (0.22 * 6.0), report);
  return report;
}

Report head_on(const PlotDir&) {
  const Passage p = pass(head_on_crowd(1000), 60.0);
  Report report;
  report_passage(p, 2000, 10.0 / (0.22 * 6.0), report);
  return report;
}

}  // namespace

void add_engine_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("circle-250", "250 agents change places across a circle", "M18",
                  Declared{.goal = 4}, circle);
  to.emplace_back("head-on", "1000 pairs meet head on", "M18", Declared{.goal = 4}, head_on);
}

}  // namespace mimesis::crowd
