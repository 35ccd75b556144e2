#include "nodes/synthesizer/biped/robot_size.h"

#include <algorithm>
#include <cmath>

#include "common/robot/drawer_size.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kLeg_m = 0.602, kArmsPull_m = 0.20;  // biped.urdf's

/// Scales a length, to the millimetre.
class Scale {
 public:
  explicit Scale(double share) : share_(share) {}
  void operator()(double& length_m) const { length_m = std::round(1e3 * share_ * length_m) / 1e3; }

 private:
  double share_;
};

Scale steps_of(const robot::Biped& biped) {
  return Scale(std::min(1.0, robot::leg_length_m(biped) / kLeg_m));
}

}  // namespace

Drawer robot_drawer(const robot::Biped& biped) {
  const robot::DrawerSize size = robot::drawer_size(biped);
  return {.handle_height_m = size.handle_height_m,
          .handle_lateral_m = size.handle_left_m,
          .object_height_m = size.object_height_m,
          .pull_m = size.pull_m};
}

RobotTrialSettings robot_trial_settings(const robot::Biped& biped) {
  const robot::DrawerSize size = robot::drawer_size(biped);
  RobotTrialSettings s;
  s.least_depth_m = size.least_depth_m;
  s.most_depth_m = size.most_depth_m;
  s.least_reach_m = size.least_reach_m;
  s.most_reach_m = size.most_reach_m;
  const Scale scale = steps_of(biped);
  for (double* length :
       {&s.least_normal_m, &s.most_normal_m, &s.least_reaching_m, &s.most_reaching_m}) {
    scale(*length);
  }
  return s;
}

StepPlanSettings robot_step_plan(const robot::Biped& biped) {
  StepPlanSettings s;
  const Scale steps = steps_of(biped);
  for (double* length :
       {&s.normal_m, &s.normal_half_m, &s.reaching_m, &s.reaching_half_m, &s.least_normal_m,
        &s.longest_step_m, &s.shortest_step_m, &s.most_reaching_m}) {
    steps(*length);
  }
  const Scale arms(robot::drawer_size(biped).pull_m / kArmsPull_m);
  for (double* length : {&s.stand_half_m, &s.stand_nearer_m, &s.stand_farther_m}) arms(*length);
  return s;
}

}  // namespace mimesis::synthesizer
