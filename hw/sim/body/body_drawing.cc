#include "hw/sim/body/body_drawing.h"

#include <algorithm>

#include "common/model/drawing.h"

namespace mimesis::hw::sim {
namespace {

using Eigen::Vector3d;
using model::Rgba;

constexpr Rgba kTrunk{0.62, 0.65, 0.69, 1.0}, kLeft{0.25, 0.49, 0.75, 1.0},
    kRight{0.84, 0.41, 0.26, 1.0}, kSole{0.24, 0.25, 0.27, 1.0}, kWood{0.77, 0.64, 0.49, 1.0},
    kFront{0.87, 0.75, 0.59, 1.0}, kHandle{0.28, 0.28, 0.3, 1.0}, kObject{0.77, 0.24, 0.35, 1.0},
    kForce{0.95, 0.75, 0.2, 1.0}, kCom{0.95, 0.95, 0.95, 1.0}, kZmp{0.9, 0.15, 0.3, 1.0};

Rgba colour_of(const robot::LinkShape& shape) {
  if (shape.sole) return kSole;
  return shape.part == robot::BodyPart::left    ? kLeft
         : shape.part == robot::BodyPart::right ? kRight
                                                : kTrunk;
}

Eigen::Isometry3d at(const Vector3d& p) { return Eigen::Isometry3d(Eigen::Translation3d(p)); }

}  // namespace

BodyDrawing::BodyDrawing(const robot::Biped& biped, const std::string& urdf_file,
                         const std::optional<DrawerSettings>& drawer)
    : biped_(biped),
      kinematics_(biped_.tree),
      shapes_(robot::link_shapes(biped, urdf_file)),
      drawn_{0},
      drawer_(drawer) {
  for (const robot::LinkShape& shape : shapes_) {
    if (std::ranges::find(drawn_, shape.link) == drawn_.end()) drawn_.push_back(shape.link);
  }
}

foxglove::SceneUpdate BodyDrawing::shapes(std::chrono::nanoseconds now) const {
  foxglove::SceneUpdate update;
  for (const int link : drawn_) {
    const std::string& frame = biped_.tree.link(link).name;
    foxglove::SceneEntity& entity = model::add_entity(update, frame, frame, now);
    for (const robot::LinkShape& shape : shapes_) {
      if (shape.link != link) continue;
      const Vector3d middle = shape.X_LP.translation();
      const Vector3d half = 0.5 * shape.length_m * shape.X_LP.linear().col(2);
      if (shape.radius_m == 0.0) {
        model::add_box(entity, shape.X_LP, shape.edges_m, colour_of(shape));
      } else if (shape.length_m == 0.0) {
        model::add_ball(entity, middle, shape.radius_m, colour_of(shape));
      } else {
        model::add_rod(entity, middle - half, middle + half, shape.radius_m, colour_of(shape));
      }
    }
  }
  if (!drawer_) return update;
  foxglove::SceneEntity& cabinet = model::add_entity(update, "cabinet", "cabinet", now);
  foxglove::SceneEntity& drawer = model::add_entity(update, "drawer", "drawer", now);
  for (const Board& board : boards(*drawer_)) {
    model::add_box(board.moves ? drawer : cabinet, at(0.5 * (board.low_m + board.high_m)),
                   board.high_m - board.low_m,
                   board.handle  ? kHandle
                   : board.moves ? kFront
                                 : kWood);
  }
  model::add_ball(model::add_entity(update, "drawer_object", "drawer_object", now),
                  Vector3d::Zero(), 0.035, kObject);
  return update;
}

foxglove::FrameTransforms BodyDrawing::frames(const BodyTruth& truth, const Eigen::VectorXd& q,
                                              const DrawerNow* drawer,
                                              std::chrono::nanoseconds now) {
  foxglove::FrameTransforms frames;
  kinematics_.update(truth.X_WB, q);
  for (const int link : drawn_)
    model::add_frame(frames, "world", biped_.tree.link(link).name, kinematics_.X_WL(link), now);
  if (drawer != nullptr && drawer_) {
    Eigen::Isometry3d X_WD = at(drawer->front_W_m);
    X_WD.linear() = Eigen::AngleAxisd(drawer_->yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
    model::add_frame(frames, "world", "cabinet", X_WD, now);
    X_WD.translation() -= drawer->opened_m * X_WD.linear().col(0);
    model::add_frame(frames, "world", "drawer", X_WD, now);
    model::add_frame(frames, "world", "drawer_object", at(drawer->object_W_m), now);
  }
  for (foxglove::FrameTransform& frame : *frames.mutable_transforms())
    frame.clear_timestamp();  // logs have it on the message alone
  return frames;
}

foxglove::SceneUpdate BodyDrawing::forces(const BodyTruth& truth, std::chrono::nanoseconds now) {
  constexpr double kLength_m_n = 1e-3, kLeast_n = 5.0, kThick_m = 0.012;
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "forces", "world", now);
  for (const robot::Side side : robot::kSides) {
    if (truth.normal_n[side] < kLeast_n) continue;
    const Vector3d foot = truth.X_WS[side].translation();
    model::add_rod(entity, foot, foot + kLength_m_n * truth.normal_n[side] * Vector3d::UnitZ(),
                   kThick_m, kForce);
  }
  model::add_ball(entity, truth.com_W_m, 0.04, kCom);
  const Vector3d below(truth.com_W_m.x(), truth.com_W_m.y(), 0.0);
  model::add_rod(entity, below, truth.com_W_m, 0.004, kCom);
  model::add_ball(entity, {truth.zmp_W_m.x(), truth.zmp_W_m.y(), 0.0}, 0.03, kZmp);
  return update;
}

}  // namespace mimesis::hw::sim
