#include "common/motion/retarget/foot_paths.h"

#include <algorithm>

namespace mimesis::retarget {
namespace {

using Eigen::Index, Eigen::Matrix3Xd, Eigen::Vector3d;

/// One foot over time: the free path and the ground points of `to` relative to the ankle, in W.
struct Foot {
  Matrix3Xd free;                  ///< ankle [m]
  std::array<Matrix3Xd, 2> point;  ///< heel and toe from the ankle [m]
  std::array<Eigen::Array<bool, 1, Eigen::Dynamic>, 2> stands;

  bool stance(Index t) const { return stands[0][t] || stands[1][t]; }
  double lowest(Index t) const { return std::min(point[0](2, t), point[1](2, t)); }
};

Foot make_foot(const mocap::BodyClip& recorded, const Ground& ground, double scale,
               const mocap::Body& to, const Contacts& contacts, std::size_t side) {
  const Index frames = recorded.frames();
  const int ankle = side == 0 ? mocap::kLeftAnkle : mocap::kRightAnkle;
  Foot foot{Matrix3Xd(3, frames), {Matrix3Xd(3, frames), Matrix3Xd(3, frames)}, {}};
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

/// What a stance from `first` to before `end` adds to the free path so that its points stay.
Matrix3Xd stance_offsets(const Foot& foot, Index first, Index end) {
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

Matrix3Xd path(const Foot& foot) {
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

}  // namespace

FootPaths foot_paths(const mocap::BodyClip& recorded, const Ground& ground, double scale,
                     const mocap::Body& to, const Contacts& contacts) {
  FootPaths paths;
  for (const std::size_t side : {0u, 1u}) {
    paths.ankle_W_m[side] = path(make_foot(recorded, ground, scale, to, contacts, side));
  }
  return paths;
}

}  // namespace mimesis::retarget
