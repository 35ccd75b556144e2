#include "common/motion/retarget/contacts.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

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
  ground.height_m = lowest_of_all;  // of somebody who never stands
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

}  // namespace mimesis::retarget
