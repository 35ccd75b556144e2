#pragma once
#include "common/robot/biped.h"
#include "nodes/synthesizer/biped/robot_trials.h"
#include "nodes/synthesizer/biped/step_plan.h"

namespace mimesis::synthesizer {

/// What a robot's size makes of settings that are biped.urdf's: furniture and reaches by its arms
/// (robot::drawer_size()), lengths of steps by its legs, but no longer than biped.urdf's: a step
/// takes as long whatever the legs, and speed is what forces grow with.
/// @throws ConfigError as robot::drawer_size()
Drawer robot_drawer(const robot::Biped& biped);
RobotTrialSettings robot_trial_settings(const robot::Biped& biped);
StepPlanSettings robot_step_plan(const robot::Biped& biped);

}  // namespace mimesis::synthesizer
