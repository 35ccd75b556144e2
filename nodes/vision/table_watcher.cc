#include "nodes/vision/table_watcher.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "nodes/vision/label_kernels.h"

namespace mimesis::vision {

using Eigen::Vector2d;

double SteadyPlace::usual_area() const {
  std::array<double, kMemory> sorted = areas_;
  const auto end = sorted.begin() + std::min(seen_, kMemory);
  const auto quartile = sorted.begin() + 3 * (end - sorted.begin() - 1) / 4;
  std::nth_element(sorted.begin(), quartile, end);
  return *quartile;
}

void SteadyPlace::update(const std::optional<Vector2d>& place_m, double area) {
  constexpr int kGone = 15;        // pictures after which an absent thing was taken away
  constexpr double kMoved = 0.02;  // [m]
  constexpr double kAlike = 0.03;
  absent_ = place_m ? 0 : absent_ + 1;
  if (absent_ >= kGone) *this = {};
  if (!place_m) return;
  elsewhere_ = mean_ && (*place_m - *mean_).norm() > kMoved ? elsewhere_ + 1 : 0;
  // it was moved, or the first observation was of another thing
  if (elsewhere_ >= kGone) *this = {};
  areas_.at(static_cast<std::size_t>(seen_ % kMemory)) = area;
  if (++seen_ == 2 * kMemory) seen_ = kMemory;
  if (mean_ && std::abs(area / usual_area() - 1.0) > kAlike) return;
  if (elsewhere_ > 0) return;
  count_ = std::min(count_ + 1, kMemory);
  mean_ = mean_ ? Vector2d(*mean_ + (*place_m - *mean_) / count_) : *place_m;
}

TableWatcher::TableWatcher(const WatcherSetup& setup)
    : camera_(setup.camera ? *setup.camera : image::Camera(setup.view)),
      sizes_(setup.sizes),
      light_(setup.reference_bgr),
      table_(setup.spots ? ColorTable(*setup.spots) : ColorTable(setup.boxes)),
      tracker_(setup.tracker),
      recognizer_(setup.recognizer),
      object_body_(cylinder(sizes_.object_radius_m, sizes_.object_height_m)),
      bar_body_(box(sizes_.bar_width_m, sizes_.bar_thickness_m, sizes_.bar_span_m)),
      cap_body_(cylinder(sizes_.goal_radius_m, sizes_.goal_cap_m)),
      open_(setup.open) {}

std::optional<Vector2d> TableWatcher::place(Kind kind, const Body& body) const {
  const Blob& blob = tracker_.blob(kind);
  if (!blob.found()) return std::nullopt;
  return locate(camera_, body, {blob.moments.mean_u(), blob.moments.mean_v()});
}

void TableWatcher::look() {
  constexpr double kLevel = 0.01;  // [m]
  bar_.update(place(Kind::bridge, bar_body_), blob(Kind::bridge).moments.area);
  goal_high_.update(place(Kind::goal_high, cap_body_), blob(Kind::goal_high).moments.area);
  goal_low_.update(place(Kind::goal_low, cap_body_), blob(Kind::goal_low).moments.area);
  const Vector2d resting(0.0, 0.5 * (sizes_.goal_cap_m + sizes_.object_height_m));
  sight_.bar = bar_.get();
  sight_.goal_high = goal_high_.get();
  sight_.goal_low = goal_low_.get();
  if (sight_.goal_high) *sight_.goal_high += resting;
  if (sight_.goal_low) *sight_.goal_low += resting;
  // A goal is high by its height; its colour decides only where the two cannot be told.
  if (sight_.goal_high && sight_.goal_low &&
      sight_.goal_low->y() > sight_.goal_high->y() + kLevel) {
    std::swap(sight_.goal_high, sight_.goal_low);
  }
  sight_.object = place(Kind::object, object_body_);
  look_at_hand();
}

void TableWatcher::look_at_hand() {
  sight_.palm.reset();
  palm_.reset();
  const Blob& hand = blob(Kind::hand);
  if (!hand.found()) return;
  const auto middle = camera_.on_plane(hand.moments.mean_u(), hand.moments.mean_v());
  if (!middle) return;
  const Eigen::Vector3d at(middle->x(), middle->y(), 0.0);
  const Vector2d reach = camera_.project(at + 0.1 * Eigen::Vector3d::UnitX()) - camera_.project(at);
  palm_ = find_palm(runs(), hand, reach, sizes_.hand_length_m * camera_.scale(at));
  if (palm_) sight_.palm = camera_.on_plane(palm_->center.x(), palm_->center.y());
}

template <class Picture>
std::optional<double> TableWatcher::object_luma(const Picture& picture) const {
  const Blob& object = blob(Kind::object);
  if (!object.found()) return std::nullopt;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (const Run& run : runs()) {
    if (!std::binary_search(object.regions.begin(), object.regions.end(), run.region)) continue;
    for (int u = run.begin; u < run.end; ++u) sum += bgr_at(picture, u, run.row);
    count += run.end - run.begin;
  }
  const Eigen::Vector3d mean = table_.gain().cwiseProduct(sum) / count;
  return to_yuv(mean[0], mean[1], mean[2]).y;
}

template <class Picture>
void TableWatcher::segment_any(const Picture& picture) {
  constexpr double kNoticeable = 0.02;  // change of gain worth a new table
  const Eigen::Vector3d& gain = light_.update(median_bgr(picture));
  if ((gain - table_.gain()).cwiseAbs().maxCoeff() > kNoticeable) table_.set_gain(gain);
  table_.apply(picture, labels_);
  if (open_) {
    uniform_.resize(labels_.size());
    opened_.resize(labels_.size());
    open_labels(labels_.data(), picture.width, picture.height, uniform_.data(), opened_.data());
    labels_.swap(opened_);
  }
  finder_.find(labels_, picture.width, picture.height);
  tracker_.update(finder_.regions());
}

template <class Picture>
void TableWatcher::watch_any(const Picture& picture) {
  MIMESIS_ASSERT(picture.width == camera_.width() && picture.height == camera_.height());
  segment_any(picture);
  look();
  sight_.object_luma = object_luma(picture);
  recognizer_.update(sight_);
}

template void TableWatcher::segment_any(const image::Image&);
template void TableWatcher::watch_any(const image::Image&);
template void TableWatcher::watch_any(const YuyvImage&);

std::optional<double> TableWatcher::bridge_height_m() const {
  if (!sight_.bar) return std::nullopt;
  return sight_.bar->y() - 0.5 * sizes_.bar_thickness_m;
}

}  // namespace mimesis::vision
