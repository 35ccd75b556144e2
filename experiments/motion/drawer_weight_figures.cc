// Weights of the drawer task and the maps to them [M18 3.3, 3.4.2].
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "common/plot/gnuplot.h"
#include "experiments/harness/statistics.h"
#include "experiments/motion/drawer_training.h"
#include "experiments/motion/figures.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using plot::Data;
using plot::plot_png;
using namespace reproduce;

// ---- fig. 3.15

// Share of the summed |weights| of joint rows that belongs to joints first..last.
double share_of(const VectorXd& w, int first, int last) {
  return w.segment(3 * first, 3 * (last - first + 1)).sum() / w.head(mocap::kBodyRows).sum();
}

// Weights of the lowest frequency of an action's pattern: what its periodic sources together have
// of the first harmonic, as the weight of one source of unit rms. (A further source may come near
// the first one, with other delays; then weights of one source alone say little: they cancel.)
VectorXd lowest_weights(const motion::MotionModel& model, const motion::Pattern& p) {
  const Index samples = model.sources.cols();
  Eigen::VectorXcd turning(samples);
  for (Index t = 0; t < samples; ++t)
    turning(t) =
        std::polar(std::numbers::sqrt2 / static_cast<double>(samples),
                   -2.0 * std::numbers::pi * static_cast<double>(t) / static_cast<double>(samples));
  const Eigen::VectorXcd harmonic = model.sources * turning;
  VectorXd weights(p.weight_rad.rows());
  for (Index r = 0; r < weights.size(); ++r) {
    std::complex<double> sum = 0.0;
    for (Index k = model.fixed; k < harmonic.size(); ++k)
      sum += p.weight_rad(r, k) * harmonic(k) * std::polar(1.0, -p.delay_rad(r, k));
    weights(r) = std::abs(sum);
  }
  return weights;
}

Report weights(const PlotDir& plot_dir) {
  constexpr std::size_t kTrial = 4;
  Report report;
  std::array<VectorXd, kActions> ramp, first;
  Data bars{"bars", {}};
  for (std::size_t a = 0; a < kActions; ++a) {
    const motion::MotionModel& model = drawer_maps().model().action[a];
    ramp[a] = model.patterns[kTrial].weight_rad.col(0).cwiseAbs();
    first[a] = lowest_weights(model, model.patterns[kTrial]);
  }
  for (int r = 0; r < mocap::kBodyRows; ++r)
    bars.rows.push_back(
        {double(r), first[0](r), first[1](r), first[2](r), ramp[0](r), ramp[1](r), ramp[2](r)});
  auto joints = [](const VectorXd& w) { return w.head(mocap::kBodyRows).sum(); };
  report.at_least("action 1: lowest periodic over non-periodic weights",
                  joints(first[0]) / joints(ramp[0]), published(1.0, "M18 fig. 3.15"), "1",
                  "the text: the periodic source dominates");
  report.at_least("action 2: non-periodic over lowest periodic weights",
                  joints(ramp[1]) / joints(first[1]), published(1.0, "M18 fig. 3.15"), "1",
                  "the text: the non-periodic source dominates");
  report.at_least("action 3: non-periodic over lowest periodic weights",
                  joints(ramp[2]) / joints(first[2]), published(1.0, "M18 fig. 3.15"), "1",
                  "the text: the non-periodic source dominates");
  report.at_least("action 1: share of the legs in the periodic source",
                  share_of(first[0], mocap::kLeftHip, mocap::kRightAnkle), 0.4, "1",
                  "the text: hip and leg joints strongly; 18 of 51 rows");
  report.at_least("action 2: share of the arms in the non-periodic source",
                  share_of(ramp[1], mocap::kLeftShoulder, mocap::kRightWrist), 0.4, "1",
                  "the text: primarily the arm; 18 of 51 rows");
  report.at_least("action 3: share of the arms in the non-periodic source",
                  share_of(ramp[2], mocap::kLeftShoulder, mocap::kRightWrist), 0.4, "1",
                  "the text: primarily the arm; 18 of 51 rows");
  if (plot_dir) {
    std::string tics = "set xtics rotate by -60 nomirror (";
    for (int j = 0; j < mocap::kBodyJoints; ++j)
      tics += (j ? ", '" : "'") + std::string(mocap::kBodyJointNames[static_cast<std::size_t>(j)]) +
              "' " + std::to_string(3 * j + 1);
    tics += ")\n";
    auto bar = [](int column, int shift, int line, const char* title) {
      return std::string("$bars using ($1+") + std::to_string(shift) +
             "*0.28-0.28):" + std::to_string(column) + " with boxes lt " + std::to_string(line) +
             " title '" + title + "'";
    };
    plot_png(report.picture(*plot_dir / "fig-3.15.png"), 1200, 640, {bars},
             "set multiplot layout 2,1\nset style fill solid 0.9 noborder; set boxwidth 0.28\nset "
             "xrange [-1:51]\nset ylabel '|w| [rad]'\n" +
                 tics + "set title 'lowest periodic component (x, y, z of each joint)'\nplot " +
                 bar(2, 0, 1, "action 1") + ", " + bar(3, 1, 3, "action 2") + ", " +
                 bar(4, 2, 2, "action 3") + "\nset title 'non-periodic source'\nplot " +
                 bar(5, 0, 1, "action 1") + ", " + bar(6, 1, 3, "action 2") + ", " +
                 bar(7, 2, 2, "action 3") + "\nunset multiplot\n");
  }
  return report;
}

// ---- fig. 3.20

constexpr int kHipFlexion = 3 * mocap::kLeftHip + 1;

double hip_weight(Action action, double length_m, double duration_s) {
  const double previous = drawer_maps().ranges().normal.mean_m;
  return drawer_maps()
      .at(action, {.length_m = length_m, .duration_s = duration_s, .previous_length_m = previous})
      .weight_rad(kHipFlexion, 1);
}

Report maps(const PlotDir& plot_dir) {
  Report report;
  std::vector<Data> data;
  for (const Action a : {kNormalStep, kReachingStep}) {
    const StepRange& r =
        a == kNormalStep ? drawer_maps().ranges().normal : drawer_maps().ranges().reaching;
    Data surface{a == kNormalStep ? "a" : "b", {}}, points{a == kNormalStep ? "pa" : "pb", {}};
    double least = 1e9, most = -1e9;
    for (int i = 0; i <= 24; ++i) {
      for (int j = 0; j <= 24; ++j) {
        const double length = r.least_m + (r.most_m - r.least_m) * i / 24,
                     duration = r.shortest_s + (r.longest_s - r.shortest_s) * j / 24;
        const double w = hip_weight(a, length, duration);
        surface.rows.push_back({length, duration, w});
        least = std::min(least, w);
        most = std::max(most, w);
      }
      surface.rows.emplace_back();
    }
    for (const motion::Pattern& p : drawer_maps().model().action[a].patterns)
      points.rows.push_back(
          {p.trial.step_length_m, p.trial.duration_s, p.weight_rad(kHipFlexion, 1)});
    const std::string name = a == kNormalStep ? "action 1" : "action 2";
    report.at_least(name + ": spread of the hip's weight over the map", most - least, 0.05, "rad",
                    "a map that does not depend on its inputs has 0");
    std::vector<double> map, mean, fitted;
    for (const LeftOutTrial& o : drawer_left_out().action[a]) {
      map.push_back(o.predicted);
      mean.push_back(o.mean);
      fitted.push_back(o.fitted);
    }
    report.at_least(
        name + ": median Q of recordings left out, predicted from the task alone", median(map),
        median(mean), "1",
        "the mean of the other trials; about the mean posture. Sources, delays and maps "
        "are learned "
        "without the recording; generated trials");
    report.at_least(name + ": least Q of recordings left out, predicted",
                    *std::ranges::min_element(map), 0.41, "1",
                    "goal of the maps: the mean trial's on recorded walks");
    report.at_least(name + ": median Q of the same, weights and means fitted", median(fitted),
                    median(map), "1", "the prediction: what the maps lose is between them");
    data.push_back(surface);
    data.push_back(points);
  }
  if (plot_dir)
    plot_png(report.picture(*plot_dir / "fig-3.20.png"), 1200, 520, data,
             "set multiplot layout 1,2\nset xlabel 'length [m]'; set ylabel 'duration [s]'; set "
             "zlabel 'w [rad]' rotate\nset xtics 0.2; set ytics 0.05; set hidden3d; set ticslevel "
             "0.1; set view 55,40; unset key\n"
             "set title 'a) action 1: hip flexion, first periodic source'\nsplot $a using 1:2:3 "
             "with lines lt 1 lw 1, $pa using 1:2:3 with points lt 2 pt 7 ps 1\n"
             "set title 'b) action 2'\nsplot $b using 1:2:3 with lines lt 1 lw 1, $pb using 1:2:3 "
             "with points lt 2 pt 7 ps 1\nunset multiplot\n");
  return report;
}

}  // namespace

void add_drawer_weight_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-3.15", "weights of two sources in the three actions", "M18",
                  Declared{.published = 3, .goal = 3}, weights);
  to.emplace_back("fig-3.20", "maps from length and duration to a weight", "M18",
                  Declared{.goal = 8}, maps);
}

}  // namespace mimesis::synthesizer
