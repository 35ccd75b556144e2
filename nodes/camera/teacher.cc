#include "nodes/camera/teacher.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mimesis::camera {
namespace {

constexpr double kHeadroomPrecision = 0.185;  // fist and fingers above the carried object [m]
constexpr double kHeadroomFull = 0.135;

using Eigen::Vector2d;
using Eigen::Vector3d;

// Phases of a demonstration, fractions of its duration.
constexpr double kReached = 0.16, kApproach = 0.12, kTouched = 0.25, kClosed = 0.30;
constexpr double kPlaced = 0.68, kReleased = 0.74, kBackedOff = 0.82;

// Grasp point in the frame of the hand (along the fingers, along the palm normal) [m].
constexpr double kPrecisionAhead = 0.074, kPrecisionBelow = 0.069;
constexpr double kFullAhead = 0.078;
constexpr double kForearm = 0.42, kElbowRadius = 0.055;

/// Minimum-jerk profile: 10 s³ - 15 s⁴ + 6 s⁵ on [0, 1], constant outside.
double minimum_jerk(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
}

double ramp(double x, double from, double to) { return minimum_jerk((x - from) / (to - from)); }

}  // namespace

void check_passable(const Demonstration& shown, const TeacherTable& table) {
  if (table.bar_removed || shown.transport == Transport::above) return;
  const double needed = shown.grip == Grip::precision ? kHeadroomPrecision : kHeadroomFull;
  if (table.bar_height_m >= needed) return;
  throw ConfigError(fmt::format(
      "bar_height_m: {:g} is too low for a hand in {} grip below the bar, at least {:g}",
      table.bar_height_m, task::word(shown.grip), needed));
}

TeacherMotion::TeacherMotion(const TeacherScript& script, const TeacherTable& table)
    : script_(script), table_(table) {
  check_passable(script.demonstration, table);
  const double half = 0.5 * table.object_height_m;
  const bool high = script.demonstration.goal == Goal::high;
  home_ = {-0.85, 0.22};
  start_ = {table.object_x_m, half};
  goal_ = high ? Vector2d(table.goal_high_x_m, table.goal_high_y_m + half)
               : Vector2d(table.goal_low_x_m, table.goal_low_y_m + half);
  const bool precision = script.demonstration.grip == Grip::precision;
  add(start_ + (precision ? Vector2d(0.0, 0.11) : Vector2d(-0.13, 0.01)), 0.0, kReached);
  add(start_, kApproach, kTouched);
  if (script.only_grasp) return;
  plan_transport();
  plan_withdrawal();
}

void TeacherMotion::add(const Vector2d& to, double begin, double end) {
  strokes_.push_back({strokes_.empty() ? home_ : strokes_.back().to, to, begin, end});
}

void TeacherMotion::add_chain(const std::vector<Vector2d>& points, double begin, double end) {
  constexpr double kOverlap = 0.4;  // share of a stroke's duration
  const double n = static_cast<double>(points.size());
  const double length = (end - begin) / (n - kOverlap * (n - 1.0));
  for (const Vector2d& p : points) {
    add(p, begin, begin + length);
    begin += (1.0 - kOverlap) * length;
  }
}

void TeacherMotion::plan_transport() {
  const double half = 0.5 * table_.object_height_m;
  if (script_.demonstration.transport == Transport::above) {
    const double y = table_.bar_height_m + table_.bar_thickness_m + half + 0.035;
    add_chain({{start_.x(), y}, {goal_.x(), y}, goal_}, kClosed, kPlaced);
  } else {
    const double y = start_.y() + 0.012;
    const double over = script_.demonstration.goal == Goal::high ? 0.045 : 0.02;
    add_chain({{start_.x(), y}, {0.09, y}, {goal_.x() - 0.01, goal_.y() + over}, goal_}, kClosed,
              kPlaced);
  }
}

void TeacherMotion::plan_withdrawal() {
  const bool precision = script_.demonstration.grip == Grip::precision;
  const bool above = script_.demonstration.transport == Transport::above;
  const double up = above ? 0.10 : 0.045;  // below the bar there is little room
  add(goal_ + (precision ? Vector2d(0.0, up) : Vector2d(-0.09, 0.01)), kReleased, kBackedOff);
  const double back = kBackedOff - 0.03;
  if (above) {
    const double y = table_.bar_height_m + table_.bar_thickness_m + 0.08;
    add_chain({{strokes_.back().to.x(), y}, {-0.25, y}, home_}, back, 1.0);
  } else {
    const double y = start_.y() + 0.012;
    add_chain({{0.10, y}, {-0.25, y}, home_}, back, 1.0);
  }
}

Vector2d TeacherMotion::grasp_point(double phase) const {
  Vector2d p = home_;
  for (const Stroke& s : strokes_) p += (s.to - s.from) * ramp(phase, s.begin, s.end);
  return p;
}

/// The elbow is raised over the bar, or lowered below it, once the wrist is behind it.
double TeacherMotion::forearm_elevation(const Vector2d& wrist) const {
  const double nominal = script_.demonstration.grip == Grip::precision ? 0.50 : 0.12;
  const bool above = script_.demonstration.transport == Transport::above;
  const double edge =
      above ? table_.bar_height_m + table_.bar_thickness_m + 0.06 : table_.bar_height_m - 0.055;
  const double needed = std::atan2(edge - wrist.y(), std::max(wrist.x(), 0.10));
  const double behind = above ? ramp(wrist.x(), -0.10, 0.10) : ramp(wrist.x(), -0.12, 0.02);
  const double wanted = above ? std::max(nominal, needed) : std::min(nominal, needed);
  const double lowest = std::asin(std::min(0.0, (kElbowRadius - wrist.y()) / kForearm));
  return std::max(nominal + behind * (wanted - nominal),
                  lowest);  // the elbow stays above the table
}

TeacherPose TeacherMotion::pose(double t_s) const {
  const double period = script_.duration_s + script_.pause_s;
  const double since = std::max(0.0, t_s - script_.start_s);
  const double turn = std::min(std::floor(since / period), static_cast<double>(script_.repeat - 1));
  const double phase = std::min((since - turn * period) / script_.duration_s, 1.0);

  const Vector2d grasp = grasp_point(phase);
  const bool moved = !script_.only_grasp;
  TeacherPose pose;
  pose.held = phase >= kTouched && (!moved || phase < kReleased);
  const Vector2d object = phase < kClosed || !moved ? start_ : phase < kReleased ? grasp : goal_;
  pose.object = {object.x(), object.y(), 0.0};
  pose.closure = ramp(phase, kTouched - 0.03, kClosed);
  if (moved) pose.closure *= 1.0 - ramp(phase, kPlaced, kReleased);
  pose.scale = script_.hand_scale;
  Vector3d touched(grasp.x(), grasp.y(), 0.0), wrist;  // where the hand holds; the wrist from there
  if (script_.demonstration.grip == Grip::precision) {
    touched.y() += 0.5 * table_.object_height_m;
    wrist = {-pose.scale * kPrecisionAhead, pose.scale * kPrecisionBelow, 0.0};
    pose.palm_normal = -Vector3d::UnitY();
  } else {
    wrist = {-pose.scale * kFullAhead, 0.0, -(table_.object_radius_m + 0.015 * pose.scale)};
    pose.palm_normal = Vector3d::UnitZ();
  }
  const Eigen::AngleAxisd tilt(script_.tilt_rad, Vector3d::UnitX());
  pose.palm_normal = tilt * pose.palm_normal;
  pose.wrist = touched + tilt * wrist;
  pose.palm = pose.wrist + 0.075 * pose.scale * pose.fingers + 0.02 * pose.scale * pose.palm_normal;
  const double elevation = forearm_elevation(pose.wrist.head<2>());
  pose.elbow = pose.wrist + kForearm * Vector3d(-std::cos(elevation), std::sin(elevation), 0.0);
  return pose;
}

double TeacherMotion::end_s() const {
  return script_.start_s + script_.repeat * (script_.duration_s + script_.pause_s) -
         script_.pause_s;
}

}  // namespace mimesis::camera
