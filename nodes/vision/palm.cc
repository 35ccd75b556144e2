#include "nodes/vision/palm.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mimesis::vision {
namespace {

bool contains(const Blob& blob, int region) {
  return std::binary_search(blob.regions.begin(), blob.regions.end(), region);
}

/// Part of a run where (u, row) · axis >= limit.
Run clip(Run run, const Eigen::Vector2d& axis, double limit) {
  const double needed = limit - axis.y() * run.row;
  if (std::abs(axis.x()) < 1e-9) {
    if (needed > 0.0) run.end = run.begin;
    return run;
  }
  const double border = std::clamp(needed / axis.x(), -1e6, 1e6);
  if (axis.x() > 0.0) {
    run.begin = std::max(run.begin, static_cast<int>(std::ceil(border)));
  } else {
    run.end = std::min(run.end, static_cast<int>(std::floor(border)) + 1);
  }
  return run;
}

}  // namespace

std::optional<Palm> find_palm(std::span<const Run> runs, const Blob& blob,
                              const Eigen::Vector2d& reach, double length_px) {
  if (!blob.found()) return std::nullopt;
  const double angle = axes(blob.moments).angle_rad;
  Eigen::Vector2d axis(std::cos(angle), std::sin(angle));
  if (axis.dot(reach) < 0.0) axis = -axis;

  double front = -std::numeric_limits<double>::infinity();
  Palm palm;
  for (const Run& run : runs) {
    if (!contains(blob, run.region)) continue;
    for (const int u : {run.begin, run.end - 1}) {
      const Eigen::Vector2d p(u, run.row);
      if (p.dot(axis) > front) {
        front = p.dot(axis);
        palm.tip = p;
      }
    }
  }
  Moments sum;
  for (const Run& run : runs) {
    if (!contains(blob, run.region)) continue;
    const Run part = clip(run, axis, front - length_px);
    if (part.end > part.begin) sum.add(part);
  }
  if (sum.area <= 0.0) return std::nullopt;
  palm.center = {sum.mean_u(), sum.mean_v()};
  return palm;
}

double palm_angle(const Eigen::Vector2d& palm_m, const Eigen::Vector2d& object_m,
                  double clearance_m) {
  const Eigen::Vector2d d = object_m - palm_m;
  const double hidden2 = std::max(0.0, clearance_m * clearance_m - d.squaredNorm());
  return std::atan2(std::sqrt(d.x() * d.x() + hidden2), -d.y());
}

}  // namespace mimesis::vision
