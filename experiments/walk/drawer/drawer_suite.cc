#include "experiments/walk/drawer/drawer_suite.h"

#include <fmt/format.h>

#include "experiments/walk/trial/draw.h"
#include "experiments/walk/trial/in_order.h"

namespace mimesis::walk {
namespace {

constexpr double kStep_s = 0.8;
enum Jumps { kStays, kOnTheWay, kBeforeIt };

/// Until the robot stands before a front so far away: from a stand, two steps every half a metre.
double arrives_s(double front_m) { return 1.0 + kStep_s + 2.0 * kStep_s * (front_m - 0.5) / 0.45; }

}  // namespace

std::vector<DrawerTrialSpec> drawers30(const Robot& robot, const synthesizer::BipedDrawer& actions,
                                       const SuiteOptions& options) {
  std::vector<DrawerTrialSpec> trials;
  Draw draw(options.seed);
  for (const Jumps jumps : {kStays, kOnTheWay, kBeforeIt}) {
    for (int i = 0; i < 10; ++i) {
      DrawerTrialSpec spec;
      spec.robot = &robot;
      spec.actions = &actions;
      spec.body.plant = options.plant;
      spec.body.seed = options.seed;
      spec.walker = options.walker;
      spec.delay_ticks = options.delay_ticks;
      spec.front_m = draw.between(1.2, 2.8);
      spec.left_m = spec.front_m * std::tan(draw.between(-0.06, 0.06));
      spec.object_depth_m = draw.between(0.124, 0.273);
      const double by_m = draw.between(-0.10, 0.10), when = draw.between(0.0, 1.0);
      const double there_s = arrives_s(spec.front_m);
      spec.name = fmt::format("{:.2f} m, {:+.2f} left, {:.2f} deep", spec.front_m, spec.left_m,
                              spec.object_depth_m);
      if (jumps != kStays) {
        const double at_s = jumps == kOnTheWay
                                ? std::lerp(1.0, there_s - 2.0 * kStep_s, when)
                                : std::lerp(there_s - 2.0 * kStep_s, there_s + 2.0, when);
        spec.jumps.push_back({.at_s = at_s, .by_m = by_m});
        spec.name += fmt::format(", {:+.0f} mm at {:.1f} s", 1e3 * by_m, at_s);
      }
      trials.push_back(std::move(spec));
    }
  }
  return trials;
}

DrawerEnd end_of(const DrawerResult& result) {
  if (result.walk.figures.fell) return DrawerEnd::kFell;
  if (result.taken) return DrawerEnd::kTaken;
  return result.refused.empty() ? DrawerEnd::kSilent : DrawerEnd::kRefused;
}

void run_drawer_trials(std::span<const DrawerTrialSpec> trials, int jobs,
                       const std::function<void(const DrawerResult&)>& done) {
  in_order<DrawerResult>(
      trials.size(), jobs, [&](std::size_t i) { return run_drawer_trial(trials[i]); }, done);
}

}  // namespace mimesis::walk
