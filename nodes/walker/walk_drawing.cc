#include "nodes/walker/walk_drawing.h"

#include "common/model/drawing.h"

namespace mimesis::walker {
namespace {

using Eigen::Vector3d;
using model::Rgba;

constexpr Rgba kStands{0.35, 0.38, 0.42, 0.6}, kLands{0.3, 0.7, 0.4, 0.7}, kCom{0.3, 0.7, 0.4, 1.0},
    kPlanned{0.3, 0.7, 0.4, 1.0}, kWished{0.95, 0.75, 0.2, 1.0}, kMeasured{0.9, 0.15, 0.3, 1.0};
constexpr double kSheet_m = 0.004;  // soles are drawn this thick

Vector3d to_eigen(const v1::Vector3& v) { return {v.x_m(), v.y_m(), v.z_m()}; }

void add_sole(foxglove::SceneEntity& entity, const v1::Footprint& foot, const robot::Biped& biped,
              const Rgba& colour) {
  const robot::Biped::Leg& leg =
      biped.leg[foot.foot() == v1::FOOT_LEFT ? robot::kLeft : robot::kRight];
  Eigen::Isometry3d X_WS = Eigen::Translation3d(to_eigen(foot.position_in_world_m())) *
                           Eigen::Isometry3d(Eigen::AngleAxisd(foot.yaw_rad(), Vector3d::UnitZ()));
  Vector3d edges, middle;
  edges << leg.max_S_m - leg.min_S_m, kSheet_m;
  middle << 0.5 * (leg.max_S_m + leg.min_S_m), 0.5 * kSheet_m;
  X_WS.translate(middle);
  model::add_box(entity, X_WS, edges, colour);
}

}  // namespace

foxglove::SceneUpdate draw_plan(const v1::WalkFeedback& feedback, const v1::WalkBalance* balance,
                                const robot::Biped& biped, std::chrono::nanoseconds now) {
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "plan", "world", now);
  for (const v1::Footprint& foot : feedback.feet()) add_sole(entity, foot, biped, kStands);
  if (feedback.to_landing_s() > 0.0) add_sole(entity, feedback.landing(), biped, kLands);
  if (balance == nullptr) return update;
  const Vector3d com = to_eigen(balance->com_planned_in_world_m());
  model::add_ball(entity, com, 0.03, kCom);
  model::add_rod(entity, {com.x(), com.y(), 0.0}, com, 0.003, kCom);
  model::add_ball(entity, to_eigen(balance->zmp_planned_in_world_m()), 0.016, kPlanned);
  model::add_ball(entity, to_eigen(balance->zmp_wished_in_world_m()), 0.016, kWished);
  model::add_ball(entity, to_eigen(balance->zmp_measured_in_world_m()), 0.016, kMeasured);
  return update;
}

}  // namespace mimesis::walker
