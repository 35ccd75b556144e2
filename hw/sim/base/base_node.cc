#include "hw/sim/base/base_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "common/model/drawing.h"
#include "common/runtime/log.h"

namespace mimesis::hw::sim {

SimBaseNode::SimBaseNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      name_(bus.node()),
      command_(bus, "crowd", {.author = runtime::Author::first}),
      info_(bus, "info", {.author = runtime::Author::first}),
      states_(bus, "states"),
      entities_(bus, "entities") {
  for (const BasePlace& p : params.bases) {
    bases_.emplace_back(params.limits, Eigen::Vector2d(p.x_m, p.y_m), p.heading_rad);
  }
  ids_.assign(bases_.size(), 0);
  wishes_.resize(bases_.size());
}

/// Ids of `NAME/k` among the agents that may come.
void SimBaseNode::read_info() {
  const v1::CrowdInfo* info = info_.take();
  if (info == nullptr) return;
  std::string strangers;
  for (std::size_t k = 0; k < bases_.size(); ++k) {
    const auto& names = info->external_names();
    const auto found = std::ranges::find(names, fmt::format("{}/{}", name_, k));
    const auto at = static_cast<int>(found - names.begin());
    ids_[k] = found != names.end() && at < info->external_ids_size() ? info->external_ids(at) : 0;
    if (ids_[k] == 0) strangers += fmt::format("{}{}/{}", strangers.empty() ? "" : ", ", name_, k);
  }
  if (!strangers.empty()) {
    runtime::warn("{} take no part: the scenario {} has no `externals` of that name", strangers,
                  info->scenario());
  }
}

void SimBaseNode::step(runtime::Time now) {
  const double dt_s = last_ ? runtime::to_seconds(now - *last_) : 1.0 / params_.rate_hz;
  if (dt_s <= 0.0) return;
  last_ = now;
  read_info();
  if (const v1::CrowdCommand* command = command_.take()) {
    told_ = now;
    for (const v1::GaitCommand& gait : command->gaits()) {
      const auto k = static_cast<std::size_t>(std::ranges::find(ids_, gait.agent()) - ids_.begin());
      if (gait.agent() == 0 || k >= bases_.size()) continue;
      // a cycle is two steps
      wishes_[k] = {.phase_rate_rad_s = gait.phase_rate_rad_s(),
                    .speed_m_s = gait.step_length_m() * gait.phase_rate_rad_s() / std::numbers::pi,
                    .heading_rad = gait.heading_rad()};
    }
  }
  const bool stale = !told_ || now - *told_ > runtime::from_seconds(params_.stale_s);
  for (std::size_t k = 0; k < bases_.size(); ++k) {
    if (stale || !wishes_[k]) {
      bases_[k].stop(dt_s);
    } else {
      bases_[k].step(dt_s, *wishes_[k]);
    }
  }
  publish(now);
}

void SimBaseNode::publish(runtime::Time now) {
  v1::CrowdStates states;
  foxglove::SceneUpdate scene;
  constexpr model::Rgba kBody{0.25, 0.35, 0.45, 1.0}, kWheel{0.1, 0.1, 0.1, 1.0};
  for (std::size_t k = 0; k < bases_.size(); ++k) {
    const WheeledBase& b = bases_[k];
    const Eigen::Vector2d p = b.position_W_m(),
                          ahead(std::cos(b.heading_rad()), std::sin(b.heading_rad()));
    if (ids_[k] != 0) {
      states.add_id(ids_[k]);
      for (const double x : p) states.add_position_in_world_m(x);
      for (const double v : ahead)
        states.add_velocity_in_world_m_s(static_cast<float>(b.speed_m_s() * v));
      states.add_heading_rad(b.heading_rad());
      states.add_phase_rad(b.phase_rad());
      states.add_phase_rate_rad_s(b.phase_rate_rad_s());
    }
    auto& entity = model::add_entity(scene, fmt::format("{}/{}", name_, k), "world", now);
    Eigen::Isometry3d pose(Eigen::AngleAxisd(b.heading_rad(), Eigen::Vector3d::UnitZ()));
    pose.translation() << p, 0.2;
    model::add_box(entity, pose, {0.5, 0.36, 0.22}, kBody);
    for (const double side : {-1.0, 1.0}) {
      model::add_rod(entity, pose * Eigen::Vector3d(0.0, side * 0.19, -0.1),
                     pose * Eigen::Vector3d(0.0, side * 0.23, -0.1), 0.1, kWheel);
    }
    // Its light is on for half of a cycle: it keeps time.
    const bool lit = b.phase_rate_rad_s() > 0.0 && b.phase_rad() < std::numbers::pi;
    model::add_ball(entity, pose * Eigen::Vector3d(0.15, 0.0, 0.16), 0.06,
                    lit ? model::Rgba{1.0, 0.8, 0.2, 1.0} : model::Rgba{0.3, 0.3, 0.3, 1.0});
  }
  if (states.id_size() > 0) states_.send(states, now);
  entities_.send(scene, now);
}

}  // namespace mimesis::hw::sim
