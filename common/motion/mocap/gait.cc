#include "common/motion/mocap/gait.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "common/math/so3.h"

namespace mimesis::mocap {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Paths of heels and toes in W, by side [m].
struct FootPaths {
  std::array<Matrix3Xd, 2> heel, toe;
};

FootPaths foot_paths(const BodyClip& clip) {
  FootPaths paths;
  for (std::size_t s = 0; s < 2; ++s) {
    paths.heel[s].resize(3, clip.frames());
    paths.toe[s].resize(3, clip.frames());
  }
  for (Index f = 0; f < clip.frames(); ++f) {
    const BodyPose pose = clip.pose(f);
    for (std::size_t s = 0; s < 2; ++s) {
      const int ankle = s == kLeft ? kLeftAnkle : kRightAnkle;
      paths.heel[s].col(f) = pose.point(ankle, clip.body.heel_m[s]);
      paths.toe[s].col(f) = pose.point(ankle, clip.body.toe_m[s]);
    }
  }
  return paths;
}

/// Distance ahead of the pelvis along the heading [m].
VectorXd ahead_of_pelvis(const Matrix3Xd& path, const BodyClip& clip, const VectorXd& heading) {
  VectorXd ahead(path.cols());
  for (Index f = 0; f < path.cols(); ++f) {
    const Vector3d d = path.col(f) - clip.root_position_W_m.col(f);
    ahead[f] = d.x() * std::cos(heading[f]) + d.y() * std::sin(heading[f]);
  }
  return ahead;
}

/// Maxima from which x falls by `drop` on both sides before it rises as high again; half of it
/// where x begins or ends before that. The first and the last value are none: x may go on rising.
std::vector<Index> maxima(const VectorXd& x, double drop) {
  std::vector<Index> found;
  Index high = 0, low = 0, lowest_before = 0;
  bool seek_maximum = true;
  auto take = [&](double fall) {
    const double rise = x[high] - x[lowest_before];
    const bool rises = rise >= (found.empty() ? 0.5 * drop : drop);
    if (high > 0 && x[high] - x[low] >= fall && rises) found.push_back(high);
  };
  for (Index f = 1; f < x.size(); ++f) {
    if (seek_maximum && x[f] > x[high]) high = low = f;
    if (x[f] < x[low]) low = f;
    if (high == 0 && x[f] < x[lowest_before]) high = lowest_before = low = f;
    if (seek_maximum && x[f] <= x[high] - drop) {
      take(drop);
      seek_maximum = false;
    } else if (!seek_maximum && x[f] >= x[low] + drop) {
      lowest_before = low;
      high = low = f;
      seek_maximum = true;
    }
  }
  if (seek_maximum) take(0.5 * drop);
  return found;
}

double fifth_percentile(VectorXd x) {
  const Index rank = x.size() / 20;
  std::nth_element(x.data(), x.data() + rank, x.data() + x.size());
  return x[rank];
}

/// Speed by central differences [m/s].
double speed(const Matrix3Xd& path, Index f, double rate_hz) {
  const Index before = std::max<Index>(f - 1, 0), after = std::min(f + 1, path.cols() - 1);
  if (after == before) return 0.0;
  return (path.col(after) - path.col(before)).norm() * rate_hz /
         static_cast<double>(after - before);
}

/// Keeps the frames before which the foot came flying, not those where only the pelvis moved away.
void keep_swings(std::vector<Index>& frames, const Matrix3Xd& foot, double rate_hz) {
  constexpr double kSwing_s = 0.5;
  const auto reach = static_cast<Index>(std::lround(kSwing_s * rate_hz));
  std::erase_if(frames, [&](Index frame) {
    for (Index f = std::max<Index>(frame - reach, 0); f <= frame; ++f) {
      if (speed(foot, f, rate_hz) > kLeastSwing_m_s) return false;
    }
    return true;
  });
}

std::vector<FrameInterval> intervals(const std::vector<bool>& stands, Index shortest) {
  std::vector<FrameInterval> all;
  for (Index f = 0; f < static_cast<Index>(stands.size()); ++f) {
    if (!stands[static_cast<std::size_t>(f)]) continue;
    if (!all.empty() && f - all.back().last <= shortest) {
      all.back().last = f;
    } else {
      all.push_back({f, f});
    }
  }
  std::erase_if(all, [&](const FrameInterval& i) { return i.last - i.first + 1 < shortest; });
  return all;
}

}  // namespace

VectorXd heading_rad(const BodyClip& clip) {
  VectorXd heading(clip.frames());
  for (Index f = 0; f < clip.frames(); ++f) {
    const Vector3d x = math::exp_so3(clip.angles_rad.block<3, 1>(0, f)).col(0);
    const double angle = std::atan2(x.y(), x.x());
    heading[f] = f == 0 ? angle : heading[f - 1] + math::wrap_pi(angle - heading[f - 1]);
  }
  return heading;
}

void remove_heading(BodyClip& clip) {
  const VectorXd heading = heading_rad(clip);
  Vector3d before = Vector3d::Zero();
  for (Index f = 0; f < clip.frames(); ++f) {
    const Eigen::Matrix3d turned =
        math::exp_so3({0.0, 0.0, -heading[f]}) * math::exp_so3(clip.angles_rad.block<3, 1>(0, f));
    before = math::nearest_axis_angle(math::log_so3(turned), before);
    clip.angles_rad.block<3, 1>(0, f) = before;
  }
}

GaitEvents find_gait_events(const BodyClip& clip) {
  GaitEvents events;
  if (clip.frames() < 3) return events;
  const FootPaths paths = foot_paths(clip);
  const VectorXd heading = heading_rad(clip);

  double travel = 0.0;
  for (Index f = 0; f + 1 < clip.frames(); ++f) {
    const Vector3d d = clip.root_position_W_m.col(f + 1) - clip.root_position_W_m.col(f);
    travel += d.x() * std::cos(heading[f]) + d.y() * std::sin(heading[f]);
  }
  events.backward = travel < -kLeastSwing_m;
  const double sign = events.backward ? -1.0 : 1.0;

  for (std::size_t s = 0; s < 2; ++s) {
    // backwards the toe is the end of the foot that arrives first
    const Matrix3Xd& strikes = events.backward ? paths.toe[s] : paths.heel[s];
    const Matrix3Xd& leaves = events.backward ? paths.heel[s] : paths.toe[s];
    const VectorXd front = sign * ahead_of_pelvis(strikes, clip, heading);
    const VectorXd back = -sign * ahead_of_pelvis(leaves, clip, heading);
    auto least = [](const VectorXd& x) {
      return std::max(kLeastSwing_m, kLeastSwingShare * (x.maxCoeff() - x.minCoeff()));
    };
    events.heel_strike[s] = maxima(front, least(front));
    events.toe_off[s] = maxima(back, least(back));
    keep_swings(events.heel_strike[s], strikes, clip.rate_hz);
  }
  return events;
}

std::array<std::vector<FrameInterval>, 2> stance_intervals(const BodyClip& clip) {
  constexpr double kSlow_m_s = 0.6, kLow_m = 0.08, kShortest_s = 0.05;
  const FootPaths paths = foot_paths(clip);
  const auto shortest =
      std::max<Index>(1, static_cast<Index>(std::lround(kShortest_s * clip.rate_hz)));
  std::array<std::vector<FrameInterval>, 2> all;
  for (std::size_t s = 0; s < 2; ++s) {
    const Matrix3Xd &heel = paths.heel[s], &toe = paths.toe[s];
    const double ground = fifth_percentile(heel.row(2).cwiseMin(toe.row(2)).transpose().eval());
    auto rests = [&](const Matrix3Xd& path, Index f) {
      return path(2, f) < ground + kLow_m && speed(path, f, clip.rate_hz) < kSlow_m_s;
    };
    std::vector<bool> stands(static_cast<std::size_t>(clip.frames()));
    for (Index f = 0; f < clip.frames(); ++f) {
      stands[static_cast<std::size_t>(f)] = rests(heel, f) || rests(toe, f);
    }
    all[s] = intervals(stands, shortest);
  }
  return all;
}

}  // namespace mimesis::mocap
