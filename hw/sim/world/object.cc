#include "hw/sim/world/object.h"

#include "common/error.h"
#include "hw/sim/world/text.h"

namespace mimesis::world {
namespace {

double top(const kin::Box& box) { return box.center.z() + box.half_extent.z(); }

/// Horizontal distance of `p` from the box's outline, 0 inside [m].
double beside(const kin::Box& box, const Eigen::Vector3d& p) {
  return ((p - box.center).cwiseAbs() - box.half_extent).head<2>().cwiseMax(0.0).norm();
}

}  // namespace

ObjectModel::ObjectModel(const kin::Table& table, const FallLimits& limits)
    : boxes_(table.boxes), balls_(table.balls), limits_(limits) {
  cylinder_.X_WO.translation() = table.object;
  cylinder_.radius = table.object_radius;
  cylinder_.height = table.object_height;
}

void ObjectModel::grasp(const Eigen::Isometry3d& X_WE) {
  MIMESIS_ASSERT(state_ != ObjectState::held);
  X_EO_ = X_WE.inverse() * cylinder_.X_WO;
  X_EO_.translation().x() = 0.0;
  state_ = ObjectState::held;
  moved_ = was_held_ = true;
  carry(X_WE);
}

void ObjectModel::carry(const Eigen::Isometry3d& X_WE) {
  MIMESIS_ASSERT(state_ == ObjectState::held);
  cylinder_.X_WO = X_WE * X_EO_;
}

void ObjectModel::release() {
  MIMESIS_ASSERT(state_ == ObjectState::held);
  state_ = ObjectState::falling;
  velocity_ = 0.0;
  plan_landing();
}

void ObjectModel::plan_landing() {
  const Eigen::Vector3d p = cylinder_.X_WO.translation();
  const double bottom = lowest_point(cylinder_);
  const double reachable = bottom + limits_.sink_tolerance;
  landing_z_ = limits_.floor_z;
  std::string support = "floor";
  for (const kin::Box& box : boxes_) {
    if (beside(box, p) == 0.0 && top(box) <= reachable && top(box) > landing_z_) {
      landing_z_ = top(box);
      support = box.name;
    }
  }

  will_topple_.clear();
  const double fall = bottom - landing_z_;
  const double lean = tilt(cylinder_);
  if (fall > limits_.max_drop)
    will_topple_ = "dropped from " + millimetres(fall) + " onto " + support;
  if (lean > std::atan2(cylinder_.radius, cylinder_.height / 2)) {
    will_topple_ =
        "released leaning by " + std::to_string(std::lround(lean * 180.0 / M_PI)) + " degrees";
  }
  for (const kin::Box& box : boxes_) {
    if (beside(box, p) > 0.0 && beside(box, p) < cylinder_.radius && top(box) <= reachable &&
        top(box) > landing_z_) {
      will_topple_ = "released across the edge of " + box.name;
    }
  }
  for (const kin::Ball& ball : balls_) {
    const double aside = (ball.center - p).head<2>().norm();
    if (aside < ball.radius + cylinder_.radius && ball.center.z() < bottom &&
        ball.center.z() + ball.radius > landing_z_) {
      will_topple_ = "released above the bridge";
    }
  }
}

void ObjectModel::step(double dt) {
  if (state_ != ObjectState::falling) return;
  double& z = cylinder_.X_WO.translation().z();
  z -= velocity_ * dt + 0.5 * limits_.gravity * dt * dt;
  velocity_ += limits_.gravity * dt;
  if (lowest_point(cylinder_) <= landing_z_) land();
}

void ObjectModel::land() {
  state_ = ObjectState::resting;
  velocity_ = 0.0;
  upright_ = will_topple_.empty();
  Eigen::Isometry3d& X_WO = cylinder_.X_WO;
  if (upright_) {
    X_WO.linear() = Eigen::Matrix3d::Identity();
    X_WO.translation().z() = landing_z_ + cylinder_.height / 2;
  } else {
    mishap_ = will_topple_;
    X_WO.linear() = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()).toRotationMatrix();
    X_WO.translation().z() = landing_z_ + cylinder_.radius;
  }
}

void ObjectModel::knock_over(const std::string& by) {
  MIMESIS_ASSERT(state_ != ObjectState::held);
  moved_ = true;
  plan_landing();
  will_topple_ = "knocked over by " + by;
  land();
}

}  // namespace mimesis::world
