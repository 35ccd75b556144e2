#include "nodes/synthesizer/retarget/contacts.h"

#include <algorithm>
#include <cmath>

namespace mimesis::retarget {
namespace {

using Eigen::Index;

constexpr double kSlow_m_s = 0.3, kLow_m = 0.04, kShort_s = 0.05;

double quantile(Eigen::VectorXd values, double share) {
  const auto n = static_cast<Index>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + n, values.end());
  return values[n];
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

double ground_height(const mocap::BodyClip& clip) {
  const auto points = ground_points(clip);
  Eigen::VectorXd lowest(points.cols());
  for (Index t = 0; t < points.cols(); ++t) {
    lowest[t] = std::min({points(2, t), points(5, t), points(8, t), points(11, t)});
  }
  return quantile(lowest, 0.5);
}

Contacts find_contacts(const mocap::BodyClip& clip) {
  const auto points = ground_points(clip);
  const Index frames = points.cols();
  Contacts contacts(4, frames);
  for (Index p = 0; p < 4; ++p) {
    const double lowest = quantile(points.row(3 * p + 2).transpose(), 0.05);
    Eigen::Array<bool, 1, Eigen::Dynamic> row(frames);
    for (Index t = 0; t < frames; ++t) {
      const Index a = std::max<Index>(t - 1, 0), b = std::min(t + 1, frames - 1);
      const Eigen::Vector3d moved = points.block<3, 1>(3 * p, b) - points.block<3, 1>(3 * p, a);
      const double seconds = static_cast<double>(std::max<Index>(b - a, 1)) / clip.rate_hz;
      row[t] = moved.norm() / seconds < kSlow_m_s && points(3 * p + 2, t) < lowest + kLow_m;
    }
    const auto shortest = static_cast<Index>(std::ceil(kShort_s * clip.rate_hz));
    drop_short(row, false, shortest);
    drop_short(row, true, shortest);
    contacts.row(p) = row;
  }
  return contacts;
}

}  // namespace mimesis::retarget
