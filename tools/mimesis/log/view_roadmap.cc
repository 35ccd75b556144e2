#include "tools/mimesis/log/view_roadmap.h"

#include <array>
#include <cmath>

#include "common/model/drawing.h"
#include "common/model/files.h"

namespace mimesis::tool {
namespace {

using model::Rgba;

constexpr double kNode = 0.004;  // radius [m]
constexpr std::array<const char*, 3> kNames{"usable", "closed", "blocked"};
constexpr std::array<Rgba, 3> kColors{
    {{0.2, 0.75, 0.35, 0.35}, {0.95, 0.6, 0.1, 0.35}, {0.9, 0.15, 0.15, 0.5}}};
constexpr Rgba kEmpty{0.1, 0.75, 0.95, 1.0}, kHolding{0.95, 0.25, 0.85, 1.0},
    kText{0.9, 0.9, 0.9, 1.0};

planner::Obstacles obstacles_of(const kin::Table& table,
                                std::optional<planner::Transport> decided) {
  planner::Obstacles obstacles{table.balls, table.boxes, {}, {}};
  if (decided) {
    const auto closed = planner::closed_passages(table, *decided);
    obstacles.boxes.insert(obstacles.boxes.end(), closed.begin(), closed.end());
  }
  return obstacles;
}

std::optional<planner::Transport> transport_of(v1::Transport transport) {
  if (transport == v1::TRANSPORT_ABOVE) return planner::Transport::above;
  if (transport == v1::TRANSPORT_BELOW) return planner::Transport::below;
  return std::nullopt;
}

bool finite(const Eigen::Vector3d& p, double size) { return p.allFinite() && std::isfinite(size); }

bool finite(const kin::Table& table) {
  bool all = finite(table.bridge_center, table.bridge_height + table.bridge_half_width) &&
             finite(table.object, table.object_height + table.object_radius);
  for (const auto& ball : table.balls) all &= finite(ball.center, ball.radius);
  for (const auto& box : table.boxes) all &= finite(box.center, box.half_extent.sum());
  for (const auto& goal : table.goals) all &= finite(goal.position, goal.radius);
  return all;
}

void draw_way(foxglove::SceneEntity& entity, const std::vector<Eigen::Isometry3d>& X_WE,
              const Rgba& color) {
  auto& line = model::add_line(entity, foxglove::LinePrimitive::LINE_STRIP, 6.0, color);
  for (const auto& X : X_WE) model::add_point(line, X.translation());
}

void draw_hand_pose(foxglove::SceneEntity& entity, const Eigen::Isometry3d& X_WE,
                    const std::string& name) {
  model::add_axes(entity, X_WE, 0.06);
  model::add_label(entity, X_WE.translation() + Eigen::Vector3d(0.0, 0.0, 0.08), 0.03, name, kText);
}

}  // namespace

foxglove::SceneUpdate to_roadmap(const kin::ArmModel& arm, const kin::Table& table,
                                 const planner::Roadmap& roadmap, double margin_m,
                                 std::optional<planner::Transport> decided,
                                 std::chrono::nanoseconds stamp) {
  planner::CollisionChecker real(arm, obstacles_of(table, std::nullopt), margin_m);
  planner::CollisionChecker narrowed(arm, obstacles_of(table, decided), margin_m);
  foxglove::SceneUpdate update;
  for (const char* name : kNames) model::add_entity(update, name, "world", stamp);
  std::array<foxglove::LinePrimitive*, 3> lines{};
  for (std::size_t use = 0; use < lines.size(); ++use) {
    lines[use] = &model::add_line(*update.mutable_entities(static_cast<int>(use)),
                                  foxglove::LinePrimitive::LINE_LIST, 1.0, kColors[use]);
  }
  const auto use_of = [&](const auto& is_free) {
    if (!is_free(real)) return static_cast<std::size_t>(Use::blocked);
    const bool open = !decided || is_free(narrowed);
    return static_cast<std::size_t>(open ? Use::usable : Use::closed);
  };
  std::vector<Eigen::Vector3d> hands;
  for (Eigen::Index i = 0; i < roadmap.nodes.cols(); ++i) {
    hands.emplace_back(kin::end_effector(arm, roadmap.nodes.col(i)).translation());
  }
  for (std::size_t i = 0; i < hands.size(); ++i) {
    const auto q = roadmap.nodes.col(static_cast<Eigen::Index>(i));
    const std::size_t use = use_of([&](auto& checker) { return checker.free(q); });
    model::add_ball(*update.mutable_entities(static_cast<int>(use)), hands[i], kNode, kColors[use]);
    for (const planner::Link& link : roadmap.links[i]) {
      if (link.to < static_cast<int>(i)) continue;  // stored at both ends
      const std::size_t link_use =
          use_of([&](auto& checker) { return checker.certify(q, roadmap.nodes.col(link.to)); });
      model::add_point(*lines[link_use], hands[i]);
      model::add_point(*lines[link_use], hands[static_cast<std::size_t>(link.to)]);
    }
  }
  return update;
}

bool RoadmapView::see(const v1::Scene& scene, const Draw& draw) {
  kin::Table table = model::from_proto(scene);
  if (!finite(table)) return false;
  v1::Scene without_time = scene;
  without_time.clear_header();
  known_.first = without_time.SerializeAsString();
  table_ = std::move(table);
  if (!roadmap_) draw_roadmap(std::chrono::nanoseconds(scene.header().stamp_ns()), draw);
  return true;
}

bool RoadmapView::see(const v1::TaskStatus& status, const Draw& draw) {
  if (status.state() != v1::TASK_STATE_PLANNING) return true;
  known_.second = transport_of(status.transport());
  if (known_ != shown_) draw_roadmap(std::chrono::nanoseconds(status.header().stamp_ns()), draw);
  return true;
}

void RoadmapView::draw_roadmap(std::chrono::nanoseconds stamp, const Draw& draw) {
  if (!table_) return;
  if (!roadmap_ || known_.first != shown_.first) {
    roadmap_ = planner::prepare_roadmap(arm_, *table_, settings_);
  }
  shown_ = known_;
  draw("view/roadmap",
       to_roadmap(arm_, *table_, *roadmap_, settings_.margin_m, shown_.second, stamp), stamp);
}

bool RoadmapView::see(const v1::Trajectory& motion, const Draw& draw) {
  Motion way{motion.phase(), {}};
  for (const v1::TrajectoryPoint& point : motion.points()) {
    if (point.position_rad_size() != arm_.dof()) return false;
    const auto q = Eigen::VectorXd::Map(point.position_rad().data(), arm_.dof());
    if (!q.allFinite()) return false;
    way.X_WE.push_back(kin::end_effector(arm_, q));
  }
  if (way.X_WE.empty()) return false;
  const bool new_plan = motion.phase() == v1::TASK_PHASE_REACH ||
                        (!motions_.empty() && motion.phase() < motions_.back().phase);
  if (new_plan) motions_.clear();
  motions_.push_back(std::move(way));

  const std::chrono::nanoseconds stamp(motion.header().stamp_ns());
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "path", "world", stamp);
  for (const Motion& m : motions_) {
    draw_way(entity, m.X_WE, m.phase == v1::TASK_PHASE_TRANSPORT ? kHolding : kEmpty);
    if (m.phase == v1::TASK_PHASE_APPROACH) draw_hand_pose(entity, m.X_WE.back(), "grasp");
    if (m.phase == v1::TASK_PHASE_RETREAT) draw_hand_pose(entity, m.X_WE.front(), "release");
  }
  draw("view/path", update, stamp);
  return true;
}

}  // namespace mimesis::tool
