#include "common/motion/retarget/to_body.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/motion/retarget/foot_paths.h"
#include "common/motion/retarget/leg_ik.h"

namespace mimesis::retarget {
namespace {

using Eigen::Index, Eigen::Matrix3d, Eigen::Vector3d;
using mocap::Body, mocap::BodyClip, mocap::BodyPose;

constexpr double kStraightest = 0.9995;  // of a leg's length: straight legs cannot be controlled
constexpr double kEase_s = 0.1;          // the pelvis begins to come down so long before it must

std::size_t at(int joint) { return static_cast<std::size_t>(joint); }
int hip(std::size_t side) { return side == 0 ? mocap::kLeftHip : mocap::kRightHip; }
int wrist(std::size_t side) { return side == 0 ? mocap::kLeftWrist : mocap::kRightWrist; }

TwoSegments leg(const Body& body, std::size_t side) {
  return {body.offset_m[at(hip(side) + 1)], body.offset_m[at(hip(side) + 2)]};
}

/// From hip to ankle with the knee, a hinge about y, stretched.
double longest(const TwoSegments& l) {
  const double across = l.upper_m.y() + l.lower_m.y();
  return std::hypot(
      std::hypot(l.upper_m.x(), l.upper_m.z()) + std::hypot(l.lower_m.x(), l.lower_m.z()), across);
}

/// From the hip to the sole, stretched.
double leg_length(const Body& body) {
  return leg(body, 0).upper_m.norm() + leg(body, 0).lower_m.norm() +
         std::max(0.0, -std::min(body.heel_m[0].z(), body.toe_m[0].z()));
}

void check(const BodyClip& recorded, const Body& to) {
  if (recorded.frames() == 0 || recorded.root_position_W_m.cols() != recorded.frames() ||
      recorded.angles_rad.rows() != mocap::kBodyRows || !(recorded.rate_hz > 0.0)) {
    throw ConfigError("retarget: clip '" + recorded.name +
                      "' has no frames or rate, expected one at least of 51 angles");
  }
  if (!recorded.angles_rad.allFinite() || !recorded.root_position_W_m.allFinite()) {
    throw ConfigError("retarget: clip '" + recorded.name + "' is not finite");
  }
  for (const Body* body : {&recorded.body, &to}) {
    for (const std::size_t side : {0u, 1u}) {
      const TwoSegments l = leg(*body, side);
      if (!(l.upper_m.norm() > 1e-3) || !(l.lower_m.norm() > 1e-3)) {
        throw ConfigError("retarget: body '" + body->name +
                          "' has no legs, expected thighs and shanks longer than 1 mm");
      }
    }
  }
}

/// Puts the middle between the hips, which bodies have in common, where the recorded one is,
/// scaled; what is called the root may be anywhere in the pelvis.
void place_root(const BodyClip& recorded, const Ground& ground, double scale, BodyClip& clip) {
  const auto middle = [](const Body& b) {
    return Vector3d(0.5 * (b.offset_m[mocap::kLeftHip] + b.offset_m[mocap::kRightHip]));
  };
  const Vector3d was = middle(recorded.body), is = middle(clip.body);
  for (Index t = 0; t < clip.frames(); ++t) {
    const Matrix3d R = math::exp_so3(recorded.angles_rad.block<3, 1>(0, t));
    Vector3d hips = recorded.root_position_W_m.col(t) + R * was;
    hips.z() -= ground.below(hips);
    clip.root_position_W_m.col(t) = scale * hips - R * is;
  }
}

/// How far the pelvis must come down in every frame so that both legs reach, eased in and out.
Eigen::VectorXd lowering(const BodyClip& clip, const FootPaths& feet) {
  Eigen::VectorXd need = Eigen::VectorXd::Zero(clip.frames());
  for (Index t = 0; t < clip.frames(); ++t) {
    const BodyPose pose = clip.pose(t);
    for (const std::size_t side : {0u, 1u}) {
      const TwoSegments l = leg(clip.body, side);
      const double length = kStraightest * longest(l);
      const Vector3d d = pose.p_WJ[at(hip(side))] - feet.ankle_W_m[side].col(t);
      const double height = std::sqrt(std::max(0.0, length * length - d.head<2>().squaredNorm()));
      need[t] = std::max(need[t], d.z() - height);
    }
  }
  const auto reach = static_cast<Index>(std::ceil(kEase_s * clip.rate_hz));
  const auto window = [&](Index t) {
    const Index first = std::max<Index>(0, t - reach);
    return std::pair(first, std::min(need.size() - 1, t + reach) - first + 1);
  };
  Eigen::VectorXd most(need.size()), eased(need.size());
  for (Index t = 0; t < need.size(); ++t) {
    const auto [first, count] = window(t);
    most[t] = need.segment(first, count).maxCoeff();
  }
  for (Index t = 0; t < need.size(); ++t) {
    const auto [first, count] = window(t);
    eased[t] = most.segment(first, count).mean();  // at least need: every term covers t
  }
  return eased;
}

void set_rotation(BodyClip& clip, int joint, Index t, const Matrix3d& R_PJ) {
  auto angles = clip.angles_rad.block<3, 1>(3 * joint, t);
  const Vector3d before = t > 0 ? Vector3d(clip.angles_rad.block<3, 1>(3 * joint, t - 1)) : angles;
  angles = math::nearest_axis_angle(math::log_so3(R_PJ), before);
}

/// Bends the legs so that the ankles are on their paths; the feet's orientation in W stays.
void move_legs(BodyClip& clip, const FootPaths& feet) {
  for (Index t = 0; t < clip.frames(); ++t) {
    const BodyPose pose = clip.pose(t);
    for (const std::size_t side : {0u, 1u}) {
      const int h = hip(side);
      const LimbPosture l = reach(leg(clip.body, side), pose.R_WJ[at(h)], pose.R_WJ[at(h + 1)],
                                  pose.p_WJ[at(h)], feet.ankle_W_m[side].col(t));
      set_rotation(clip, h, t, pose.R_WJ[mocap::kRoot].transpose() * l.R_upper);
      set_rotation(clip, h + 1, t, l.R_upper.transpose() * l.R_lower);
      set_rotation(clip, h + 2, t, l.R_lower.transpose() * pose.R_WJ[at(h + 2)]);
    }
  }
}

double stance_speed(const BodyClip& clip, const Contacts& contacts) {
  const auto points = ground_points(clip);
  double sum = 0.0;
  long count = 0;
  for (Index p = 0; p < 4; ++p) {
    for (Index t = 0; t + 1 < clip.frames(); ++t) {
      if (!contacts(p, t) || !contacts(p, t + 1)) continue;
      sum += (points.block<2, 1>(3 * p, t + 1) - points.block<2, 1>(3 * p, t)).norm();
      ++count;
    }
  }
  return count > 0 ? sum * clip.rate_hz / static_cast<double>(count) : 0.0;
}

void report_feet(const BodyMotion& motion, BodyReport& report) {
  const auto points = ground_points(motion.clip);
  report.stance_speed_m_s = stance_speed(motion.clip, motion.contacts);
  report.lowest_m = 1e9;
  for (Index t = 0; t < points.cols(); ++t) {
    for (const Index side : {0, 1}) {
      const double low = std::min(points(6 * side + 2, t), points(6 * side + 5, t));
      report.lowest_m = std::min(report.lowest_m, low);
      if (motion.contacts(2 * side, t) || motion.contacts(2 * side + 1, t)) {
        report.stance_height_max_m = std::max(report.stance_height_max_m, std::abs(low));
      }
    }
  }
}

void report_hands_and_rotations(const BodyClip& recorded, const Ground& ground, const BodyClip& now,
                                BodyReport& report) {
  double hands = 0.0, rotations = 0.0;
  for (Index t = 0; t < now.frames(); ++t) {
    const BodyPose was = recorded.pose(t), is = now.pose(t);
    for (const std::size_t side : {0u, 1u}) {
      Vector3d hand = was.point(wrist(side), recorded.body.hand_m[side]);
      hand.z() -= ground.below(hand);
      const double off =
          (is.point(wrist(side), now.body.hand_m[side]) - report.scale * hand).norm();
      hands += off * off;
      report.hand_max_m = std::max(report.hand_max_m, off);
    }
    for (Index j = 0; j < mocap::kBodyJoints; ++j) {
      const Matrix3d a = math::exp_so3(recorded.angles_rad.block<3, 1>(3 * j, t));
      const Matrix3d b = math::exp_so3(now.angles_rad.block<3, 1>(3 * j, t));
      const double off = math::log_so3(a.transpose() * b).norm();
      rotations += off * off;
      report.rotation_max_rad = std::max(report.rotation_max_rad, off);
    }
  }
  const auto frames = static_cast<double>(now.frames());
  report.hand_rms_m = std::sqrt(hands / (2.0 * frames));
  report.rotation_rms_rad = std::sqrt(rotations / (mocap::kBodyJoints * frames));
}

}  // namespace

BodyMotion retarget(const BodyClip& recorded, const Body& to) {
  check(recorded, to);
  const Ground ground = find_ground(recorded);
  BodyMotion motion{recorded, find_contacts(recorded, ground), {}};
  BodyClip& clip = motion.clip;
  BodyReport& report = motion.report;
  report.scale = leg_length(to) / leg_length(recorded.body);
  clip.body = to;
  place_root(recorded, ground, report.scale, clip);
  report.stance_speed_unlocked_m_s = stance_speed(clip, motion.contacts);
  const FootPaths feet = foot_paths(recorded, ground, report.scale, to, motion.contacts);
  const Eigen::VectorXd lowered = lowering(clip, feet);
  clip.root_position_W_m.row(2) -= lowered.transpose();
  report.pelvis_lowered_max_m = lowered.maxCoeff();
  move_legs(clip, feet);
  report_feet(motion, report);
  report_hands_and_rotations(recorded, ground, clip, report);
  return motion;
}

}  // namespace mimesis::retarget
