#include "common/model/drawing.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace mimesis::model {
namespace {

void set_vector(const Eigen::Vector3d& v, foxglove::Vector3& out) {
  out.set_x(v.x());
  out.set_y(v.y());
  out.set_z(v.z());
}

void set_rotation(const Eigen::Quaterniond& q, foxglove::Quaternion& out) {
  out.set_x(q.x());
  out.set_y(q.y());
  out.set_z(q.z());
  out.set_w(q.w());
}

/// Fills the fields that boxes, balls and cylinders share.
template <class Primitive>
Primitive& fill(Primitive* out, const Eigen::Isometry3d& pose, const Eigen::Vector3d& size,
                const Rgba& color) {
  model::set(pose, *out->mutable_pose());
  set_vector(size, *out->mutable_size());
  model::set(color, *out->mutable_color());
  return *out;
}

Eigen::Isometry3d at(const Eigen::Vector3d& position) {
  return Eigen::Isometry3d(Eigen::Translation3d(position));
}

}  // namespace

google::protobuf::Timestamp to_timestamp(std::chrono::nanoseconds t) {
  google::protobuf::Timestamp out;
  out.set_seconds(t.count() / 1'000'000'000);
  out.set_nanos(static_cast<int>(t.count() % 1'000'000'000));
  return out;
}

void set(const Rgba& color, foxglove::Color& out) {
  out.set_r(color.r);
  out.set_g(color.g);
  out.set_b(color.b);
  out.set_a(color.a);
}

void set(const Eigen::Isometry3d& pose, foxglove::Pose& out) {
  set_vector(pose.translation(), *out.mutable_position());
  set_rotation(Eigen::Quaterniond(pose.linear()), *out.mutable_orientation());
}

foxglove::SceneEntity& add_entity(foxglove::SceneUpdate& update, const std::string& id,
                                  const std::string& frame, std::chrono::nanoseconds stamp) {
  foxglove::SceneEntity& entity = *update.add_entities();
  *entity.mutable_timestamp() = to_timestamp(stamp);
  entity.set_frame_id(frame);
  entity.set_id(id);
  entity.set_frame_locked(true);
  return entity;
}

void add_box(foxglove::SceneEntity& entity, const Eigen::Isometry3d& pose,
             const Eigen::Vector3d& edges, const Rgba& color) {
  fill(entity.add_cubes(), pose, edges, color);
}

void add_ball(foxglove::SceneEntity& entity, const Eigen::Vector3d& center, double radius,
              const Rgba& color) {
  add_ellipsoid(entity, at(center), Eigen::Vector3d::Constant(2.0 * radius), color);
}

void add_ellipsoid(foxglove::SceneEntity& entity, const Eigen::Isometry3d& pose,
                   const Eigen::Vector3d& axes, const Rgba& color) {
  fill(entity.add_spheres(), pose, axes, color);
}

void add_uncertainty(foxglove::SceneEntity& entity, const Eigen::Vector3d& center,
                     const Eigen::Matrix3d& covariance_m2, const Rgba& color) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance_m2);
  Eigen::Isometry3d pose = at(center);
  pose.linear() = axes.eigenvectors();
  if (pose.linear().determinant() < 0.0) pose.linear().col(0) *= -1.0;
  add_ellipsoid(entity, pose, 6.0 * axes.eigenvalues().cwiseMax(0.0).cwiseSqrt(), color);
}

void add_rod(foxglove::SceneEntity& entity, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
             double radius, const Rgba& color) {
  add_taper(entity, from, to, radius, radius, color);
}

void add_taper(foxglove::SceneEntity& entity, const Eigen::Vector3d& from,
               const Eigen::Vector3d& to, double radius_from, double radius_to, const Rgba& color) {
  const double length = (to - from).norm(), radius = std::max(radius_from, radius_to);
  if (length < 1e-9 || !(radius > 0.0)) return;
  Eigen::Isometry3d pose = at(0.5 * (from + to));
  pose.linear() = math::rotation_onto(Eigen::Vector3d::UnitZ(), to - from);
  foxglove::CylinderPrimitive& rod =
      fill(entity.add_cylinders(), pose, {2.0 * radius, 2.0 * radius, length}, color);
  rod.set_bottom_scale(radius_from / radius);
  rod.set_top_scale(radius_to / radius);
}

void add_hull(foxglove::SceneEntity& entity, const math::ConvexPart& hull, const Rgba& color) {
  foxglove::TriangleListPrimitive& list = *entity.add_triangles();
  set(Eigen::Isometry3d::Identity(), *list.mutable_pose());
  set(color, *list.mutable_color());
  for (const auto& triangle : robot::hull_faces(hull)) {
    for (const Eigen::Vector3d& corner : triangle) {
      foxglove::Point3& out = *list.add_points();
      out.set_x(corner.x());
      out.set_y(corner.y());
      out.set_z(corner.z());
    }
  }
}

void add_label(foxglove::SceneEntity& entity, const Eigen::Vector3d& center, double height,
               const std::string& text, const Rgba& color) {
  foxglove::TextPrimitive& label = *entity.add_texts();
  set(at(center), *label.mutable_pose());
  label.set_billboard(true);
  label.set_font_size(height);
  set(color, *label.mutable_color());
  label.set_text(text);
}

foxglove::LinePrimitive& add_line(foxglove::SceneEntity& entity, foxglove::LinePrimitive::Type type,
                                  double thickness_px, const Rgba& color) {
  foxglove::LinePrimitive& line = *entity.add_lines();
  line.set_type(type);
  set(Eigen::Isometry3d::Identity(), *line.mutable_pose());
  line.set_thickness(thickness_px);
  line.set_scale_invariant(true);
  set(color, *line.mutable_color());
  return line;
}

void add_point(foxglove::LinePrimitive& line, const Eigen::Vector3d& point) {
  foxglove::Point3& out = *line.add_points();
  out.set_x(point.x());
  out.set_y(point.y());
  out.set_z(point.z());
}

void add_axes(foxglove::SceneEntity& entity, const Eigen::Isometry3d& pose, double length) {
  for (int axis = 0; axis < 3; ++axis) {
    const Rgba color{axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0, 1.0};
    add_rod(entity, pose.translation(), pose.translation() + length * pose.linear().col(axis),
            0.05 * length, color);
  }
}

void add_frame(foxglove::FrameTransforms& transforms, const std::string& parent,
               const std::string& child, const Eigen::Isometry3d& pose,
               std::chrono::nanoseconds stamp) {
  foxglove::FrameTransform& t = *transforms.add_transforms();
  *t.mutable_timestamp() = to_timestamp(stamp);
  t.set_parent_frame_id(parent);
  t.set_child_frame_id(child);
  set_vector(pose.translation(), *t.mutable_translation());
  set_rotation(Eigen::Quaterniond(pose.linear()), *t.mutable_rotation());
}

namespace {

constexpr Rgba kTable{0.75, 0.72, 0.68, 1.0}, kBar{0.25, 0.35, 0.55, 1.0},
    kArm{0.95, 0.5, 0.1, 0.15}, kObject{0.1, 0.6, 0.3, 1.0}, kGoal{0.9, 0.2, 0.2, 0.4},
    kLink{0.82, 0.84, 0.87, 1.0}, kJoint{0.95, 0.45, 0.1, 1.0}, kHand{0.2, 0.2, 0.22, 1.0};

// The hand of the safety balls' size [models/README.md], as seen from E [m].
constexpr double kAperture = 0.058;  // between the inner faces of the open fingers
constexpr double kFinger = 0.012;    // radius of a finger
constexpr double kTips = 0.026, kPalm = -0.05;
constexpr double kSlim = 0.8;  // width of a link, relative to its safety balls [1]

std::string frame_name(const std::string& prefix, std::size_t i) {
  return prefix + "/" + std::to_string(i);
}

void draw_table(foxglove::SceneEntity& entity, const kin::Table& table) {
  for (const kin::Box& box : table.boxes) {
    add_box(entity, Eigen::Isometry3d(Eigen::Translation3d(box.center)), 2.0 * box.half_extent,
            kTable);
  }
  for (const kin::Hull& hull : table.hulls) add_hull(entity, hull.shape, kTable);
  for (const kin::Ball& ball : table.balls) add_ball(entity, ball.center, ball.radius, kBar);
  for (const kin::GoalPlace& goal : table.goals) {
    add_ball(entity, goal.position, goal.radius, kGoal);
  }
}

/// An upright cylinder.
void draw_object(foxglove::SceneEntity& entity, const kin::Table& table,
                 const Eigen::Vector3d& center) {
  const Eigen::Vector3d half(0.0, 0.0, 0.5 * table.object_height);
  add_rod(entity, center - half, center + half, table.object_radius, kObject);
}

/// Origin of frame i - 1 in frame i, which joint i does not change: −Rᵀ t of its transform.
Eigen::Vector3d joint_before(const kin::DhLink& link) {
  return {-link.a, -link.d * std::sin(link.alpha), -link.d * std::cos(link.alpha)};
}

void draw_hand(foxglove::SceneEntity& entity, double closure) {
  const double half_gap = 0.5 * kAperture * (1.0 - std::clamp(closure, 0.0, 1.0));
  add_box(entity, Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, kPalm)),
          {kAperture + 4.0 * kFinger, 0.06, 0.03}, kHand);
  for (const double side : {-1.0, 1.0}) {
    const double x = side * (half_gap + kFinger);
    add_rod(entity, {x, 0.0, kPalm}, {x, 0.0, kTips - kFinger}, kFinger, kHand);
    add_ball(entity, {x, 0.0, kTips - kFinger}, kFinger, kHand);
  }
}

void draw_part(foxglove::SceneEntity& entity, const kin::SafetyPart& part, const Rgba& color) {
  if (part.shape.points.rows() == 1) {
    add_ball(entity, part.shape.points.row(0), part.shape.radius, color);
  } else {
    add_hull(entity, part.shape, color);
  }
}

}  // namespace

foxglove::SceneUpdate to_entities(const kin::Table& table, const kin::ArmModel& arm,
                                  std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  draw_table(add_entity(update, "table", "world", stamp), table);
  for (std::size_t frame = 0; frame < arm.links.size() + 1; ++frame) {
    const std::string name = frame_name("arm", frame);
    foxglove::SceneEntity& link = add_entity(update, name, name, stamp);
    for (const kin::SafetyPart& part : kin::deciding_parts(arm)) {
      if (part.frame == static_cast<int>(frame))
        draw_part(link, part, arm.parts.empty() ? kArm : kLink);
    }
  }
  draw_object(add_entity(update, "object", "object", stamp), table, Eigen::Vector3d::Zero());
  return update;
}

foxglove::FrameTransforms to_transforms(const kin::ArmModel& arm,
                                        const std::vector<Eigen::Isometry3d>& X,
                                        const Eigen::Isometry3d& X_WO,
                                        const std::vector<kin::GoalPlace>& goals,
                                        std::chrono::nanoseconds stamp) {
  foxglove::FrameTransforms transforms;
  for (std::size_t i = 0; i < X.size(); ++i) {
    add_frame(transforms, "world", frame_name("arm", i), X[i], stamp);
  }
  if (!X.empty()) add_frame(transforms, "world", "tool", X.back() * arm.X_LE, stamp);
  add_frame(transforms, "world", "object", X_WO, stamp);
  for (const kin::GoalPlace& goal : goals) {
    add_frame(transforms, "world", "goal/" + goal.name,
              Eigen::Isometry3d(Eigen::Translation3d(goal.position)), stamp);
  }
  return transforms;
}

foxglove::SceneUpdate to_robot(const kin::ArmModel& arm, double closure,
                               std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  if (!arm.parts.empty()) {
    const std::vector<kin::SafetyPart> parts = kin::deciding_parts(arm);
    for (std::size_t frame = 0; frame < arm.links.size() + 1; ++frame) {
      const std::string name = frame_name("robot", frame);
      foxglove::SceneEntity& entity = add_entity(update, name, name, stamp);
      for (const kin::SafetyPart& part : parts)
        if (part.frame == static_cast<int>(frame)) draw_part(entity, part, kLink);
    }
    return update;
  }
  double radius = 0.05;  // radius of a frame; without balls: that of the frame before
  for (std::size_t frame = 1; frame < arm.links.size() + 1; ++frame) {
    const std::string name = frame_name("robot", frame);
    foxglove::SceneEntity& entity = add_entity(update, name, name, stamp);
    double largest = 0.0;
    for (const kin::SafetyBall& ball : arm.balls) {
      if (ball.frame == static_cast<int>(frame)) largest = std::max(largest, ball.radius);
    }
    if (largest > 0.0) radius = kSlim * largest;
    add_rod(entity, joint_before(arm.links[frame - 1]), Eigen::Vector3d::Zero(), radius, kLink);
    add_ball(entity, Eigen::Vector3d::Zero(), radius, kJoint);
    if (frame == arm.links.size()) {
      add_rod(entity, Eigen::Vector3d::Zero(), arm.X_LE * Eigen::Vector3d(0.0, 0.0, kPalm), radius,
              kLink);
    }
  }
  draw_hand(add_entity(update, "robot/tool", "robot/tool", stamp), closure);
  return update;
}

foxglove::FrameTransforms to_robot_frames(const kin::ArmModel& arm,
                                          const std::vector<Eigen::Isometry3d>& X,
                                          std::chrono::nanoseconds stamp) {
  foxglove::FrameTransforms transforms;
  for (std::size_t i = 0; i < X.size(); ++i) {
    add_frame(transforms, "world", frame_name("robot", i), X[i], stamp);
  }
  add_frame(transforms, "world", "robot/tool", X.back() * arm.X_LE, stamp);
  return transforms;
}

}  // namespace mimesis::model
