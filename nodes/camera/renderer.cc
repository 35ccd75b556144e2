#include "nodes/camera/renderer.h"

#include <cmath>

namespace mimesis::camera {
namespace {

const Bgr kLightGreen(118.0f, 222.0f, 120.0f);
const Bgr kDarkGreen(44.0f, 106.0f, 26.0f);

}  // namespace

Renderer::Renderer(const Picture& picture)
    : picture_(picture),
      camera_(picture.view),
      motion_(picture.script, picture.table),
      table_(draw_table(picture.table, camera_, picture.clutter, picture.seed)),
      layer_(camera_, table_),
      faults_(picture.faults, picture.seed) {}

void Renderer::render(double t_s, image::Image& out) {
  const TeacherPose pose = motion_.pose(t_s);
  out = table_.color;
  hand_capsules(pose, picture_.script.lesson.grip, hand_);
  const Bgr& color = picture_.script.color == Color::light ? kLightGreen : kDarkGreen;
  layer_.draw(hand_,
              {pose.object, picture_.table.object_radius_m, picture_.table.object_height_m, color},
              out);
  faults_.apply(static_cast<std::uint64_t>(std::llround(1e6 * t_s)), out);
}

Truth Renderer::truth(double t_s) const {
  const TeacherPose pose = motion_.pose(t_s);
  const TeacherTable& table = picture_.table;
  Truth truth;
  truth.object = pose.object.head<2>();
  truth.palm = pose.palm.head<2>();
  truth.goal_high = {table.goal_high_x_m, table.goal_high_y_m};
  truth.goal_low = {table.goal_low_x_m, table.goal_low_y_m};
  truth.bridge_height = table.bridge_height_m;
  truth.bridge_in_view = !table.bridge_removed;
  truth.held = pose.held;
  const Eigen::Vector2d pixel = camera_.project(pose.palm);
  truth.hand_in_view = pixel.x() >= 0.0 && pixel.x() < camera_.width() && pixel.y() >= 0.0 &&
                       pixel.y() < camera_.height();
  return truth;
}

}  // namespace mimesis::camera
