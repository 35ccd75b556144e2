#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "common/error.h"
#include "nodes/synthesizer/drawer/trial_generator.h"

namespace mimesis::synthesizer {
namespace {

// Standard library generators give the same bits everywhere, its distributions do not.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double uniform() { return (static_cast<double>(random_() >> 11) + 0.5) * 0x1.0p-53; }  // (0, 1)
  // normal, cut at two standard deviations
  double normal() {
    for (;;) {
      const double r = std::sqrt(-2.0 * std::log(uniform()));
      const double x = r * std::cos(2.0 * std::numbers::pi * uniform());
      if (std::abs(x) <= 2.0) return x;
    }
  }
  double around(double mean, double deviation) { return mean + deviation * normal(); }

 private:
  std::mt19937_64 random_;
};

constexpr double kMeanNormalLength = 1.57;   // m: two of three steps of 0.385 (2.64 m − 0.6 m)
constexpr double kNormalDeviation = 0.042;   // m
constexpr double kPublishedR2 = 0.08;        // of action 1's length on the initial distance
constexpr double kMeanFinalDistance = 0.60;  // m
constexpr double kFrontObject = 0.15, kBackObject = 0.33, kSideObject = 0.11;  // m

// Noise of action 1's length: what of it goes with the distance is taken out and put back in the
// share that R² asks for.
Eigen::VectorXd normal_lengths(const Eigen::VectorXd& distance_m, Draw& draw) {
  const Eigen::VectorXd d = (distance_m.array() - distance_m.mean()).matrix().normalized();
  Eigen::VectorXd e(d.size());
  for (double& x : e) x = draw.normal();
  e.array() -= e.mean();
  e -= d.dot(e) * d;
  const double size = kNormalDeviation * std::sqrt(static_cast<double>(d.size()));
  const Eigen::VectorXd noise =
      size * (std::sqrt(kPublishedR2) * d + std::sqrt(1.0 - kPublishedR2) * e.normalized());
  return noise.array() + kMeanNormalLength;
}

Manner draw_manner(Draw& draw) {
  Manner m;
  m.half_width_m = draw.around(0.09, 0.006);
  m.sway_m = draw.around(0.022, 0.002);
  m.pelvis_turn_rad = draw.around(0.08, 0.008);
  m.pelvis_list_rad = draw.around(0.04, 0.004);
  m.arm_swing_rad = draw.around(0.38, 0.03);
  m.elbow_rad = draw.around(0.40, 0.03);
  m.lean_rad = draw.around(0.05, 0.01);
  m.extra_lean_rad = std::abs(draw.around(0.0, 0.02));
  m.toe_out_rad = draw.around(0.10, 0.01);
  m.clearance_m = draw.around(0.05, 0.003);
  m.drift_rad = draw.around(0.010, 0.002);
  m.drift_phase_rad = 2.0 * std::numbers::pi * draw.uniform();
  m.first_step_share = draw.around(0.5, 0.006);
  return m;
}

TrialPlan at_pace(TrialPlan plan, double pace) {
  plan.pace = pace;
  plan.normal_length_m *= pace;
  plan.reaching_length_m *= pace;
  return plan;
}

void check(const GeneratorSettings& s) {
  auto refuse = [](const std::string& what) { throw ConfigError("drawer trials: " + what); };
  if (s.trials < 4)
    refuse(std::to_string(s.trials) + " trials, expected at least 4 (the places of the object)");
  if (s.samples < 20)
    refuse(std::to_string(s.samples) + " samples an action, expected at least 20");
  if (!(s.nearest_m < s.farthest_m)) refuse("nearest distance is not below the farthest");
  if (!(s.nearest_m >= 2.3))
    refuse("nearest distance " + std::to_string(s.nearest_m) +
           " m leaves nothing for action 2, expected at least 2.3 m");
  if (!(s.farthest_m <= 3.2))
    refuse("farthest distance " + std::to_string(s.farthest_m) +
           " m asks action 2 for a jump, expected at most 3.2 m");
  for (double pace : s.paces)
    if (!(pace >= 0.5 && pace <= 1.25))
      refuse("pace " + std::to_string(pace) + " is outside [0.5, 1.25]");
}

}  // namespace

std::vector<TrialPlan> draw_plans(const GeneratorSettings& settings) {
  check(settings);
  Draw draw(settings.seed);
  const int n = settings.trials;
  const Eigen::VectorXd distance =
      Eigen::VectorXd::LinSpaced(n, settings.nearest_m, settings.farthest_m);
  const Eigen::VectorXd normal = normal_lengths(distance, draw);
  std::vector<TrialPlan> plans;
  for (int i = 0; i < n; ++i) {
    TrialPlan p;
    p.recording = i;
    // the order of places 0 3 1 2 keeps depth and side apart from the distance
    const int place = std::array{0, 3, 1, 2}[static_cast<std::size_t>(i % 4)];
    p.object_depth_m = place < 2 ? kFrontObject : kBackObject;
    p.object_lateral_m = place % 2 == 0 ? kSideObject : -kSideObject;
    p.normal_length_m = normal(i);
    p.final_distance_m = kMeanFinalDistance + draw.around(0.0, 0.008) +
                         0.15 * (p.object_depth_m - 0.5 * (kFrontObject + kBackObject));
    p.reaching_length_m = distance(i) - p.normal_length_m - p.final_distance_m;
    p.duration_s[kNormalStep] =
        1.12 * std::sqrt(p.normal_length_m / kMeanNormalLength) * draw.around(1.0, 0.025);
    p.duration_s[kReachingStep] =
        1.25 * draw.around(1.0, 0.03) + 0.25 * (p.reaching_length_m - 0.47);
    p.duration_s[kStanding] = 1.60 * draw.around(1.0, 0.04) + 0.4 * (p.object_depth_m - 0.24);
    p.manner = draw_manner(draw);
    plans.push_back(p);
  }
  for (double pace : settings.paces)
    for (int i = 0; i < n; ++i) plans.push_back(at_pace(plans[static_cast<std::size_t>(i)], pace));
  return plans;
}

}  // namespace mimesis::synthesizer
