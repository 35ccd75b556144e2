#include "nodes/planner/drawing/roadmap_drawing_node.h"

#include <array>

#include "common/model/drawing.h"
#include "common/model/files.h"
#include "common/runtime/param_source.h"
#include "nodes/planner/planner_node.h"
#include "nodes/planner/roadmap_file.h"

namespace mimesis::planner {
namespace {

using model::Rgba;

constexpr double kNodeRadius = 0.004;  // [m]
enum Use : std::size_t { kUsable, kClosed, kBlocked };
constexpr std::array<const char*, 3> kUses{"usable", "closed", "blocked"};
constexpr std::array<Rgba, 3> kUseColors{
    {{0.2, 0.75, 0.35, 0.35}, {0.95, 0.6, 0.1, 0.35}, {0.9, 0.15, 0.15, 0.5}}};

Obstacles obstacles_of(const kin::Table& table, std::optional<Transport> decided) {
  Obstacles obstacles{table.balls, table.boxes, {}, {}};
  if (decided) {
    const auto closed = closed_passages(table, *decided);
    obstacles.boxes.insert(obstacles.boxes.end(), closed.begin(), closed.end());
  }
  return obstacles;
}

PlannerParams params_of(const v1::NodeStart& start) {
  PlannerParams params;
  const runtime::Yaml all = runtime::parse_yaml(start.parameters(), start.node() + "/start");
  const runtime::Variables none(all);
  runtime::ParamReader reader(start.node(), &all, none, {});
  params.visit(reader);
  reader.finish();
  return params;
}

std::optional<Transport> to_transport(v1::Transport transport) {
  if (transport == v1::TRANSPORT_ABOVE) return Transport::above;
  if (transport == v1::TRANSPORT_BELOW) return Transport::below;
  return std::nullopt;
}

}  // namespace

foxglove::SceneUpdate to_drawing(const kin::ArmModel& arm, const kin::Table& table,
                                 const Roadmap& roadmap, double margin_m,
                                 std::optional<Transport> decided, std::chrono::nanoseconds stamp) {
  CollisionChecker real(arm, obstacles_of(table, std::nullopt), margin_m);
  CollisionChecker narrowed(arm, obstacles_of(table, decided), margin_m);
  foxglove::SceneUpdate update;
  for (const char* name : kUses) model::add_entity(update, name, "world", stamp);
  std::array<foxglove::LinePrimitive*, kUses.size()> lines{};
  for (std::size_t use = 0; use < lines.size(); ++use) {
    lines[use] = &model::add_line(*update.mutable_entities(static_cast<int>(use)),
                                  foxglove::LinePrimitive::LINE_LIST, 1.0, kUseColors[use]);
  }
  const auto use_of = [&](const auto& is_free) {
    if (!is_free(real)) return kBlocked;
    return !decided || is_free(narrowed) ? kUsable : kClosed;
  };
  std::vector<Eigen::Vector3d> hands;
  for (Eigen::Index i = 0; i < roadmap.nodes().cols(); ++i) {
    hands.emplace_back(kin::end_effector(arm, roadmap.nodes().col(i)).translation());
  }
  for (std::size_t i = 0; i < hands.size(); ++i) {
    const auto q = roadmap.nodes().col(static_cast<Eigen::Index>(i));
    const Use use = use_of([&](auto& checker) { return checker.free(q); });
    model::add_ball(*update.mutable_entities(static_cast<int>(use)), hands[i], kNodeRadius,
                    kUseColors[use]);
    for (const Link& link : roadmap.links()[i]) {
      if (link.to < static_cast<int>(i)) continue;  // stored at both ends
      const Use link_use =
          use_of([&](auto& checker) { return checker.certify(q, roadmap.nodes().col(link.to)); });
      model::add_point(*lines[link_use], hands[i]);
      model::add_point(*lines[link_use], hands[static_cast<std::size_t>(link.to)]);
    }
  }
  return update;
}

RoadmapDrawer::RoadmapDrawer(const v1::NodeStart& start) {
  const PlannerParams params = params_of(start);
  arm_ = model::load_arm(params.robot);
  settings_ = task_settings(params);
  if (!params.roadmap.empty())
    stored_ = std::make_shared<const Roadmap>(load_roadmap(params.roadmap, arm_));
}

foxglove::SceneUpdate RoadmapDrawer::draw(const v1::Scene& scene, const v1::TaskStatus& status) {
  const kin::Table table = model::from_proto(scene);
  v1::Scene without_time = scene;
  without_time.clear_header();
  std::string bytes = without_time.SerializeAsString();
  if (!roadmap_ || bytes != scene_) {
    roadmap_ = stored_ ? *refreshed_roadmap(stored_, arm_, table, settings_)
                       : prepare_roadmap(arm_, table, settings_);
  }
  scene_ = std::move(bytes);
  return to_drawing(arm_, table, *roadmap_, settings_.margin_m, to_transport(status.transport()),
                    std::chrono::nanoseconds(status.header().stamp_ns()));
}

}  // namespace mimesis::planner
