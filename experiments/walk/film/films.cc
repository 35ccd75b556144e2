#include <algorithm>

#include "common/error.h"
#include "experiments/walk/drawer/drawer_trial.h"
#include "experiments/walk/figures.h"
#include "experiments/walk/film/scene.h"
#include "experiments/walk/trial/suites.h"

namespace mimesis::walk {
namespace {

using reproduce::at_most;
using reproduce::near;
using reproduce::Report;

/// A trial of `mimesis walk-trials`.
TrialSpec from_suite(const std::string& suite, const std::string& name, const Robot& robot) {
  for (TrialSpec& spec : make_suite(suite, robot, SuiteOptions())) {
    if (spec.name == name) return spec;
  }
  throw ConfigError("walk-trials: suite " + suite + " has no trial '" + name + "'");
}

void add_balance(const TrialResult& result, Report& report) {
  report.rows.push_back(near("falls", result.figures.fell, reproduce::goal(0), 0, "1"));
  report.rows.push_back(at_most("divergent component off the plan, largest", result.dcm_max_m, 0.1,
                                "m", "half of a sole's length; nothing is published"));
}

/// Starts, walks a while and continues: 16 s, of which the middle is filmed.
TrialSpec arms_trial(const Robot& robot) {
  return from_suite("speeds", "arms 1.5 rad, 0.3", robot);
}

Report arms(const PlotDir&) {
  const Robot robot = load_robot("biped");
  Report report;
  const TrialResult result = run_trial(arms_trial(robot));
  add_balance(result, report);
  report.rows.push_back(near("walked in 11 s at 0.3 m/s", result.walked_m,
                             reproduce::closed_form(3.3, "speed times time"), 0.4, "m"));
  return report;
}

Paths film_arms(const std::filesystem::path& dir) {
  const Robot robot = load_robot("biped");
  TrialSpec spec = arms_trial(robot);
  spec.duration_s = 7.2;
  Scene scene(robot, {.from_s = 4.0, .camera_rad = -1.2, .aspect = 0.9});
  run_trial(spec, [&](const TrialTick& tick) { scene.see(tick); });
  return scene.write(dir, kWalkArms.name, 9);
}

/// From the right, in the middle of the step in which the left leg carries.
TrialSpec push_trial(const Robot& robot) {
  return from_suite("pushes", "walking towards 90 deg at 5.65 s", robot);
}

Report push(const PlotDir&) {
  const Robot robot = load_robot("biped");
  Report report;
  add_balance(run_trial(push_trial(robot)), report);
  return report;
}

Paths film_push(const std::filesystem::path& dir) {
  const Robot robot = load_robot("biped");
  const TrialSpec spec = push_trial(robot);
  const double at_s = spec.pushes.at(0).at_s;
  // the second of eight pictures, 0.4 s apart, is of the push
  Scene scene(robot, {.from_s = at_s - 0.36,
                      .until_s = at_s + 2.45,
                      .camera_rad = -0.4,
                      .aspect = 0.75,
                      .pushes = spec.pushes});
  run_trial(spec, [&](const TrialTick& tick) { scene.see(tick); });
  return scene.write(dir, kWalkPush.name, 8);
}

DrawerResult run_drawer(const Robot& robot, const std::function<void(const DrawerTick&)>& watch) {
  const synthesizer::BipedDrawer actions = synthesizer::make_biped_drawer(robot.biped);
  DrawerTrialSpec spec;
  spec.name = "drawer";
  spec.robot = &robot;
  spec.actions = &actions;
  return run_drawer_trial(spec, watch);
}

Report drawer(const PlotDir&) {
  const Robot robot = load_robot("biped");
  Report report;
  const DrawerResult result = run_drawer(robot, {});
  add_balance(result.walk, report);
  report.rows.push_back(reproduce::holds("the object is taken", result.taken, reproduce::goal()));
  report.rows.push_back(
      at_most("hand at the handle, error", result.handle_error_m, 0.01, "m", "goal of the task"));
  report.rows.push_back(
      at_most("hand at the object, error", result.reach_error_m, 0.01, "m", "goal of the task"));
  return report;
}

Paths film_drawer(const std::filesystem::path& dir) {
  const Robot robot = load_robot("biped");
  Scene scene(robot, {.from_s = 2.0,
                      .camera_rad = -1.25,
                      .height_m = 2.0,
                      .aspect = 1.35,
                      .fixed_W_m = Eigen::Vector2d(0.95, 0.0)});
  run_drawer(robot, [&](const DrawerTick& tick) {
    const film::FilmDrawer seen{tick.drawer.front_W_m, tick.drawer.handle_W_m,
                                tick.drawer.object_W_m};
    scene.see(tick.trial, &seen);
  });
  return scene.write(dir, kWalkDrawer.name, 7);
}

}  // namespace

std::vector<reproduce::Figure> films() {
  const auto figure = [](const FilmTitle& t, auto run, auto film) {
    return reproduce::Figure{t.name, t.title, "M18", t.rows, run, film};
  };
  return {figure(kWalkArms, arms, film_arms), figure(kWalkDrawer, drawer, film_drawer),
          figure(kWalkPush, push, film_push)};
}

}  // namespace mimesis::walk
