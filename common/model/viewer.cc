#include "common/model/viewer.h"

namespace mimesis::model {
namespace {

struct Rgba {
  double r, g, b, a;
};
constexpr Rgba kTable{0.75, 0.72, 0.68, 1.0}, kBridge{0.25, 0.35, 0.55, 1.0},
    kArm{0.95, 0.5, 0.1, 0.9}, kObject{0.1, 0.6, 0.3, 1.0}, kGoal{0.9, 0.2, 0.2, 0.4};

google::protobuf::Timestamp timestamp(std::chrono::nanoseconds t) {
  google::protobuf::Timestamp out;
  out.set_seconds(t.count() / 1'000'000'000);
  out.set_nanos(static_cast<int>(t.count() % 1'000'000'000));
  return out;
}

void set(const Eigen::Vector3d& v, foxglove::Vector3& out) {
  out.set_x(v.x());
  out.set_y(v.y());
  out.set_z(v.z());
}

/// Fills the fields that all primitives share.
template <class Primitive>
Primitive& fill(Primitive* out, const Eigen::Vector3d& position, const Eigen::Vector3d& size,
                const Rgba& color) {
  set(position, *out->mutable_pose()->mutable_position());
  out->mutable_pose()->mutable_orientation()->set_w(1.0);
  set(size, *out->mutable_size());
  out->mutable_color()->set_r(color.r);
  out->mutable_color()->set_g(color.g);
  out->mutable_color()->set_b(color.b);
  out->mutable_color()->set_a(color.a);
  return *out;
}

foxglove::SceneEntity& add(foxglove::SceneUpdate& update, const std::string& id,
                           const std::string& frame, std::chrono::nanoseconds stamp) {
  foxglove::SceneEntity& entity = *update.add_entities();
  *entity.mutable_timestamp() = timestamp(stamp);
  entity.set_frame_id(frame);
  entity.set_id(id);
  entity.set_frame_locked(true);
  return entity;
}

std::string frame_name(std::size_t i) { return "arm/" + std::to_string(i); }

}  // namespace

foxglove::SceneUpdate to_entities(const kin::Table& table, const kin::ArmModel& arm,
                                  std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& still = add(update, "table", "world", stamp);
  for (const kin::Box& box : table.boxes) {
    fill(still.add_cubes(), box.center, 2.0 * box.half_extent, kTable);
  }
  for (const kin::Ball& ball : table.balls) {
    fill(still.add_spheres(), ball.center, Eigen::Vector3d::Constant(2.0 * ball.radius), kBridge);
  }
  for (const kin::GoalPlace& goal : table.goals) {
    fill(still.add_spheres(), goal.position, Eigen::Vector3d::Constant(2.0 * goal.radius), kGoal);
  }
  for (std::size_t frame = 0; frame < arm.links.size() + 1; ++frame) {
    foxglove::SceneEntity& link = add(update, frame_name(frame), frame_name(frame), stamp);
    for (const kin::SafetyBall& ball : arm.balls) {
      if (ball.frame != static_cast<int>(frame)) continue;
      fill(link.add_spheres(), ball.center, Eigen::Vector3d::Constant(2.0 * ball.radius), kArm);
    }
  }
  foxglove::CylinderPrimitive& cylinder =
      fill(add(update, "object", "object", stamp).add_cylinders(), Eigen::Vector3d::Zero(),
           {2.0 * table.object_radius, 2.0 * table.object_radius, table.object_height}, kObject);
  cylinder.set_bottom_scale(1.0);
  cylinder.set_top_scale(1.0);
  return update;
}

foxglove::FrameTransforms to_transforms(const kin::ArmModel& arm,
                                        const std::vector<Eigen::Isometry3d>& X,
                                        const Eigen::Isometry3d& X_WO,
                                        const std::vector<kin::GoalPlace>& goals,
                                        std::chrono::nanoseconds stamp) {
  foxglove::FrameTransforms transforms;
  const auto add_frame = [&](const std::string& name, const Eigen::Isometry3d& pose) {
    foxglove::FrameTransform& t = *transforms.add_transforms();
    *t.mutable_timestamp() = timestamp(stamp);
    t.set_parent_frame_id("world");
    t.set_child_frame_id(name);
    set(pose.translation(), *t.mutable_translation());
    const Eigen::Quaterniond q(pose.linear());
    t.mutable_rotation()->set_x(q.x());
    t.mutable_rotation()->set_y(q.y());
    t.mutable_rotation()->set_z(q.z());
    t.mutable_rotation()->set_w(q.w());
  };
  for (std::size_t i = 0; i < X.size(); ++i) add_frame(frame_name(i), X[i]);
  if (!X.empty()) add_frame("tool", X.back() * arm.X_LE);
  add_frame("object", X_WO);
  for (const kin::GoalPlace& goal : goals) {
    add_frame("goal/" + goal.name, Eigen::Isometry3d(Eigen::Translation3d(goal.position)));
  }
  return transforms;
}

}  // namespace mimesis::model
