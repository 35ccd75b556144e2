// Three walks of the suites and of the drawer task, by themselves.
#include "common/error.h"
#include "experiments/walk/drawer/drawer_trial.h"
#include "experiments/walk/figures.h"
#include "experiments/walk/trial/suites.h"

namespace mimesis::walk {
namespace {

using namespace reproduce;

/// A trial of `mimesis walk-trials`.
TrialSpec from_suite(const std::string& suite, const std::string& name, const Robot& robot) {
  for (TrialSpec& spec : make_suite(suite, robot, SuiteOptions())) {
    if (spec.name == name) return spec;
  }
  throw ConfigError("walk-trials: suite " + suite + " has no trial '" + name + "'");
}

void add_balance(const TrialResult& result, Report& report) {
  report.near("falls", result.figures.fell, goal(0), 0, "1");
  report.at_most("divergent component off the plan, largest", result.dcm_max_m, 0.1, "m",
                 "half of a sole's length; nothing is published");
}

}  // namespace

Report walk_arms(const PlotDir&) {
  const Robot robot = load_robot("biped");
  Report report;
  const TrialResult result = run_trial(from_suite("speeds", "arms 1.5 rad, 0.3", robot));
  add_balance(result, report);
  report.near("walked in 11 s at 0.3 m/s", result.walked_m, closed_form(3.3, "speed times time"),
              0.4, "m");
  return report;
}

/// From the right, in the middle of the step in which the left leg carries.
Report walk_push(const PlotDir&) {
  const Robot robot = load_robot("biped");
  Report report;
  add_balance(run_trial(from_suite("pushes", "walking towards 90 deg at 5.65 s", robot)), report);
  return report;
}

Report walk_drawer(const PlotDir&) {
  const Robot robot = load_robot("biped");
  const synthesizer::BipedDrawer actions = synthesizer::make_biped_drawer(robot.biped);
  DrawerTrialSpec spec;
  spec.name = "drawer";
  spec.robot = &robot;
  spec.actions = &actions;
  const DrawerResult result = run_drawer_trial(spec);
  Report report;
  add_balance(result.walk, report);
  report.holds("the object is taken", result.taken, goal());
  report.at_most("hand at the handle, error", result.handle_error_m, 0.01, "m", "goal of the task");
  report.at_most("hand at the object, error", result.reach_error_m, 0.01, "m", "goal of the task");
  return report;
}

}  // namespace mimesis::walk
