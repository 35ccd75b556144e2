// Limit cycles of other shapes and with other rates of attraction [M18 4.5, fig. 4.12, 4.13]. The
// engine's agents have phases and no radius: an integrator of its own.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "common/math/circle.h"
#include "common/math/integrator.h"
#include "common/plot/gnuplot.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/oscillators.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using namespace reproduce;
using Cycle = std::function<WarpedCycle(double phi)>;
using math::kTwoPi;

constexpr double kPhaseRate_1_s = 1.0;  // φ is time, as in eq. 4.48
constexpr int kPerTurn = 720;
constexpr double kPi = std::numbers::pi;

bool upper(double phi) { return math::wrap_two_pi(phi) < kPi; }

/// Above half an ellipse of half-axes 2 and 1, below half a circle of radius 2.
WarpedCycle half_ellipse(double phi) {
  const double s = std::sin(phi), c = std::cos(phi);
  constexpr double kAlpha = 0.15;
  if (!upper(phi)) return {0.25, 0.0, kAlpha};
  return {(c * c + 4.0 * s * s) / 4.0, 1.5 * s * c, kAlpha};
}

/// Circle of radius 2; strays come back slowly above and fast below.
WarpedCycle two_rates(double phi) { return {0.25, 0.0, upper(phi) ? 0.04 : 0.8}; }

/// Rows φ, ρ from φ = 0 on.
std::vector<std::vector<double>> orbit(const Cycle& cycle, double rho, int turns) {
  const double dt = kTwoPi / kPerTurn / kPhaseRate_1_s;
  // the halves are taken from the middle of a step: at its ends both have the same F, not the same
  // α
  std::vector<std::vector<double>> rows;
  for (int n = 0; n <= turns * kPerTurn; ++n) {
    const double phi = kPhaseRate_1_s * n * dt;
    rows.push_back({phi, rho});
    const double side = upper(phi + 0.5 * kPhaseRate_1_s * dt) ? 0.25 * kPi : 1.25 * kPi;
    const double alpha = cycle(side).gain_1_s;
    const auto f = [&](double t, double r) {
      WarpedCycle c = cycle(kPhaseRate_1_s * t);
      c.gain_1_s = alpha;
      return warped_rate(c, kPhaseRate_1_s, r);
    };
    rho = math::rk4_step(f, n * dt, rho, dt);
  }
  return rows;
}

/// ρ = F + (ρ₀ − F₀) exp(−∫α dφ/ω): largest difference.
double off_closed_form(const Cycle& cycle, const std::vector<std::vector<double>>& rows) {
  const double start = rows.front()[1] - cycle(0.0).rho;
  const double above = cycle(0.5 * kPi).gain_1_s, below = cycle(1.5 * kPi).gain_1_s;
  double worst = 0.0;
  for (const auto& r : rows) {
    const double turns = std::floor(r[0] / kTwoPi + 1e-9), rest = r[0] - turns * kTwoPi;
    const double integral = turns * kPi * (above + below) + above * std::min(rest, kPi) +
                            below * std::max(0.0, rest - kPi);
    const double expected = cycle(r[0]).rho + start * std::exp(-integral / kPhaseRate_1_s);
    worst = std::max(worst, std::abs(r[1] - expected));
  }
  return worst;
}

/// Points of the planes with polar coordinates (ρ, φ) and (r, φ).
Data portrait(const std::string& name, const std::vector<std::vector<double>>& rows) {
  Data out{name, {}};
  for (const auto& r : rows) {
    const double c = std::cos(r[0]), s = std::sin(r[0]), radius = 1.0 / std::sqrt(r[1]);
    out.rows.push_back({r[1] * c, r[1] * s, radius * c, radius * s});
  }
  return out;
}

Data attractor(const Cycle& cycle) {
  std::vector<std::vector<double>> rows;
  for (int n = 0; n <= kPerTurn; ++n) {
    const double phi = kTwoPi * n / kPerTurn;
    rows.push_back({phi, cycle(phi).rho});
  }
  return portrait("cycle", rows);
}

constexpr double kFrom[] = {0.08, 0.14, 0.6, 1.0, 1.4};  // ρ₀

void plot(const std::filesystem::path& png, const std::string& title, const Cycle& cycle,
          int turns) {
  std::vector<Data> data{attractor(cycle)};
  std::string rho, r;
  for (std::size_t i = 0; i < std::size(kFrom); ++i) {
    const std::string name = "orbit" + std::to_string(i);
    data.push_back(portrait(name, orbit(cycle, kFrom[i], turns)));
    rho += "$" + name + " using 1:2 with lines lc 1 lw 1.1 notitle, ";
    r += "$" + name + " using 3:4 with lines lc 1 lw 1.1 notitle, ";
  }
  plot::plot_png(
      png, 1000, 520, data,
      "set multiplot layout 1,2 title '" + title +
          "'\nset size ratio -1\nset grid\nset xzeroaxis\nset yzeroaxis\nset key top right\n"
          "set title 'polar coordinates (ρ, φ), ρ = 1/r²'\nset xlabel 'ρ cos φ'\n"
          "set ylabel 'ρ sin φ'\nset xrange [-2.1:2.1]\nset yrange [-2.1:2.1]\nplot " +
          rho +
          "$cycle using 1:2 with lines lc 2 lw 3 title 'attractor'\n"
          "set title 'polar coordinates (r, φ)'\nset xlabel 'r cos φ'\nset ylabel 'r sin φ'\n"
          "set xrange [-3.8:3.8]\nset yrange [-3.8:3.8]\nplot " +
          r + "$cycle using 3:4 with lines lc 2 lw 3 title 'attractor'\nunset multiplot");
}

/// Rows for the factors of a distance over the upper half, the lower half, and a turn.
void rows_of(const Cycle& cycle, Report& report) {
  double worst = 0.0;
  for (const double from : kFrom) {
    worst = std::max(worst, off_closed_form(cycle, orbit(cycle, from, 4)));
  }
  report.near("ρ - F - (ρ₀ - F₀) exp(-∫α dφ), largest of 4 turns", worst,
              closed_form(0.0, "eq. 4.48"), 1e-8, "1");
  const auto rows = orbit(cycle, 1.4, 1);
  const auto off = [&](int n) {
    return rows[std::size_t(n)][1] - cycle(rows[std::size_t(n)][0]).rho;
  };
  const double above = cycle(0.5 * kPi).gain_1_s * kPi, below = cycle(1.5 * kPi).gain_1_s * kPi;
  report.near("decay over the upper half: ∫α dφ", std::log(off(0) / off(kPerTurn / 2)),
              closed_form(above, "eq. 4.48"), 1e-6, "1");
  report.near("decay over the lower half: ∫α dφ", std::log(off(kPerTurn / 2) / off(kPerTurn)),
              closed_form(below, "eq. 4.48"), 1e-6, "1");
  report.near("radius of the attractor at φ = π/2",
              1.0 / std::sqrt(orbit(cycle, cycle(0.0).rho, 1)[kPerTurn / 4][1]),
              closed_form(1.0 / std::sqrt(cycle(0.5 * kPi).rho), "F^(-1/2)"), 1e-8, "1");
  report.near("radius of the attractor at φ = 3π/2",
              1.0 / std::sqrt(orbit(cycle, cycle(0.0).rho, 1)[3 * kPerTurn / 4][1]),
              closed_form(2.0, "F^(-1/2)"), 1e-8, "1");
}

Report warped_shape(const PlotDir& dir) {
  Report report;
  rows_of(half_ellipse, report);
  report.near("the ellipse's vertical half-axis", 1.0 / std::sqrt(half_ellipse(0.5 * kPi).rho),
              closed_form(1.0, "ellipse"), 1e-12, "1");
  if (dir)
    plot(report.picture(*dir / "fig-4.12.png"),
         "Limit cycle warped to half an ellipse and half a circle, α = 0.15", half_ellipse, 3);
  return report;
}

Report warped_attraction(const PlotDir& dir) {
  Report report;
  rows_of(two_rates, report);
  if (dir)
    plot(report.picture(*dir / "fig-4.13.png"), "Circle with α = 0.04 above and 0.8 below",
         two_rates, 2);
  return report;
}

}  // namespace

void add_cycle_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-4.12", "a limit cycle warped to another shape", "M18",
                  Declared{.closed_form = 6}, warped_shape);
  to.emplace_back("fig-4.13", "a limit cycle with two rates of attraction", "M18",
                  Declared{.closed_form = 5}, warped_attraction);
}

}  // namespace mimesis::crowd
