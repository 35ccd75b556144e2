#include "common/motion/mocap/body_from_markers.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cctype>
#include <string>

#include "common/math/so3.h"

namespace mimesis::mocap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMarkerOverSole_m = 0.03, kMarkerBelowHeadTop_m = 0.10;

/// Part of v square to the unit vector u, of length 1.
Vector3d square_to(const Vector3d& v, const Vector3d& u) { return (v - v.dot(u) * u).normalized(); }

enum { kX, kY, kZ };

/// Frame from one exact axis and a hint for a second.
Matrix3d frame(int exact, const Vector3d& exact_W, int hinted, const Vector3d& hint_W) {
  const int third = 3 - exact - hinted;
  Matrix3d R;
  R.col(exact) = exact_W.normalized();
  R.col(hinted) = square_to(hint_W, R.col(exact));
  R.col(third) = R.col((third + 1) % 3).cross(R.col((third + 2) % 3));
  return R;
}

Matrix3d half_way(const Matrix3d& from, const Matrix3d& to) {
  return from * math::exp_so3(0.5 * math::log_so3(from.transpose() * to));
}

void set_pelvis(const GaitMarkerSet& m, BodyPose& pose) {
  const Vector3d asis = 0.5 * (m.col(kLASI) + m.col(kRASI));
  const Vector3d psis = 0.5 * (m.col(kLPSI) + m.col(kRPSI));
  pose.R_WJ[kRoot] = frame(kY, m.col(kLASI) - m.col(kRASI), kX, asis - psis);
  pose.p_WJ[kRoot] = 0.5 * (asis + psis);
}

/// Sets the trunk above the pelvis: stiff in the T-posture and of standard size.
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
  pose.R_WJ[kChest] = frame(kZ, above - below, kX, front - back);
  pose.R_WJ[kSpine] = half_way(pose.R_WJ[kRoot], pose.R_WJ[kChest]);
  pose.p_WJ[kSpine] = (2.0 * pose.p_WJ[kRoot] + below) / 3.0;
  pose.p_WJ[kChest] = below;
  pose.p_WJ[kNeck] = above;

  const Vector3d forehead = 0.5 * (m.col(kLFHD) + m.col(kRFHD));
  const Vector3d occiput = 0.5 * (m.col(kLBHD) + m.col(kRBHD));
  const Vector3d left = m.col(kLFHD) + m.col(kLBHD) - m.col(kRFHD) - m.col(kRBHD);
  pose.R_WJ[kHead] = frame(kX, forehead - occiput, kY, left);
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

void set_leg(const GaitMarkerSet& m, std::size_t side, MarkerPose& out) {
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

  pose.p_WJ[knee] =
      inwards(KNE, pose.p_WJ[hip], sign * R_pelvis.col(1), 0.5 * kKneeWidth_m + kMarkerRadius_m);
  pose.R_WJ[hip] = frame(kZ, pose.p_WJ[hip] - pose.p_WJ[knee], kY, R_pelvis.col(1));

  pose.p_WJ[ankle] = inwards(ANK, pose.p_WJ[knee], sign * pose.R_WJ[hip].col(1),
                             0.5 * kAnkleWidth_m + kMarkerRadius_m);
  pose.R_WJ[knee] = frame(kZ, pose.p_WJ[knee] - pose.p_WJ[ankle], kY, pose.R_WJ[hip].col(1));

  pose.R_WJ[ankle] = frame(kX, TOE - HEE, kY, pose.R_WJ[knee].col(1));
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

void set_arm(const GaitMarkerSet& m, std::size_t side, MarkerPose& out) {
  BodyPose& pose = out.pose;
  const bool left = side == kLeft;
  const double sign = left ? 1.0 : -1.0;
  const std::size_t shoulder = left ? kLeftShoulder : kRightShoulder;
  const std::size_t elbow = shoulder + 1, wrist = shoulder + 2;
  const Vector3d SHO = m.col(left ? kLSHO : kRSHO), ELB = m.col(left ? kLELB : kRELB);
  const Vector3d WRA = m.col(left ? kLWRA : kRWRA), WRB = m.col(left ? kLWRB : kRWRB);
  const Vector3d FIN = m.col(left ? kLFIN : kRFIN);

  pose.p_WJ[shoulder] = SHO - kShoulderDrop_m * pose.R_WJ[kChest].col(2);
  pose.p_WJ[wrist] = 0.5 * (WRA + WRB);
  // the axis moves the centre, which moves the axis: twice is enough for 0.1 mm
  pose.p_WJ[elbow] = ELB;
  Vector3d axis;
  for (int i = 0; i < 3; ++i) {
    axis = elbow_axis(pose.p_WJ[elbow] - pose.p_WJ[shoulder], pose.p_WJ[wrist] - pose.p_WJ[elbow],
                      WRA - WRB, sign);
    pose.p_WJ[elbow] = ELB - (0.5 * kElbowWidth_m + kMarkerRadius_m) * axis;
  }
  pose.R_WJ[shoulder] = frame(kY, sign * (pose.p_WJ[elbow] - pose.p_WJ[shoulder]), kZ, axis);
  pose.R_WJ[elbow] = frame(kY, sign * (pose.p_WJ[wrist] - pose.p_WJ[elbow]), kZ, axis);
  pose.R_WJ[wrist] = frame(kY, sign * (FIN - pose.p_WJ[wrist]), kZ, WRA - WRB);
  out.hand[side] = 2.0 * FIN - pose.p_WJ[wrist];
}

using Eigen::Index;
/// What other sets call the markers of both sides, behind L or R, or (ASIS, PSIS) before it. CMU's
/// waist has FWT and BWT.
struct OtherNames {
  std::string_view name;
  std::array<std::string_view, 3> others;
};
constexpr std::array kOtherNames{OtherNames{"ASI", {"ASIS", "FWT"}},
                                 OtherNames{"PSI", {"PSIS", "BWT"}},
                                 OtherNames{"KNE", {"KNEE"}},
                                 OtherNames{"ANK", {"ANKLE"}},
                                 OtherNames{"HEE", {"HEEL"}},
                                 OtherNames{"TOE", {"TOES", "MT2", "MET2"}},
                                 OtherNames{"SHO", {"SHOULDER", "SHOULD"}},
                                 OtherNames{"ELB", {"ELBOW"}}};
constexpr std::array<std::string_view, 5> kSacrum = {"SACR", "SACRUM", "SACRAL", "VSAC", "VSACRAL"};

/// A label without "subject:", in capitals, letters and digits alone; "Left" is L.
std::string plain(std::string_view label) {
  if (const auto colon = label.rfind(':'); colon != std::string_view::npos) {
    label.remove_prefix(colon + 1);
  }
  std::string out;
  for (const char each : label) {
    const auto c = static_cast<unsigned char>(each);
    if (std::isalnum(c) != 0) out += static_cast<char>(std::toupper(c));
  }
  if (out.starts_with("LEFT")) out.erase(1, 3);
  if (out.starts_with("RIGHT")) out.erase(1, 4);
  return out;
}

/// Whether a label is that of a marker of the set.
bool names(std::string_view label, std::string_view marker) {
  const std::string found = plain(label);
  if (found == marker) return true;
  const std::string_view side = marker.substr(0, 1);
  const auto* other = std::ranges::find(kOtherNames, marker.substr(1), &OtherNames::name);
  if (other == kOtherNames.end()) return false;
  return std::ranges::any_of(other->others, [&](std::string_view name) {
    if (name.empty()) return false;
    const bool behind = name == "ASIS" || name == "PSIS";
    return found == std::string(side) + std::string(name) ||
           (behind && found == std::string(name) + std::string(side));
  });
}

template <class IsIt>
Index find_label(const Markers& markers, const IsIt& is_it) {
  const auto found = std::ranges::find_if(markers.labels, is_it);
  return found == markers.labels.end() ? -1 : found - markers.labels.begin();
}

Index find_sacrum(const Markers& markers) {
  return find_label(markers, [](const std::string& label) {
    return std::ranges::find(kSacrum, plain(label)) != kSacrum.end();
  });
}

bool seen(const Markers& markers, Index marker) {
  return !markers.position_m.row(3 * marker).array().isNaN().all();
}

/// Index of every marker of the set. The sacrum stands for both PSIS where they are absent.
std::array<Index, kGaitMarkers> find_set(const Markers& markers, bool legs_only,
                                         const MarkerLabels& given) {
  std::array<Index, kGaitMarkers> found;
  std::string absent;
  found.fill(-1);
  for (std::size_t i = 0; i < kGaitMarkers; ++i) {
    if (legs_only && !of_the_legs(i)) continue;
    found[i] = find_label(markers, [&](const std::string& label) {
      return given[i].empty() ? names(label, kGaitMarkerNames[i]) : label == given[i];
    });
    const bool of_sacrum = (i == kLPSI || i == kRPSI) && given[i].empty();
    if (found[i] < 0 && of_sacrum) found[i] = find_sacrum(markers);
    if (found[i] < 0 || !seen(markers, found[i]))
      absent += (absent.empty() ? "" : ", ") + std::string(kGaitMarkerNames[i]);
  }
  if (!absent.empty()) {
    throw ConfigError(markers.name + ": markers absent or never seen: " + absent +
                      "; expected the PluginGait set, or their labels in a map");
  }
  return found;
}

Vector3d mean_of(const Markers& markers, Index marker) {
  Vector3d sum = Vector3d::Zero();
  double count = 0.0;
  for (Index f = 0; f < markers.frames(); ++f) {
    const Vector3d p = markers.position_m.block<3, 1>(3 * marker, f);
    if (!p.allFinite()) continue;
    sum += p;
    count += 1.0;
  }
  return sum / count;
}

/// Rotation from the file's axes to z up: what points from the toes to the pelvis is up.
Matrix3d upright(const Markers& markers, const std::array<Index, kGaitMarkers>& set) {
  const Vector3d leg = mean_of(markers, set[kLASI]) - mean_of(markers, set[kLTOE]);
  Index axis = 0;
  const double height = leg.cwiseAbs().maxCoeff(&axis);
  if (!(height > 0.3)) {
    throw ConfigError(markers.name + ": the pelvis is " + std::to_string(height) +
                      " m from the toes, expected the markers of a person");
  }
  const Vector3d up = Vector3d::Unit(axis) * (leg[axis] < 0.0 ? -1.0 : 1.0);
  return math::rotation_onto(up, Vector3d::UnitZ());
}

std::vector<MarkerGroup> rigid_groups(const Markers& markers,
                                      const std::array<Index, kGaitMarkers>& set) {
  MarkerGroup pelvis = {set[kLASI], set[kRASI], set[kLPSI]};
  if (set[kRPSI] != set[kLPSI]) pelvis.push_back(set[kRPSI]);
  const Index sacrum = find_sacrum(markers);
  if (sacrum >= 0 && sacrum != set[kLPSI] && seen(markers, sacrum)) pelvis.push_back(sacrum);
  std::vector<MarkerGroup> groups = {pelvis};
  if (set[kC7] >= 0) {
    groups.push_back({set[kLFHD], set[kRFHD], set[kLBHD], set[kRBHD]});  // head
    groups.push_back({set[kC7], set[kT10], set[kCLAV], set[kSTRN]});     // chest
  }
  return groups;
}

/// Poses of the longest run of frames that show the whole set, and the first of these frames.
std::pair<std::vector<MarkerPose>, Index> find_poses(Markers markers, bool legs_only,
                                                     const MarkerLabels& labels) {
  const std::array<Index, kGaitMarkers> set = find_set(markers, legs_only, labels);
  const Matrix3d R_WF = upright(markers, set);
  fill_gaps(markers, rigid_groups(markers, set));
  auto at = [&](Index f) {
    GaitMarkerSet m = GaitMarkerSet::Zero();
    for (std::size_t i = 0; i < kGaitMarkers; ++i) {
      if (set[i] < 0) continue;  // marker of the upper body, not used
      m.col(static_cast<Index>(i)) = R_WF * markers.position_m.block<3, 1>(3 * set[i], f);
    }
    return m;
  };
  Index first = 0, start = 0, longest = 0;
  for (Index f = 0; f <= markers.frames(); ++f) {
    if (f < markers.frames() && at(f).allFinite()) continue;
    if (f - start > longest) {
      longest = f - start;
      first = start;
    }
    start = f + 1;
  }
  if (longest == 0) throw ConfigError(markers.name + ": no frame shows all markers of the set");
  std::vector<MarkerPose> poses;
  for (Index f = first; f < first + longest; ++f) {
    poses.push_back(pose_from_markers(at(f), legs_only));
  }
  return {poses, first};
}

}  // namespace

MarkerPose pose_from_markers(const GaitMarkerSet& m, bool legs_only) {
  MarkerPose out;
  set_pelvis(m, out.pose);
  if (legs_only) {
    set_standard_trunk(out);
  } else {
    set_trunk(m, out);
  }
  for (std::size_t side = 0; side < 2; ++side) {
    set_leg(m, side, out);
    if (!legs_only) set_arm(m, side, out);
  }
  return out;
}

MarkerLabels find_marker_labels(const Markers& markers) {
  MarkerLabels found;
  for (std::size_t i = 0; i < kGaitMarkers; ++i) {
    const Index at = find_label(
        markers, [&](const std::string& label) { return names(label, kGaitMarkerNames[i]); });
    if (at >= 0) found[i] = markers.labels[static_cast<std::size_t>(at)];
  }
  return found;
}

BodyClip body_from_markers(const Markers& markers, bool legs_only, const MarkerLabels& labels) {
  const auto [poses, first] = find_poses(markers, legs_only, labels);
  BodyClip clip;
  clip.name = clip.body.name = markers.name;
  clip.rate_hz = markers.rate_hz;
  clip.first_frame = markers.first_frame + static_cast<long>(first);
  const auto frames = static_cast<Index>(poses.size());
  clip.root_position_W_m.resize(3, frames);
  clip.angles_rad.resize(kBodyRows, frames);
  Body& body = clip.body;

  const double share = 1.0 / static_cast<double>(frames);
  for (Index f = 0; f < frames; ++f) {
    const MarkerPose& p = poses[static_cast<std::size_t>(f)];
    auto local = [&](std::size_t joint, const Vector3d& point) -> Vector3d {
      return share * p.pose.R_WJ[joint].transpose() * (point - p.pose.p_WJ[joint]);
    };
    clip.root_position_W_m.col(f) = p.pose.p_WJ[kRoot];
    put_angles(p.pose, f, clip.angles_rad);
    for (std::size_t j = 1; j < kBodyJoints; ++j) {
      body.offset_m[j] += local(static_cast<std::size_t>(kBodyParents[j]), p.pose.p_WJ[j]);
    }
    for (std::size_t s = 0; s < 2; ++s) {
      const std::size_t ankle = s == kLeft ? kLeftAnkle : kRightAnkle;
      body.toe_m[s] += local(ankle, p.toe[s]);
      body.heel_m[s] += local(ankle, p.heel[s]);
      body.hand_m[s] += local(s == kLeft ? kLeftWrist : kRightWrist, p.hand[s]);
    }
    body.head_top_m += local(kHead, p.head_top);
  }
  return clip;
}

}  // namespace mimesis::mocap
