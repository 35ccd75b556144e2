#include "nodes/walker/tasks/limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"

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
  for (const Side side : robot::kSides) {
    const int knee = biped.leg[static_cast<std::size_t>(side)].dof[3];
    const double straight = stretched_knee(biped, side), bent = biped.half_sitting[knee];
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

double stretched_knee(const robot::Biped& biped, Side side) {
  // The squared distance of two points on either side of a hinge: a + b cos q + c sin q.
  const auto& leg = biped.leg[static_cast<std::size_t>(side)];
  const auto link_of = [&](std::size_t joint) {
    return biped.tree.require_link(biped.tree.moved(leg.dof[joint]).name);
  };
  const int thigh = link_of(2), ankle = link_of(4);
  robot::Kinematics kinematics(biped.tree);
  const auto squared = [&](double angle) {
    Eigen::VectorXd q = biped.half_sitting;
    q[leg.dof[3]] = angle;
    kinematics.update(Eigen::Isometry3d::Identity(), q);
    return (kinematics.X_WL(thigh).translation() - kinematics.X_WL(ankle).translation())
        .squaredNorm();
  };
  const double zero = squared(0.0), half = squared(std::numbers::pi),
               quarter = squared(0.5 * std::numbers::pi);
  const double middle = 0.5 * (zero + half);
  return std::atan2(quarter - middle, zero - middle);
}

}  // namespace mimesis::walker
