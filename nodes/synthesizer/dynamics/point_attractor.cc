#include <algorithm>
#include <string>

#include "common/error.h"
#include "common/math/integrator.h"
#include "nodes/synthesizer/dynamics/oscillators.h"

namespace mimesis::synthesizer {

PointAttractor::PointAttractor(double speed_1_s, double pulse_1_s, double pulse_s, double dt_s)
    : speed_(speed_1_s), pulse_(pulse_1_s), dt_(dt_s) {
  auto need = [](double value, const char* name) {
    if (!(value > 0.0 && std::isfinite(value))) {
      throw ConfigError(std::string("point attractor: ") + name + " is " + std::to_string(value) +
                        ", expected a positive number");
    }
  };
  need(speed_1_s, "speed_1_s");
  need(pulse_1_s, "pulse_1_s");
  need(pulse_s, "pulse_s");
  need(dt_s, "dt_s");
  pulse_steps_ = std::max(1, static_cast<int>(std::lround(pulse_s / dt_s)));
}

void PointAttractor::switch_to(bool one) {
  if (one != one_) left_ = pulse_steps_;
  one_ = one;
}

void PointAttractor::step() {
  const double sign = one_ ? 1.0 : -1.0, push = left_ > 0 ? sign * pulse_ : 0.0;
  auto rate = [&](double, double x) { return sign * speed_ * x * (1.0 - x) + push; };
  set_value(math::rk4_step(rate, 0.0, x_, dt_));
  if (left_ > 0) --left_;
}

}  // namespace mimesis::synthesizer
