#include "nodes/crowd/scene_node.h"

#include <array>
#include <cmath>

#include "common/model/drawing.h"

namespace mimesis::crowd {
namespace {

using model::Rgba;

constexpr std::array<Rgba, 8> kGroups{{{0.20, 0.45, 0.85, 1.0},
                                       {0.90, 0.40, 0.15, 1.0},
                                       {0.20, 0.65, 0.35, 1.0},
                                       {0.65, 0.35, 0.75, 1.0},
                                       {0.85, 0.70, 0.15, 1.0},
                                       {0.15, 0.70, 0.75, 1.0},
                                       {0.85, 0.30, 0.50, 1.0},
                                       {0.45, 0.45, 0.45, 1.0}}};
constexpr Rgba kStone{0.55, 0.52, 0.50, 1.0}, kGoal{0.90, 0.20, 0.20, 0.5};
constexpr double kTall_m = 1.7, kStroke_m = 0.5, kStroke_px = 3.0;
constexpr std::size_t kMostDiscs = 500;

void paint_still(const Scenario& scenario, foxglove::SceneEntity& entity) {
  for (const PillarSpec& p : scenario.pillars) {
    model::add_rod(entity, {p.x_m, p.y_m, 0.0}, {p.x_m, p.y_m, kTall_m}, p.radius_m, kStone);
  }
  for (const WallSpec& w : scenario.walls) {
    model::add_rod(entity, {w.from_x_m, w.from_y_m, 0.1}, {w.to_x_m, w.to_y_m, 0.1}, 0.05, kStone);
  }
  for (const Group& group : scenario.groups) {
    const std::vector<double>& xy = group.goals.position_m;
    for (std::size_t i = 0; i + 1 < xy.size(); i += 2) {
      model::add_ball(entity, {xy[i], xy[i + 1], 0.05}, 0.15, kGoal);
    }
  }
}

}  // namespace

foxglove::SceneUpdate paint(const Scenario& scenario, std::span<const Observed> agents,
                            std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  paint_still(scenario, model::add_entity(update, "place", "world", stamp));
  for (std::size_t g = 0; g < scenario.groups.size(); ++g) {
    const Rgba& color = kGroups[g % kGroups.size()];
    foxglove::SceneEntity& entity =
        model::add_entity(update, "group/" + scenario.groups[g].name, "world", stamp);
    foxglove::LinePrimitive& strokes =
        model::add_line(entity, foxglove::LinePrimitive::LINE_LIST, kStroke_px, color);
    for (const Observed& agent : agents) {
      if (agent.group != static_cast<int>(g)) continue;
      const Eigen::Vector3d p(agent.p_W_m.x(), agent.p_W_m.y(), 0.0);
      const Eigen::Vector3d ahead(std::cos(agent.heading_rad), std::sin(agent.heading_rad), 0.0);
      model::add_point(strokes, p);
      model::add_point(strokes, p + kStroke_m * ahead);
      if (agents.size() > kMostDiscs) continue;
      model::add_rod(entity, p, p + Eigen::Vector3d(0.0, 0.0, 0.05), scenario.groups[g].radius_m,
                     color);
    }
  }
  return update;
}

}  // namespace mimesis::crowd
