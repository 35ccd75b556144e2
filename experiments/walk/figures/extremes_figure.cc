// Behaviours for the smallest and largest steps and goal distances, and those between [M18 3.8.4,
// fig. 3.44].
#include <algorithm>
#include <cmath>

#include "experiments/walk/figures/list.h"
#include "experiments/walk/figures/study_rows.h"
#include "experiments/walk/film/scene.h"

namespace mimesis::walk {
namespace {

constexpr double kStrip_s = 0.2;  // between pictures that a strip is chosen from

/// Two walks, the smallest and the largest, each seen by `use`.
template <class Use>
void shoot(double picture_s, const Use& use) {
  DrawerStudy& study = DrawerStudy::shared();
  const Robot& robot = *study.robot().robot;
  const std::vector<DrawerGoal> goals = extreme_goals();
  for (const auto& [name, goal] : {std::pair{"fig-3.44-smallest", goals.front()},
                                   std::pair{"fig-3.44-largest", goals.back()}}) {
    Scene scene(robot, {.from_s = 1.5,
                        .camera_rad = -1.25,
                        .height_m = 1.9,
                        .aspect = 1.35,
                        .fixed_W_m = Eigen::Vector2d(0.95, 0.0),
                        .picture_s = picture_s});
    run_online(online_spec(robot, study.actions(kSources[1]), goal), [&](const DrawerTick& tick) {
      const film::FilmDrawer seen{tick.drawer.front_W_m, tick.drawer.handle_W_m,
                                  tick.drawer.object_W_m};
      scene.see(tick.trial, &seen);
    });
    use(scene, std::string(name));
  }
}

}  // namespace

reproduce::Report extremes(const std::optional<std::filesystem::path>& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  const auto outcomes = study.extremes();
  reproduce::Report report;
  report.rows.push_back(
      reproduce::near("sequences", static_cast<double>(outcomes.size()), 30, 0, "1"));
  report.rows.push_back(reproduce::near("falls", falls(outcomes), 0, 0, "1",
                                        "\"for all tested step sizes a human-like coordinated "
                                        "behavior was generated\" [M18 3.8.4]"));
  report.rows.push_back(
      reproduce::holds("every object is taken",
                       std::ranges::all_of(outcomes, [](const Outcome& o) { return o.taken; })));
  const auto row = [&](const char* what, double (*value)(const Outcome&)) {
    report.rows.push_back(reproduce::within(what, largest(outcomes, value), kMostError_m, "m",
                                            "\"always below 10 mm\" [M18 3.8.3, fig. 3.41]"));
  };
  row("size of action 1 (50.5-56.1 cm), largest error", normal_error);
  row("size of action 2 (16.3-35.9 cm), largest error", reaching_error);
  row("reach (66.3-75.5 cm), largest error of the hand when it grips", reach_error);
  if (plot_dir) {
    shoot(kStrip_s, [&](const Scene& scene, const std::string& name) {
      report.plots.push_back(*plot_dir / (name + ".png"));
      scene.write_strip(report.plots.back(), 8);
    });
  }
  return report;
}

std::vector<std::filesystem::path> extremes_film(const std::filesystem::path& dir) {
  std::vector<std::filesystem::path> out;
  shoot(0.04, [&](const Scene& scene, const std::string& name) {
    std::ranges::copy(scene.write(dir, name, 8), std::back_inserter(out));
  });
  return out;
}

}  // namespace mimesis::walk
