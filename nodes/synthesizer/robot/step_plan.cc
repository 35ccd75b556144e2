#include "nodes/synthesizer/robot/step_plan.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace mimesis::synthesizer {
namespace {

constexpr double kRounding = 1e-6;
double squared(double x) { return x * x; }

/// `count` equal lengths with a wished length.
struct Length {
  double count = 0.0, wished = 0.0, half = 1.0, least = 0.0, most = 0.0, value = 0.0;
  bool at_bound = false;
};

/// Lengths within their bounds that add up to `total` and cost the least Σ nᵢ((xᵢ − wᵢ)/hᵢ)²:
/// x = w + λh², those beyond a bound are put there and the rest solved again.
bool share_out(std::array<Length, 4>& lengths, double total) {
  double least = 0.0, most = 0.0;
  for (Length& l : lengths) {
    least += l.count * l.least;
    most += l.count * l.most;
    l.at_bound = l.count == 0.0;
    l.value = l.wished;
  }
  if (total < least - kRounding || total > most + kRounding) return false;
  for (std::size_t round = 0; round <= lengths.size(); ++round) {
    double left = total, give = 0.0;
    for (const Length& l : lengths) {
      left -= l.count * (l.at_bound ? l.value : l.wished);
      if (!l.at_bound) give += l.count * squared(l.half);
    }
    if (give == 0.0) return std::abs(left) < 1e-3;
    const double lambda = left / give;
    // beyond the limits counts only the side that the others have to compensate
    double beyond = 0.0;
    for (Length& l : lengths) {
      if (l.at_bound) continue;
      l.value = l.wished + lambda * squared(l.half);
      beyond += l.count * (l.value - std::clamp(l.value, l.least, l.most));
    }
    bool all = true;
    for (Length& l : lengths) {
      const double within = std::clamp(l.value, l.least, l.most);
      if (l.at_bound || within == l.value || (l.value - within) * beyond < 0.0) continue;
      l.value = within;
      l.at_bound = true;
      all = false;
    }
    if (all) return true;
  }
  return true;
}

/// How many steps of each kind: first a closing step of the foot in the air (and of the left one
/// after it: actions end with the left foot), then steps of action 1, then actions 2, or those that
/// lead back.
struct Kinds {
  bool close = false;
  int normal = 0, reaching = 0, back = 0;
};

class Search {
 public:
  Search(const FeetAlongWay& feet, double front_m, double comfortable_m,
         const StepPlanSettings& settings)
      : feet_(feet), front_m_(front_m), comfortable_m_(comfortable_m), s_(settings) {}

  std::optional<StepPlan> best() {
    const bool right = feet_.swing == mocap::kRight;
    const int most = 2 * s_.most_normal;
    if (feet_.stands) offer({});
    for (int m = 0; m <= s_.most_reaching; ++m) {
      for (int n = 0; n <= most; ++n) {
        if (n > 0 && m == 0) continue;  // full stride does not end in a stand
        const bool even = n % 2 == 0;
        if (right ? even && m > 0 : !even) offer({.close = false, .normal = n, .reaching = m});
        if (!right && even && (m > 0 || !feet_.stands)) {
          offer({.close = true, .normal = n, .reaching = m});
        }
      }
    }
    if (!found_) offer_back();
    return found_;
  }

 private:
  void offer_back() {
    const bool may = feet_.swing == mocap::kRight && (feet_.stands || feet_.may_step_back);
    if (!feet_.stands) offer({.close = true});
    if (found_) return;
    for (int m = 1; m <= s_.most_back; ++m) {
      if (may) offer({.back = m});
      if (!may) offer({.close = true, .back = m});
    }
  }

  void offer(const Kinds& k) {
    const bool stays = !k.close && k.normal == 0 && k.reaching == 0 && k.back == 0;
    const double from = stays ? 0.5 * (feet_.support_m + feet_.other_m) : feet_.support_m;
    const double step = 0.5 * s_.normal_m, way = front_m_ - from;
    // how far the middle of the feet is behind the foot that action 2 begins from
    double behind = k.normal > 0 ? 0.5 * step : 0.0;
    if (k.normal == 0 && !k.close) behind = 0.5 * (feet_.support_m - feet_.other_m);
    std::array<Length, 4> l{
        Length{.count = static_cast<double>(k.normal),
               .wished = step,
               .half = 0.5 * s_.normal_half_m,
               .least = 0.5 * s_.least_normal_m,
               .most = s_.longest_step_m},
        Length{.count = static_cast<double>(k.reaching),
               .wished = std::clamp(s_.reaching_m - behind, s_.shortest_step_m, s_.longest_step_m),
               .half = s_.reaching_half_m,
               .least = s_.shortest_step_m,
               .most = std::min(s_.longest_step_m,
                                behind > 0.01 ? s_.most_reaching_m - behind : s_.longest_step_m)},
        Length{.count = static_cast<double>(k.back),
               .wished = -0.5 * s_.longest_back_m,
               .half = 0.5 * s_.longest_back_m,
               .least = -s_.longest_back_m,
               .most = -s_.shortest_step_m},
        Length{.count = 1.0,
               .wished = comfortable_m_,
               .half = s_.stand_half_m,
               .least = comfortable_m_ - s_.stand_nearer_m,
               .most = comfortable_m_ + s_.stand_farther_m}};
    if (l[1].most < l[1].least || !share_out(l, way)) return;
    double cost = squared((l[3].value - l[3].wished) / l[3].half);
    if (k.normal > 0) cost += 0.5 * k.normal * squared((l[0].value - l[0].wished) / l[0].half);
    if (k.reaching > 0) {
      cost += k.reaching * squared((l[1].value - l[1].wished) / l[1].half) + (k.reaching - 1);
    }
    if (k.back > 0) cost += k.back * (squared((l[2].value - l[2].wished) / l[2].half) + 1.0);
    cost += change(k);
    if (found_ && cost >= found_->cost - 1e-9) return;
    found_ = spelled(k, l[0].value, k.back > 0 ? l[2].value : l[1].value);
    found_->cost = cost;
    found_->final_distance_m = l[3].value;
  }

  /// Cost of making the current action another one, or of stepping on the spot.
  double change(const Kinds& k) const {
    if (feet_.swing == mocap::kRight) return 0.0;
    if (k.close) return feet_.stands || feet_.action == kNormalStep ? 1.0 : 0.0;
    return !feet_.stands && feet_.action == kReachingStep ? 1.0 : 0.0;
  }

  StepPlan spelled(const Kinds& k, double normal_m, double reaching_m) const {
    StepPlan plan;
    double x = feet_.support_m;
    mocap::Side side = feet_.swing;
    const auto add = [&](Action action, double length) {
      x += length;
      plan.steps.push_back({action, side, x});
      side = side == mocap::kLeft ? mocap::kRight : mocap::kLeft;
    };
    if (k.close) add(kReachingStep, 0.0);
    if (k.close && side == mocap::kLeft) add(kReachingStep, 0.0);
    for (int i = 0; i < k.normal; ++i) add(kNormalStep, normal_m);
    for (int i = 0; i < k.reaching + k.back; ++i) {
      add(kReachingStep, reaching_m);
      add(kReachingStep, 0.0);
    }
    return plan;
  }

  const FeetAlongWay& feet_;
  double front_m_, comfortable_m_;
  const StepPlanSettings& s_;
  std::optional<StepPlan> found_;
};

}  // namespace

tl::expected<StepPlan, Status> plan_steps(const FeetAlongWay& feet, double front_m,
                                          double comfortable_m, const StepPlanSettings& settings) {
  if (auto plan = Search(feet, front_m, comfortable_m, settings).best()) return std::move(*plan);
  const double way = front_m - feet.support_m, most = comfortable_m + settings.stand_farther_m;
  const char* why = way < comfortable_m ? "that is too near, even for steps back"
                    : way > settings.most_normal * settings.normal_m
                        ? "that is farther than the longest plan"
                        : "no sequence of trained steps ends there";
  return tl::make_unexpected(Status{
      fmt::format("drawer {:.2f} m ahead of the feet: {}; expected to stand at {:.2f} to {:.2f} m",
                  way, why, comfortable_m - settings.stand_nearer_m, most)});
}

}  // namespace mimesis::synthesizer
