#pragma once
#include <google/protobuf/message.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/image/rig.h"
#include "common/model/drawing.h"
#include "common/model/files.h"
#include "common/model/viewer.h"
#include "proto/cognition.pb.h"
#include "proto/foxglove/image.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"
#include "proto/planner.pb.h"
#include "proto/scene.pb.h"

namespace mimesis::tool {

/// Takes a message for a topic of the log that is being written, stamped with the time it shows.
using Draw = std::function<void(const std::string& topic, const google::protobuf::Message& message,
                                std::chrono::nanoseconds stamp)>;

/// The camera's calibration in frame "camera".
inline foxglove::CameraCalibration to_calibration(const image::View& view,
                                                  std::chrono::nanoseconds stamp) {
  const double cx = 0.5 * (view.width_px - 1), cy = 0.5 * (view.height_px - 1);
  const double f = view.focal_px;
  foxglove::CameraCalibration out;
  *out.mutable_timestamp() = model::to_timestamp(stamp);
  out.set_frame_id("camera");
  out.set_width(static_cast<std::uint32_t>(view.width_px));
  out.set_height(static_cast<std::uint32_t>(view.height_px));
  out.set_distortion_model("plumb_bob");
  for (int i = 0; i < 5; ++i) out.add_d(0.0);
  for (const double k : {f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0}) out.add_k(k);
  for (const double r : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) out.add_r(r);
  for (const double p : {f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0}) out.add_p(p);
  return out;
}

/// The teacher's table T as frame "teacher" in "world", the camera as "camera" in "teacher". The
/// place of the teacher's table is not measured: it is shown 2.6 m in front of the robot, facing
/// it.
inline foxglove::FrameTransforms to_camera_frames(const image::View& view,
                                                  std::chrono::nanoseconds stamp) {
  constexpr double kTeacher = 2.6;  // x of T in W [m]
  Eigen::Isometry3d X_WT(Eigen::Translation3d(kTeacher, 0.0, 0.0));
  X_WT.linear() << 0.0, 0.0, -1.0,  // x_T = −y_W, y_T = z_W, z_T = −x_W
      -1.0, 0.0, 0.0,               //
      0.0, 1.0, 0.0;
  const image::Camera camera(view);
  Eigen::Isometry3d X_TC(Eigen::Translation3d(camera.eye()));
  X_TC.linear() = camera.R_CT().transpose();
  foxglove::FrameTransforms frames;
  model::add_frame(frames, "world", "teacher", X_WT, stamp);
  model::add_frame(frames, "teacher", "camera", X_TC, stamp);
  return frames;
}

namespace color {
constexpr model::Rgba kRest{0.25, 0.45, 0.9, 1.0}, kZero{0.55, 0.55, 0.55, 1.0},
    kActive{1.0, 0.55, 0.1, 1.0}, kText{0.95, 0.95, 0.95, 1.0}, kBack{0.1, 0.11, 0.13, 1.0};
}  // namespace color

/// Colour of a point of activity u: blue at rest, grey at 0, orange when active.
inline model::Rgba activity_color(double u) {
  const model::Rgba &from = color::kZero, &to = u < 0.0 ? color::kRest : color::kActive;
  const double share = std::abs(std::tanh(0.5 * u));
  return {std::lerp(from.r, to.r, share), std::lerp(from.g, to.g, share),
          std::lerp(from.b, to.b, share), 1.0};
}

/// Activity u(x) of all fields as curves on a board that stands left of the robot's table, in the
/// plane y = 1.25 m of W: x along the board, the first field on top, a grey line at u = 0. One
/// entity, replaced by every message.
inline foxglove::SceneUpdate to_board(const v1::FieldActivity& fields) {
  constexpr double kLeft = -0.2, kWidth = 1.2;    // place of the curves along x of W [m]
  constexpr double kPlane = 1.25, kBoard = 1.26;  // y of the curves and of the board behind [m]
  constexpr double kBottom = 0.15, kRow = 0.17;   // z of the lower edge, height of a field [m]
  constexpr double kMargin = 0.25;                // left of the curves, for their names [m]
  // In recorded runs fields rest at -3 and rise to 16: the line u = 0 is low in the row.
  constexpr double kZeroLine = 0.04, kScale = 0.0075;  // [m], of one unit of activity [m]
  constexpr double kSmallest = -4.0, kLargest = 16.0;  // activity that stays within the row [1]
  constexpr auto kStrip = foxglove::LinePrimitive::LINE_STRIP;
  foxglove::SceneUpdate update;
  const std::chrono::nanoseconds stamp(fields.header().stamp_ns());
  foxglove::SceneEntity& entity = model::add_entity(update, "fields", "world", stamp);
  const double height = kRow * fields.fields_size();
  const Eigen::Vector3d middle(kLeft + 0.5 * (kWidth - kMargin), kBoard, kBottom + 0.5 * height);
  model::add_box(entity, Eigen::Isometry3d(Eigen::Translation3d(middle)),
                 {kWidth + kMargin + 0.1, 0.01, height}, color::kBack);
  for (int row = 0; row < fields.fields_size(); ++row) {
    const v1::Field& field = fields.fields(row);
    const double z_zero = kBottom + height - (row + 1) * kRow + kZeroLine;
    auto& zero = model::add_line(entity, kStrip, 1.0, color::kZero);
    model::add_point(zero, {kLeft, kPlane, z_zero});
    model::add_point(zero, {kLeft + kWidth, kPlane, z_zero});
    auto& curve = model::add_line(entity, kStrip, 3.0, color::kZero);
    const double step = kWidth / std::max(1, field.u_size() - 1);
    for (int i = 0; i < field.u_size(); ++i) {
      const double u = std::isfinite(field.u(i)) ? field.u(i) : 0.0;
      const double shown = std::clamp(u, kSmallest, kLargest);
      model::add_point(curve, {kLeft + i * step, kPlane, z_zero + kScale * shown});
      model::set(activity_color(u), *curve.add_colors());
    }
    model::add_label(entity, {kLeft - 0.5 * kMargin, kPlane, z_zero + 0.04}, 0.06, field.name(),
                     color::kText);
  }
  return update;
}

inline bool finite(const Eigen::Vector3d& p, double size) {
  return p.allFinite() && std::isfinite(size);
}

inline bool finite(const kin::Table& table) {
  bool all = finite(table.bridge_center, table.bridge_height + table.bridge_half_width) &&
             finite(table.object, table.object_height + table.object_radius);
  for (const auto& ball : table.balls) all &= finite(ball.center, ball.radius);
  for (const auto& box : table.boxes) all &= finite(box.center, box.half_extent.sum());
  for (const auto& goal : table.goals) all &= finite(goal.position, goal.radius);
  return all;
}

/// Draws the planner's knowledge on view/roadmap: its roadmap when the scene is first seen, and for
/// every plan that finds a scene or a decision changed.
class RoadmapView {
 public:
  /// Makes the drawing for a scene, and the decision and stamp of a status.
  using Make =
      std::function<foxglove::SceneUpdate(const v1::Scene& scene, const v1::TaskStatus& status)>;
  explicit RoadmapView(Make make) : make_(std::move(make)) {}

  /// False: a place of the scene is not finite.
  bool see(const v1::Scene& scene, const Draw& draw) {
    if (!finite(model::from_proto(scene))) return false;
    const bool first = !scene_;
    scene_ = scene;
    if (first) draw_roadmap(scene.header().stamp_ns(), draw);
    return true;
  }
  bool see(const v1::TaskStatus& status, const Draw& draw) {
    if (status.state() != v1::TASK_STATE_PLANNING) return true;
    decided_ = status.transport();
    draw_roadmap(status.header().stamp_ns(), draw);
    return true;
  }

 private:
  void draw_roadmap(std::uint64_t stamp_ns, const Draw& draw) {
    if (!scene_) return;
    v1::Scene without_time = *scene_;
    without_time.clear_header();
    const std::pair known(without_time.SerializeAsString(), decided_);
    if (known == shown_) return;
    shown_ = known;
    v1::TaskStatus status;
    status.mutable_header()->set_stamp_ns(stamp_ns);
    status.set_transport(decided_);
    draw("view/roadmap", make_(*scene_, status), std::chrono::nanoseconds(stamp_ns));
  }

  Make make_;
  std::optional<v1::Scene> scene_;  ///< the last one
  v1::Transport decided_ = v1::TRANSPORT_UNSPECIFIED;
  std::pair<std::string, v1::Transport> shown_;  ///< scene without its header, decision
};

}  // namespace mimesis::tool
