#include "common/error.h"
#include "common/kin/bridge.h"
#include "common/model/files.h"
#include "common/runtime/params.h"

namespace mimesis::model {
namespace {

using runtime::ParamVisitor;

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
  double surface_z_m = 0.0;
  kin::BridgeShape bridge;
  std::vector<BoxEntry> boxes;
  std::vector<GoalEntry> goals;
  std::vector<double> object_position_m;
  double object_radius_m = 0.0, object_height_m = 0.0;

  void visit(ParamVisitor& v) {
    v("surface_z_m", surface_z_m, -10.0, 10.0);
    v.group("bridge", [this](ParamVisitor& g) {
      g("x_m", bridge.x, -10.0, 10.0);
      g("half_width_m", bridge.half_width, 0.01, 10.0);
      g("height_m", bridge.height, 0.01, 10.0);
      g("ball_radius_m", bridge.ball_radius, 1e-3, 1.0);
      g("max_spacing_m", bridge.max_spacing, 1e-3, 1.0);
    });
    list(v, "boxes", boxes);
    list(v, "goals", goals);
    v.group("object", [this](ParamVisitor& g) {
      g("position_m", object_position_m, -10.0, 10.0, 3);
      g("radius_m", object_radius_m, 1e-3, 1.0);
      g("height_m", object_height_m, 1e-3, 1.0);
    });
  }
};

Eigen::Vector3d vector(const std::vector<double>& v) { return Eigen::Vector3d::Map(v.data()); }

}  // namespace

kin::Table load_table(const std::string& file, std::optional<double> bridge_height) {
  TableFile entry;
  runtime::load_params(file, [&](ParamVisitor& v) { entry.visit(v); });
  kin::BridgeShape bridge = entry.bridge;
  bridge.surface_z = entry.surface_z_m;
  bridge.height = bridge_height.value_or(bridge.height);
  if (bridge.height < bridge.ball_radius) {
    throw ConfigError(file + ": bridge: height_m is below ball_radius_m");
  }

  kin::Table table;
  table.balls = kin::bridge_balls(bridge);
  table.bridge_center = kin::bar_center(bridge);
  table.bridge_height = bridge.height;
  table.bridge_half_width = bridge.half_width;
  for (const BoxEntry& box : entry.boxes) {
    table.boxes.push_back({vector(box.center_m), vector(box.half_extent_m), box.name});
  }
  for (const GoalEntry& goal : entry.goals) {
    table.goals.push_back({goal.name, vector(goal.position_m), goal.radius_m});
  }
  table.object = vector(entry.object_position_m);
  table.object_radius = entry.object_radius_m;
  table.object_height = entry.object_height_m;
  return table;
}

}  // namespace mimesis::model
