// A leader and its group [M18 4.3.7, fig. 4.7].
#include <array>
#include <cmath>
#include <random>
#include <sstream>
#include <string>

#include "common/math/circle.h"
#include "common/plot/gnuplot.h"
#include "experiments/crowd/crowds.h"
#include "experiments/crowd/figures.h"
#include "experiments/harness/statistics.h"
#include "nodes/crowd/certificate/rate_fit.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using namespace reproduce;

constexpr int kFollowers = 4;  // five characters with the leader, as in the movies
constexpr double kLedStep_s = 0.01;

/// The leader is the first.
Crowd led(double k, double alpha, std::span<const double> phases) {
  Rules rules;
  rules.phase = {{Topology::all_to_all}, k, alpha};
  return one_group(rules, phases, kLedStep_s);
}

Crowd led_from_anywhere(double k, double alpha, std::mt19937_64& draw) {
  return led(k, alpha, uniform(kFollowers + 1, 0.0, math::kTwoPi, draw));
}

std::vector<double> to_leader(const Crowd& crowd) {
  std::vector<double> out;
  for (const double phi : crowd.phase_rad().subspan(1)) {
    out.push_back(math::wrap_pi(phi - crowd.phase_rad()[0]));
  }
  return out;
}

struct Rates {
  double mutual, tracking;
};

/// Median rates over random starts.
Rates measure(double k, double alpha) {
  std::vector<double> mutual, tracking;
  std::mt19937_64 draw(7);
  for (int trial = 0; trial < 20; ++trial) {
    RateFit group(1e-6, 3e-2), leader(1e-6, 3e-2);
    for (Crowd crowd = led_from_anywhere(k, alpha, draw); crowd.time_s() < 18.0 / alpha;
         crowd.step()) {
      const auto off = to_leader(crowd);
      group.add(crowd.time_s(), dispersion(off));
      leader.add(crowd.time_s(), std::abs(circular_sum(off).angle()));
    }
    mutual.push_back(group.rate_1_s().value_or(std::nan("")));
    tracking.push_back(leader.rate_1_s().value_or(std::nan("")));
  }
  return {median(mutual), median(tracking)};
}

/// Mean R after some gait cycles.
double dispersion_after(double k, double alpha, int cycles) {
  std::mt19937_64 draw(11);
  std::vector<double> r;
  for (int trial = 0; trial < 20; ++trial) {
    Crowd crowd = led_from_anywhere(k, alpha, draw);
    while (crowd.time_s() < cycles * math::kTwoPi / kOmega_rad_s) crowd.step();
    r.push_back(dispersion(to_leader(crowd)));
  }
  return mean(r);
}

/// Stages as in the movies: uncoupled, coupled, the leader is pushed, a member is pushed.
constexpr double kCoupled_s = 6.0, kLeader_s = 36.0, kMember_s = 66.0, kEnd_s = 90.0;

Data scene() {
  Data out{"scene", {}};
  Crowd crowd = led(0.0, 0.0, std::array{1.1, 0.4, 2.2, 4.0, 5.3});
  const auto push = [&](AgentId id) {
    AgentState state = crowd.find(id)->state;
    state.phase_rad += 2.0;
    return crowd.set_state(id, state);
  };
  for (int n = 0; n * kLedStep_s < kEnd_s; ++n, crowd.step()) {
    if (n == std::lround(kCoupled_s / kLedStep_s)) {
      crowd.set_rules(0, {.phase = {{Topology::all_to_all}, 0.2, 0.25}});
    }
    if (n == std::lround(kLeader_s / kLedStep_s) && !push(1)) break;
    if (n == std::lround(kMember_s / kLedStep_s) && !push(3)) break;
    if (n % 5 != 0) continue;
    const auto off = to_leader(crowd);
    out.rows.push_back({crowd.time_s(), off[0], off[1], off[2], off[3], dispersion(off),
                        std::abs(circular_sum(off).angle())});
  }
  return out;
}

void plot_leader(const std::filesystem::path& png) {
  std::ostringstream s;
  const auto bar = [&](int id, double from, double to, const char* colour) {
    s << "set object " << id << " rect from " << from << ",-4.1 to " << to << ",-3.6 fc rgb '"
      << colour << "' fs solid 1 noborder\n";
  };
  s << "set multiplot layout 2,1 title 'A leader and four followers, k = 0.2/s, α = 0.25/s'\n"
       "set lmargin 11\nset rmargin 24\nset grid\nset xrange [0:90]\nset key outside right\n"
       "set yrange [-4.2:3.6]\nset ylabel 'phase - leader [rad]'\n";
  bar(1, 0.0, kCoupled_s, "#e8c840");
  bar(2, kCoupled_s, kEnd_s, "#4aa860");
  bar(3, kLeader_s, kLeader_s + 6.0, "#c8371e");
  bar(4, kMember_s, kMember_s + 6.0, "#c8371e");
  s << "set label 1 'uncoupled' at 0.5,-3.25\nset label 2 'coupled' at 16,-3.25\n"
       "set label 3 'leader pushed by 2 rad' at 36.5,-3.25\n"
       "set label 4 'follower 2 pushed' at 66.5,-3.25\nplot ";
  for (int i = 0; i < kFollowers; ++i) {
    s << (i ? ", " : "") << "$scene using 1:" << i + 2 << " with points ls " << i + 1
      << " pt 7 ps 0.25 title 'follower " << i + 1 << "'";
  }
  s << "\nunset object 1\nunset object 2\nunset object 3\nunset object 4\nunset label 1\nunset "
       "label 2\nunset label "
       "3\nunset label 4\nset logscale y\nset yrange [1e-6:4]\nset format y '%.0e'\n"
       "set xlabel 'time [s]'\nset ylabel 'distance'\n"
       "plot $scene using 1:6 with lines ls 1 title 'in the group, R', $scene using 1:7 with lines "
       "ls 2 title 'mean to leader', "
    << "(x > 38 && x < 60) ? 2.2*exp(-0.25*(x-36)) : NaN with lines dt 2 lw 1.5 lc rgb '#404040' "
       "title 'exp(-αt)', (x > 7.5 && x < 20) ? 1.2*exp(-1.05*(x-6)) : NaN with lines dt 3 lw 1.5 "
       "lc rgb '#404040' title 'exp(-(kN+α)t)', (x > 67 && x < 80) ? 0.8*exp(-1.05*(x-66)) : NaN "
       "with lines dt 3 lw 1.5 lc rgb '#404040' notitle\nunset multiplot";
  plot::plot_png(png, 1000, 680, {scene()}, s.str());
}

Report leader(const PlotDir& dir) {
  Report report;
  for (const auto& [k, alpha] : {std::pair{0.2, 0.25}, {0.35, 0.25}, {0.3, 0.1}, {0.01, 1.0}}) {
    const Rates r = measure(k, alpha);
    std::ostringstream name;
    name << "k = " << k << ", α = " << alpha << ": ";
    const double group = k * kFollowers + alpha;
    report.near(name.str() + "rate in the group", r.mutual, closed_form(group, "kN + α"),
                0.02 * group, "1/s");
    report.near(name.str() + "rate to the leader", r.tracking, closed_form(alpha, "α, not kN + α"),
                0.02 * alpha, "1/s");
  }
  report.at_least(
      "k = 0.01, α = 0: R after 20 cycles", dispersion_after(0.01, 0.0, 20), 0.2, "1",
      "movie 6: no coordinated behaviour; R of random phases is 0.7, and exp(-kNt) 0.43");
  report.at_most("k = 0.01, α = 1: R after 20 cycles", dispersion_after(0.01, 1.0, 20), 1e-6, "1",
                 "movie 7: a leader makes it fast");
  if (dir) plot_leader(report.picture(*dir / "fig-4.7.png"));
  return report;
}

}  // namespace

void add_leader_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-4.7", "a leader and its group: kN + α among them, α to the leader", "M18",
                  Declared{.closed_form = 8, .goal = 2}, leader);
}

}  // namespace mimesis::crowd
