#include "common/model/files.h"

namespace mimesis::model {
namespace {

void set(const Eigen::Vector3d& p, v1::Vector3& out) {
  out.set_x_m(p.x());
  out.set_y_m(p.y());
  out.set_z_m(p.z());
}

Eigen::Vector3d vector(const v1::Vector3& v) { return {v.x_m(), v.y_m(), v.z_m()}; }

v1::Goal goal_of(const std::string& name) {
  if (name == "high") return v1::GOAL_HIGH;
  return name == "low" ? v1::GOAL_LOW : v1::GOAL_UNSPECIFIED;
}

std::string name_of(v1::Goal goal) {
  if (goal == v1::GOAL_HIGH) return "high";
  return goal == v1::GOAL_LOW ? "low" : "";
}

}  // namespace

v1::Scene to_proto(const kin::Table& table) {
  v1::Scene scene;
  for (const kin::Ball& ball : table.balls) {
    v1::Ball& out = *scene.add_obstacles();
    set(ball.center, *out.mutable_center_in_world_m());
    out.set_radius_m(ball.radius);
  }
  for (const kin::Box& box : table.boxes) {
    v1::Box& out = *scene.add_boxes();
    set(box.center, *out.mutable_center_in_world_m());
    set(box.half_extent, *out.mutable_half_extent_m());
    out.set_name(box.name);
  }
  set(table.bridge_center, *scene.mutable_bridge()->mutable_center_in_world_m());
  scene.mutable_bridge()->set_height_m(table.bridge_height);
  scene.mutable_bridge()->set_half_width_m(table.bridge_half_width);
  for (const kin::GoalPlace& goal : table.goals) {
    v1::GoalPlace& out = *scene.add_goals();
    out.set_goal(goal_of(goal.name));
    set(goal.position, *out.mutable_position_in_world_m());
    out.set_radius_m(goal.radius);
  }
  set(table.object, *scene.mutable_object()->mutable_position_in_world_m());
  scene.mutable_object()->set_radius_m(table.object_radius);
  scene.mutable_object()->set_height_m(table.object_height);
  return scene;
}

kin::Table from_proto(const v1::Scene& scene) {
  kin::Table table;
  for (const v1::Ball& ball : scene.obstacles()) {
    table.balls.push_back({vector(ball.center_in_world_m()), ball.radius_m()});
  }
  for (const v1::Box& box : scene.boxes()) {
    table.boxes.push_back(
        {vector(box.center_in_world_m()), vector(box.half_extent_m()), box.name()});
  }
  table.bridge_center = vector(scene.bridge().center_in_world_m());
  table.bridge_height = scene.bridge().height_m();
  table.bridge_half_width = scene.bridge().half_width_m();
  for (const v1::GoalPlace& goal : scene.goals()) {
    table.goals.push_back(
        {name_of(goal.goal()), vector(goal.position_in_world_m()), goal.radius_m()});
  }
  table.object = vector(scene.object().position_in_world_m());
  table.object_radius = scene.object().radius_m();
  table.object_height = scene.object().height_m();
  return table;
}

}  // namespace mimesis::model
