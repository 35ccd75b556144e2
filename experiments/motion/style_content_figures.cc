#include <Eigen/Core>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/plot/gnuplot.h"
#include "experiments/harness/figure.h"
#include "experiments/motion/figures.h"
#include "experiments/motion/planar_arm.h"
#include "experiments/motion/style_content.h"
#include "experiments/motion/svd.h"
#include "nodes/synthesizer/sequence/local_regression.h"

namespace mimesis::synthesizer {

/// The reaches of the planar arm that fig. 3.22 shows and that style-preserving-reach learns from.

inline constexpr int kReachSamples = 100;
inline constexpr double kReachStep_s = 0.01;

inline PlanarArm planar_arm() { return {Eigen::Vector3d(0.3, 0.25, 0.15)}; }
inline Eigen::Vector3d reach_start() { return {-0.25, 0.0, 1.5}; }

/// +1: elbow up (shoulder raised, elbow bent down again); −1: elbow down.
inline ArmStyle elbow_style(double side) {
  return {Eigen::Vector3d(0.9 * side, -1.5 * side, 0.0), Eigen::Vector3d(1.0, 1.0, 0.0), 4.0};
}

namespace {

using plot::Data;
using namespace reproduce;

/// Fraction of i times an irrational: spread evenly, the same on every machine.
double spread(int i, double step) { return i * step - std::floor(i * step); }

struct Reaches {
  Eigen::MatrixXd goals;    // N×2 [m]
  Eigen::MatrixXd motions;  // N×(3·samples) [rad]
};

/// Reaches of the planar arm from one posture, elbow up or down, each a little different.
Reaches reaches(int count) {
  const Eigen::Vector3d start = reach_start();
  Reaches r{Eigen::MatrixXd(count, 2), Eigen::MatrixXd(count, 3 * kReachSamples)};
  for (int i = 0; i < count; ++i) {
    r.goals.row(i) << 0.32 + 0.26 * spread(i + 1, std::numbers::sqrt2),
        -0.12 + 0.34 * spread(i + 1, std::numbers::sqrt3);
    ArmStyle style = elbow_style(spread(i + 1, std::numbers::phi) < 0.5 ? -1.0 : 1.0);
    style.preferred_rad *= 0.85 + 0.3 * spread(i + 1, std::numbers::e);
    const auto path =
        straight_reach(planar_arm().end(start), r.goals.row(i).transpose(), kReachSamples);
    r.motions.row(i) =
        follow(planar_arm(), start, path, kReachStep_s, style).reshaped().transpose();
  }
  return r;
}

Eigen::Vector2d hand_at_end(const Eigen::RowVectorXd& motion) {
  return planar_arm().end(motion.tail(3).transpose());
}

/// Mean and largest distance of the hand from goals that were not trained.
struct Miss {
  double mean_m = 0.0, worst_m = 0.0;
  void add(double miss_m, int of) {
    mean_m += miss_m / of;
    worst_m = std::max(worst_m, miss_m);
  }
};

/// The hand while the target moves on a closed curve and the style follows its last value.
struct Pursuit {
  Miss with, without, averaged;
};

Pursuit pursue(int trained) {
  const Reaches r = reaches(trained);
  const Eigen::RowVectorXd mean = r.motions.colwise().mean();
  constexpr int kPrimitives = 6;
  const Eigen::MatrixXd primitives = thin_svd(r.motions.rowwise() - mean).V.leftCols(kPrimitives);
  const Eigen::MatrixXd weights = (r.motions.rowwise() - mean) * primitives;
  StyleContentOptions options;
  options.centres = 3;
  const StyleContent content(r.goals, weights, options);
  Eigen::MatrixXd extended(trained, 3);
  extended << r.goals, content.styles();
  const LocalRegression plain(r.goals, weights), preserving(extended, weights);
  const double width = std::sqrt(content.styles().squaredNorm() / trained);
  const StyleContent::Kernel kernel{0.25 * width, 0.2};
  Eigen::VectorXd style = content.styles().row(0).transpose();
  Pursuit done;
  constexpr int kSteps = 120;
  for (int i = 0; i < kSteps; ++i) {
    const double a = 2.0 * std::numbers::pi * i / kSteps;
    const Eigen::Vector2d goal(0.45 + 0.08 * std::cos(a), 0.05 + 0.11 * std::sin(2.0 * a));
    style = content.infer_style(goal, style, 0.5 * width, kernel);
    const Eigen::VectorXd none =
        content.infer_style(goal, style, std::numeric_limits<double>::infinity(), kernel);
    const auto hand = [&](const LocalRegression& map, const Eigen::VectorXd& input) {
      return hand_at_end(mean + map.at(input).value.transpose() * primitives.transpose());
    };
    const auto with_style = [&](double s) { return Eigen::Vector3d(goal.x(), goal.y(), s); };
    const Eigen::Vector2d p = hand(plain, goal), s = hand(preserving, with_style(style[0]));
    done.without.add((p - goal).norm(), kSteps);
    done.with.add((s - goal).norm(), kSteps);
    done.averaged.add((hand(preserving, with_style(none[0])) - goal).norm(), kSteps);
  }
  return done;
}

}  // namespace

/// Claim of M18 fig. 3.27, on this arm: how far the hand ends from a moving target when motions are
/// mapped from goal and style, and from the goal alone.
Report style_preserving_reach(const PlotDir&) {
  const Pursuit many = pursue(160), few = pursue(80);
  Report report;
  const char* why = "1-2 cm against 7-8 cm, for a 7-joint arm and its own data";
  const double with_cm = 100.0 * many.with.mean_m;
  report.rows = {at_most("style-preserving, 160 reaches: miss, mean", with_cm,
                         published(2.0, "M18 fig. 3.27"), "cm", why),
                 at_most("style-preserving: miss, largest", 100.0 * many.with.worst_m,
                         published(2.0, "M18 fig. 3.27"), "cm", why),
                 at_least("by goal alone: miss, mean", 100.0 * many.without.mean_m,
                          published(7.0, "M18 fig. 3.27"), "cm", why),
                 at_least("by goal alone: miss, largest", 100.0 * many.without.worst_m,
                          published(8.0, "M18 fig. 3.27"), "cm", why),
                 at_least("style without prior: miss, mean", 100.0 * many.averaged.mean_m, 7.0,
                          "cm", "the mean style lies between the two elbows"),
                 at_most("style-preserving, 80 reaches: miss, mean", 100.0 * few.with.mean_m, 3.0,
                         "cm", "how much depends on the number of reaches"),
                 at_most("style-preserving, 80 reaches: miss, largest", 100.0 * few.with.worst_m,
                         8.0, "cm", "how much depends on the number of reaches")};
  return report;
}

namespace {

using Eigen::Index;
using plot::Data;

// ---- fig. 3.22 ---------------------------------------------------------------------------------

/// Broken lines of the arm at some instants.
Data snapshots(const std::string& name, const Eigen::MatrixXd& q) {
  Data data{name, {}};
  for (Index t = 0; t < q.cols(); t += 9) {
    const Eigen::Matrix2Xd p = planar_arm().points(q.col(t));
    for (Index i = 0; i < p.cols(); ++i) data.rows.push_back({p(0, i), p(1, i)});
    data.rows.push_back({std::nan(""), std::nan("")});
  }
  return data;
}

Report two_elbows(const PlotDir& dir) {
  const Eigen::Vector3d start = reach_start();
  const Eigen::Vector2d from = planar_arm().end(start), to = from + Eigen::Vector2d(0.0, 0.25);
  const Eigen::Matrix2Xd path = straight_reach(from, to, kReachSamples);
  const Eigen::MatrixXd up = follow(planar_arm(), start, path, kReachStep_s, elbow_style(1.0));
  const Eigen::MatrixXd down = follow(planar_arm(), start, path, kReachStep_s, elbow_style(-1.0));
  double off_path = 0.0, apart = 0.0;
  for (Index t = 0; t < kReachSamples; ++t) {
    off_path = std::max({off_path, (planar_arm().end(up.col(t)) - path.col(t)).norm(),
                         (planar_arm().end(down.col(t)) - path.col(t)).norm()});
    apart = std::max(apart, (planar_arm().end(up.col(t)) - planar_arm().end(down.col(t))).norm());
  }
  Report report;
  const char* same = "both styles move the hand alike, the style lives in the null space";
  report.rows = {
      at_most("hand off the vertical line", 1e3 * off_path, 1.0, "mm", same),
      at_most("hand of one style off that of the other", 1e3 * apart, 1.0, "mm", same),
      holds("elbow up: bent to the negative side at the goal", up(1, kReachSamples - 1) < -0.3,
            goal()),
      holds("elbow down: bent to the positive side", down(1, kReachSamples - 1) > 0.3, goal()),
      at_least("shoulder, up against down", up(0, kReachSamples - 1) - down(0, kReachSamples - 1),
               0.5, "rad", "the two reaches must look different")};
  if (dir) {
    report.plots.push_back(*dir / "fig-3.22.png");
    Data first = snapshots("first", start);
    plot::plot_png(report.plots.back(), 760, 720,
                   {snapshots("up", up),
                    snapshots("down", down),
                    first,
                    {"line", {{from.x(), from.y()}, {to.x(), to.y()}}}},
                   R"(set size ratio -1
set title 'Fig. 3.22: the same reach, elbow up and elbow down'
set xlabel 'x [m]'; set ylabel 'y [m]'; set key left bottom
set xrange [-0.05:0.65]; set yrange [-0.32:0.42]
plot $up with linespoints lc rgb '#1f4e9c' lw 1.2 pt 7 ps 0.5 title 'elbow up', \
 $down with linespoints lc rgb '#c8371e' lw 1.2 pt 7 ps 0.5 title 'elbow down', \
 $first with linespoints lc rgb '#2b8c4a' lw 4 pt 6 ps 1.6 title 'start', \
 $line with lines lc rgb '#000000' lw 2 dt 2 title 'hand', \
 $line every ::1::1 with points pt 3 ps 2.5 lw 2 lc rgb '#50d060' title 'goal'
)");
  }
  return report;
}

// ---- fig. 3.24, 3.25 ---------------------------------------------------------------------------

/// N points of the rectangle goal × style, warped into goal × features [M18 fig. 3.24]: the style
/// axis turns with the goal, and with `variable` the mean style moves too.
struct Distribution {
  Eigen::MatrixXd goals, features;  // N×1, N×2
  Eigen::VectorXd style;            // N, from the local mean
};

constexpr int kGoals = 41, kStyles = 9;

Eigen::Vector2d style_axis(double g) {
  const double angle = 0.3 + 2.2 * g;
  return {std::cos(angle), std::sin(angle)};
}

Eigen::Vector2d centre(double g, bool variable) {
  return variable ? Eigen::Vector2d(0.6 * std::sin(std::numbers::pi * g), 0.7 * g * g) +
                        0.4 * std::sin(2.0 * std::numbers::pi * g) * style_axis(g)
                  : Eigen::Vector2d(0.0, 0.0);
}

Distribution distribution(bool variable) {
  Distribution d{Eigen::MatrixXd(kGoals * kStyles, 1), Eigen::MatrixXd(kGoals * kStyles, 2),
                 Eigen::VectorXd(kGoals * kStyles)};
  for (int i = 0; i < kGoals * kStyles; ++i) {
    const double g = static_cast<double>(i / kStyles) / (kGoals - 1);
    d.style[i] = 2.0 * (i % kStyles) / (kStyles - 1) - 1.0;
    d.goals(i, 0) = g;
    d.features.row(i) = (centre(g, variable) + d.style[i] * style_axis(g)).transpose();
  }
  return d;
}

const char* name_of(bool variable) { return variable ? "variable mean" : "constant mean"; }

constexpr const char* kSpace = R"(set xlabel 'goal'; set ylabel 'W1' ; set zlabel 'W2'
set xyplane 0; set view 62,32; set border 4095 lc rgb '#b0b0b0'; set ticslevel 0
set xtics 0.5; set ytics 1; set ztics 1
)";

Data points_of(const Distribution& d) {
  Data data{"points", {}};
  for (Index i = 0; i < d.goals.rows(); ++i) {
    data.rows.push_back({d.goals(i, 0), d.features(i, 0), d.features(i, 1)});
  }
  return data;
}

Report distributions(const PlotDir& dir) {
  Report report;
  for (const bool variable : {false, true}) {
    const Distribution d = distribution(variable);
    Data lines{"fibres", {}};
    double bent = 0.0;
    for (int g = 0; g < kGoals; ++g) {
      const auto x = d.features.middleRows(g * kStyles, kStyles);
      const Eigen::VectorXd s = thin_svd(x.rowwise() - x.colwise().mean()).s;
      bent = std::max(bent, s[1] / s[0]);
      if (g % 4) continue;
      for (const int end : {0, kStyles - 1}) {
        lines.rows.push_back({d.goals(g * kStyles, 0), x(end, 0), x(end, 1)});
      }
      lines.rows.push_back({std::nan(""), std::nan(""), std::nan("")});
    }
    const Eigen::Vector2d first = style_axis(0.0), last = style_axis(1.0);
    const double turn = std::acos(std::clamp(first.dot(last), -1.0, 1.0));
    const std::string name = name_of(variable);
    report.at_most(name + ": the style fibres are straight", bent, closed_form(1e-9, "put in"), "1",
                   "one dimension per goal, as the text has it");
    report.near(name + ": turn of the style axis over the goals", turn, closed_form(2.2, "put in"),
                1e-9, "rad", "no fixed direction of the feature space would do");
    if (!dir) continue;
    plot::plot_png(
        report.picture(*dir / (variable ? "fig-3.24-variable.png" : "fig-3.24-constant.png")), 760,
        640, {points_of(d), lines},
        "set title 'Fig. 3.24: style fibres along the goals, " + name + "'\n" + kSpace +
            R"(unset key
splot $points with points pt 7 ps 0.35 lc rgb '#909090', $fibres with lines lc rgb '#1f4e9c' lw 4
)");
  }
  return report;
}

struct Fit {
  double style_rms, mean_rms, axis_rad;
};

Fit compare(const StyleContent& model, const Distribution& d, bool variable) {
  const double sign = model.styles().col(0).dot(d.style) < 0.0 ? -1.0 : 1.0;
  Fit fit{std::sqrt((sign * model.styles().col(0) - d.style).squaredNorm() /
                    static_cast<double>(d.style.size())),
          0.0, 0.0};
  for (int i = 0; i <= 100; ++i) {  // goals between the trained ones too
    const double g = 0.01 * i;
    const Eigen::VectorXd at = Eigen::VectorXd::Constant(1, g);
    fit.mean_rms += (model.mean(at) - centre(g, variable)).squaredNorm() / 101.0;
    const double cosine = sign * model.directions(at).col(0).dot(style_axis(g));
    fit.axis_rad = std::max(fit.axis_rad, std::acos(std::clamp(cosine, -1.0, 1.0)));
  }
  fit.mean_rms = std::sqrt(fit.mean_rms);
  return fit;
}

void plot_regression(Report& report, const PlotDir& dir, const Distribution& d,
                     const StyleContent& model, bool variable) {
  if (!dir) return;
  Data mean{"mean", {}}, fixed{"fixed", {}};
  for (const double s : {-1.0, -0.5, 0.5, 1.0}) {
    for (int i = 0; i <= 100; ++i) {
      const Eigen::VectorXd g = Eigen::VectorXd::Constant(1, 0.01 * i);
      const Eigen::VectorXd x = model.feature(g, Eigen::VectorXd::Constant(1, s));
      fixed.rows.push_back({g[0], x[0], x[1]});
      if (s == 1.0) mean.rows.push_back({g[0], model.mean(g)[0], model.mean(g)[1]});
    }
    fixed.rows.push_back({std::nan(""), std::nan(""), std::nan("")});
  }
  plot::plot_png(
      report.picture(*dir / (variable ? "fig-3.25-variable.png" : "fig-3.25-constant.png")), 760,
      640, {points_of(d), mean, fixed},
      std::string("set title 'Fig. 3.25: learned means and fixed styles, ") + name_of(variable) +
          "'\n" + kSpace + R"(set key top left
splot $points with points pt 7 ps 0.35 lc rgb '#909090' title 'motions', \
 $fixed with lines lc rgb '#1f4e9c' lw 2 title 'style -1, -0.5, 0.5, 1', \
 $mean with lines lc rgb '#2b8c4a' lw 4 title 'mean'
)");
}

Report regression(const PlotDir& dir) {
  Report report;
  for (const bool variable : {false, true}) {
    const Distribution d = distribution(variable);
    StyleContentOptions options;
    options.centres = 8;
    const StyleContent model(d.goals, d.features, options);
    options.start = StyleContentOptions::Start::norm;
    const Fit ours = compare(model, d, variable);
    const Fit printed = compare(StyleContent(d.goals, d.features, options), d, variable);
    const std::string name = name_of(variable);
    const char* range = "of a style range of 2; the truth is known";
    report.at_most(name + ": inferred style, rms error", ours.style_rms, 0.04, "1", range);
    report.at_most(name + ": local means, rms error", ours.mean_rms, 0.02, "1", range);
    report.at_most(name + ": style axis, largest error", ours.axis_rad, 0.1, "rad",
                   "smooth basis functions bend a little at the ends");
    report.at_least(name + ": rms error from the start s = |R| as printed", printed.style_rms,
                    ours.style_rms, "1",
                    "its directions begin by chance, since R∘|R| averages out");
    plot_regression(report, dir, d, model, variable);
  }
  return report;
}

}  // namespace

void add_style_content_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-3.22", "Reaching with elbow up or down: prioritised inverse kinematics",
                  "M18", Declared{.goal = 5}, two_elbows);
  to.emplace_back("fig-3.24", "Synthetic goal-style distributions", "M18",
                  Declared{.closed_form = 4}, distributions);
  to.emplace_back("fig-3.25", "Style-content separation: inferred means and styles", "M18",
                  Declared{.goal = 8}, regression);
  to.emplace_back("style-preserving-reach",
                  "Reaching a moving target with and without style inference", "M18",
                  Declared{.published = 4, .goal = 3}, style_preserving_reach);
}

}  // namespace mimesis::synthesizer
