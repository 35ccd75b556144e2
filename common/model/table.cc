#include "common/kin/table.h"

#include "common/error.h"
#include "common/model/files.h"
#include "common/model/messages.h"
#include "common/runtime/param_source.h"
#include "common/runtime/params.h"

namespace mimesis::model {
namespace {

using runtime::ParamVisitor;

struct ObstacleEntry {
  std::vector<double> center_m;
  double radius_m = 0.0;

  void visit(ParamVisitor& v) {
    v("center_m", center_m, -10.0, 10.0, 3);
    v("radius_m", radius_m, 1e-4, 10.0);
  }
};

struct BoxEntry {
  std::string name;
  std::vector<double> center_m, half_extent_m;

  void visit(ParamVisitor& v) {
    v("name", name);
    v("center_m", center_m, -10.0, 10.0, 3);
    v("half_extent_m", half_extent_m, 1e-4, 10.0, 3);
  }
};

struct GoalEntry {
  std::string name;
  std::vector<double> position_m;
  double radius_m = 0.0;

  void visit(ParamVisitor& v) {
    v("name", name, {"high", "low"});
    v("position_m", position_m, -10.0, 10.0, 3);
    v("radius_m", radius_m, 1e-3, 1.0);
  }
};

struct TableFile {
  bool with_bar = true, with_object = true;  // are demanded
  double surface_z_m = 0.0;
  std::vector<ObstacleEntry> balls;
  kin::BarShape bar;
  std::vector<BoxEntry> boxes;
  std::vector<GoalEntry> goals;
  std::vector<double> object_position_m;
  double object_radius_m = 0.0, object_height_m = 0.0;

  void visit(ParamVisitor& v) {
    v("surface_z_m", surface_z_m, -10.0, 10.0);
    list(v, "balls", balls);
    if (with_bar) visit_bar(v);
    list(v, "boxes", boxes);
    list(v, "goals", goals);
    if (with_object) visit_object(v);
  }

 private:
  void visit_bar(ParamVisitor& v) {
    v.group("bar", [this](ParamVisitor& g) {
      g("x_m", bar.x, -10.0, 10.0);
      g("half_width_m", bar.half_width, 0.01, 10.0);
      g("height_m", bar.height, 0.01, 10.0);
      g("ball_radius_m", bar.ball_radius, 1e-3, 1.0);
      g("max_spacing_m", bar.max_spacing, 1e-3, 1.0);
    });
  }
  void visit_object(ParamVisitor& v) {
    v.group("object", [this](ParamVisitor& g) {
      g("position_m", object_position_m, -10.0, 10.0, 3);
      g("radius_m", object_radius_m, 1e-3, 1.0);
      g("height_m", object_height_m, 1e-3, 1.0);
    });
  }
};

Eigen::Vector3d vector(const std::vector<double>& v) { return Eigen::Vector3d::Map(v.data()); }

/// Name of a goal's place; none for a goal that is not known.
std::string name_of(task::Goal goal) {
  return goal == task::Goal::unknown ? "" : std::string(task::word(goal));
}

kin::Table table_of(const std::string& file, const TableFile& entry,
                    std::optional<double> bar_height) {
  kin::Table table;
  if (entry.with_bar) {
    kin::BarShape bar = entry.bar;
    bar.surface_z = entry.surface_z_m;
    bar.height = bar_height.value_or(bar.height);
    if (bar.height < bar.ball_radius) {
      throw ConfigError(file + ": bar: height_m is below ball_radius_m");
    }
    table.balls = kin::bar_balls(bar);
    table.bar_center = kin::bar_center(bar);
    table.bar_height = bar.height;
    table.bar_half_width = bar.half_width;
  }
  for (const ObstacleEntry& ball : entry.balls) {
    table.balls.push_back({vector(ball.center_m), ball.radius_m});
  }
  for (const BoxEntry& box : entry.boxes) {
    table.boxes.push_back({vector(box.center_m), vector(box.half_extent_m), box.name});
  }
  for (const GoalEntry& goal : entry.goals) {
    table.goals.push_back({goal.name, vector(goal.position_m), goal.radius_m});
  }
  if (entry.with_object) {
    table.object = vector(entry.object_position_m);
    table.object_radius = entry.object_radius_m;
    table.object_height = entry.object_height_m;
  }
  return table;
}

}  // namespace

kin::Table load_table(const std::string& file, std::optional<double> bar_height) {
  TableFile entry;
  runtime::load_params(file, [&](ParamVisitor& v) { entry.visit(v); });
  return table_of(file, entry, bar_height);
}

kin::Table load_scene(const std::string& file) {
  const runtime::ParamSource source(runtime::find_model_file(file), {}, {});
  TableFile entry;
  entry.with_bar = source.gives("bar");
  entry.with_object = source.gives("object");
  source.read("", [&](ParamVisitor& v) { entry.visit(v); });
  return table_of(file, entry, {});
}

v1::Scene to_proto(const kin::Table& table) {
  v1::Scene scene;
  for (const kin::Ball& ball : table.balls) {
    v1::Ball& out = *scene.add_obstacles();
    to_proto(ball.center, *out.mutable_center_in_world_m());
    out.set_radius_m(ball.radius);
  }
  for (const kin::Box& box : table.boxes) {
    v1::Box& out = *scene.add_boxes();
    to_proto(box.center, *out.mutable_center_in_world_m());
    to_proto(box.half_extent, *out.mutable_half_extent_m());
    out.set_name(box.name);
  }
  to_proto(table.bar_center, *scene.mutable_bar()->mutable_center_in_world_m());
  scene.mutable_bar()->set_height_m(table.bar_height);
  scene.mutable_bar()->set_half_width_m(table.bar_half_width);
  for (const kin::GoalPlace& goal : table.goals) {
    v1::GoalPlace& out = *scene.add_goals();
    out.set_goal(goal.name == "high"  ? v1::GOAL_HIGH
                 : goal.name == "low" ? v1::GOAL_LOW
                                      : v1::GOAL_UNSPECIFIED);
    to_proto(goal.position, *out.mutable_position_in_world_m());
    out.set_radius_m(goal.radius);
  }
  to_proto(table.object, *scene.mutable_object()->mutable_position_in_world_m());
  scene.mutable_object()->set_radius_m(table.object_radius);
  scene.mutable_object()->set_height_m(table.object_height);
  return scene;
}

kin::Table from_proto(const v1::Scene& scene) {
  kin::Table table;
  for (const v1::Ball& ball : scene.obstacles()) {
    table.balls.push_back({to_eigen(ball.center_in_world_m()), ball.radius_m()});
  }
  for (const v1::Box& box : scene.boxes()) {
    table.boxes.push_back(
        {to_eigen(box.center_in_world_m()), to_eigen(box.half_extent_m()), box.name()});
  }
  table.bar_center = to_eigen(scene.bar().center_in_world_m());
  table.bar_height = scene.bar().height_m();
  table.bar_half_width = scene.bar().half_width_m();
  for (const v1::GoalPlace& goal : scene.goals()) {
    table.goals.push_back(
        {name_of(from_proto(goal.goal())), to_eigen(goal.position_in_world_m()), goal.radius_m()});
  }
  table.object = to_eigen(scene.object().position_in_world_m());
  table.object_radius = scene.object().radius_m();
  table.object_height = scene.object().height_m();
  return table;
}

}  // namespace mimesis::model
