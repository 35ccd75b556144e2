#include <cmath>
#include <cstring>

#include "common/image/image.h"
#include "common/model/files.h"
#include "experiments/sight/figures.h"
#include "experiments/sight/shown_scene.h"
#include "nodes/camera/robot_renderer.h"
#include "nodes/vision/robot_table.h"

namespace mimesis::sight {
namespace {

using Eigen::Vector3d;
using namespace reproduce;

constexpr const char* kFigure = "Figure 2.3";
const Vector3d kRobotOrigin(0.52, 0.0, -0.01);  // of frame T in W, as in launch/imitation.yaml

vision::TableWatcher watcher_of(const std::array<image::Camera, 2>& cameras, bool robot) {
  vision::WatcherSetup setup;
  setup.camera = cameras[0];
  setup.right = cameras[1];
  if (robot) setup.stereo.goal_form = "block";
  return vision::TableWatcher(setup);
}

/// The teacher's table: precision grip, above the bar, to the high goal.
void watch_teacher(Report& report, image::Image& shown) {
  for (const bool light : {true, false}) {
    camera::Picture picture;
    picture.script.demonstration.color = light ? task::Color::light : task::Color::dark;
    const auto cameras = camera::usual_cameras(picture.view, 0.3);
    camera::Renderer left(picture, cameras[0], 0), right(picture, cameras[1], 1);
    vision::TableWatcher watcher = watcher_of(cameras, false);
    image::Image a, b;
    for (double t = 0.0; t < left.end_s() + 0.5; t += 1.0 / 30.0) {
      left.render(t, a);
      right.render(t, b);
      if (t == 0.0) teach(watcher, a, camera::clicks(picture, cameras[0]));
      watcher.watch_right(b);
      watcher.watch(a);
      if (light && t < 3.4) shown = a;
    }
    const vision::ActionRecognizer& action = watcher.action();
    const auto color = light ? task::Color::light : task::Color::dark;
    report.holds(light ? "a light object is seen as one" : "a dark object, too",
                 action.color().value == color, published(kFigure));
    if (!light) continue;
    report.holds("grip is precision (PG)", action.grip().value == task::Grip::precision,
                 published(kFigure));
    report.holds("trajectory is above the bar (AT)",
                 action.transport().value == task::Transport::above, published(kFigure));
    const auto goals = watcher.stereo()->goals();
    const bool two = goals.size() == 2;
    report.holds("the higher target has the small spatial gap",
                 two && watcher.classify(goals[0]) == task::Goal::high &&
                     watcher.classify(goals[1]) == task::Goal::low,
                 published(kFigure));
    const camera::TeacherTable& table = picture.table;
    const auto gap = [&](std::size_t k) {
      return 1e3 * (two ? watcher.gap_m(goals[k]).value_or(NAN) : NAN);
    };
    report.near(
        "small gap", gap(0),
        closed_form(1e3 * (table.bar_height_m - table.goal_high_y_m), "heights of bar and stand"),
        3.0, "mm", "0.2 % of the depth, of two things");
    report.near(
        "large gap", gap(1),
        closed_form(1e3 * (table.bar_height_m - table.goal_low_y_m), "heights of bar and stand"),
        3.0, "mm", "0.2 % of the depth, of two things");
  }
}

/// The robot's camera, which stands opposite.
void watch_robot(Report& report, image::Image& shown) {
  const kin::Table table = model::load_table("bar_table.yaml");
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  std::vector<Eigen::Isometry3d> X;
  kin::forward(arm, arm.home, X);
  Eigen::Matrix3Xd centers;
  kin::ball_centers(arm, X, centers);
  std::vector<kin::Ball> balls;
  for (std::size_t i = 0; i < arm.balls.size(); ++i)
    balls.push_back({centers.col(static_cast<Eigen::Index>(i)), arm.balls[i].radius});
  image::View view;
  view.eye_m = {0.25, 0.95, 1.0};
  view.target_m = {0.0, 0.2, 0.0};
  const auto cameras = camera::usual_cameras(view, 0.35);
  const camera::Picture picture;
  camera::RobotRenderer left(table, picture.table.paints, picture.room, kRobotOrigin, cameras[0],
                             picture.faults, 1, 0),
      right(table, picture.table.paints, picture.room, kRobotOrigin, cameras[1], picture.faults, 1,
            1);
  vision::TableWatcher watcher = watcher_of(cameras, true);
  image::Image b;
  left.render(balls, table.object, 0.0, shown);
  teach(watcher, shown, left.clicks());
  for (int i = 0; i < 20; ++i) {
    left.render(balls, table.object, 0.1 * i, shown);
    right.render(balls, table.object, 0.1 * i, b);
    watcher.watch_right(b);
    watcher.watch(shown);
  }
  vision::RobotTableSetup setup;
  setup.inflation_sigma = 0.0;  // the places themselves
  setup.origin_m = {kRobotOrigin.x(), kRobotOrigin.y(), kRobotOrigin.z()};
  const auto seen = vision::robot_table(*watcher.stereo(), setup);
  const auto off = [&](const Vector3d& a, const Vector3d& c) {
    return seen ? 1e3 * (a - c).norm() : INFINITY;
  };
  const kin::Table found = seen ? seen->table : table;
  const char* why = "cameras known exactly, 20 pictures, arm at home in view";
  report.at_most("robot's camera: place of the object", off(found.object, table.object), goal(3.0),
                 "mm", why);
  report.at_most("robot's camera: place of the bar", off(found.bar_center, table.bar_center),
                 goal(3.0), "mm", why);
  for (std::size_t k = 0; k < 2; ++k) {
    report.at_most("robot's camera: " + table.goals[k].name + " goal",
                   off(found.goals[k].position, table.goals[k].position), goal(3.0), "mm", why);
  }
}

Report setup(const PlotDir& dir) {
  Report report;
  image::Image teacher, robot;
  watch_teacher(report, teacher);
  watch_robot(report, robot);
  if (!dir) return report;
  std::filesystem::create_directories(*dir);
  image::Image sheet(teacher.width + robot.width, teacher.height);
  for (int v = 0; v < sheet.height; ++v) {
    std::memcpy(sheet.at(0, v), teacher.at(0, v), 3 * static_cast<std::size_t>(teacher.width));
    std::memcpy(sheet.at(teacher.width, v), robot.at(0, v),
                3 * static_cast<std::size_t>(robot.width));
  }
  report.plots.push_back(*dir / "fig-2.3.png");
  const auto written = image::write_png(report.plots.back(), sheet);
  if (!written) throw std::runtime_error(written.error().reason);
  return report;
}

}  // namespace

reproduce::Figure setup_figure() {
  return Figure("fig-2.3",
                "What vision sees of the teacher's table, and the robot's camera of its own", "M18",
                Declared{.published = 5, .closed_form = 2, .goal = 4}, setup);
}

}  // namespace mimesis::sight
