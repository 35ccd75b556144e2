#include "nodes/walker/testing/filtered_walk.h"

#include "nodes/walker/pattern/generators.h"
#include "nodes/walker/pattern/preview_control.h"

namespace mimesis::walker {
namespace {

constexpr double kSteady_s = 4.0;  ///< the walk and the arms have got going

template <class Error>
Eigen::Vector2d rms(const std::vector<FilteredWalk::Tick>& ticks, const Error& error) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double count = 0.0;
  for (const FilteredWalk::Tick& tick : ticks) {
    if (tick.time_s < kSteady_s) continue;
    sum += error(tick).cwiseAbs2();
    count += 1.0;
  }
  return (sum / count).cwiseSqrt();
}

}  // namespace

Eigen::Vector2d FilteredWalk::rms_before_m() const {
  return rms(ticks, [](const Tick& tick) { return tick.error_before_m; });
}
Eigen::Vector2d FilteredWalk::rms_after_m() const {
  return rms(ticks, [](const Tick& tick) { return tick.error_after_m; });
}

FilteredWalk filtered_walk(const robot::Biped& biped, double speed_m_s, double arms,
                           const FilterSettings& settings, double duration_s) {
  const GaitSettings gait = gait_settings(biped);
  LinearMpc pattern(gait);
  const double y = 0.5 * biped.feet_distance_m;
  pattern.reset(
      {Footprint{.side = kLeft, .p_W_m = {0.0, y}}, Footprint{.side = kRight, .p_W_m = {0.0, -y}}});
  DynamicFilter filter(biped, gait, settings);
  WholeBody body(biped, gait.com_height_m);  // judges independently of the filter
  const SwingingArms upper_body(biped, arms);
  std::vector<UpperBody> upper(static_cast<std::size_t>(settings.samples));
  Wish wish;
  wish.velocity_m_s.x() = speed_m_s;
  FilteredWalk walk;
  for (int tick = 0; tick * kTick_s < duration_s; ++tick) {
    pattern.step(wish);
    for (std::size_t k = 0; k < upper.size(); ++k) {
      upper_body.at((tick + static_cast<int>(k) * filter.ticks_a_sample()) * kTick_s, upper[k]);
    }
    const ComState shift = filter.step(pattern, upper);
    walk.unreachable += filter.unreachable();
    const PatternSample& plan = pattern.now();
    const auto error = [&](const ComState& com) -> Eigen::Vector2d {
      return body.zmp(plan, com, upper[0], body.moments(upper[0])) - plan.zmp_W_m;
    };
    walk.ticks.push_back({.time_s = tick * kTick_s,
                          .planned_m = plan.zmp_W_m,
                          .error_before_m = error(plan.com),
                          .error_after_m = error(plan.com + shift)});
  }
  return walk;
}

}  // namespace mimesis::walker
