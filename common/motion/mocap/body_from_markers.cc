#include "common/motion/mocap/body_from_markers.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

#include "common/math/so3.h"
#include "common/motion/mocap/plugin_gait.h"

namespace mimesis::mocap {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Index of a label, with or without "subject:" before; -1: absent.
Index find_label(const Markers& markers, std::string_view name) {
  for (std::size_t i = 0; i < markers.labels.size(); ++i) {
    std::string_view label = markers.labels[i];
    if (const auto colon = label.rfind(':'); colon != std::string_view::npos) {
      label.remove_prefix(colon + 1);
    }
    if (label == name) return static_cast<Index>(i);
  }
  return -1;
}

bool seen(const Markers& markers, Index marker) {
  return !markers.position_m.row(3 * marker).array().isNaN().all();
}

/// Index of every marker of the set. SACR stands for both PSIS where they are absent.
std::array<Index, kGaitMarkers> find_set(const Markers& markers, bool legs_only) {
  std::array<Index, kGaitMarkers> found;
  std::string absent;
  found.fill(-1);
  for (std::size_t i = 0; i < kGaitMarkers; ++i) {
    if (legs_only && !of_the_legs(i)) continue;
    found[i] = find_label(markers, kGaitMarkerNames[i]);
    if (found[i] < 0 && (i == kLPSI || i == kRPSI)) found[i] = find_label(markers, "SACR");
    if (found[i] < 0 || !seen(markers, found[i]))
      absent += (absent.empty() ? "" : ", ") + std::string(kGaitMarkerNames[i]);
  }
  if (!absent.empty()) {
    throw ConfigError(markers.name + ": markers absent or never seen: " + absent +
                      "; expected the PluginGait set");
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
  return Eigen::Quaterniond::FromTwoVectors(up, Vector3d::UnitZ()).toRotationMatrix();
}

std::vector<MarkerGroup> rigid_groups(const Markers& markers,
                                      const std::array<Index, kGaitMarkers>& set) {
  MarkerGroup pelvis{"pelvis", {set[kLASI], set[kRASI], set[kLPSI]}};
  if (set[kRPSI] != set[kLPSI]) pelvis.markers.push_back(set[kRPSI]);
  const Index sacrum = find_label(markers, "SACR");
  if (sacrum >= 0 && sacrum != set[kLPSI] && seen(markers, sacrum))
    pelvis.markers.push_back(sacrum);
  std::vector<MarkerGroup> groups = {pelvis};
  if (set[kC7] >= 0) {
    groups.push_back({"head", {set[kLFHD], set[kRFHD], set[kLBHD], set[kRBHD]}});
    groups.push_back({"chest", {set[kC7], set[kT10], set[kCLAV], set[kSTRN]}});
  }
  return groups;
}

struct MarkerPoses {
  std::vector<MarkerPose> poses;
  Index first = 0;
  GapReport gaps;
};

/// Poses of the longest run of frames that show the whole set.
MarkerPoses find_poses(Markers markers, const MarkerBodyOptions& options) {
  const std::array<Index, kGaitMarkers> set = find_set(markers, options.legs_only);
  const Matrix3d R_WF = upright(markers, set);
  MarkerPoses out;
  out.gaps = fill_gaps(markers, rigid_groups(markers, set), options.longest_gap_s);

  auto at = [&](Index f) {
    GaitMarkerSet m = GaitMarkerSet::Zero();
    for (std::size_t i = 0; i < kGaitMarkers; ++i) {
      if (set[i] < 0) continue;  // of the upper body, not used
      m.col(static_cast<Index>(i)) = R_WF * markers.position_m.block<3, 1>(3 * set[i], f);
    }
    return m;
  };
  Index start = 0, longest = 0;
  for (Index f = 0; f <= markers.frames(); ++f) {
    if (f < markers.frames() && at(f).allFinite()) continue;
    if (f - start > longest) {
      longest = f - start;
      out.first = start;
    }
    start = f + 1;
  }
  if (longest == 0) throw ConfigError(markers.name + ": no frame shows all markers of the set");
  for (Index f = 0; f < longest; ++f) {
    out.poses.push_back(pose_from_markers(at(out.first + f), options));
  }
  return out;
}

/// Mean orientation of the segments in a T-posture that faces forward. [M18 3.3.2: constant
/// biases, saved from the T-posture]
std::array<Matrix3d, kBodyJoints> zero_of(const std::vector<MarkerPose>& poses) {
  std::array<Matrix3d, kBodyJoints> zero;
  zero.fill(Matrix3d::Zero());
  for (const MarkerPose& p : poses) {
    const Vector3d x = p.pose.R_WJ[kRoot].col(0);
    const Matrix3d back = math::exp_so3({0.0, 0.0, -std::atan2(x.y(), x.x())});
    for (std::size_t j = 0; j < kBodyJoints; ++j) zero[j] += back * p.pose.R_WJ[j];
  }
  for (Matrix3d& R : zero) {
    const Eigen::JacobiSVD<Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
    R = svd.matrixU() * svd.matrixV().transpose();
  }
  return zero;
}

}  // namespace

MarkerBody body_from_markers(const Markers& markers, const MarkerBodyOptions& options) {
  MarkerPoses found = find_poses(markers, options);
  std::array<Matrix3d, kBodyJoints> zero;
  zero.fill(Matrix3d::Identity());
  if (options.t_posture) zero = zero_of(find_poses(*options.t_posture, options).poses);

  MarkerBody out;
  out.gaps = found.gaps;
  BodyClip& clip = out.clip;
  clip.name = clip.body.name = markers.name;
  clip.rate_hz = markers.rate_hz;
  clip.first_frame = markers.first_frame + static_cast<long>(found.first);
  const auto frames = static_cast<Index>(found.poses.size());
  clip.root_position_W_m.resize(3, frames);
  clip.angles_rad.resize(kBodyRows, frames);
  Body& body = clip.body;
  body.offset_m.fill(Vector3d::Zero());
  for (auto* points : {&body.toe_m, &body.heel_m, &body.hand_m}) points->fill(Vector3d::Zero());
  body.head_top_m.setZero();

  const double share = 1.0 / static_cast<double>(frames);
  for (Index f = 0; f < frames; ++f) {
    MarkerPose& p = found.poses[static_cast<std::size_t>(f)];
    for (std::size_t j = 0; j < kBodyJoints; ++j) p.pose.R_WJ[j] *= zero[j].transpose();
    auto local = [&](std::size_t joint, const Vector3d& point) -> Vector3d {
      return share * p.pose.R_WJ[joint].transpose() * (point - p.pose.p_WJ[joint]);
    };
    clip.root_position_W_m.col(f) = p.pose.p_WJ[kRoot];
    for (std::size_t j = 0; j < kBodyJoints; ++j) {
      Matrix3d R_PJ = p.pose.R_WJ[j];
      if (kBodyParents[j] >= 0) {
        const auto parent = static_cast<std::size_t>(kBodyParents[j]);
        R_PJ = p.pose.R_WJ[parent].transpose() * R_PJ;
        body.offset_m[j] += local(parent, p.pose.p_WJ[j]);
      }
      const auto row = static_cast<Index>(3 * j);
      const Vector3d before =
          f > 0 ? Vector3d(clip.angles_rad.block<3, 1>(row, f - 1)) : Vector3d(Vector3d::Zero());
      clip.angles_rad.block<3, 1>(row, f) = math::nearest_axis_angle(math::log_so3(R_PJ), before);
    }
    for (std::size_t s = 0; s < 2; ++s) {
      const std::size_t ankle = s == kLeft ? kLeftAnkle : kRightAnkle;
      body.toe_m[s] += local(ankle, p.toe[s]);
      body.heel_m[s] += local(ankle, p.heel[s]);
      body.hand_m[s] += local(s == kLeft ? kLeftWrist : kRightWrist, p.hand[s]);
    }
    body.head_top_m += local(kHead, p.head_top);
  }
  return out;
}

}  // namespace mimesis::mocap
