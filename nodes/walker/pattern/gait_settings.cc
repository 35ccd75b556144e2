#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "nodes/walker/pattern/steps.h"

namespace mimesis::walker {
namespace {

void demand(bool fulfilled, const char* what) {
  if (!fulfilled) throw ConfigError(std::string("gait: ") + what);
}

bool on_grid(double seconds) {
  const double samples = seconds / (kSampleTicks * kTick_s);
  return std::abs(samples - std::round(samples)) < 1e-9;
}

/// Thigh and shank.
double leg_length_m(const robot::Biped& biped) {
  const robot::Biped::Leg& leg = biped.leg[kLeft];
  const auto offset = [&](int dof) { return biped.tree.moved(dof).X_PJ.translation().norm(); };
  return offset(leg.dof[3]) + offset(leg.dof[4]);
}

}  // namespace

void check(const GaitSettings& s) {
  demand(s.com_height_m > 0.1 && s.com_height_m < 3.0, "com_height is not in (0.1, 3) m");
  demand(on_grid(s.step_s) && s.step_s > 0.35 && s.step_s < 1.25,
         "step is no multiple of 0.1 s in [0.4, 1.2]");
  demand(on_grid(s.double_support_s) && s.double_support_s > 0.05 &&
             s.double_support_s < s.step_s - 0.25,
         "double_support is no multiple of 0.1 s in [0.1, step - 0.3]");
  demand(on_grid(s.first_double_support_s) && s.first_double_support_s > 0.35 &&
             s.first_double_support_s < 5.05,
         "first_double_support is no multiple of 0.1 s in [0.4, 5]");
  demand(s.step_height_m >= 0.0 && s.step_height_m < 0.5, "step_height is not in [0, 0.5) m");
  demand(s.zmp_half_m.minCoeff() > 0.0 && s.zmp_half_m.maxCoeff() < 0.5,
         "zmp_half is not in (0, 0.5) m");
  demand(s.narrowest_step_m > 0.0 && s.narrowest_step_m < s.feet_distance_m &&
             s.feet_distance_m < s.widest_step_m && s.widest_step_m < 2.0,
         "0 < narrowest_step < feet_distance < widest_step < 2 m does not hold");
  demand(s.longest_step_m > 0.0 && s.longest_step_m < 2.0, "longest_step is not in (0, 2) m");
  demand(s.most_forward_m_s >= 0.0 && s.most_sideways_m_s >= 0.0 && s.most_turn_rad_s >= 0.0 &&
             s.most_foot_yaw_rad >= 0.0 && s.most_foot_yaw_rad < 1.0,
         "a limit is negative, or most_foot_yaw is not below 1 rad");
}

GaitSettings gait_settings(const robot::Biped& biped) {
  GaitSettings s;
  const GaitSettings standard;
  constexpr double kLeg_m = 0.6, kSoleBack_m = 0.1, kSoleInner_m = 0.056;  // of biped.urdf
  const double scale = leg_length_m(biped) / kLeg_m;
  s.com_height_m = biped.com_height_m;
  s.feet_distance_m = biped.feet_distance_m;
  const robot::Biped::Leg& leg = biped.leg[kLeft];
  const double ahead = std::min(-leg.min_S_m.x(), leg.max_S_m.x());
  const double aside = std::min(-leg.min_S_m.y(), leg.max_S_m.y());
  s.zmp_half_m = {standard.zmp_half_m.x() * ahead / kSoleBack_m,
                  standard.zmp_half_m.y() * aside / kSoleInner_m};
  s.narrowest_step_m *= s.feet_distance_m / standard.feet_distance_m;
  s.widest_step_m *= scale;
  s.longest_step_m *= scale;
  s.step_height_m *= scale;
  s.most_forward_m_s *= scale;
  s.most_sideways_m_s *= scale;
  check(s);
  return s;
}

}  // namespace mimesis::walker
