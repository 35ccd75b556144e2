#include "common/model/drawing.h"

#include <Eigen/Eigenvalues>

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
  const double length = (to - from).norm();
  if (length < 1e-9) return;
  Eigen::Isometry3d pose = at(0.5 * (from + to));
  pose.linear() = math::rotation_onto(Eigen::Vector3d::UnitZ(), to - from);
  foxglove::CylinderPrimitive& rod =
      fill(entity.add_cylinders(), pose, {2.0 * radius, 2.0 * radius, length}, color);
  rod.set_bottom_scale(1.0);
  rod.set_top_scale(1.0);
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

}  // namespace mimesis::model
