#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/plot/gnuplot.h"
#include "nodes/synthesizer/control/local_regression.h"
#include "nodes/synthesizer/control/style_content.h"
#include "experiments/motion/planar_reach.h"

namespace mimesis::synthesizer {
namespace {

using reproduce::at_least;
using reproduce::at_most;
using plot::Data;
using reproduce::Report;

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
  Data target{"goal", {}}, hit{"preserving", {}}, missed{"plain", {}};
};

Pursuit pursue(int trained) {
  const Reaches r = reaches(trained);
  const Eigen::RowVectorXd mean = r.motions.colwise().mean();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(r.motions.rowwise() - mean, Eigen::ComputeThinV);
  constexpr int kPrimitives = 6;
  const Eigen::MatrixXd primitives = svd.matrixV().leftCols(kPrimitives);
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
    done.target.rows.push_back({goal.x(), goal.y()});
    done.hit.rows.push_back({s.x(), s.y()});
    done.missed.rows.push_back({p.x(), p.y()});
  }
  done.target.rows.push_back(done.target.rows.front());
  return done;
}

}  // namespace

reproduce::Report style_preserving_reach(const std::optional<std::filesystem::path>& dir) {
  const Pursuit many = pursue(160), few = pursue(80);
  Report report;
  const char* why =
      "M18 fig. 3.27 prints 1-2 cm against 7-8 cm, for a 7-joint arm and its own data";
  const double with_cm = 100.0 * many.with.mean_m;
  report.rows = {
      at_most("style-preserving, 160 reaches: miss, mean", with_cm, 2.0, "cm", why),
      at_most("style-preserving: miss, largest", 100.0 * many.with.worst_m, 2.0, "cm", why),
      at_least("by goal alone: miss, mean", 100.0 * many.without.mean_m, 7.0, "cm", why),
      at_least("by goal alone: miss, largest", 100.0 * many.without.worst_m, 8.0, "cm", why),
      at_least("style without prior: miss, mean", 100.0 * many.averaged.mean_m, 7.0, "cm",
               "the mean style lies between the two elbows"),
      at_most("style-preserving, 80 reaches: miss, mean", 100.0 * few.with.mean_m, 3.0, "cm",
              "how much depends on the number of reaches"),
      at_most("style-preserving, 80 reaches: miss, largest", 100.0 * few.with.worst_m, 8.0, "cm",
              "how much depends on the number of reaches")};
  if (dir) {
    report.plots.push_back(*dir / "style-preserving-reach.png");
    plot::plot_png(report.plots.back(), 760, 640, {many.target, many.hit, many.missed},
                        R"(set size ratio -1
set title 'A moving target (M18 3.4.3): where the hand arrives'
set xlabel 'x [m]'; set ylabel 'y [m]'; set key top left
set yrange [-0.15:0.25]
plot $goal with lines lc rgb '#000000' lw 2 title 'target', \
 $preserving with points pt 7 ps 0.8 lc rgb '#2b8c4a' title 'style preserved', \
 $plain with points pt 6 ps 0.8 lc rgb '#c8371e' title 'by goal alone'
)");
  }
  return report;
}

}  // namespace mimesis::synthesizer
