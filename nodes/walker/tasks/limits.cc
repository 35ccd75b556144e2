#include "nodes/walker/tasks/limits.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "nodes/walker/tasks/leg_room.h"

namespace mimesis::walker {
namespace {

// The base is no joint; this keeps absurd goals from throwing it about.
constexpr double kBase_m_s = 3.0, kBase_rad_s = 10.0;
constexpr double kApproach_1_s = 50.0;  // of the way that is left to a limit

void check(bool good, const char* key, double value, const char* expected) {
  if (good) return;
  throw ConfigError("stack." + std::string(key) + ": " + std::to_string(value) + ", expected " +
                    expected);
}

}  // namespace

Limits::Limits(const robot::Biped& biped, const StackSettings& settings)
    : lower_(biped.tree.lower()),
      upper_(biped.tree.upper()),
      speed_(settings.speed_share * biped.tree.max_speed()) {
  const double margin = settings.limit_margin_rad, share = settings.speed_share;
  check(margin >= 0.0 && margin <= 0.2, "limit_margin_rad", margin, "0 .. 0.2");
  check(share > 0.0 && share <= 1.0, "speed_share", share, "above 0, at most 1");
  check(settings.knee_margin_rad >= 0.0 && settings.knee_margin_rad <= 0.5, "knee_margin_rad",
        settings.knee_margin_rad, "0 .. 0.5");
  check(settings.damping >= 1e-6 && settings.damping <= 1.0, "damping", settings.damping,
        "1e-6 .. 1");
  for (Eigen::Index i = 0; i < lower_.size(); ++i) {
    const double room = std::min(margin, 0.5 * (upper_[i] - lower_[i]));
    lower_[i] += room;
    upper_[i] -= room;
  }
  keep_knees_bent(biped, settings.knee_margin_rad);
}

void Limits::keep_knees_bent(const robot::Biped& biped, double margin_rad) {
  const LegRoom room(biped);
  for (const Side side : robot::kSides) {
    const int knee = biped.leg[side].dof[robot::kKnee];
    const double straight = room.straight_rad(side), bent = biped.half_sitting[knee];
    if (bent > straight) {
      lower_[knee] = std::clamp(straight + margin_rad, lower_[knee], upper_[knee]);
    } else {
      upper_[knee] = std::clamp(straight - margin_rad, lower_[knee], upper_[knee]);
    }
  }
}

void Limits::bounds(const Eigen::Ref<const Eigen::VectorXd>& q, double dt_s,
                    Eigen::Ref<Eigen::VectorXd> lower, Eigen::Ref<Eigen::VectorXd> upper) const {
  upper.head<3>().setConstant(kBase_m_s * dt_s);
  upper.segment<3>(3).setConstant(kBase_rad_s * dt_s);
  lower.head<6>() = -upper.head<6>();
  const double share = std::min(1.0, kApproach_1_s * dt_s);
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const double most = speed_[i] * dt_s;
    lower[6 + i] = std::clamp(share * (lower_[i] - q[i]), -most, most);
    upper[6 + i] = std::clamp(share * (upper_[i] - q[i]), -most, most);
  }
}

}  // namespace mimesis::walker
