// Planning of the drawer task: the generated training data [M18 3.3].
#include <cmath>

#include "common/motion/demix/held_out.h"
#include "common/plot/gnuplot.h"
#include "experiments/motion/drawer_training.h"
#include "experiments/motion/figures.h"
#include "nodes/synthesizer/sequence/trials.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using plot::Data;
using plot::plot_png;
using namespace reproduce;

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

// What legs walk in a period, by the way of the lowest of heels and toes under the pelvis.
double walked_m(const mocap::Body& body, const MatrixXd& rows) {
  double walked = 0.0;
  std::array<Eigen::Vector3d, 4> before;
  for (Index t = 0; t <= rows.cols(); ++t) {
    const VectorXd angles = rows.col(t % rows.cols()).head(mocap::kBodyRows);
    const auto pose = forward_kinematics(
        body, std::span<const double, mocap::kBodyRows>(angles.data(), mocap::kBodyRows),
        Eigen::Vector3d::Zero());
    const std::array<Eigen::Vector3d, 4> now = {pose.point(mocap::kLeftAnkle, body.heel_m[0]),
                                                pose.point(mocap::kLeftAnkle, body.toe_m[0]),
                                                pose.point(mocap::kRightAnkle, body.heel_m[1]),
                                                pose.point(mocap::kRightAnkle, body.toe_m[1])};
    if (t > 0) {
      std::size_t lowest = 0;
      for (std::size_t i = 1; i < 4; ++i) {
        if (now[i].z() + before[i].z() < now[lowest].z() + before[lowest].z()) lowest = i;
      }
      walked += before[lowest].x() - now[lowest].x();
    }
    before = now;
  }
  return walked;
}

// 1 - Σ(yᵢ - ŷᵢ)² / Σ(yᵢ - ȳ)², ŷᵢ predicted without trial i.
double held_out_r_squared(const VectorXd& y, const VectorXd& predicted) {
  return 1.0 - (y - predicted).squaredNorm() / (y.array() - y.mean()).matrix().squaredNorm();
}

struct LearnedWay {
  double legs, labels;
};

// Ten trials whose length of action 1 goes with the initial distance as R² says. Each is left out
// once; a line over the distance gives its motion (means and weights of the mixture that is learned
// from the others), and its length as it is written with the trials. Nobody tells the map a length.
LearnedWay learned_lengths(double put_in) {
  const DrawerData data =
      generate_drawer_data(mocap::standard_body(), {}, {.paces = {}, .length_r_squared = put_in});
  const mocap::Trials& set = data.action[kNormalStep];
  const Index n = static_cast<Index>(set.trials.size()), rows = set.rows_per_trial();
  demix::SisaOptions options{
      .sources = 4, .tied = true, .fixed = demix::non_periodic(1, set.samples.cols())};
  options.start = demix::sisa(set, options).mixture.sources.bottomRows(3);
  VectorXd legs(n), length(n), label(n);
  for (Index i = 0; i < n; ++i) {
    const auto is_it = [&](const mocap::Trial& t) {
      return &t == &set.trials[static_cast<std::size_t>(i)];
    };
    const mocap::Trials others = demix::subset(set, std::not_fn(is_it));
    const demix::Mixture mix = demix::sisa(others, options).mixture;
    MatrixXd x(n - 1, 1), y(n - 1, rows * 5), lengths(n - 1, 1);
    for (Index k = 0; k < n - 1; ++k) {
      const mocap::Trial& trial = others.trials[static_cast<std::size_t>(k)];
      x(k, 0) = trial.task.at(0);
      lengths(k, 0) = trial.step_length_m;
      y.row(k) << mix.means.segment(k * rows, rows).transpose(),
          mix.weights.middleRows(k * rows, rows).reshaped().transpose();
    }
    const mocap::Trial& asked = set.trials[static_cast<std::size_t>(i)];
    const VectorXd at = VectorXd::Constant(1, asked.task.at(0));
    // one line over all trials, also beyond their ends
    const LocalRegressionOptions line{.bandwidth = 100.0, .ridge = 1e-9, .margin = 10.0};
    const VectorXd p = LocalRegression(x, y, line).at(at).value;
    const auto legs_of = [&](const VectorXd& means, const MatrixXd& weights) {
      return walked_m(data.body,
                      demix::Mixture{mix.sources, weights, mix.delay_rad.topRows(rows), means, 1}
                          .reconstruct());
    };
    double bias = 0.0;  // of what the mixture's legs walk, as the other trials have it
    for (Index k = 0; k < n - 1; ++k) {
      const double walked =
          legs_of(mix.means.segment(k * rows, rows), mix.weights.middleRows(k * rows, rows));
      bias += (walked - lengths(k, 0)) / static_cast<double>(n - 1);
    }
    legs(i) = legs_of(p.head(rows), p.tail(rows * 4).reshaped(rows, 4)) - bias;
    length(i) = asked.step_length_m;
    label(i) = LocalRegression(x, lengths, line).at(at).value(0);
  }
  return {held_out_r_squared(length, legs), held_out_r_squared(length, label)};
}

// R² of the length of the first action on the distance, over the plans for 13 distances.
double planned_r_squared() {
  const ActionRanges ranges = ranges_of(drawer_data().action);
  std::vector<double> distance, length;
  for (double d = 2.34; d < 2.945; d += 0.05) {
    const auto plan = plan_actions(d, ranges);
    if (!plan || plan->size() != 3) continue;
    distance.push_back(d);
    length.push_back(plan->front().length_m);
  }
  const auto n = static_cast<Index>(distance.size());
  return regression(VectorXd::Map(distance.data(), n), VectorXd::Map(length.data(), n)).r_squared;
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
  report.near("put in: R² of action 1's length on the initial distance", normal.r_squared,
              closed_form(0.08, "put in, M18 3.3.1"), 1e-6, "1");
  report.near("follows from it: p", normal.p,
              closed_form(0.429, "of R² = 0.08 put in and 10 trials, M18 3.3.1"), 0.005, "1");
  // what the even distances leave of action 1's length and of the final distance is action 2's
  const double rest = 0.92 * 0.042 * 0.042 + 0.15 * 0.15 * 0.09 * 0.09 + 0.008 * 0.008;
  const double spread = 0.6 * 0.6 * 11.0 / 108.0;  // variance of 10 even distances
  const double slope = 1.0 - std::sqrt(0.08 * 0.042 * 0.042 / spread);
  report.near("follows from the lengths put in: R² of action 2's length", reaching.r_squared,
              closed_form(slope * slope * spread / (slope * slope * spread + rest),
                          "of what is put in; M18 3.3.1 prints 0.95"),
              0.03, "1");
  report.near("put in: nearest start", initial.minCoeff(), closed_form(2.34, "M18 3.7"), 1e-6, "m");
  report.near("put in: farthest start", initial.maxCoeff(), closed_form(2.94, "M18 3.7"), 1e-6,
              "m");
  report.near("put in: final distance, mean", last.mean(), closed_form(0.6, "M18 3.4.2"), 0.02,
              "m");
  report.at_most("put in: final distance, largest deviation",
                 (last.array() - last.mean()).abs().maxCoeff(), 0.05, "m", "\"almost constant\"");
  report.holds("put in: final distance rises with the object's depth",
               regression(depth, last).slope > 0.0 && regression(depth, last).p < 0.05,
               closed_form("M18 3.3.1"));
  report.near("put in: share of the first step, mean of half of action 1 over D - 0.6 m",
              (0.5 * first.array() / (initial.array() - 0.6)).mean(),
              closed_form(0.385, "M18 3.4.2"), 0.02, "1");
  // whoever puts nothing in must get nothing out, on trials that are left out
  const LearnedWay none = learned_lengths(0.0), peoples = learned_lengths(0.08),
                   strong = learned_lengths(0.8);
  const std::string what = ": held-out R² of action 1's way of the legs, learned from the distance";
  report.at_most("R² = 0 put in" + what, none.legs, 0.0, "1",
                 "1 - errors² / deviations² of trials left out of sources, delays "
                 "and map: at 0 and below the distance tells nothing");
  report.at_most("R² = 0.08 put in" + what, peoples.legs, 0.08, "1",
                 "of ten trials nobody can learn more than was put in");
  report.at_least("R² = 0.8 put in" + what, strong.legs, 0.5 * strong.labels, "1",
                  "half of what the written lengths give");
  report.beside(
      "R² of action 1 as the online plan divides the way", planned_r_squared(),
      published(0.08, "M18 3.3.1, of people"), "1",
      "the rule of M18 3.4.2, (D - 0.6 m) gamma, makes it proportional: people's independence of "
      "the distance is in the trials and not in the plan");
  if (plot_dir)
    plot_png(report.picture(*plot_dir / "fig-3.7.png"), 900, 480, {bars},
             "set style data histograms; set style histogram rowstacked\n"
             "set style fill solid 0.85 noborder; set boxwidth 0.7\n"
             "set xlabel 'trial, by initial distance'; set ylabel 'm from the object'\n"
             "set key outside right top invert; set yrange [0:*]\n"
             "plot $bars using 2:xtic(1) lc rgb '#3a66b0' title 'panel to object', "
             "'' using 3 lc rgb '#c8371e' title 'standing', "
             "'' using 4 lc rgb '#e8b820' title 'action 2', "
             "'' using 5 lc rgb '#2b8c4a' title 'action 1'\n");
  return report;
}

}  // namespace

void add_drawer_plan_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-3.7", "how the way to the drawer is divided (generated trials)", "M18",
                  Declared{.published = 1, .closed_form = 8, .goal = 4}, planning);
}

}  // namespace mimesis::synthesizer
