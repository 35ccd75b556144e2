#pragma once
#include <Eigen/Geometry>
#include <chrono>
#include <string>
#include <vector>

#include "common/kin/arm.h"
#include "common/kin/table.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"

namespace mimesis::model {

/// Each 0 .. 1 [1].
struct Rgba {
  double r = 0.0, g = 0.0, b = 0.0, a = 1.0;
};

/// The same in messages of foxglove.*.
google::protobuf::Timestamp to_timestamp(std::chrono::nanoseconds t);
void set(const Rgba& color, foxglove::Color& out);
void set(const Eigen::Isometry3d& pose, foxglove::Pose& out);

/// An entity that moves with `frame` and stays until it is replaced by one of the same id.
foxglove::SceneEntity& add_entity(foxglove::SceneUpdate& update, const std::string& id,
                                  const std::string& frame, std::chrono::nanoseconds stamp);

/// All lengths in m, places in the entity's frame.
void add_box(foxglove::SceneEntity& entity, const Eigen::Isometry3d& pose,
             const Eigen::Vector3d& edges, const Rgba& color);
void add_ball(foxglove::SceneEntity& entity, const Eigen::Vector3d& center, double radius,
              const Rgba& color);
/// `axes`: whole lengths along the axes of `pose`.
void add_ellipsoid(foxglove::SceneEntity& entity, const Eigen::Isometry3d& pose,
                   const Eigen::Vector3d& axes, const Rgba& color);
/// Ellipsoid of three standard deviations of a place. `covariance_m2`: symmetric, none below zero.
void add_uncertainty(foxglove::SceneEntity& entity, const Eigen::Vector3d& center,
                     const Eigen::Matrix3d& covariance_m2, const Rgba& color);
/// A cylinder from `from` to `to`; nothing if they are the same place.
void add_rod(foxglove::SceneEntity& entity, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
             double radius, const Rgba& color);
/// The same, tapered.
void add_taper(foxglove::SceneEntity& entity, const Eigen::Vector3d& from,
               const Eigen::Vector3d& to, double radius_from, double radius_to, const Rgba& color);
/// Without its radius.
void add_hull(foxglove::SceneEntity& entity, const math::ConvexPart& hull, const Rgba& color);
/// Text that faces the viewer. `height`: of a line.
void add_label(foxglove::SceneEntity& entity, const Eigen::Vector3d& center, double height,
               const std::string& text, const Rgba& color);
/// Points are added with `add_point`. `thickness_px`: on the screen, independent of the distance.
foxglove::LinePrimitive& add_line(foxglove::SceneEntity& entity, foxglove::LinePrimitive::Type type,
                                  double thickness_px, const Rgba& color);
void add_point(foxglove::LinePrimitive& line, const Eigen::Vector3d& point);
/// Axes x, y, z of a frame in red, green, blue.
void add_axes(foxglove::SceneEntity& entity, const Eigen::Isometry3d& pose, double length);

/// Where frame `child` is in `parent`, at `stamp`.
void add_frame(foxglove::FrameTransforms& transforms, const std::string& parent,
               const std::string& child, const Eigen::Isometry3d& pose,
               std::chrono::nanoseconds stamp);

/// Scene for viewers of logs: the table in frame "world", the arm's parts and balls in "arm/0" ..
/// "arm/n", the object in "object". Entities are locked to their frames, so they are sent once and
/// moved by transforms.
foxglove::SceneUpdate to_entities(const kin::Table& table, const kin::ArmModel& arm,
                                  std::chrono::nanoseconds stamp);

/// Frames "arm/0" .. "arm/n" (`X` of kin::forward, may be empty), "tool" if X is not, "object" and
/// "goal/NAME" in "world".
foxglove::FrameTransforms to_transforms(const kin::ArmModel& arm,
                                        const std::vector<Eigen::Isometry3d>& X,
                                        const Eigen::Isometry3d& X_WO,
                                        const std::vector<kin::GoalPlace>& goals,
                                        std::chrono::nanoseconds stamp);

/// The arm as it looks: the convex parts of its links, with the hand as it is fitted, in frames
/// "robot/0" .. "robot/n". Of an arm without: link i as a rod from joint to joint in frame
/// "robot/i", the hand in frame "robot/tool". Thinner than its safety balls. `closure`: of the
/// hand, 0 open .. 1 closed [1].
foxglove::SceneUpdate to_robot(const kin::ArmModel& arm, double closure,
                               std::chrono::nanoseconds stamp);

/// Frames "robot/0" .. "robot/n" (`X` of kin::forward) and "robot/tool" in "world".
foxglove::FrameTransforms to_robot_frames(const kin::ArmModel& arm,
                                          const std::vector<Eigen::Isometry3d>& X,
                                          std::chrono::nanoseconds stamp);

}  // namespace mimesis::model
