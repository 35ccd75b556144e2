// What the drawer task is learned from and how well [M18 3.3, 3.4.2].
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/reproduce/gnuplot.h"
#include "nodes/synthesizer/demix/sisa.h"
#include "nodes/synthesizer/figures/drawer_training.h"
#include "nodes/synthesizer/figures/figures.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using reproduce::at_least;
using reproduce::at_most;
using reproduce::Data;
using reproduce::holds;
using reproduce::near;
using reproduce::plot_png;
using reproduce::Report;
using PlotDir = std::optional<std::filesystem::path>;

// ---- fig. 3.7

// Linear regression of y on x.
struct Regression {
  double slope = 0.0, r_squared = 0.0, p = 1.0;
};

// Probability of a larger |t| with an even number of degrees of freedom: the finite sum of
// Student's distribution (Abramowitz and Stegun 26.7.4).
double two_sided_p(double t, int degrees) {
  const double cos2 = degrees / (degrees + t * t), sine = std::sqrt(1.0 - cos2);
  double term = 1.0, sum = 1.0;
  for (int i = 2; i < degrees; i += 2) sum += term *= cos2 * (i - 1.0) / i;
  return 1.0 - sine * sum;
}

Regression regression(const VectorXd& x, const VectorXd& y) {
  const VectorXd a = x.array() - x.mean(), b = y.array() - y.mean();
  Regression r;
  r.slope = a.dot(b) / a.squaredNorm();
  r.r_squared = r.slope * a.dot(b) / b.squaredNorm();
  const int degrees = static_cast<int>(x.size()) - 2;
  r.p = two_sided_p(std::sqrt(r.r_squared * degrees / (1.0 - r.r_squared)), degrees);
  return r;
}

Report planning(const PlotDir& plot_dir) {
  const auto plans = draw_plans({.paces = {}});
  const auto n = static_cast<Index>(plans.size());
  VectorXd initial(n), first(n), second(n), last(n), depth(n);
  Data bars{"bars", {}};
  for (Index i = 0; i < n; ++i) {
    const TrialPlan& p = plans[static_cast<std::size_t>(i)];
    initial(i) = p.initial_distance_m();
    first(i) = p.normal_length_m;
    second(i) = p.reaching_length_m;
    last(i) = p.final_distance_m;
    depth(i) = p.object_depth_m;
    bars.rows.push_back({static_cast<double>(i + 1), depth(i), last(i), second(i), first(i)});
  }
  Report report;
  const Regression normal = regression(initial, first), reaching = regression(initial, second);
  report.rows.push_back(near("trials", static_cast<double>(n), 10, 0, "1"));
  report.rows.push_back(near("first action on initial distance: R², put in by the generator",
                             normal.r_squared, 0.08, 1e-6, "1"));
  report.rows.push_back(near("first action on initial distance: p", normal.p, 0.429, 0.005, "1"));
  report.rows.push_back(
      near("second action on initial distance: R²", reaching.r_squared, 0.95, 0.05, "1"));
  report.rows.push_back(near("second action on initial distance: log10 p", std::log10(reaching.p),
                             std::log10(1.4e-6), 1.5, "1"));
  report.rows.push_back(near("nearest start, put in", initial.minCoeff(), 2.34, 1e-6, "m"));
  report.rows.push_back(near("farthest start, put in", initial.maxCoeff(), 2.94, 1e-6, "m"));
  report.rows.push_back(near("final distance, mean", last.mean(), 0.6, 0.02, "m"));
  report.rows.push_back(at_most("final distance, largest deviation",
                                (last.array() - last.mean()).abs().maxCoeff(), 0.05, "m",
                                "\"almost constant\""));
  report.rows.push_back(
      holds("final distance rises with the object's depth",
            regression(depth, last).slope > 0.0 && regression(depth, last).p < 0.05));
  report.rows.push_back(near("share of the first step: mean of half of action 1 over D - 0.6 m",
                             (0.5 * first.array() / (initial.array() - 0.6)).mean(), 0.385, 0.02,
                             "1"));
  if (plot_dir) {
    const auto png = *plot_dir / "fig-3.7.png";
    plot_png(png, 900, 480, {bars},
             "set style data histograms; set style histogram rowstacked\n"
             "set style fill solid 0.85 noborder; set boxwidth 0.7\n"
             "set xlabel 'trial, by initial distance'; set ylabel 'm from the object'\n"
             "set key outside right top invert; set yrange [0:*]\n"
             "plot $bars using 2:xtic(1) lc rgb '#3a66b0' title 'panel to object', "
             "'' using 3 lc rgb '#c8371e' title 'standing', "
             "'' using 4 lc rgb '#e8b820' title 'action 2', "
             "'' using 5 lc rgb '#2b8c4a' title 'action 1'\n");
    report.plots.push_back(png);
  }
  return report;
}

// ---- fig. 3.13

mocap::Trials drawn_only(const mocap::Trials& set) {
  mocap::Trials out = set;
  out.trials.resize(10);
  out.samples = set.samples.topRows(10 * set.rows_per_trial());
  return out;
}

mocap::Trials together(const std::array<mocap::Trials, kActions>& sets) {
  mocap::Trials all = sets[0];
  for (std::size_t a = 1; a < kActions; ++a) {
    const Index rows = all.samples.rows();
    all.trials.insert(all.trials.end(), sets[a].trials.begin(), sets[a].trials.end());
    all.samples.conservativeResize(rows + sets[a].samples.rows(), Eigen::NoChange);
    all.samples.bottomRows(sets[a].samples.rows()) = sets[a].samples;
  }
  return all;
}

double sisa_q2(const mocap::Trials& set, int periodic, bool tied) {
  demix::SisaOptions options;
  options.sources = 1 + periodic;
  options.tied = tied;
  options.fixed = drawer_ramp(set.samples.cols());
  options.turns = 15;
  options.finalists = 1;
  return demix::sisa(set, options).quality_squared;
}

// The ramp and the first K principal components of what it leaves: the same stepwise regression.
std::vector<double> pca_q2(const mocap::Trials& set, int most) {
  const MatrixXd centred = set.samples.colwise() - set.samples.rowwise().mean();
  Eigen::RowVectorXd ramp = drawer_ramp(set.samples.cols());
  ramp.array() -= ramp.mean();
  const MatrixXd rest = centred - (centred * ramp.transpose()) * ramp / ramp.squaredNorm();
  const VectorXd energy = Eigen::BDCSVD<MatrixXd>(rest).singularValues().cwiseAbs2();
  std::vector<double> q2;
  for (int k = 1; k <= most; ++k)
    q2.push_back(1.0 - energy.tail(energy.size() - k).sum() / centred.squaredNorm());
  return q2;
}

Report approximation(const PlotDir& plot_dir) {
  DrawerData drawn = drawer_data();
  for (auto& set : drawn.action) set = drawn_only(set);
  const mocap::Trials all = together(drawn.action);
  constexpr int kMost = 6;
  Data free{"free", {}}, pca{"pca", {}}, tied{"tied", {}}, stepwise{"stepwise", {}},
      chosen{"chosen", {}};
  const auto components = pca_q2(all, kMost);
  bool better = true;
  for (int k = 1; k <= kMost; ++k) {
    const double q_free = sisa_q2(all, k, false),
                 q_pca = components[static_cast<std::size_t>(k - 1)];
    better = better && q_free > q_pca;
    free.rows.push_back({double(k), q_free});
    pca.rows.push_back({double(k), q_pca});
    tied.rows.push_back({double(k), sisa_q2(drawn.action[kNormalStep], k, true)});
    if (k <= kMost - 2)
      stepwise.rows.push_back({double(k + 2), learn_drawer_model(drawn, {k, 2}).quality_squared});
  }
  Report report;
  report.rows.push_back(at_least("Q2 of action 1, 3 periodic sources, tied (printed 0.956)",
                                 tied.rows[2][1], 0.956, "1",
                                 "generated trials are simpler than recorded ones"));
  report.rows.push_back(at_least("Q2 of all actions, 3 + 2 periodic sources, tied (printed 0.967)",
                                 stepwise.rows[2][1], 0.967, "1",
                                 "generated trials are simpler than recorded ones"));
  report.rows.push_back(holds("free delays above PCA at every number of sources", better));
  report.rows.push_back(at_least("Q2 of all actions, 3 sources, free delays", free.rows[2][1],
                                 components[2], "1", "PCA with 3"));
  report.rows.push_back(at_least("Q2 of all 40 trials, 3 + 2 sources",
                                 drawer_maps().model().quality_squared, 0.967, "1",
                                 "what the motions are made from"));
  if (plot_dir) {
    chosen.rows = {{3.0, tied.rows[2][1]}, {5.0, stepwise.rows[2][1]}};
    const auto png = *plot_dir / "fig-3.13.png";
    plot_png(png, 800, 520, {free, pca, tied, stepwise, chosen},
             "set xlabel 'periodic sources'; set ylabel 'Q2'; set key bottom right\n"
             "plot $free using 1:2 with linespoints lt 1 pt 7 title 'anechoic, free delays, all "
             "actions', "
             "$pca using 1:2 with linespoints lt 3 pt 7 title 'PCA, all actions', "
             "$tied using 1:2 with linespoints lt 4 dt 3 pt 7 title 'tied delays, action 1', "
             "$stepwise using 1:2 with linespoints lt 2 dt 2 pt 7 title 'tied, two more for "
             "actions 2 and 3', "
             "$chosen using 1:2 with points lt 8 pt 6 ps 2.5 title 'chosen'\n");
    report.plots.push_back(png);
  }
  return report;
}

// ---- fig. 3.14

int dominant_harmonic(const Eigen::RowVectorXd& source) {
  const Index n = source.size();
  int best = 1;
  double most = 0.0;
  for (int h = 1; h <= 12; ++h) {
    double re = 0.0, im = 0.0;
    for (Index t = 0; t < n; ++t) {
      const double angle =
          2.0 * std::numbers::pi * h * static_cast<double>(t) / static_cast<double>(n);
      re += source(t) * std::cos(angle);
      im += source(t) * std::sin(angle);
    }
    if (re * re + im * im > most) most = re * re + im * im, best = h;
  }
  return best;
}

Data curves(const std::string& name, const MatrixXd& sources) {
  Data d{name, {}};
  for (Index t = 0; t < sources.cols(); ++t) {
    d.rows.push_back({static_cast<double>(t) / static_cast<double>(sources.cols())});
    for (Index k = 0; k < sources.rows(); ++k) d.rows.back().push_back(sources(k, t));
  }
  return d;
}

std::string panel(const std::string& data, int columns, bool ramp, const std::string& title) {
  std::string script = "set title '" + title + "'\nplot ";
  for (int k = 0; k < columns; ++k)
    script += std::string(k ? ", " : "") + "$" + data + " using 1:" + std::to_string(k + 2) +
              " with lines lt " + (ramp && k == 0 ? "8 dt 2" : std::to_string(ramp ? k : k + 1)) +
              " notitle";
  return script + "\n";
}

Report sources(const PlotDir& plot_dir) {
  Report report;
  const DrawerModel& small = drawer_maps().model();
  const DrawerModel large = learn_drawer_model(drawer_data(), {4, 3});
  const MatrixXd &s = small.action[0].sources, &l = large.action[0].sources;
  report.rows.push_back(near("sources of action 1 with the non-periodic one",
                             static_cast<double>(1 + small.options.first_sources), 4, 0, "1"));
  report.rows.push_back(near("further sources for actions 2 and 3",
                             static_cast<double>(small.options.further_sources), 2, 0, "1"));
  report.rows.push_back(holds("the non-periodic source falls from 1 to -1",
                              s(0, 0) == 1.0 && s(0, s.cols() - 1) < -0.999));
  report.rows.push_back(
      near("harmonic of the strongest periodic source", dominant_harmonic(s.row(1)), 1, 0, "1"));
  double jump = 0.0;
  for (Index k = 1; k < s.rows(); ++k)
    jump = std::max(jump, std::abs(s(k, 0) - s(k, s.cols() - 1)));
  report.rows.push_back(at_most("periodic sources close: largest step over the end", jump, 0.5, "1",
                                "rms 1, 100 samples"));
  report.rows.push_back(at_least("Q2 of all actions with 4 + 3 sources", large.quality_squared,
                                 small.quality_squared, "1", "3 + 2 sources"));
  if (plot_dir) {
    const auto png = *plot_dir / "fig-3.14.png";
    plot_png(png, 1000, 640,
             {curves("a", s.topRows(4)), curves("b", s.bottomRows(2)), curves("c", l.topRows(5)),
              curves("d", l.bottomRows(3))},
             "set multiplot layout 2,2\nset xlabel 't / T'\nset xzeroaxis\n" +
                 panel("a", 4, true, "a) action 1: 3 periodic sources, non-periodic dashed") +
                 panel("b", 2, false, "b) 2 further ones for actions 2 and 3") +
                 panel("c", 5, true, "c) 4 periodic sources") +
                 panel("d", 3, false, "d) 3 further ones") + "unset multiplot\n");
    report.plots.push_back(png);
  }
  return report;
}

// ---- fig. 3.15

// Share of the summed |weights| of joint rows that belongs to joints first..last.
double share_of(const VectorXd& w, int first, int last) {
  return w.segment(3 * first, 3 * (last - first + 1)).sum() / w.head(mocap::kBodyRows).sum();
}

Report weights(const PlotDir& plot_dir) {
  constexpr std::size_t kTrial = 4;
  Report report;
  std::array<VectorXd, kActions> ramp, first;
  Data bars{"bars", {}};
  for (std::size_t a = 0; a < kActions; ++a) {
    const MatrixXd& w = drawer_maps().model().action[a].patterns[kTrial].weight_rad;
    ramp[a] = w.col(0).cwiseAbs();
    first[a] = w.col(1).cwiseAbs();
  }
  for (int r = 0; r < mocap::kBodyRows; ++r)
    bars.rows.push_back(
        {double(r), first[0](r), first[1](r), first[2](r), ramp[0](r), ramp[1](r), ramp[2](r)});
  auto joints = [](const VectorXd& w) { return w.head(mocap::kBodyRows).sum(); };
  report.rows.push_back(at_least("action 1: periodic over non-periodic weights",
                                 joints(first[0]) / joints(ramp[0]), 1.0, "1",
                                 "the text: the periodic source dominates"));
  report.rows.push_back(at_least("action 2: non-periodic over periodic weights",
                                 joints(ramp[1]) / joints(first[1]), 1.0, "1",
                                 "the text: the non-periodic source dominates"));
  report.rows.push_back(at_least("action 3: non-periodic over periodic weights",
                                 joints(ramp[2]) / joints(first[2]), 1.0, "1",
                                 "the text: the non-periodic source dominates"));
  report.rows.push_back(at_least("action 1: share of the legs in the periodic source",
                                 share_of(first[0], mocap::kLeftHip, mocap::kRightAnkle), 0.4, "1",
                                 "the text: hip and leg joints strongly; 18 of 51 rows"));
  report.rows.push_back(at_least("action 2: share of the arms in the non-periodic source",
                                 share_of(ramp[1], mocap::kLeftShoulder, mocap::kRightWrist), 0.4,
                                 "1", "the text: primarily the arm; 18 of 51 rows"));
  report.rows.push_back(at_least("action 3: share of the arms in the non-periodic source",
                                 share_of(ramp[2], mocap::kLeftShoulder, mocap::kRightWrist), 0.4,
                                 "1", "the text: primarily the arm; 18 of 51 rows"));
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
    const auto png = *plot_dir / "fig-3.15.png";
    plot_png(png, 1200, 640, {bars},
             "set multiplot layout 2,1\nset style fill solid 0.9 noborder; set boxwidth 0.28\nset "
             "xrange [-1:51]\nset ylabel '|w| [rad]'\n" +
                 tics + "set title 'lowest periodic source (x, y, z of each joint)'\nplot " +
                 bar(2, 0, 1, "action 1") + ", " + bar(3, 1, 3, "action 2") + ", " +
                 bar(4, 2, 2, "action 3") + "\nset title 'non-periodic source'\nplot " +
                 bar(5, 0, 1, "action 1") + ", " + bar(6, 1, 3, "action 2") + ", " +
                 bar(7, 2, 2, "action 3") + "\nunset multiplot\n");
    report.plots.push_back(png);
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

// Q of a trial left out with all of its paces, from a map of the others; and with their mean.
struct LeftOut {
  double map, mean;
};

std::vector<LeftOut> left_out(Action action) {
  const ActionMaps& maps = drawer_maps();
  const MotionModel& model = maps.model().action[action];
  const auto n = static_cast<Index>(model.patterns.size()),
             rows = static_cast<Index>(model.rows.size()), k = model.sources.rows();
  std::vector<LeftOut> out;
  for (int recording = 0; recording < 10; ++recording) {
    std::vector<std::size_t> rest, test;
    for (std::size_t i = 0; i < model.patterns.size(); ++i)
      (static_cast<int>(i) % 10 == recording ? test : rest).push_back(i);
    MatrixXd x(static_cast<Index>(rest.size()), ActionMaps::inputs(action, {}).size()),
        y(static_cast<Index>(rest.size()), rows * (1 + k));
    for (std::size_t i = 0; i < rest.size(); ++i) {
      const Pattern& p = model.patterns[rest[i]];
      x.row(static_cast<Index>(i)) = ActionMaps::inputs(action, maps.task_of(action, rest[i]));
      y.row(static_cast<Index>(i)) << p.mean_rad.transpose(), p.weight_rad.reshaped().transpose();
    }
    const LocalRegression map(
        x, y, {.bandwidth = maps.map(action).bandwidth(), .ridge = maps.map(action).ridge()});
    auto quality = [&](std::size_t trial, const VectorXd& parameters) {
      demix::Mixture mix{.sources = model.sources,
                         .weights = parameters.tail(rows * k).reshaped(rows, k),
                         .delay_rad = model.patterns[0].delay_rad,
                         .means = parameters.head(rows),
                         .fixed = model.fixed};
      // means count as well: what is compared is motion, around the mean posture of the others
      const VectorXd around = y.leftCols(rows).colwise().mean().transpose();
      const MatrixXd truth = drawer_data()
                                 .action[action]
                                 .samples.middleRows(static_cast<Index>(trial) * rows, rows)
                                 .colwise() -
                             around;
      const MatrixXd guess = mix.reconstruct().colwise() - around;
      return 1.0 - (truth - guess).norm() / truth.norm();
    };
    for (const std::size_t i : test)
      out.push_back({quality(i, map.at(ActionMaps::inputs(action, maps.task_of(action, i))).value),
                     quality(i, y.colwise().mean().transpose())});
  }
  MIMESIS_ASSERT(static_cast<Index>(out.size()) == n);
  return out;
}

double median(std::vector<double> x) {
  std::ranges::sort(x);
  return 0.5 * (x[(x.size() - 1) / 2] + x[x.size() / 2]);
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
    for (const Pattern& p : drawer_maps().model().action[a].patterns)
      points.rows.push_back(
          {p.trial.step_length_m, p.trial.duration_s, p.weight_rad(kHipFlexion, 1)});
    const std::string name = a == kNormalStep ? "action 1" : "action 2";
    report.rows.push_back(at_least(name + ": spread of the hip's weight over the map", most - least,
                                   0.05, "rad", "a map that does not depend on its inputs has 0"));
    std::vector<double> map, mean;
    for (const LeftOut& o : left_out(a)) {
      map.push_back(o.map);
      mean.push_back(o.mean);
    }
    report.rows.push_back(at_least(name + ": median Q of trials left out (about the mean posture)",
                                   median(map), median(mean), "1", "the mean of the other trials"));
    report.rows.push_back(at_least(name + ": least Q of trials left out",
                                   *std::ranges::min_element(map), 0.41, "1",
                                   "goal of the maps: the mean trial's on recorded walks"));
    data.push_back(surface);
    data.push_back(points);
  }
  if (plot_dir) {
    const auto png = *plot_dir / "fig-3.20.png";
    plot_png(png, 1200, 520, data,
             "set multiplot layout 1,2\nset xlabel 'length [m]'; set ylabel 'duration [s]'; set "
             "zlabel 'w [rad]' rotate\nset xtics 0.2; set ytics 0.05; set hidden3d; set ticslevel "
             "0.1; set view 55,40; unset key\n"
             "set title 'a) action 1: hip flexion, first periodic source'\nsplot $a using 1:2:3 "
             "with lines lt 1 lw 1, $pa using 1:2:3 with points lt 2 pt 7 ps 1\n"
             "set title 'b) action 2'\nsplot $b using 1:2:3 with lines lt 1 lw 1, $pb using 1:2:3 "
             "with points lt 2 pt 7 ps 1\nunset multiplot\n");
    report.plots.push_back(png);
  }
  return report;
}

}  // namespace

void add_drawer_data_figures(std::vector<reproduce::Figure>& to) {
  to.push_back(
      {"fig-3.7", "how the way to the drawer is divided (generated trials)", "M18", planning});
  to.push_back(
      {"fig-3.13", "Q2 of the drawer task against the number of sources", "M18", approximation});
  to.push_back({"fig-3.14", "sources of the drawer task", "M18", sources});
  to.push_back({"fig-3.15", "weights of two sources in the three actions", "M18", weights});
  to.push_back({"fig-3.20", "maps from length and duration to a weight", "M18", maps});
}

}  // namespace mimesis::synthesizer
