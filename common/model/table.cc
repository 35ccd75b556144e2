#include "common/kin/table.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/model/files.h"
#include "common/model/messages.h"
#include "common/robot/point_cloud.h"
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

/// Where the frame of a file is in W.
struct PlacedFile {
  std::string name, file;
  std::vector<double> position_m{0.0, 0.0, 0.0}, rpy_rad{0.0, 0.0, 0.0};

  void visit_place(ParamVisitor& v) {
    v("name", name);
    v("file", file);
    v("position_m", position_m, -10.0, 10.0, 3);
    v("rpy_rad", rpy_rad, -6.3, 6.3, 3);
  }
  Eigen::Isometry3d X_WF() const {
    Eigen::Isometry3d X(Eigen::Translation3d(Eigen::Vector3d::Map(position_m.data())));
    X.linear() = math::rotation_of_rpy(Eigen::Vector3d::Map(rpy_rad.data()));
    return X;
  }
};

struct MeshEntry : PlacedFile {
  double scale = 1.0;
  robot::PartSettings fit;

  void visit(ParamVisitor& v) {
    visit_place(v);
    v("scale", scale, 1e-6, 1e3);
    v("fitted_m", fit.tolerance_m, 0.001, 1.0);
    v("most_parts", fit.most_parts, 1, 200);
  }
};

struct CloudEntry : PlacedFile {
  double cell_m = 0.02;     // one ball for each
  double radius_m = 0.005;  // around each point
  double within_m = 0.0;    // of the world's origin; 0: all points count
  std::string viewpoint = "refuse";

  void visit(ParamVisitor& v) {
    visit_place(v);
    v("cell_m", cell_m, 0.001, 1.0);
    v("radius_m", radius_m, 0.0, 1.0);
    v("within_m", within_m, 0.0, 100.0);
    v("viewpoint", viewpoint, {"refuse", "apply", "ignore"});
  }
};

struct TableFile {
  bool with_bar = true, with_object = true;  // are demanded
  double surface_z_m = 0.0;
  std::vector<ObstacleEntry> balls;
  kin::BarShape bar;
  std::vector<BoxEntry> boxes;
  std::vector<MeshEntry> meshes;
  std::vector<CloudEntry> clouds;
  std::vector<GoalEntry> goals;
  std::vector<double> object_position_m;
  double object_radius_m = 0.0, object_height_m = 0.0;

  void visit(ParamVisitor& v) {
    v("surface_z_m", surface_z_m, -10.0, 10.0);
    list(v, "balls", balls);
    if (with_bar) visit_bar(v);
    list(v, "boxes", boxes);
    list(v, "meshes", meshes);
    list(v, "clouds", clouds);
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

kin::Hull hull_of(math::ConvexPart shape, std::string name) {
  kin::Hull hull{std::move(shape), {}, std::move(name)};
  hull.cover = robot::balls_around(hull.shape);
  return hull;
}

constexpr double kMostMesh_m = 20.0;
constexpr double kMostFar_m = 1e4;
constexpr std::size_t kMostCells = 20'000;

std::string name_of(const PlacedFile& entry) {
  return entry.name.empty() ? std::filesystem::path(entry.file).stem().string() : entry.name;
}

void add_mesh(const std::string& beside, const MeshEntry& entry, kin::Table& table) {
  robot::Solid solid{.kind = robot::Solid::Kind::mesh, .X_LS = entry.X_WF()};
  solid.mesh = robot::load_mesh(beside, entry.file, Eigen::Vector3d::Constant(entry.scale));
  const double longest = solid.mesh->box().sizes().maxCoeff();
  if (longest > kMostMesh_m)
    throw ConfigError(fmt::format(
        "mesh '{}' is {:.3g} m long, expected at most {} m: of one in millimetres scale is 0.001",
        entry.file, longest, kMostMesh_m));
  for (math::ConvexPart& part : robot::convex_parts({&solid, 1}, entry.fit))
    table.hulls.push_back(hull_of(std::move(part), name_of(entry)));
}

void add_cloud(const std::string& beside, const CloudEntry& entry, kin::Table& table) {
  using robot::Viewpoint;
  const Viewpoint viewpoint = entry.viewpoint == "apply"    ? Viewpoint::apply
                              : entry.viewpoint == "ignore" ? Viewpoint::ignore
                                                            : Viewpoint::refuse;
  const std::string path = (std::filesystem::path(beside).parent_path() / entry.file).string();
  const Eigen::Matrix3Xd points = entry.X_WF() * robot::read_point_cloud(path, viewpoint);
  Eigen::Matrix3Xd near(3, points.cols());
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (entry.within_m == 0.0 || points.col(i).norm() <= entry.within_m)
      near.col(count++) = points.col(i);
  }
  if (count == 0)
    throw ConfigError(
        fmt::format("{}: no point is within {} m of the world's origin, expected some", entry.file,
                    entry.within_m));
  const double farthest = std::sqrt(near.leftCols(count).colwise().squaredNorm().maxCoeff());
  if (farthest > kMostFar_m)
    throw ConfigError(fmt::format(
        "{}: a point is {:.3g} m away, expected at most {} m: scale it, or say within_m",
        entry.file, farthest, kMostFar_m));
  const auto balls = robot::balls_of_points(near.leftCols(count), entry.cell_m, entry.radius_m);
  if (balls.size() > kMostCells)
    throw ConfigError(fmt::format(
        "{}: points in {} cells of {} m, expected at most {}: a larger cell_m, or within_m",
        entry.file, balls.size(), entry.cell_m, kMostCells));
  for (const math::RoundBound& ball : balls) table.balls.push_back({ball.center, ball.radius});
}

/// `add(path of the file, entry, table)` of each; faults name the entry.
template <class Entry, class Add>
void add_all(const std::string& file, const char* key, const std::vector<Entry>& entries,
             kin::Table& table, const Add& add) {
  for (std::size_t i = 0; i < entries.size(); ++i) {
    try {
      if (entries[i].file.empty()) throw ConfigError("file is missing, expected one");
      add(runtime::find_model_file(file), entries[i], table);
    } catch (const ConfigError& e) {
      throw ConfigError(fmt::format("{}: {}[{}]: {}", file, key, i, e.what()));
    }
  }
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
  add_all(file, "meshes", entry.meshes, table, add_mesh);
  add_all(file, "clouds", entry.clouds, table, add_cloud);
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
  for (const kin::Hull& hull : table.hulls) {
    for (const math::RoundBound& cover : hull.cover) {
      v1::Ball& out = *scene.add_obstacles();
      to_proto(cover.center, *out.mutable_center_in_world_m());
      out.set_radius_m(cover.radius);
    }
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
