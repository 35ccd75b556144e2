// A folk dance that organises itself [M18 fig. 3.33].
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/circle.h"
#include "common/plot/gnuplot.h"
#include "experiments/motion/figures.h"
#include "experiments/motion/folk_dance.h"
#include "experiments/motion/styled_walks.h"

namespace mimesis::synthesizer {
namespace {

using plot::Data;
using namespace reproduce;

constexpr double kLength_s = 80.0;
const std::vector<std::string> kClips = {"bandai_nc/dataset-1_walk_normal_001.bvh",
                                         "bandai_nc/dataset-1_walk_happy_001.bvh",
                                         "bandai_nc/dataset-2_walk-turn-left_normal_001.bvh",
                                         "bandai_nc/dataset-2_walk-turn-right_normal_001.bvh"};

const motion::MotionModel& dance_model() {
  static const motion::MotionModel model = styled_walks(recorded_walks(kClips), 5);
  return model;
}

FolkDance dance() {
  const motion::MotionModel& m = dance_model();
  return {m,
          {pattern_of(m, "happy"), pattern_of(m, "normal"), pattern_of(m, "walk-turn-left_normal"),
           pattern_of(m, "walk-turn-right_normal")},
          {}};
}

/// Curves of the plot, and what FolkDance does not count itself.
struct Seen {
  std::vector<Data> paths, errors;  ///< by sector; by dancer
  double fastest = 0.0;             ///< largest frequency outside, of the neutral one
  double slide_m_s = 0.0;           ///< sliding of standing feet, mean over the dancers
  int least_laps = 0;
};

Seen watch(FolkDance& d) {
  Seen seen;
  for (int k = 1; k <= 4; ++k) seen.paths.push_back({"s" + std::to_string(k), {}});
  for (int i = 0; i < d.size(); ++i) seen.errors.push_back({"e" + std::to_string(i), {}});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double neutral =
      math::kTwoPi / d.model()
                         .patterns[static_cast<std::size_t>(pattern_of(d.model(), "normal"))]
                         .trial.duration_s;
  std::vector<FootSlide> slides(static_cast<std::size_t>(d.size()), FootSlide(1.0 / 60.0));
  for (int n = 0; d.time_s() < kLength_s; ++n) {
    d.step();
    for (int i = 0; i < d.size(); ++i) {
      const Dancer& who = d.dancer(i);
      slides[static_cast<std::size_t>(i)].observe(d.batch(), i);
      if (who.sector == DanceSector::outside) {
        seen.fastest = std::max(seen.fastest, who.frequency_rad_s / neutral);
      }
      if (n % 6 != 0) continue;
      const Eigen::Vector2d p = d.batch().root(i).position_W_m;
      seen.paths[static_cast<std::size_t>(who.sector) - 1].rows.push_back({p.x(), p.y()});
      auto& error = seen.errors[static_cast<std::size_t>(i)].rows;
      if (!error.empty() && std::abs(error.back()[1] - who.beat_error_rad) > 3.0) {
        error.push_back({nan, nan});
      }
      error.push_back({d.time_s(), who.beat_error_rad,
                       static_cast<double>(who.sector == DanceSector::corridor)});
    }
  }
  seen.least_laps = d.dancer(0).laps;
  for (int i = 0; i < d.size(); ++i) {
    seen.least_laps = std::min(seen.least_laps, d.dancer(i).laps);
    seen.slide_m_s += slides[static_cast<std::size_t>(i)].mean_m_s() / d.size();
  }
  return seen;
}

void plot_dance(const std::filesystem::path& png, const Seen& seen) {
  std::vector<Data> data = seen.paths;
  std::string errors;
  for (std::size_t i = 0; i < seen.errors.size(); i += 2) {
    const std::string name = "$" + seen.errors[i].name;
    data.push_back(seen.errors[i]);
    for (auto& row : data.back().rows) row.resize(3, std::nan(""));
    errors += (errors.empty() ? "plot " : ", ") + name +
              " using 1:2 with lines lc rgb '#c0c0c0' notitle, " + name +
              " using 1:($3 > 0.5 ? $2 : NaN) with lines lw 2 lc 1 " +
              (i == 0 ? "title 'in the corridor'" : "notitle");
  }
  plot::plot_png(
      png, 1000, 900, data,
      "set multiplot layout 2,1 title 'A folk dance of eight couples (M18 fig. 3.33)'\n"
      "set size ratio -1\nset xlabel 'x [m]'\nset ylabel 'y [m]'\nset key outside\n"
      "plot $s1 with dots lc 1 notitle, $s2 with dots lc 2 notitle, $s3 with dots lc 3 notitle, "
      "$s4 with dots lc 4 notitle, NaN with lines lw 4 lc 1 title '1 corridor', NaN with lines lw "
      "4 lc 2 title '2 parting', NaN with lines lw 4 lc 3 title '3 outside', NaN with lines lw 4 "
      "lc 4 title '4 entrance'\n"
      "set size noratio\nset xlabel 'time [s]'\nset ylabel 'phase - beat, left row [rad]'\n"
      "set yrange [-3.2:3.2]\nset grid\n" +
          errors + "\nunset multiplot\n");
}

Report folk_dance(const PlotDir& dir) {
  if (const auto clip = absent_clip(kClips); !clip.empty()) return report_absent(clip);
  FolkDance d = dance();
  const Seen seen = watch(d);
  const DanceNumbers& n = d.numbers();
  const char* in = "in the corridor, one cycle after the entrance; nothing is printed";
  Report report;
  report.rows = {
      at_least("laps of each dancer", seen.least_laps, 3, "1", "80 s"),
      at_most("phase error to the music", n.beat_error_rad, 0.15, "rad", in),
      at_most("phase error between partners", n.couple_error_rad, 0.15, "rad", in),
      at_most("partners apart along the corridor", n.apart_m, 0.25, "m", in),
      near("entrances with the wrong foot", n.wrong_foot, goal(0), 0, "1"),
      at_most("largest phase error at an entrance", n.entrance_error_rad, 0.5, "rad",
              "half a cycle, pi, is the wrong foot"),
      at_least("largest phase difference of partners outside", n.spread_rad, 1.0, "rad",
               "there everybody walks alone"),
      at_least("fastest frequency outside / neutral", seen.fastest, 1.1, "1",
               "they hurry to be back in time"),
      at_least("least distance between two dancers", n.least_distance_m, 0.45, "m",
               "pelvis to pelvis; shoulders are 0.4 m wide"),
      at_most("standing feet slide", seen.slide_m_s, prototype(0.083, "motion.md"), "m/s",
              "what feet of recordings do"),
  };
  if (dir) plot_dance(report.picture(*dir / "fig-3.33.png"), seen);
  return report;
}

}  // namespace

void add_dance_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-3.33", "a folk dance that organises itself", "M18",
                  Declared{.prototype = 1, .goal = 9}, folk_dance);
}

}  // namespace mimesis::synthesizer
