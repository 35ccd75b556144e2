#include "nodes/vision/table_watcher.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

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

namespace {

Segmentation segmentation_for(const WatcherSetup& setup) {
  const Eigen::Vector3d& table = setup.reference_bgr;
  if (setup.spots) return {ColorTable(*setup.spots), LightMeter(*setup.spots, table), setup.open};
  return {ColorTable(setup.boxes), LightMeter(table), setup.open};
}

}  // namespace

void TableSkin::count(std::span<const std::uint8_t> labels) {
  std::ranges::fill(now_, 0);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] != static_cast<std::uint8_t>(Kind::hand)) continue;
    const int u = static_cast<int>(i) % width_, v = static_cast<int>(i) / width_;
    ++now_[static_cast<std::size_t>(v / kCell * columns_ + u / kCell)];
  }
}

void TableSkin::learn(std::span<const std::uint8_t> labels, int width, int height) {
  width_ = width;
  columns_ = (width + kCell - 1) / kCell;
  now_.resize(static_cast<std::size_t>(columns_ * ((height + kCell - 1) / kCell)));
  count(labels);
  learned_ = now_;
}

void TableSkin::update(std::span<const std::uint8_t> labels) {
  count(labels);
  for (std::size_t i = 0; i < now_.size(); ++i) {
    if (4 * now_[i] < learned_[i]) learned_[i] = 0;
  }
}

std::span<const double> TableSkin::shares(std::span<const Region> regions,
                                          std::span<const Run> runs) {
  shares_.assign(regions.size(), 0.0);
  for (const Run& run : runs) {
    if (run.kind != Kind::hand) continue;
    const int row = run.row / kCell * columns_;
    for (int u = run.begin; u < run.end;) {
      const int end = std::min(run.end, (u / kCell + 1) * kCell);
      const auto region = static_cast<std::size_t>(run.region);
      if (learned_[static_cast<std::size_t>(row + u / kCell)] > 0)
        shares_[region] += (end - u) / regions[region].moments.area;
      u = end;
    }
  }
  return shares_;
}

TableWatcher::TableWatcher(const WatcherSetup& setup)
    : camera_(setup.camera ? *setup.camera : image::Camera(setup.view)),
      right_(setup.right),
      sizes_(setup.sizes),
      small_gap_m_(setup.small_gap_m),
      hand_box_(setup.boxes.hand),
      reference_bgr_(setup.reference_bgr),
      segmentation_(segmentation_for(setup)),
      right_segmentation_(segmentation_for(setup)),
      tracker_(setup.tracker),
      min_hand_area_(setup.tracker.min_hand_area),
      clearance_m_(setup.recognizer.clearance_m),
      recognizer_(setup.recognizer),
      object_body_(cylinder(sizes_.object_radius_m, sizes_.object_height_m)),
      bar_body_(box(sizes_.bar_width_m, sizes_.bar_thickness_m, sizes_.bar_span_m)),
      cap_body_(cylinder(sizes_.goal_radius_m, sizes_.goal_cap_m)) {
  if (!right_) return;
  stereo_.emplace(camera_, *right_, setup.stereo);
  const std::array eyes{camera_, *right_};
  if (TeacherHand::possible(setup.hand, eyes)) hand_.emplace(setup.hand, eyes);
}

std::optional<Vector2d> TableWatcher::place(Kind kind, const Body& body) const {
  constexpr double kBelow = 0.05;  // [m] under the table is nothing
  const Blob& blob = tracker_.blob(kind);
  if (!blob.found()) return std::nullopt;
  const auto at = locate(camera_, body, {blob.moments.mean_u(), blob.moments.mean_v()});
  return at && at->y() > -kBelow ? at : std::nullopt;
}

void TableWatcher::look() {
  stereo_ ? look_with_two() : look_with_one();
  sight_.object = place(Kind::object, object_body_);
  look_at_hand();
}

void TableWatcher::look_with_one() {
  bar_.update(place(Kind::bar, bar_body_), blob(Kind::bar).moments.area);
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
      sight_.goal_low->y() > sight_.goal_high->y() + kSameHeight_m) {
    std::swap(sight_.goal_high, sight_.goal_low);
  }
}

void TableWatcher::look_with_two() {
  const Thing* bar = stereo_->bar();
  sight_.bar.reset();
  if (bar != nullptr) sight_.bar = bar->solid.center.head<2>();
  const std::vector<Thing> objects = stereo_->of(Kind::object);
  if (!objects.empty()) {  // its true size, from here on
    sizes_.object_radius_m = objects[0].solid.half_width;
    sizes_.object_height_m = objects[0].solid.length;
    object_body_ = objects[0].solid.body();
  }
  sight_.goal_high.reset();
  sight_.goal_low.reset();
  for (const Thing& goal : stereo_->goals()) {
    const Vector2d resting(goal.solid.center.x(), goal.solid.top() + 0.5 * sizes_.object_height_m);
    const Goal kind = classify(goal);
    if (kind == Goal::high && !sight_.goal_high) sight_.goal_high = resting;
    if (kind == Goal::low) sight_.goal_low = resting;
  }
}

std::optional<double> TableWatcher::gap_m(const Thing& goal) const {
  const Thing* bar = stereo_ ? stereo_->bar() : nullptr;
  if (bar == nullptr) return std::nullopt;
  return bar->solid.bottom() - goal.solid.top();
}

Goal TableWatcher::classify(const Thing& goal) const {
  const std::vector<Thing> goals = stereo_->goals();
  const double top = goal.solid.top(), highest = goals.front().solid.top(),
               lowest = goals.back().solid.top();
  if (highest > lowest + kSameHeight_m)
    return highest - top < top - lowest ? Goal::high : Goal::low;
  const auto gap = gap_m(goal);
  if (!gap) return Goal::unknown;
  return *gap < small_gap_m_ ? Goal::high : Goal::low;
}

void TableWatcher::look_at_hand() {
  sight_.palm.reset();
  sight_.wrist.reset();
  sight_.palm_angle_rad.reset();
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

/// Grip and transport are read off the hand model until they are decided. A palm that grasps faces
/// the object: how the model is turned and where the palm is are two measurements of one angle,
/// with errors of their own. Without a model the second is all there is.
void TableWatcher::follow_hand() {
  sight_.facing_angle_rad.reset();
  if (sight_.palm && sight_.object)
    sight_.facing_angle_rad = palm_angle(*sight_.palm, *sight_.object, clearance_m_);
  if (!hand_) sight_.palm_angle_rad = sight_.facing_angle_rad;
  if (!hand_) return;
  if (!recognizer_.needs_hand()) return hand_->forget();
  if (!right_new_) return;
  hand_->follow(sight_.palm);
  if (!hand_->sight()) return;
  sight_.wrist = hand_->sight()->wrist.head<2>();
  if (sight_.facing_angle_rad)
    sight_.palm_angle_rad = 0.5 * (hand_->sight()->palm_angle_rad + *sight_.facing_angle_rad);
}

/// Where object and hand are along the bar, by both cameras: fingers hide parts of the object, not
/// the same ones from both, so the hand's place counts as much.
void TableWatcher::look_beside_bar() {
  sight_.beside_m.reset();
  sight_.bar_half_m.reset();
  const Thing* bar = stereo_ ? stereo_->bar() : nullptr;
  if (bar == nullptr) return;
  sight_.bar_half_m = 0.5 * bar->solid.length;
  if (!right_new_ || !blob(Kind::object).found()) return;
  const Moments& object = blob(Kind::object).moments;
  const double yaw = bar->solid.yaw_rad;
  const Eigen::Vector3d along(std::cos(yaw), 0.0, -std::sin(yaw));
  std::optional<double> beside;
  if (const auto at = stereo_->object_at({object.mean_u(), object.mean_v()}))
    beside = along.dot(*at - bar->solid.center);
  if (hand_ && hand_->sight()) {
    const double hand = along.dot(hand_->sight()->palm - bar->solid.center);
    beside = beside ? 0.5 * (*beside + hand) : hand;
  }
  sight_.beside_m = beside;
}

const image::Image& TableWatcher::as_bgr(const YuyvImage& picture) {
  if (bgr_.width != picture.width || bgr_.height != picture.height)
    bgr_ = image::Image(picture.width, picture.height);
  for (int v = 0; v < bgr_.height; ++v) {
    for (int u = 0; u < bgr_.width; ++u) {
      const Eigen::Vector3d bgr = bgr_at(picture, u, v);
      for (int c = 0; c < 3; ++c) bgr_.at(u, v)[c] = static_cast<std::uint8_t>(bgr[c]);
    }
  }
  return bgr_;
}

void TableWatcher::look_for_second_hand() {
  const Blob& hand = blob(Kind::hand);
  bool seen = false;
  for (std::size_t i = 0; i < regions().size(); ++i) {
    const Region& r = regions()[i];
    seen |= r.kind == Kind::hand && r.moments.area >= min_hand_area_ &&
            !std::ranges::binary_search(hand.regions, static_cast<int>(i));
  }
  second_hand_ = seen ? second_hand_ + 1 : 0;
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
  const Eigen::Vector3d mean = segmentation_.gain().cwiseProduct(sum) / count;
  return to_yuv(mean[0], mean[1], mean[2]).y;
}

tl::expected<void, Status> TableWatcher::teach(const image::Image& image,
                                               std::span<const TaughtRegion> regions) {
  const Eigen::Vector3d gain =
      gain_by_table(image, reference_bgr_).value_or(Eigen::Vector3d::Ones());
  auto lesson = vision::teach(image, regions, gain);
  if (!lesson) return tl::unexpected(lesson.error());
  auto& hand = lesson->spots.of[static_cast<std::size_t>(Kind::hand)];
  skin_unlearned_ = !hand;
  table_skin_.reset();
  if (!hand) hand = spot_in(hand_box_);
  for (Segmentation* each : {&segmentation_, &right_segmentation_})
    each->learn(ColorTable(lesson->spots), {lesson->spots, lesson->reference_bgr, gain});
  right_new_ = false;  // it was looked at in the colours before
  if (stereo_) stereo_->forget();
  return {};
}

void TableWatcher::segment(const image::Image& image) {
  segmentation_.segment(image);
  tracker_.update(regions());
}

void TableWatcher::leave_out_skin_of_table() {
  constexpr double kMost = 0.8;  // of a hand's pixels
  if (skin_unlearned_) table_skin_.emplace().learn(labels(), camera_.width(), camera_.height());
  skin_unlearned_ = false;
  if (!table_skin_) return;
  table_skin_->update(labels());
  const std::span<const double> shares = table_skin_->shares(regions(), runs());
  for (std::size_t i = 0; i < shares.size(); ++i) {
    if (shares[i] > kMost) segmentation_.leave_out(i);
  }
}

template <class Picture>
void TableWatcher::watch_any(const Picture& picture) {
  MIMESIS_ASSERT(picture.width == camera_.width() && picture.height == camera_.height());
  segmentation_.segment(picture);
  leave_out_skin_of_table();
  tracker_.update(regions());
  if (right_new_) stereo_->update(regions(), right_segmentation_.regions());
  look();
  if (hand_ && recognizer_.needs_hand()) hand_->see(0, as_bgr(picture), labels());
  follow_hand();
  look_beside_bar();
  right_new_ = false;
  sight_.object_luma = object_luma(picture);
  look_for_second_hand();
  if (!two_hands()) recognizer_.update(sight_);
}

template <class Picture>
void TableWatcher::watch_right_any(const Picture& picture) {
  MIMESIS_ASSERT(right_ && picture.width == right_->width() && picture.height == right_->height());
  right_segmentation_.segment(picture);
  if (hand_ && recognizer_.needs_hand())
    hand_->see(1, as_bgr(picture), right_segmentation_.labels());
  right_new_ = true;
}

template void TableWatcher::watch_any(const image::Image&);
template void TableWatcher::watch_any(const YuyvImage&);
template void TableWatcher::watch_right_any(const image::Image&);
template void TableWatcher::watch_right_any(const YuyvImage&);

std::optional<double> TableWatcher::bar_height_m() const {
  if (stereo_) {
    const Thing* bar = stereo_->bar();
    return bar == nullptr ? std::nullopt : std::optional(bar->solid.bottom());
  }
  if (!sight_.bar) return std::nullopt;
  return sight_.bar->y() - 0.5 * sizes_.bar_thickness_m;
}

}  // namespace mimesis::vision
