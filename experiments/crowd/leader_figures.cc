// A leader and its group [M18 4.3.7, fig. 4.7].
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <sstream>
#include <string>

#include "common/math/circle.h"
#include "common/math/integrator.h"
#include "common/plot/gnuplot.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/oscillators.h"
#include "experiments/crowd/statistics.h"
#include "nodes/crowd/certificate/rate_fit.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using reproduce::near;
using reproduce::Report;
using PlotDir = std::optional<std::filesystem::path>;

constexpr int kFollowers = 4;  // five characters with the leader, as in the movies
constexpr double kStep_s = 0.01;
using LedStates = Eigen::Matrix<double, 2, kFollowers + 1>;  // the leader is the last
using Angles = std::array<double, kFollowers>;

LedStates rate_of(const LedStates& x, double k, double alpha) {
  static const auto graph = CouplingGraph::make(Topology::all_to_all, kFollowers);
  const dmp::AndronovHopf oscillator{kOmega_rad_s};
  LedStates rate;
  rate.col(kFollowers) = oscillator.rate(x.col(kFollowers));
  Eigen::Matrix2Xd group = x.leftCols<kFollowers>(), group_rate(2, kFollowers);
  hopf_network_rate(graph, oscillator, k, {alpha, x.col(kFollowers)}, group, group_rate);
  rate.leftCols<kFollowers>() = group_rate;
  return rate;
}

LedStates step(const LedStates& x, double k, double alpha) {
  return math::rk4_step([&](double, const LedStates& s) { return rate_of(s, k, alpha); }, 0.0, x,
                        kStep_s);
}

Angles to_leader(const LedStates& x) {
  Angles out;
  const double leader = dmp::phase_of(x.col(kFollowers));
  for (int i = 0; i < kFollowers; ++i) {
    out[std::size_t(i)] = math::wrap_pi(dmp::phase_of(x.col(i)) - leader);
  }
  return out;
}

/// To the phases given, on the limit cycle.
LedStates at(const std::array<double, kFollowers + 1>& phases) {
  LedStates x;
  for (int i = 0; i <= kFollowers; ++i) {
    x.col(i) << std::cos(phases[std::size_t(i)]), std::sin(phases[std::size_t(i)]);
  }
  return x;
}

LedStates random_start(std::mt19937_64& draw) {
  std::uniform_real_distribution<double> uniform(0.0, 2.0 * std::numbers::pi);
  std::array<double, kFollowers + 1> phases;
  for (double& p : phases) p = uniform(draw);
  return at(phases);
}

struct Rates {
  double mutual, tracking;
};

/// Median rates over random starts, near synchrony: while the leader is far away, its pull acts by
/// α cos(distance) on differences in the group; hence the low window.
Rates measure(double k, double alpha) {
  std::vector<double> mutual, tracking;
  std::mt19937_64 draw(7);
  for (int trial = 0; trial < 20; ++trial) {
    RateFit group(1e-11, 1e-5), leader(1e-6, 3e-2);
    LedStates x = random_start(draw);
    for (double t = 0.0; t < 18.0 / alpha; t += kStep_s) {
      const Angles off = to_leader(x);
      group.add(t, dispersion(off));
      leader.add(t, std::abs(circular_sum(off).angle()));
      x = step(x, k, alpha);
    }
    mutual.push_back(group.rate_1_s().value_or(std::nan("")));
    tracking.push_back(leader.rate_1_s().value_or(std::nan("")));
  }
  return {median(mutual), median(tracking)};
}

/// R after some gait cycles.
double dispersion_after(double k, double alpha, int cycles) {
  std::mt19937_64 draw(11);
  double sum = 0.0;
  constexpr int kTrials = 20;
  for (int trial = 0; trial < kTrials; ++trial) {
    LedStates x = random_start(draw);
    for (double t = 0.0; t < cycles * 2.0 * std::numbers::pi / kOmega_rad_s; t += kStep_s) {
      x = step(x, k, alpha);
    }
    sum += dispersion(to_leader(x)) / kTrials;
  }
  return sum;
}

/// Stages as in the movies: uncoupled, coupled, the leader is pushed, a member is pushed.
constexpr double kCoupled_s = 6.0, kLeader_s = 36.0, kMember_s = 66.0, kEnd_s = 90.0;

Data scene() {
  Data out{"scene", {}};
  LedStates x = at({0.4, 2.2, 4.0, 5.3, 1.1});
  const auto push = [&](int i, double by) {
    x.col(i) = Eigen::Rotation2Dd(by).toRotationMatrix() * x.col(i);
  };
  for (int n = 0; n * kStep_s < kEnd_s; ++n) {
    const double t = n * kStep_s;
    if (n == std::lround(kLeader_s / kStep_s)) push(kFollowers, 2.0);
    if (n == std::lround(kMember_s / kStep_s)) push(1, 2.0);
    const Angles off = to_leader(x);
    if (n % 5 == 0) {
      out.rows.push_back({t, off[0], off[1], off[2], off[3], dispersion(off),
                          std::abs(circular_sum(off).angle())});
    }
    const bool on = t >= kCoupled_s;
    x = step(x, on ? 0.2 : 0.0, on ? 0.25 : 0.0);
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
    report.rows.push_back(
        near(name.str() + "rate in the group, kN + α", r.mutual, group, 0.02 * group, "1/s"));
    report.rows.push_back(near(name.str() + "rate to the leader, α (not kN + α)", r.tracking, alpha,
                               0.02 * alpha, "1/s"));
  }
  report.rows.push_back(reproduce::at_least(
      "k = 0.01, α = 0: R after 20 cycles", dispersion_after(0.01, 0.0, 20), 0.3, "1",
      "movie 6: no coordinated behaviour; random phases of four have R = 0.7"));
  report.rows.push_back(reproduce::at_most("k = 0.01, α = 1: R after 20 cycles",
                                           dispersion_after(0.01, 1.0, 20), 1e-6, "1",
                                           "movie 7: a leader makes it fast"));
  if (dir) {
    report.plots.push_back(*dir / "fig-4.7.png");
    plot_leader(report.plots.back());
  }
  return report;
}

}  // namespace

void add_leader_figures(std::vector<reproduce::Figure>& to) {
  to.push_back(
      {"fig-4.7", "a leader and its group: kN + α among them, α to the leader", "M18", leader});
}

}  // namespace mimesis::crowd
