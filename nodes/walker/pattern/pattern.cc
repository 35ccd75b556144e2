#include <algorithm>
#include <cmath>
#include <sstream>

#include "common/error.h"
#include "nodes/walker/pattern/steps.h"

namespace mimesis::walker {
namespace {

void demand_gait(bool fulfilled, const char* key, double value, const char* expected) {
  if (fulfilled) return;
  std::ostringstream text;  // 0.75, not 0.750000
  text << "gait." << key << ": " << value << ", expected " << expected;
  throw ConfigError(text.str());
}

bool on_grid(double seconds) {
  const double samples = seconds / (kSampleTicks * kTick_s);
  return std::abs(samples - std::round(samples)) < 1e-9;
}

}  // namespace

void check(const GaitSettings& s) {
  demand_gait(s.com_height_m > 0.1 && s.com_height_m < 3.0, "com_height_m", s.com_height_m,
              "between 0.1 and 3");
  demand_gait(on_grid(s.step_s) && s.step_s > 0.35 && s.step_s < 1.25, "step_s", s.step_s,
              "a multiple of 0.1 in [0.4, 1.2]");
  demand_gait(on_grid(s.double_support_s) && s.double_support_s > 0.05 &&
                  s.double_support_s < s.step_s - 0.25,
              "double_support_s", s.double_support_s, "a multiple of 0.1 in [0.1, step_s - 0.3]");
  demand_gait(on_grid(s.first_double_support_s) && s.first_double_support_s > 0.35 &&
                  s.first_double_support_s < 5.05,
              "first_double_support_s", s.first_double_support_s, "a multiple of 0.1 in [0.4, 5]");
  for (const double half : s.zmp_half_m) {
    demand_gait(half > 0.0 && half < 0.5, "zmp_half_m", half, "between 0 and 0.5");
  }
  demand_gait(s.narrowest_step_m > 0.0, "narrowest_step_m", s.narrowest_step_m, "above 0");
  demand_gait(s.feet_distance_m > s.narrowest_step_m, "feet_distance_m", s.feet_distance_m,
              "above narrowest_step_m");
  demand_gait(s.widest_step_m > s.feet_distance_m && s.widest_step_m < 2.0, "widest_step_m",
              s.widest_step_m, "above feet_distance_m, below 2");
}

GaitSettings gait_settings(const robot::Biped& biped) {
  GaitSettings s;
  const GaitSettings standard;
  // biped.urdf: thigh + shank as published for HRP-2 (2 × 0.3 m), without the 35 mm by which the
  // knee is beside the hip; robot::leg_length_m() counts these and gives 0.602 m, the value that
  // the synthesizer divides by (robot_size.cc). See docs/walking.md 8.2 before changing either.
  constexpr double kLeg_m = 0.6;
  constexpr double kSoleBack_m = 0.1, kSoleInner_m = 0.056;  // from the ankle
  const double scale = robot::leg_length_m(biped) / kLeg_m;
  s.step_s = biped.step_s;
  s.com_height_m = biped.com_height_m;
  s.feet_distance_m = biped.feet_distance_m;
  const robot::Biped::Leg& leg = biped.leg[kLeft];
  const double ahead = std::min(-leg.min_S_m.x(), leg.max_S_m.x());
  const double aside = std::min(-leg.min_S_m.y(), leg.max_S_m.y());
  // What the feedback needs beside the plan is no smaller on small soles: errors of the senses are
  // not.
  constexpr double kForFeedback_m = 0.02, kLeast_m = 0.005;
  s.zmp_half_m = {standard.zmp_half_m.x() * ahead / kSoleBack_m,
                  std::min(standard.zmp_half_m.y() * aside / kSoleInner_m,
                           std::max(aside - kForFeedback_m, kLeast_m))};
  s.narrowest_step_m *= s.feet_distance_m / standard.feet_distance_m;
  s.widest_step_m *= scale;
  s.longest_step_m *= scale;
  s.step_height_m *= scale;
  s.most_forward_m_s *= scale;
  s.most_sideways_m_s *= scale;
  const auto own = [](double value, double& out) {
    if (value > 0.0) out = value;
  };
  own(biped.gait.step_height_m, s.step_height_m);
  own(biped.gait.most_forward_m_s, s.most_forward_m_s);
  own(biped.gait.most_sideways_m_s, s.most_sideways_m_s);
  own(biped.gait.most_turn_rad_s, s.most_turn_rad_s);
  check(s);
  return s;
}

}  // namespace mimesis::walker
