// Power laws all over the phase plane of a morphed oscillator [M18 4.5.1, fig. 4.14]. The engine's
// agents have phases and no radius: an integrator of its own.
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "common/math/integrator.h"
#include "common/plot/gnuplot.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/oscillators.h"
#include "experiments/dmp/power_law.h"

namespace mimesis::crowd {
namespace {

using Eigen::Vector2d;
using plot::Data;
using namespace reproduce;

// ellipse of area π: an equi-affine map of the circle
constexpr double kLong_m = 1.25, kShort_m = 0.8;
constexpr std::array kBetas{-1.0 / 3.0, 0.0, 1.0 / 3.0, 2.0 / 3.0};
constexpr std::array kNames{"-1/3", "0", "1/3", "2/3"};
constexpr double kPathStep_s = 0.005;

dmp::PowerLawField field(double beta) {
  return dmp::PowerLawField(
      {.long_m = kLong_m, .short_m = kShort_m, .beta = beta, .mean_speed_m_s = 1.0});
}

struct Trace {
  std::vector<Vector2d> p;
  std::vector<double> speed;
};

template <class Velocity>
Trace trace(const Velocity& velocity, Vector2d p, double seconds) {
  Trace out;
  const auto f = [&](double, const Vector2d& x) { return velocity(x); };
  for (double t = 0.0; t < seconds; t += kPathStep_s) {
    out.p.push_back(p);
    out.speed.push_back(velocity(p).norm());
    p = math::rk4_step(f, 0.0, p, kPathStep_s);
  }
  return out;
}

/// Exponent of v = γ κ^−β by least squares over a trace, curvature from its points alone.
double exponent(const Trace& trace) {
  double n = 0.0, mx = 0.0, my = 0.0, xx = 0.0, xy = 0.0;
  for (std::size_t i = 1; i + 1 < trace.p.size(); ++i) {
    const Vector2d a = trace.p[i] - trace.p[i - 1], b = trace.p[i + 1] - trace.p[i];
    const double turn = std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
    const double x = std::log(2.0 * turn / (a.norm() + b.norm())), y = std::log(trace.speed[i]);
    n += 1.0;
    const double dx = x - mx, dy = y - my;
    mx += dx / n;
    my += dy / n;
    xx += dx * (x - mx);
    xy += dx * (y - my);
  }
  return -xy / xx;
}

/// Distance from the ellipse, in the oscillator's plane.
double off_ellipse(const Vector2d& p) {
  return std::abs(Vector2d(p.x() / kLong_m, p.y() / kShort_m).norm() - 1.0);
}

constexpr std::array kScale{0.7, 0.85, 1.15, 1.3};  // starts, times the ellipse

Data panel(const std::string& name, const std::vector<Trace>& traces) {
  Data out{name, {}};
  for (const Trace& t : traces) {
    for (std::size_t i = 0; i < t.p.size(); i += 2) {
      out.rows.push_back({t.p[i].x(), t.p[i].y(), t.speed[i]});
    }
    out.rows.push_back({std::nan(""), std::nan(""), std::nan("")});
  }
  return out;
}

template <class Velocity>
std::vector<Trace> traces(const Velocity& velocity, double a, double b) {
  std::vector<Trace> out;
  for (const double s : kScale) {
    for (int k = 0; k < 8; ++k) {
      const double phi = 0.25 * std::numbers::pi * k;
      out.push_back(trace(velocity, s * Vector2d(a * std::cos(phi), b * std::sin(phi)), 1.2));
    }
  }
  return out;
}

void plot_paths(const std::filesystem::path& png) {
  std::vector<Data> data;
  // plain oscillator with inverted squared radius, eq. 4.50, and its image under the affine map
  const auto plain = [](const Vector2d& x) -> Vector2d {
    const double rho = 1.0 / x.squaredNorm();
    const double growth = -0.5 * warped_rate({1.0, 0.0, 1.0}, 1.0, rho) / rho;  // ṙ/r
    return {growth * x.x() - x.y(), growth * x.y() + x.x()};
  };
  const auto morphed = [&](const Vector2d& p) -> Vector2d {
    const Vector2d v = plain({p.x() / kLong_m, p.y() / kShort_m});
    return {kLong_m * v.x(), kShort_m * v.y()};
  };
  data.push_back(panel("p0", traces(plain, 1.0, 1.0)));
  data.push_back(panel("p1", traces(morphed, kLong_m, kShort_m)));
  for (const bool ellipse : {false, true}) {
    Data cycle{"c" + std::to_string(ellipse), {}};
    for (int n = 0; n <= 180; ++n) {
      const double phi = 2.0 * std::numbers::pi * n / 180;
      cycle.rows.push_back(
          {(ellipse ? kLong_m : 1.0) * std::cos(phi), (ellipse ? kShort_m : 1.0) * std::sin(phi)});
    }
    data.push_back(std::move(cycle));
  }
  std::string titles[6] = {"a) unit cycle", "b) elliptic, equi-affine map"};
  for (std::size_t i = 0; i < kBetas.size(); ++i) {
    const auto f = field(kBetas[i]);
    data.push_back(
        panel("p" + std::to_string(i + 2),
              traces([&](const Vector2d& p) { return f.velocity(p); }, kLong_m, kShort_m)));
    titles[i + 2] = fmt::format("{}) power law, β = {}", char('c' + i), kNames[i]);
  }
  std::string script =
      "set multiplot layout 2,3 title 'Phase portraits of Andronov-Hopf oscillators; colour: "
      "speed [m/s]'\nset size ratio -1\nset xrange [-1.75:1.75]\nset yrange [-1.45:1.45]\n"
      "set style fill solid 1 noborder\nset cbrange [0.6:1.6]\nset palette defined (0 '#1f4e9c', "
      "0.4 '#3aa6b9', 0.7 '#d08a10', 1 "
      "'#c8371e')\nunset key\nset grid\n";
  for (int i = 0; i < 6; ++i) {
    script += "set title '" + titles[i] + "'\nplot $p" + std::to_string(i) +
              " using 1:2:3 with lines lc palette lw 1.8, $c" + std::to_string(i > 0) +
              " with lines lw 1.2 lc rgb '#202020'\n";
  }
  plot::plot_png(png, 1200, 700, data, script + "unset multiplot");
}

Report power_laws(const PlotDir& dir) {
  Report report;
  for (std::size_t i = 0; i < kBetas.size(); ++i) {
    const auto f = field(kBetas[i]);
    const auto velocity = [&](const Vector2d& p) { return f.velocity(p); };
    const std::string name = std::string("β = ") + kNames[i];
    report.near(name + ": exponent of one lap on the ellipse",
                exponent(trace(velocity, f.on_path(0.0), f.lap_s())),
                closed_form(kBetas[i], "law of the field"), 1e-3, "1");
    double worst = kBetas[i];
    for (const double s : {0.85, 1.15}) {  // where all are curved to the left
      const double beta = exponent(trace(velocity, s * f.on_path(0.4), 2.0));
      if (std::abs(beta - kBetas[i]) > std::abs(worst - kBetas[i])) worst = beta;
    }
    report.near(name + ": exponent of transients, worst of two", worst,
                closed_form(kBetas[i], "law of the field"), 2e-3, "1");
    const Trace far = trace(velocity, kScale.back() * f.on_path(0.4), 4.0 * f.lap_s());
    report.near(name + ": distance from the ellipse after 4 laps", off_ellipse(far.p.back()),
                goal(0.0), 1e-6, "1");
    // radial contraction [eq. 4.53]
    bool closer = true;
    for (std::size_t n = 1; n < far.p.size(); ++n) {
      closer = closer && off_ellipse(far.p[n]) <= off_ellipse(far.p[n - 1]) + 1e-12;
    }
    report.holds(name + ": comes closer at every step", closer, closed_form("eq. 4.53"));
  }
  if (dir) plot_paths(report.picture(*dir / "fig-4.14.png"));
  return report;
}

}  // namespace

void add_power_law_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-4.14", "power laws over the phase plane of a morphed oscillator", "M18",
                  Declared{.closed_form = 12, .goal = 4}, power_laws);
}

}  // namespace mimesis::crowd
