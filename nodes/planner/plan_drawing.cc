#include "nodes/planner/plan_drawing.h"

#include <fmt/format.h>

#include <Eigen/SVD>

#include "common/model/drawing.h"
#include "common/model/messages.h"

namespace mimesis::planner {
namespace {

using Eigen::Vector3d;
using model::Rgba;
using model::to_eigen;

constexpr Rgba kEmpty{0.1, 0.75, 0.95, 1.0}, kHolding{0.95, 0.25, 0.85, 1.0},
    kText{0.95, 0.95, 0.95, 1.0}, kSeen{0.95, 0.75, 0.2, 0.35}, kDoubt{0.95, 0.3, 0.2, 0.6};
constexpr double kEvery_s = 0.02;  // a point of the way
constexpr double kAxes_m = 0.06, kLabel_m = 0.03;

/// `spread_m`: lower triangle of L by rows, L Lᵀ the covariance; nothing if it was told exactly.
void add_uncertainty(foxglove::SceneEntity& entity, const Vector3d& center,
                     const google::protobuf::RepeatedField<double>& spread_m) {
  if (spread_m.size() != 6) return;
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
  for (int row = 0, k = 0; row < 3; ++row) {
    for (int column = 0; column <= row; ++column) L(row, column) = spread_m[k++];
  }
  model::add_uncertainty(entity, center, L * L.transpose(), kDoubt);
  model::add_label(entity, center + Vector3d(0.0, 0.0, 2.0 * kLabel_m), 0.7 * kLabel_m,
                   fmt::format("±{:.1f} mm", 1e3 * L.jacobiSvd().singularValues()(0)), kText);
}

}  // namespace

foxglove::SceneUpdate draw_plan(const kin::ArmModel& arm, const TaskPlan& plan,
                                std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "plan", "world", stamp);
  for (const PlannedMotion& motion : plan.motions) {
    const JointTrajectory& samples = motion.trajectory;
    const auto hand = [&](Eigen::Index k) {
      return kin::end_effector(arm, samples.position.col(k));
    };
    const auto every = std::max<Eigen::Index>(1, std::lround(kEvery_s / samples.period_s));
    auto& way = model::add_line(entity, foxglove::LinePrimitive::LINE_STRIP, 6.0,
                                motion.phase == Phase::transport ? kHolding : kEmpty);
    const Eigen::Index last = samples.samples() - 1;
    for (Eigen::Index k = 0; k < last; k += every) model::add_point(way, hand(k).translation());
    model::add_point(way, hand(last).translation());
    const auto pose = [&](const Eigen::Isometry3d& X_WE, const char* name) {
      model::add_axes(entity, X_WE, kAxes_m);
      model::add_label(entity, X_WE * Vector3d(0.0, 0.0, -kAxes_m), kLabel_m, name, kText);
    };
    if (motion.phase == Phase::approach) pose(hand(last), "grasp");
    if (motion.phase == Phase::retreat) pose(hand(0), "release");
  }
  return update;
}

foxglove::SceneUpdate draw_seen(const v1::Scene& scene, std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "seen", "world", stamp);
  if (scene.has_object()) {
    const v1::GraspObject& object = scene.object();
    const Vector3d center = to_eigen(object.position_in_world_m());
    const Vector3d half(0.0, 0.0, 0.5 * object.height_m());
    model::add_rod(entity, center - half, center + half, object.radius_m(), kSeen);
    add_uncertainty(entity, center, object.spread_m());
  }
  for (const v1::GoalPlace& goal : scene.goals()) {
    const Vector3d place = to_eigen(goal.position_in_world_m());
    model::add_ball(entity, place, goal.radius_m(), kSeen);
    add_uncertainty(entity, place, goal.spread_m());
  }
  if (scene.has_bar()) {
    const Vector3d middle = to_eigen(scene.bar().center_in_world_m());
    const Vector3d half(0.0, scene.bar().half_width_m(), 0.0);
    model::add_rod(entity, middle - half, middle + half, 0.005, kSeen);
    add_uncertainty(entity, middle, scene.bar().spread_m());
  }
  return update;
}

}  // namespace mimesis::planner
