// How the speed of the shipped gait changes with the length of steps [M18 fig. 4.9a; M10 fig. 3;
// M13 fig. 3a].
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "common/plot/gnuplot.h"
#include "common/runtime/param_source.h"
#include "experiments/crowd/figures.h"
#include "nodes/crowd/verb/measured_gait.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using namespace reproduce;

constexpr int kCurves = 10;  // as there
constexpr double kMost = 0.25;

Report speed(const PlotDir& dir) {
  Report report;
  const motion::MotionModel model =
      motion::load_motion_model(runtime::find_model_file("walk.motion.json"));
  std::vector<double> steps;
  for (int c = 0; c < kCurves; ++c) steps.push_back(1.0 + kMost * c / (kCurves - 1));
  const auto walks = walk_straight(model, "walk", steps);
  const std::vector<SpeedSample>& plain = walks[0];
  double mean = 0.0;
  for (const SpeedSample& s : plain) mean += s.g_m_rad / static_cast<double>(plain.size());
  std::vector<Data> data;
  std::ostringstream curves;
  double most_rms = 0.0, most_mean = 0.0;
  for (int c = 0; c < kCurves; ++c) {
    const double mu = steps[static_cast<std::size_t>(c)] - 1.0;
    const std::vector<SpeedSample>& longer = walks[static_cast<std::size_t>(c)];
    double square = 0.0, sum = 0.0;
    Data curve{"g" + std::to_string(c), {}};
    for (std::size_t i = 0; i < longer.size(); ++i) {
      const double off = longer[i].g_m_rad - (1.0 + mu) * plain[i].g_m_rad;
      square += off * off;
      sum += longer[i].g_m_rad;
      if (i < longer.size() / 4)
        curve.rows.push_back({longer[i].phase_rad, longer[i].g_m_rad / mean});
    }
    const double n = static_cast<double>(longer.size());
    most_rms = std::max(most_rms, std::sqrt(square / n) / mean);
    most_mean = std::max(most_mean, std::abs(sum / n / mean - 1.0 - mu));
    std::ranges::sort(curve.rows);
    curves << (c ? ", $g" : "$g") << c << " with lines lw " << (c ? 1 : 3) << " lc palette frac "
           << 0.9 * c / (kCurves - 1) << " notitle";
    data.push_back(std::move(curve));
  }
  report.at_most("largest deviation of the mean speed from 1 + mu, mu to 0.25", most_mean,
                 published(0.05, "M18 fig. 4.9a"), "1",
                 "well approximated by (1 + mu) g, it says, without a number; ours blends learned "
                 "cycles of travel, so it is exact but for rounding");
  report.at_most("largest rms of v/omega - (1 + mu) g over <g>", most_rms,
                 published(0.05, "M18 fig. 4.9a"), "1", "the same, over the cycle");
  if (dir) {
    plot::plot_png(report.picture(*dir / "fig-4.9a.png"), 720, 460, data,
                   "set title 'Speed over the gait cycle, steps longer by 0 (thick) to 25 %'\n"
                   "set grid\nset xlabel 'phase [rad]'\nset ylabel 'v / omega <g>'\n"
                   "set xrange [0:6.2832]\nunset colorbox\nset cbrange [0:1]\nplot " +
                       curves.str());
  }
  return report;
}

}  // namespace

void add_speed_figure(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-4.9a", "speed over the gait cycle for longer steps of the shipped walk",
                  "M18", Declared{.published = 2}, speed);
}

}  // namespace mimesis::crowd
