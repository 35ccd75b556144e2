// The drawer jumps while the robot comes: from two places to the same one [M18 3.8.4, fig. 3.45].
#include <cmath>

#include "experiments/walk/figures/list.h"
#include "experiments/walk/film/scene.h"
#include "experiments/walk/study/drawer_study.h"

namespace mimesis::walk {
namespace {

constexpr double kFinal_m = 1.75, kDepth_m = 0.2;
struct Row {
  const char *name, *what;
  double by_m, at_s;
};
constexpr std::array kRows = {Row{"fig-3.45-away", "jumps away by 0.2 m", 0.2, 3.5},
                              Row{"fig-3.45-nearer", "jumps nearer by 0.2 m", -0.2, 4.5}};

DrawerTrialSpec spec_of(DrawerStudy& study, const Row& row) {
  DrawerTrialSpec spec;
  spec.name = row.name;
  spec.robot = study.robot().robot;
  spec.actions = &study.actions(kSources[1]);
  spec.front_m = kFinal_m - row.by_m;
  spec.object_depth_m = kDepth_m;
  spec.jumps = {{row.at_s, row.by_m}};
  spec.walker = launched_walker();
  spec.delay_ticks = kSensorDelayTicks;
  return spec;
}

Scene scene_of(const DrawerStudy& study, double picture_s) {
  return {*study.robot().robot,
          {.from_s = 1.5,
           .camera_rad = -1.25,
           .height_m = 1.9,
           .aspect = 1.35,
           .fixed_W_m = Eigen::Vector2d(0.95, 0.0),
           .picture_s = picture_s}};
}

void see(Scene& scene, const DrawerTick& tick) {
  const film::FilmDrawer seen{tick.drawer.front_W_m, tick.drawer.handle_W_m,
                              tick.drawer.object_W_m};
  scene.see(tick.trial, &seen);
}

}  // namespace

reproduce::Report jumps(const std::optional<std::filesystem::path>& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  reproduce::Report report;
  for (const Row& row : kRows) {
    Scene scene = scene_of(study, 0.2);
    double feet_m = 0.0;
    const DrawerResult result = run_drawer_trial(spec_of(study, row), [&](const DrawerTick& tick) {
      feet_m = 0.5 * (tick.trial.truth.X_WS[0](0, 3) + tick.trial.truth.X_WS[1](0, 3));
      see(scene, tick);
    });
    const std::string what = std::string(row.what) + ": ";
    const Outcome outcome = outcome_of(result.walk, {});
    report.rows.push_back(reproduce::near(what + "falls", outcome.fell, 0, 0, "1"));
    report.rows.push_back(reproduce::holds(what + "the object is taken", result.taken,
                                           "moments d and e of the figure"));
    report.rows.push_back(reproduce::near(
        what + "middle of the feet before the front, at the end", kFinal_m - feet_m, 0.51, 0.055,
        "m", "reference: where the trained robot is at ease; half of the distances it knows"));
    report.rows.push_back(reproduce::at_most(what + "hand at the object, error",
                                             result.taken ? result.reach_error_m : std::nan(""),
                                             0.010, "m", "goal of the task; no figure published"));
    if (plot_dir) {
      report.plots.push_back(*plot_dir / (std::string(row.name) + ".png"));
      scene.write_strip(report.plots.back(), 8);
    }
  }
  return report;
}

std::vector<std::filesystem::path> jumps_film(const std::filesystem::path& dir) {
  DrawerStudy& study = DrawerStudy::shared();
  std::vector<std::filesystem::path> out;
  for (const Row& row : kRows) {
    Scene scene = scene_of(study, 0.04);
    run_drawer_trial(spec_of(study, row), [&](const DrawerTick& tick) { see(scene, tick); });
    std::ranges::copy(scene.write(dir, row.name, 8), std::back_inserter(out));
  }
  return out;
}

}  // namespace mimesis::walk
