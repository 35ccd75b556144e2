#include "nodes/vision/blob_tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mimesis::vision {
namespace {

constexpr double kFresh = 0.3;                    // weight of a region far from the last place
constexpr double kLarger = 1.6, kSmaller = 0.05;  // than the object was
constexpr double kVisible = 0.2;                  // of an object is seen: it is there
// How far the object may have moved since much of it was seen, and more for each picture since, in
// memory_px.
constexpr double kJump = 1.5, kJumpMore = 0.25;
constexpr int kLongGone = 30;  // pictures without an object

/// Free pixels between two bounding boxes, the larger of the two directions; negative if they
/// overlap.
int gap(const Moments& a, const Moments& b) {
  const int du = std::max(a.left, b.left) - std::min(a.right, b.right);
  const int dv = std::max(a.top, b.top) - std::min(a.bottom, b.bottom);
  return std::max(du, dv) - 1;
}

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

void BlobTracker::update(std::span<const Region> regions) {
  for (std::size_t k = 1; k < kKinds; ++k) update(static_cast<Kind>(k), regions);
}

bool BlobTracker::possible(Kind kind, const Region& region) const {
  const double area = region.moments.area;
  if (region.kind != kind || area < limits_.min_area) return false;
  if (kind != Kind::object || object_area_ == 0.0) return true;
  const double far = std::hypot(region.moments.mean_u() - object_place_.u,
                                region.moments.mean_v() - object_place_.v);
  return area < kLarger * object_area_ && area > kSmaller * object_area_ &&
         far < (kJump + kJumpMore * hidden_) * limits_.memory_px;
}

int BlobTracker::choose(Kind kind, std::span<const Region> regions) const {
  const Place& last = last_[static_cast<std::size_t>(kind)];
  int best = -1;
  double best_score = 0.0;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const Region& r = regions[i];
    if (!possible(kind, r)) continue;
    const double far =
        last.known ? std::hypot(r.moments.mean_u() - last.u, r.moments.mean_v() - last.v) : 0.0;
    // Never more than 1 / kFresh times larger: a patch of skin colour must not hold the tracker for
    // ever.
    const double nearness = kFresh + (1.0 - kFresh) * std::exp(-far / limits_.memory_px);
    const double score = r.moments.area * nearness;
    if (score > best_score) {
      best_score = score;
      best = static_cast<int>(i);
    }
  }
  return best;
}

void BlobTracker::update(Kind kind, std::span<const Region> regions) {
  const auto k = static_cast<std::size_t>(kind);
  Blob& blob = blobs_[k];
  blob.moments = {};
  blob.regions.clear();
  const int seed = choose(kind, regions);
  if (seed >= 0) {
    blob.moments = regions[static_cast<std::size_t>(seed)].moments;
    blob.regions.push_back(seed);
    for (bool grown = true; grown;) {
      grown = false;
      for (std::size_t i = 0; i < regions.size(); ++i) {
        const Region& r = regions[i];
        const int index = static_cast<int>(i);
        if (r.kind != kind || r.moments.area < limits_.min_area) continue;
        if (kind == Kind::object && object_area_ > 0.0 &&
            blob.moments.area + r.moments.area > kLarger * object_area_)
          continue;
        if (gap(blob.moments, r.moments) > limits_.gap_px) continue;
        if (std::find(blob.regions.begin(), blob.regions.end(), index) != blob.regions.end())
          continue;
        blob.moments.add(r.moments);
        blob.regions.push_back(index);
        grown = true;
      }
    }
    std::sort(blob.regions.begin(), blob.regions.end());
  }
  if (kind == Kind::hand && blob.moments.area < limits_.min_hand_area) {
    blob.moments = {};
    blob.regions.clear();
  }
  if (kind == Kind::object) follow_object(blob);
  if (blob.found()) {
    last_[k] = {blob.moments.mean_u(), blob.moments.mean_v(), true};
  } else {
    last_[k].known = false;
  }
}

void BlobTracker::follow_object(const Blob& blob) {
  const double area = blob.moments.area;
  objectless_ = blob.found() ? 0 : objectless_ + 1;
  if (objectless_ > kLongGone) object_area_ = 0.0;
  if (!blob.found() || area < kVisible * object_area_) {
    ++hidden_;
    return;
  }
  hidden_ = 0;
  object_area_ = std::max(object_area_, area);
  object_place_ = {blob.moments.mean_u(), blob.moments.mean_v(), true};
}

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
