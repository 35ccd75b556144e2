#include "common/motion/retarget/leg_ik.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace mimesis::retarget {
namespace {

constexpr double kOwnAxis = 0.2;

}  // namespace

LimbPosture reach(const TwoSegments& limb, const Eigen::Matrix3d& R_upper,
                  const Eigen::Matrix3d& R_lower, const Eigen::Vector3d& hip_W,
                  const Eigen::Vector3d& goal_W) {
  const Eigen::Vector3d a = R_upper * limb.upper_m, b = R_lower * limb.lower_m;
  const double la = a.norm(), lb = b.norm(), distance = (goal_W - hip_W).norm();
  const Eigen::Vector3d u = b / lb;
  // Axis of the bend, perpendicular to the lower segment. The share of the y axis decides where the
  // limb is straight or bent the wrong way.
  const Eigen::Vector3d y = R_lower.col(1) - R_lower.col(1).dot(u) * u;
  const Eigen::Vector3d axis = (a.cross(u) / la + kOwnAxis * y).normalized();
  // |a + lb (cos δ u + sin δ axis×u)| = distance; the straight limb is at δ₀, bent ones beyond
  const double along = a.dot(u), across = a.dot(axis.cross(u));
  const double wanted = (distance * distance - la * la - lb * lb) / (2.0 * lb);
  const double bend = std::atan2(across, along) +
                      std::acos(std::clamp(wanted / std::hypot(along, across), -1.0, 1.0));
  LimbPosture out;
  out.R_lower = math::exp_so3(bend * axis) * R_lower;
  const Eigen::Vector3d end = a + out.R_lower * limb.lower_m;
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(end, goal_W - hip_W).toRotationMatrix();
  out.R_upper = turn * R_upper;
  out.R_lower = turn * out.R_lower;
  out.miss_m = (hip_W + turn * end - goal_W).norm();
  return out;
}

}  // namespace mimesis::retarget
