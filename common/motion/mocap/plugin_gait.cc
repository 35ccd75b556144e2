#include "common/motion/mocap/plugin_gait.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace mimesis::mocap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMarkerOverSole_m = 0.03, kMarkerBelowHeadTop_m = 0.10;

/// Part of v square to the unit vector u, of length 1.
Vector3d square_to(const Vector3d& v, const Vector3d& u) { return (v - v.dot(u) * u).normalized(); }

Matrix3d columns(const Vector3d& x, const Vector3d& y, const Vector3d& z) {
  Matrix3d R;
  R << x, y, z;
  return R;
}

// Frames from one exact axis and a hint for a second.
Matrix3d frame_y_x(const Vector3d& y_exact, const Vector3d& x_hint) {
  const Vector3d y = y_exact.normalized(), x = square_to(x_hint, y);
  return columns(x, y, x.cross(y));
}
Matrix3d frame_z_y(const Vector3d& z_exact, const Vector3d& y_hint) {
  const Vector3d z = z_exact.normalized(), y = square_to(y_hint, z);
  return columns(y.cross(z), y, z);
}
Matrix3d frame_z_x(const Vector3d& z_exact, const Vector3d& x_hint) {
  const Vector3d z = z_exact.normalized(), x = square_to(x_hint, z);
  return columns(x, z.cross(x), z);
}
Matrix3d frame_x_y(const Vector3d& x_exact, const Vector3d& y_hint) {
  const Vector3d x = x_exact.normalized(), y = square_to(y_hint, x);
  return columns(x, y, x.cross(y));
}
Matrix3d frame_y_z(const Vector3d& y_exact, const Vector3d& z_hint) {
  const Vector3d y = y_exact.normalized(), z = square_to(z_hint, y);
  return columns(y.cross(z), y, z);
}

Matrix3d half_way(const Matrix3d& from, const Matrix3d& to) {
  return from * math::exp_so3(0.5 * math::log_so3(from.transpose() * to));
}

void set_pelvis(const GaitMarkerSet& m, BodyPose& pose) {
  const Vector3d asis = 0.5 * (m.col(kLASI) + m.col(kRASI));
  const Vector3d psis = 0.5 * (m.col(kLPSI) + m.col(kRPSI));
  pose.R_WJ[kRoot] = frame_y_x(m.col(kLASI) - m.col(kRASI), asis - psis);
  pose.p_WJ[kRoot] = 0.5 * (asis + psis);
}

/// What is above the pelvis, stiff in the T-posture and of standard size.
void set_standard_trunk(MarkerPose& out) {
  static const Body body = standard_body();
  const Matrix3d R = out.pose.R_WJ[kRoot];
  for (std::size_t j = kSpine; j < kBodyJoints; ++j) {
    out.pose.R_WJ[j] = R;
    out.pose.p_WJ[j] =
        out.pose.p_WJ[static_cast<std::size_t>(kBodyParents[j])] + R * body.offset_m[j];
  }
  out.hand = {out.pose.point(kLeftWrist, body.hand_m[kLeft]),
              out.pose.point(kRightWrist, body.hand_m[kRight])};
  out.head_top = out.pose.point(kHead, body.head_top_m);
}

void set_trunk(const GaitMarkerSet& m, MarkerPose& out) {
  BodyPose& pose = out.pose;
  const Vector3d below = 0.5 * (m.col(kT10) + m.col(kSTRN));
  const Vector3d above = 0.5 * (m.col(kC7) + m.col(kCLAV));
  const Vector3d front = m.col(kCLAV) + m.col(kSTRN), back = m.col(kC7) + m.col(kT10);
  pose.R_WJ[kChest] = frame_z_x(above - below, front - back);
  pose.R_WJ[kSpine] = half_way(pose.R_WJ[kRoot], pose.R_WJ[kChest]);
  pose.p_WJ[kSpine] = (2.0 * pose.p_WJ[kRoot] + below) / 3.0;
  pose.p_WJ[kChest] = below;
  pose.p_WJ[kNeck] = above;

  const Vector3d forehead = 0.5 * (m.col(kLFHD) + m.col(kRFHD));
  const Vector3d occiput = 0.5 * (m.col(kLBHD) + m.col(kRBHD));
  const Vector3d left = m.col(kLFHD) + m.col(kLBHD) - m.col(kRFHD) - m.col(kRBHD);
  pose.R_WJ[kHead] = frame_x_y(forehead - occiput, left);
  pose.R_WJ[kNeck] = half_way(pose.R_WJ[kChest], pose.R_WJ[kHead]);
  const Vector3d skull = 0.5 * (forehead + occiput);
  pose.p_WJ[kHead] = 0.5 * (above + skull);
  out.head_top = skull + kMarkerBelowHeadTop_m * pose.R_WJ[kHead].col(2);
}

/// Joint centre `depth` inwards of a marker, square to the line from the joint above. That line
/// ends in the centre sought: repeated, each time 1/50 of the error is left.
Vector3d inwards(const Vector3d& marker, const Vector3d& above, const Vector3d& outwards,
                 double depth) {
  Vector3d centre = marker;
  for (int i = 0; i < 4; ++i) {
    centre = marker - depth * square_to(outwards, (centre - above).normalized());
  }
  return centre;
}

void set_leg(const GaitMarkerSet& m, std::size_t side, const MarkerBodyOptions& o,
             MarkerPose& out) {
  BodyPose& pose = out.pose;
  const bool left = side == kLeft;
  const double sign = left ? 1.0 : -1.0;
  const std::size_t hip = left ? kLeftHip : kRightHip, knee = hip + 1, ankle = hip + 2;
  const Vector3d KNE = m.col(left ? kLKNE : kRKNE), ANK = m.col(left ? kLANK : kRANK);
  const Vector3d HEE = m.col(left ? kLHEE : kRHEE), TOE = m.col(left ? kLTOE : kRTOE);

  const Matrix3d& R_pelvis = pose.R_WJ[kRoot];
  const double w = (m.col(kLASI) - m.col(kRASI)).norm();
  const Vector3d in_pelvis(-0.19 * w, sign * 0.36 * w, -0.30 * w);
  pose.p_WJ[hip] = 0.5 * (m.col(kLASI) + m.col(kRASI)) + R_pelvis * in_pelvis;

  pose.p_WJ[knee] = inwards(KNE, pose.p_WJ[hip], sign * R_pelvis.col(1),
                            0.5 * o.knee_width_m + o.marker_radius_m);
  pose.R_WJ[hip] = frame_z_y(pose.p_WJ[hip] - pose.p_WJ[knee], R_pelvis.col(1));

  pose.p_WJ[ankle] = inwards(ANK, pose.p_WJ[knee], sign * pose.R_WJ[hip].col(1),
                             0.5 * o.ankle_width_m + o.marker_radius_m);
  pose.R_WJ[knee] = frame_z_y(pose.p_WJ[knee] - pose.p_WJ[ankle], pose.R_WJ[hip].col(1));

  pose.R_WJ[ankle] = frame_x_y(TOE - HEE, pose.R_WJ[knee].col(1));
  out.toe[side] = TOE - kMarkerOverSole_m * pose.R_WJ[ankle].col(2);
  out.heel[side] = HEE - kMarkerOverSole_m * pose.R_WJ[ankle].col(2);
}

/// Axis about which the elbow bends the forearm forward in the T-posture: up. A stretched arm does
/// not show it; then, gradually, the wrist's width counts.
Vector3d elbow_axis(const Vector3d& upper, const Vector3d& fore, const Vector3d& wrist_up,
                    double sign) {
  constexpr double kBent = 0.3;  // sine of the bend from which its plane is trusted alone
  const Vector3d y = upper.normalized();
  const Vector3d normal = -sign * y.cross(fore.normalized());
  const double trust = std::min(1.0, normal.norm() / kBent);
  Vector3d axis = (1.0 - trust) * square_to(wrist_up, y);
  if (normal.norm() > 1e-9) axis += trust * normal.normalized();
  return axis.normalized();
}

void set_arm(const GaitMarkerSet& m, std::size_t side, const MarkerBodyOptions& o,
             MarkerPose& out) {
  BodyPose& pose = out.pose;
  const bool left = side == kLeft;
  const double sign = left ? 1.0 : -1.0;
  const std::size_t shoulder = left ? kLeftShoulder : kRightShoulder;
  const std::size_t elbow = shoulder + 1, wrist = shoulder + 2;
  const Vector3d SHO = m.col(left ? kLSHO : kRSHO), ELB = m.col(left ? kLELB : kRELB);
  const Vector3d WRA = m.col(left ? kLWRA : kRWRA), WRB = m.col(left ? kLWRB : kRWRB);
  const Vector3d FIN = m.col(left ? kLFIN : kRFIN);

  pose.p_WJ[shoulder] = SHO - o.shoulder_drop_m * pose.R_WJ[kChest].col(2);
  pose.p_WJ[wrist] = 0.5 * (WRA + WRB);
  // the axis moves the centre, which moves the axis: twice is enough for 0.1 mm
  pose.p_WJ[elbow] = ELB;
  Vector3d axis;
  for (int i = 0; i < 3; ++i) {
    axis = elbow_axis(pose.p_WJ[elbow] - pose.p_WJ[shoulder], pose.p_WJ[wrist] - pose.p_WJ[elbow],
                      WRA - WRB, sign);
    pose.p_WJ[elbow] = ELB - (0.5 * o.elbow_width_m + o.marker_radius_m) * axis;
  }
  pose.R_WJ[shoulder] = frame_y_z(sign * (pose.p_WJ[elbow] - pose.p_WJ[shoulder]), axis);
  pose.R_WJ[elbow] = frame_y_z(sign * (pose.p_WJ[wrist] - pose.p_WJ[elbow]), axis);
  pose.R_WJ[wrist] = frame_y_z(sign * (FIN - pose.p_WJ[wrist]), WRA - WRB);
  out.hand[side] = 2.0 * FIN - pose.p_WJ[wrist];
}

}  // namespace

MarkerPose pose_from_markers(const GaitMarkerSet& m, const MarkerBodyOptions& options) {
  MarkerPose out;
  set_pelvis(m, out.pose);
  if (options.legs_only) {
    set_standard_trunk(out);
  } else {
    set_trunk(m, out);
  }
  for (std::size_t side = 0; side < 2; ++side) {
    set_leg(m, side, options, out);
    if (!options.legs_only) set_arm(m, side, options, out);
  }
  return out;
}

}  // namespace mimesis::mocap
