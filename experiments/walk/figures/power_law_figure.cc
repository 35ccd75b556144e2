// The biped walks half an ellipse (which has every curvature of it) by four power laws [M18 4.5.1,
// fig. 4.14]: what becomes of the law once it has gone through walking in steps.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "experiments/dmp/power_law.h"
#include "experiments/harness/statistics.h"
#include "experiments/walk/figures.h"
#include "experiments/walk/trial/suites.h"
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {
namespace {

using dmp::PowerLawField;
using Eigen::Vector2d;
using namespace reproduce;

constexpr double kRunIn_s = 6.0;  // from standing to walking along the path
/// Large and slow enough that no law asks for more than the robot turns or walks.
constexpr double kLong_m = 2.4, kShort_m = 1.5, kSpeed_m_s = 0.15;

struct Lap {
  TrialResult result;
  double exponent = 0.0;    // exponent of the walked path
  double off_path_m = 0.0;  // mean of the feet, largest
};

/// One entry per step: where the middle of the feet was when it landed.
struct Landing {
  double time_s;
  Vector2d middle_W_m;
};

/// Exponent by least squares of log v on log κ over gait cycles of two steps: within one the body
/// sways.
double exponent_of(const std::vector<Landing>& landings, const PowerLawField& field) {
  std::vector<Vector2d> points;
  for (std::size_t i = 2; i < landings.size(); ++i) {
    if (landings[i - 2].time_s < kRunIn_s) continue;
    const Vector2d way = landings[i].middle_W_m - landings[i - 2].middle_W_m;
    const double speed = way.norm() / (landings[i].time_s - landings[i - 2].time_s);
    points.emplace_back(std::log(field.curvature(landings[i - 1].middle_W_m)), std::log(speed));
  }
  return -slope(points);
}

/// Steers the robot along the field from where its plan stands.
class Steering {
 public:
  Steering(const PowerLawField& field, const Eigen::Isometry2d& X_FW)
      : field_(field), X_FW_(X_FW) {}

  walker::WalkerWish wish() const {
    const Vector2d p = X_FW_ * middle_W_m_, v = field_.velocity(p);
    const double heading = std::atan2(v.y(), v.x()) - Eigen::Rotation2Dd(X_FW_.linear()).angle();
    const double off = std::remainder(heading - yaw_rad_, 2.0 * std::numbers::pi);
    walker::WalkerWish wish;
    wish.walk.velocity_m_s = {v.norm() * std::cos(off), v.norm() * std::sin(off)};
    wish.walk.yaw_rate_rad_s = v.norm() * field_.curvature(p) + off / kTurning_s;
    return wish;
  }
  void see(const walker::PatternSample& plan) {
    middle_W_m_ =
        0.5 * (plan.foot[0].X_WS.translation() + plan.foot[1].X_WS.translation()).head<2>();
    yaw_rad_ = plan.yaw_rad;
  }
  Vector2d place() const { return X_FW_ * middle_W_m_; }

 private:
  static constexpr double kTurning_s = 2.0;  // errors of heading are turned away in

  const PowerLawField& field_;
  Eigen::Isometry2d X_FW_;  // W of the robot, which starts at its origin along x, in the field
  Vector2d middle_W_m_ = Vector2d::Zero();
  double yaw_rad_ = 0.0;
};

Lap walk_half(const Robot& robot, double beta) {
  const PowerLawField field(
      {.long_m = kLong_m, .short_m = kShort_m, .beta = beta, .mean_speed_m_s = kSpeed_m_s});
  // Starts at the flat side, heading along it
  Eigen::Isometry2d X_FW = Eigen::Isometry2d::Identity();
  X_FW.translation() = field.on_path(-0.5 * std::numbers::pi);
  Steering steering(field, X_FW);

  Lap lap;
  std::vector<Landing> landings;
  TrialSpec spec;
  spec.name = "power law";
  spec.robot = &robot;
  spec.duration_s = kRunIn_s + 0.5 * field.lap_s();
  spec.wish = [&](double) { return steering.wish(); };
  lap.result = run_trial(spec, [&](const TrialTick& tick) {
    const int steps = static_cast<int>(landings.size());
    steering.see(tick.out.pattern);
    if (tick.out.pattern.steps <= steps) return;
    const Vector2d p = steering.place();
    landings.push_back({tick.time_s, p});
    const Vector2d q(p.x() / kLong_m, p.y() / kShort_m);
    lap.off_path_m = std::max(lap.off_path_m, (p - p / q.norm()).norm());
  });
  lap.exponent = exponent_of(landings, field);
  return lap;
}

}  // namespace

Report power_law(const PlotDir&) {
  const Robot robot = load_robot("biped");
  Report report;
  constexpr std::array laws = {std::pair{-1.0 / 3.0, "β = -1/3"}, std::pair{0.0, "β = 0"},
                               std::pair{1.0 / 3.0, "β = 1/3"}, std::pair{2.0 / 3.0, "β = 2/3"}};
  const std::vector<Lap> laps =
      in_parallel(laws.size(), [&](std::size_t i) { return walk_half(robot, laws[i].first); });
  for (std::size_t i = 0; i < laws.size(); ++i) {
    const Lap& lap = laps[i];
    const auto& [beta, name] = laws[i];
    const std::string law = name;
    report.near(law + ": falls", lap.result.figures.fell, goal(0), 0, "1");
    report.near(law + ": exponent of what was walked", lap.exponent, closed_form(beta, "wished"),
                0.03, "1", "a tenth of the way to the next law");
    report.at_most(law + ": off the path, largest", lap.off_path_m, 0.02, "m",
                   "middle of the feet at landings; nothing is published");
  }
  return report;
}

}  // namespace mimesis::walk
