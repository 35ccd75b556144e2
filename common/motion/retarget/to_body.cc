#include "common/motion/retarget/to_body.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/math/so3.h"

namespace mimesis::retarget {
namespace {

using Eigen::Index;

constexpr double kSlow_m_s = 0.3, kLow_m = 0.04, kShort_s = 0.05;
constexpr double kHeldBack_m = 0.15;  // feet must spread further than this to tell a slope

using Points = Eigen::Matrix<double, 12, Eigen::Dynamic>;

bool slow(const Points& points, Index point, Index t, double rate_hz) {
  const Index a = std::max<Index>(t - 1, 0), b = std::min(t + 1, points.cols() - 1);
  const Eigen::Vector3d moved = points.block<3, 1>(3 * point, b) - points.block<3, 1>(3 * point, a);
  return moved.norm() * rate_hz < kSlow_m_s * static_cast<double>(std::max<Index>(b - a, 1));
}

/// Runs of `value` shorter than `frames` that do not touch the ends become the other value.
void drop_short(Eigen::Ref<Eigen::Array<bool, 1, Eigen::Dynamic>> row, bool value, Index frames) {
  for (Index i = 0; i < row.size();) {
    Index end = i;
    while (end < row.size() && row[end] == row[i]) ++end;
    if (row[i] == value && end - i < frames && i > 0 && end < row.size()) {
      row.segment(i, end - i) = !value;
    }
    i = end;
  }
}

using Eigen::Index, Eigen::Matrix3Xd, Eigen::Vector3d;

/// One foot over time: the free path and the ground points of `to` relative to the ankle, in W.
struct FootPath {
  Matrix3Xd free;                  ///< ankle [m]
  std::array<Matrix3Xd, 2> point;  ///< heel and toe from the ankle [m]
  std::array<Eigen::Array<bool, 1, Eigen::Dynamic>, 2> stands;

  bool stance(Index t) const { return stands[0][t] || stands[1][t]; }
  double lowest(Index t) const { return std::min(point[0](2, t), point[1](2, t)); }
};

FootPath make_foot(const mocap::BodyClip& recorded, const Ground& ground, double scale,
                   const mocap::Body& to, const Contacts& contacts, std::size_t side) {
  const Index frames = recorded.frames();
  const int ankle = side == 0 ? mocap::kLeftAnkle : mocap::kRightAnkle;
  FootPath foot{Matrix3Xd(3, frames), {Matrix3Xd(3, frames), Matrix3Xd(3, frames)}, {}};
  for (Index t = 0; t < frames; ++t) {
    const mocap::BodyPose pose = recorded.pose(t);
    const Eigen::Matrix3d& R = pose.R_WJ[static_cast<std::size_t>(ankle)];
    foot.point[kHeel].col(t) = R * to.heel_m[side];
    foot.point[kToe].col(t) = R * to.toe_m[side];
    foot.free.col(t) = scale * pose.p_WJ[static_cast<std::size_t>(ankle)];
    // The sole, not the ankle, is as high above the ground as it was
    const Vector3d heel = pose.point(ankle, recorded.body.heel_m[side]);
    const Vector3d toe = pose.point(ankle, recorded.body.toe_m[side]);
    const double clearance = std::min(heel.z() - ground.below(heel), toe.z() - ground.below(toe));
    foot.free(2, t) = scale * clearance - foot.lowest(t);
  }
  for (const std::size_t p : {0u, 1u}) {
    foot.stands[p] = contacts.row(2 * static_cast<Index>(side) + static_cast<Index>(p));
  }
  return foot;
}

/// Offset of the free path during a stance from `first` to before `end`, so that its points stay.
Matrix3Xd stance_offsets(const FootPath& foot, Index first, Index end) {
  Matrix3Xd offsets(3, end - first);
  std::size_t pivot = foot.stands[kHeel][first] ? kHeel : kToe;
  Vector3d place = foot.free.col(first) + foot.point[pivot].col(first);
  for (Index t = first; t < end; ++t) {
    if (!foot.stands[pivot][t]) {  // the foot rolls on: the other point stays where it is now
      const Vector3d ankle = place - foot.point[pivot].col(t);
      pivot = 1 - pivot;
      place = ankle + foot.point[pivot].col(t);
    }
    offsets.col(t - first) = place - foot.point[pivot].col(t) - foot.free.col(t);
  }
  offsets.colwise() -= Vector3d(offsets.rowwise().mean());
  for (Index t = first; t < end; ++t) {
    offsets(2, t - first) = -foot.lowest(t) - foot.free(2, t);  // the lower point on the ground
  }
  return offsets;
}

Matrix3Xd path(const FootPath& foot) {
  const Index frames = foot.free.cols();
  Matrix3Xd offset = Matrix3Xd::Zero(3, frames);
  Index last = -1;  // frame in which the stance before ended; none yet
  const auto fade = [&](Index next) {
    // next: first frame of the stance that follows; `frames` if none does
    const Vector3d from = last >= 0       ? Vector3d(offset.col(last))
                          : next < frames ? Vector3d(offset.col(next))
                                          : Vector3d::Zero();
    const Vector3d to = next < frames ? Vector3d(offset.col(next)) : from;
    for (Index t = last + 1; t < next; ++t) {
      const double x = static_cast<double>(t - last) / static_cast<double>(next - last);
      offset.col(t) = from + x * x * (3.0 - 2.0 * x) * (to - from);
    }
  };
  for (Index t = 0; t < frames; ++t) {
    if (!foot.stance(t)) continue;
    Index end = t;
    while (end < frames && foot.stance(end)) ++end;
    offset.middleCols(t, end - t) = stance_offsets(foot, t, end);
    fade(t);
    last = end - 1;
    t = last;
  }
  fade(frames);
  Matrix3Xd ankle = foot.free + offset;
  for (Index t = 0; t < frames; ++t) ankle(2, t) = std::max(ankle(2, t), -foot.lowest(t));
  return ankle;
}

constexpr double kOwnAxis = 0.2;

using Eigen::Index, Eigen::Matrix3d, Eigen::Vector3d;
using mocap::Body, mocap::BodyClip, mocap::BodyPose;

// share of a leg's length: straight legs cannot be controlled
constexpr double kStraightest = 0.9995;
constexpr double kEase_s = 0.1;  // the pelvis begins to come down this long before it must

std::size_t body_index(int joint) { return static_cast<std::size_t>(joint); }
int hip(std::size_t side) { return side == 0 ? mocap::kLeftHip : mocap::kRightHip; }

TwoSegments leg(const Body& body, std::size_t side) {
  return {body.offset_m[body_index(hip(side) + 1)], body.offset_m[body_index(hip(side) + 2)]};
}

/// From hip to ankle with the knee, a hinge about y, stretched.
double longest(const TwoSegments& l) {
  const double across = l.upper_m.y() + l.lower_m.y();
  return std::hypot(
      std::hypot(l.upper_m.x(), l.upper_m.z()) + std::hypot(l.lower_m.x(), l.lower_m.z()), across);
}

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
/// scaled; the root may be anywhere in the pelvis.
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
      const Vector3d d = pose.p_WJ[body_index(hip(side))] - feet.ankle_W_m[side].col(t);
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
      const LimbPosture l =
          reach(leg(clip.body, side), pose.R_WJ[body_index(h)], pose.R_WJ[body_index(h + 1)],
                pose.p_WJ[body_index(h)], feet.ankle_W_m[side].col(t));
      set_rotation(clip, h, t, pose.R_WJ[mocap::kRoot].transpose() * l.R_upper);
      set_rotation(clip, h + 1, t, l.R_upper.transpose() * l.R_lower);
      set_rotation(clip, h + 2, t, l.R_lower.transpose() * pose.R_WJ[body_index(h + 2)]);
    }
  }
}

}  // namespace

Eigen::Matrix<double, 12, Eigen::Dynamic> ground_points(const mocap::BodyClip& clip) {
  Eigen::Matrix<double, 12, Eigen::Dynamic> points(12, clip.frames());
  for (Index t = 0; t < clip.frames(); ++t) {
    const mocap::BodyPose pose = clip.pose(t);
    for (const std::size_t side : {0u, 1u}) {
      const int ankle = side == 0 ? mocap::kLeftAnkle : mocap::kRightAnkle;
      const auto row = static_cast<Index>(6 * side);
      points.block<3, 1>(row, t) = pose.point(ankle, clip.body.heel_m[side]);
      points.block<3, 1>(row + 3, t) = pose.point(ankle, clip.body.toe_m[side]);
    }
  }
  return points;
}

Ground find_ground(const mocap::BodyClip& clip) {
  const Points points = ground_points(clip);
  std::vector<Eigen::Vector3d> feet;
  double lowest_of_all = points(2, 0);
  for (Index t = 0; t < points.cols(); ++t) {
    Index low = 0;
    for (Index p = 1; p < 4; ++p) low = points(3 * p + 2, t) < points(3 * low + 2, t) ? p : low;
    lowest_of_all = std::min(lowest_of_all, points(3 * low + 2, t));
    if (slow(points, low, t, clip.rate_hz)) feet.emplace_back(points.block<3, 1>(3 * low, t));
  }
  Ground ground;
  ground.height_m = lowest_of_all;  // height for a person who never stands
  if (feet.empty()) return ground;
  const auto count = static_cast<double>(feet.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : feet) mean += p / count;
  Eigen::Matrix2d spread = kHeldBack_m * kHeldBack_m * count * Eigen::Matrix2d::Identity();
  Eigen::Vector2d rise = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : feet) {
    const Eigen::Vector3d d = p - mean;
    spread += d.head<2>() * d.head<2>().transpose();
    rise += d.z() * d.head<2>();
  }
  ground.centre = mean.head<2>();
  ground.height_m = mean.z();
  ground.slope = spread.ldlt().solve(rise);
  return ground;
}

Contacts find_contacts(const mocap::BodyClip& clip, const Ground& ground) {
  const Points points = ground_points(clip);
  const auto shortest = static_cast<Index>(std::ceil(kShort_s * clip.rate_hz));
  Contacts contacts(4, points.cols());
  for (Index p = 0; p < 4; ++p) {
    Eigen::Array<bool, 1, Eigen::Dynamic> row(points.cols());
    for (Index t = 0; t < points.cols(); ++t) {
      const Eigen::Vector3d at = points.block<3, 1>(3 * p, t);
      row[t] = slow(points, p, t, clip.rate_hz) && at.z() - ground.below(at) < kLow_m;
    }
    drop_short(row, false, shortest);
    drop_short(row, true, shortest);
    contacts.row(p) = row;
  }
  return contacts;
}

FootPaths foot_paths(const mocap::BodyClip& recorded, const Ground& ground, double scale,
                     const mocap::Body& to, const Contacts& contacts) {
  FootPaths paths;
  for (const std::size_t side : {0u, 1u}) {
    paths.ankle_W_m[side] = path(make_foot(recorded, ground, scale, to, contacts, side));
  }
  return paths;
}

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
  const Eigen::Matrix3d turn = math::rotation_onto(end, goal_W - hip_W);
  out.R_upper = turn * R_upper;
  out.R_lower = turn * out.R_lower;
  out.miss_m = (hip_W + turn * end - goal_W).norm();
  return out;
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

BodyMotion retarget(const BodyClip& recorded, const Body& to) {
  check(recorded, to);
  const Ground ground = find_ground(recorded);
  BodyMotion motion{recorded, find_contacts(recorded, ground),
                    leg_length(to) / leg_length(recorded.body)};
  BodyClip& clip = motion.clip;
  clip.body = to;
  place_root(recorded, ground, motion.scale, clip);
  const FootPaths feet = foot_paths(recorded, ground, motion.scale, to, motion.contacts);
  clip.root_position_W_m.row(2) -= lowering(clip, feet).transpose();
  move_legs(clip, feet);
  return motion;
}

}  // namespace mimesis::retarget
