// Behaviours for the smallest and largest steps and goal distances, and those between [M18 3.8.4,
// fig. 3.44].
#include <algorithm>
#include <cmath>

#include "tools/mimesis/film/robot_film.h"
#include "tools/mimesis/walk/figures/list.h"
#include "tools/mimesis/walk/figures/study_rows.h"

namespace mimesis::walk {
namespace {

constexpr double kFrame_s = 0.1;

std::vector<film::FilmFrame> shoot(DrawerStudy& study, const DrawerGoal& goal) {
  const Robot& robot = *study.robot().robot;
  const film::RobotFigure figure(robot.biped, robot.urdf_file);
  std::vector<film::FilmFrame> frames;
  double next_s = 0.9;
  run_online(online_spec(robot, study.actions(kSources[1]), goal), [&](const DrawerTick& tick) {
    if (tick.trial.time_s < next_s) return;
    next_s += kFrame_s;
    film::FilmFrame frame;
    figure.add_to(frame, tick.trial.truth.X_WB, tick.trial.sensors.q);
    film::add_drawer(frame, {.front_W_m = tick.drawer.front_W_m,
                             .handle_W_m = tick.drawer.handle_W_m,
                             .object_W_m = tick.drawer.object_W_m});
    frame.camera = film::camera_beside(tick.trial.truth.X_WB.translation().head<2>(), 0.0, 2.3);
    frame.label = synthesizer::film_time(tick.trial.time_s);
    frames.push_back(std::move(frame));
  });
  return frames;
}

void write(const std::filesystem::path& dir, DrawerStudy& study, int count,
           std::vector<std::filesystem::path>& out) {
  const std::vector<DrawerGoal> goals = extreme_goals();
  for (const auto& [name, goal] : {std::pair{"fig-3.44-smallest", goals.front()},
                                   std::pair{"fig-3.44-largest", goals.back()}}) {
    const auto files = synthesizer::write_film(shoot(study, goal), dir, name,
                                               {.count = count, .cell_width_px = 200});
    out.insert(out.end(), files.begin(), files.end());
  }
}

}  // namespace

reproduce::Report extremes(const std::optional<std::filesystem::path>& plot_dir) {
  DrawerStudy& study = DrawerStudy::shared();
  const auto& outcomes = study.extremes();
  const auto largest = [&](auto value) {
    return spread_of(values_of(outcomes, [&](const Outcome& o) { return std::abs(value(o)); }))
        .most;
  };
  reproduce::Report report;
  report.rows.push_back(
      reproduce::near("sequences", static_cast<double>(outcomes.size()), 30, 0, "1"));
  report.rows.push_back(reproduce::near("falls", falls(outcomes), 0, 0, "1"));
  report.rows.push_back(
      reproduce::holds("every object is taken",
                       std::ranges::all_of(outcomes, [](const Outcome& o) { return o.taken; })));
  const char* why = "the bound of fig. 3.41";
  report.rows.push_back(reproduce::at_most(
      "size of action 1 (50.5-56.1 cm), largest error",
      largest([](const Outcome& o) { return o.normal_error_m; }), 0.010, "m", why));
  report.rows.push_back(reproduce::at_most(
      "size of action 2 (16.3-35.9 cm), largest error",
      largest([](const Outcome& o) { return o.reaching_error_m; }), 0.010, "m", why));
  report.rows.push_back(reproduce::at_most(
      "reach (66.3-75.5 cm), largest error of the hand when it grips",
      largest([](const Outcome& o) { return o.reach_error_m; }), 0.010, "m", why));
  if (plot_dir) {
    std::vector<std::filesystem::path> files;
    write(*plot_dir, study, 9, files);
    for (const auto& f : files) {
      if (f.extension() == ".png") report.plots.push_back(f);
    }
  }
  return report;
}

std::vector<std::filesystem::path> extremes_film(const std::filesystem::path& dir) {
  std::vector<std::filesystem::path> out;
  write(dir, DrawerStudy::shared(), 9, out);
  return out;
}

}  // namespace mimesis::walk
