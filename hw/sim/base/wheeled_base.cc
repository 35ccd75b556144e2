#include "hw/sim/base/wheeled_base.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"

namespace mimesis::hw::sim {

void WheeledBase::step(double dt_s, const BaseWish& wish) {
  const double aside = math::wrap_pi(wish.heading_rad - heading_);
  const double turn =
      std::clamp(limits_.turn_gain_1_s * aside, -limits_.turn_max_rad_s, limits_.turn_max_rad_s);
  // Beside its heading it goes on as far as it gets nearer.
  const double speed =
      std::clamp(wish.speed_m_s, 0.0, limits_.v_max_m_s) * std::max(0.0, std::cos(aside));
  const double more = limits_.a_max_m_s2 * dt_s, faster = limits_.turn_a_max_rad_s2 * dt_s;
  speed_ += std::clamp(speed - speed_, -more, more);
  turn_ += std::clamp(turn - turn_, -faster, faster);
  const double middle = heading_ + 0.5 * turn_ * dt_s;
  position_ += speed_ * dt_s * Eigen::Vector2d(std::cos(middle), std::sin(middle));
  heading_ = math::wrap_pi(heading_ + turn_ * dt_s);
  phase_rate_ = std::max(0.0, wish.phase_rate_rad_s);
  phase_ = math::wrap_two_pi(phase_ + phase_rate_ * dt_s);
}

}  // namespace mimesis::hw::sim
