#include "nodes/synthesizer/robot/drawer_tracker.h"

#include <algorithm>
#include <cmath>

namespace mimesis::synthesizer {
namespace {

using Eigen::Vector3d;

double square(double x) { return x * x; }

// A mean of the last sightings that stands off so far says that the place drifts faster than
// assumed. The mean has a third of one sighting's deviation; 1.4 of those in space are 3 of it.
constexpr double kMeanShare = 0.2, kMeanOff = 1.4;

}  // namespace

void TrackedPlace::step(double drift_m) {
  age_s_ += dt_s_;
  variance_ += dt_s_ * square(drift_m);
  left_W_m_ *= std::exp(-dt_s_ / settings_.smooth_s);
}

void TrackedPlace::put(const Vector3d& p_W_m, double variance) {
  p_W_m_ = p_W_m;
  variance_ = variance;
  left_W_m_.setZero();
  off_W_m_.setZero();
  elsewhere_ = 0;
  known_ = true;
}

void TrackedPlace::shift(const Vector3d& by_W_m, double deviation_m) {
  p_W_m_ += by_W_m;
  variance_ += square(deviation_m);
  elsewhere_ = 0;
}

double TrackedPlace::deviation_m() const { return std::sqrt(variance_); }

std::optional<Vector3d> TrackedPlace::see(const Vector3d& p_W_m) {
  age_s_ = 0.0;
  const double noise = square(settings_.seen_m);
  if (!known_) {
    put(p_W_m, noise);
    return std::nullopt;
  }
  const Vector3d off = p_W_m - p_W_m_;
  if (off.norm() > settings_.gate * std::sqrt(variance_ + noise)) {
    if (elsewhere_ > 0 && (p_W_m - other_W_m_).norm() > settings_.gate * std::sqrt(2.0 * noise)) {
      elsewhere_ = 0;
    }
    if (elsewhere_ == 0) other_W_m_.setZero();
    ++elsewhere_;
    other_W_m_ += (p_W_m - other_W_m_) / elsewhere_;
    if (elsewhere_ < settings_.elsewhere) return std::nullopt;
    const Vector3d moved = other_W_m_ - p_W_m_;
    put(other_W_m_, noise / elsewhere_);
    return moved;
  }
  elsewhere_ = 0;
  off_W_m_ += kMeanShare * (off - off_W_m_);
  if (off_W_m_.norm() > kMeanOff * settings_.seen_m) variance_ = std::max(variance_, noise);
  const double gain = variance_ / (variance_ + noise);
  p_W_m_ += gain * off;
  left_W_m_ += gain * off;
  variance_ *= 1.0 - gain;
  return std::nullopt;
}

DrawerTracker::DrawerTracker(double handle_left_m, double dt_s, const TrackerSettings& settings)
    : handle_left_m_(handle_left_m),
      dt_s_(dt_s),
      settings_(settings),
      handle_(settings, dt_s),
      object_(settings, dt_s) {}

/// The image shows where things were from where the head was.
void DrawerTracker::see(const DrawerSenses::Sight& sight, const Vector3d& way) {
  const double ago = std::max(0.0, std::round(sight.age_s / dt_s_) - settings_.late_ticks);
  if (!(ago < static_cast<double>(std::min<std::uint64_t>(steps_, kPast)))) return;
  const Eigen::Isometry3d& X_WH = X_WH_[(steps_ - 1 - static_cast<std::uint64_t>(ago)) % kPast];
  const auto look = [&](TrackedPlace& place, TrackedPlace& other, const Vector3d& p_H_m) {
    const Vector3d closes = -seen_.opened_m * way;
    const auto moved = place.see(X_WH * p_H_m - closes);
    if (!moved || seen_.held) return;
    place.shift(closes, 0.0);
    // A drawer moves both, a wrong estimate moves one. What is seen of the other decides, and must
    // not shift this one back.
    other.shift(*moved + closes, moved->norm());
    seen_.opened_m = 0.0;
  };
  if (sight.handle_H_m && !seen_.held) look(handle_, object_, *sight.handle_H_m);
  if (sight.object_H_m && !seen_.taken) look(object_, handle_, *sight.object_H_m);
}

void DrawerTracker::move_with_hand(const RobotFeedback& robot, const DrawerSenses& senses,
                                   const Vector3d& way) {
  if (robot.hands_known && senses.holds[mocap::kLeft]) {
    const double hand_m = way.dot(robot.hand_W_m[mocap::kLeft]);
    if (!seen_.held) gripped_m_ = hand_m + seen_.opened_m;
    seen_.opened_m = std::max(0.0, gripped_m_ - hand_m);
  }
  seen_.held = senses.holds[mocap::kLeft];
  seen_.taken = senses.holds[mocap::kRight];
}

const DrawerSeen* DrawerTracker::step(const RobotFeedback* robot, double heading_rad,
                                      const DrawerSenses& senses) {
  if (robot == nullptr || !robot->X_WH) {
    steps_ = 0;  // what the head did meanwhile is not known
    return nullptr;
  }
  X_WH_[steps_ % kPast] = *robot->X_WH;
  ++steps_;
  const Vector3d way(std::cos(heading_rad), std::sin(heading_rad), 0.0);
  const double drift_m = robot->moves() ? settings_.walking_m : settings_.standing_m;
  handle_.step(drift_m);
  // a drawer that is pulled need not run along the way: its object drifts aside
  object_.step(seen_.held ? settings_.walking_m : drift_m);
  move_with_hand(*robot, senses, way);
  if (senses.sight) see(*senses.sight, way);
  if (!handle_.known() || !object_.known()) return nullptr;

  const Eigen::Vector2d left(-way.y(), way.x());
  seen_.front_W_m = handle_.p_W_m().head<2>() - handle_left_m_ * left;
  seen_.handle_W_m = handle_.p_W_m() - seen_.opened_m * way;
  seen_.object_W_m = seen_.taken && robot->hands_known ? robot->hand_W_m[mocap::kRight]
                                                       : object_.p_W_m() - seen_.opened_m * way;
  seen_.age_s = {handle_.age_s(), object_.age_s()};
  return &seen_;
}

}  // namespace mimesis::synthesizer
