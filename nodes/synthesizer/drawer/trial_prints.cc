#include <algorithm>
#include <cmath>
#include <limits>

#include "nodes/synthesizer/drawer/trial_times.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Where the feet end: apart, left in front, since the left hand pulls, and more so after a longer
// step. A short action 2 leaves the left foot nearly where it is and the right one behind.
struct LastPrints {
  double left, right;
  explicit LastPrints(const TrialPlan& p) {
    constexpr double kLeast = 0.03, kSoft = 0.05;  // m
    const double apart = 0.04 + 0.30 * std::max(0.0, p.reaching_length_m - 0.2);
    const double end = p.normal_length_m + p.reaching_length_m;
    const double front =
        0.5 * (1.0 - p.manner.first_step_share) * p.normal_length_m + p.normal_length_m;
    left = front + kLeast + kSoft * std::log1p(std::exp((end + apart - front - kLeast) / kSoft));
    right = 2.0 * end - left;
  }
};

}  // namespace

std::vector<Footprint> prints_of(mocap::Side side, const TrialPlan& p, const TrialTimes& t) {
  const double length = p.normal_length_m, t1 = t.t1;
  const double left0 = 0.5 * (1.0 - p.manner.first_step_share) * length;
  const double right0 = left0 + p.manner.first_step_share * length - length;  // before action 1
  const LastPrints last(p);
  const bool left = side == mocap::kLeft;
  const double y = left ? p.manner.half_width_m : -p.manner.half_width_m;
  // strike, and the other foot's strike after it, after which this one may lift
  struct Stand {
    double x, strike, other;
  };
  const std::vector<Stand> stands = left ? std::vector<Stand>{{left0 - length, -t1, -0.5 * t1},
                                                              {left0, 0.0, 0.5 * t1},
                                                              {left0 + length, t1, t.right_strike},
                                                              {last.left, t.left_strike, kNever}}
                                         : std::vector<Stand>{{right0 - length, -1.5 * t1, -t1},
                                                              {right0, -0.5 * t1, 0.0},
                                                              {right0 + length, 0.5 * t1, t1},
                                                              {last.right, t.right_strike, kNever}};
  std::vector<Footprint> prints;
  for (std::size_t i = 0; i < stands.size(); ++i) {
    // feet roll with long strides and are put down flat with short ones
    auto roll = [&](std::size_t k) {
      const double stride = k == 0              ? length
                            : k < stands.size() ? stands[k].x - stands[k - 1].x
                                                : 0.0;
      return std::clamp(stride / 1.4, 0.15, 1.0);
    };
    const double lift = stands[i].other + 0.11 * t1;
    prints.push_back({.x_m = stands[i].x,
                      .y_m = y,
                      .strike_s = stands[i].strike,
                      .flat_s = stands[i].strike + 0.10 * t1,
                      .heel_off_s = lift - 0.31 * t1,
                      .lift_s = lift,
                      .strike_pitch_rad = -0.30 * roll(i),
                      .lift_pitch_rad = 0.95 * roll(i + 1)});
  }
  return prints;
}

}  // namespace mimesis::synthesizer
