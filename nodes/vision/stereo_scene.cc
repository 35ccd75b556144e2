#include "nodes/vision/stereo_scene.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace mimesis::vision {
namespace {

using Eigen::Vector3d;

constexpr std::array<Kind, 4> kThings{Kind::object, Kind::bar, Kind::goal_high, Kind::goal_low};
constexpr double kAlikeAreas = 0.04;  // areas that differ by less show the same part of a thing
constexpr double kHere = 0.03;        // [m] from one picture to the next

/// Regions that may be one thing, and how badly they fit.
struct Candidate {
  std::size_t left, right;
  double cost;
};

/// The most pairs without a region in two of them, of these the best: exhaustive, since things of
/// one class are few.
struct Choice {
  std::vector<std::size_t> taken;
  double cost = 0.0;
};
void choose_pairs(std::span<const Candidate> candidates, std::size_t from, Choice& now,
                  Choice& best) {
  const auto better = [](const Choice& a, const Choice& b) {
    return a.taken.size() != b.taken.size() ? a.taken.size() > b.taken.size() : a.cost < b.cost;
  };
  if (better(now, best)) best = now;
  for (std::size_t i = from; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    const bool free = std::ranges::none_of(now.taken, [&](std::size_t k) {
      return candidates[k].left == c.left || candidates[k].right == c.right;
    });
    if (!free) continue;
    now.taken.push_back(i);
    now.cost += c.cost;
    choose_pairs(candidates, i + 1, now, best);
    now.taken.pop_back();
    now.cost -= c.cost;
  }
}

double upper_quartile(std::vector<double> values) {
  const auto at = values.begin() + 3 * (static_cast<std::ptrdiff_t>(values.size()) - 1) / 4;
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

std::string in_words(const Vector3d& p) {
  return fmt::format("({:.0f}, {:.0f}, {:.0f}) mm", 1e3 * p.x(), 1e3 * p.y(), 1e3 * p.z());
}

}  // namespace

Outline outline_of(const Moments& m) {
  // A pixel is a unit square, not a point.
  constexpr double kPixel = 1.0 / 12.0;
  const double u = m.mean_u(), v = m.mean_v();
  Outline out{m.area, {u, v}, {}};
  out.spread << m.uu / m.area - u * u + kPixel, m.uv / m.area - u * v, m.uv / m.area - u * v,
      m.vv / m.area - v * v + kPixel;
  return out;
}

StereoScene::StereoScene(const image::Camera& left, const image::Camera& right,
                         const SceneLimits& limits)
    : cameras_{left, right}, limits_(limits) {}

std::vector<StereoScene::Pair> StereoScene::pairs(Kind kind, std::span<const Region> left,
                                                  std::span<const Region> right) const {
  // Largest |logarithm of the ratio|: a bar that points to one camera looks short to it.
  const double most = kind == Kind::bar ? 1.2 : 0.5;
  constexpr double kMiddles = 0.4;           // the worst of 300 drawn bars has 0.3
  constexpr double kBelow = 0.02, kFar = 3;  // [m]
  constexpr std::size_t kMost = 8;           // the largest; more are clutter
  std::array<std::vector<Outline>, 2> seen;
  for (std::size_t side = 0; side < 2; ++side) {
    for (const Region& r : side == 0 ? left : right) {
      if (r.kind == kind && r.moments.area >= limits_.min_area)
        seen[side].push_back(outline_of(r.moments));
    }
    std::ranges::stable_sort(seen[side], std::greater{}, &Outline::area);
    if (seen[side].size() > kMost) seen[side].resize(kMost);
  }
  std::vector<Candidate> candidates;
  std::vector<Pair> possible;
  for (std::size_t i = 0; i < seen[0].size(); ++i) {
    for (std::size_t k = 0; k < seen[1].size(); ++k) {
      const Outline &a = seen[0][i], &b = seen[1][k];
      const double off = image::epipolar_distance(cameras_[0], cameras_[1], a.mean, b.mean);
      const double ratio = std::abs(std::log(a.area / b.area));
      // The middle of a thing's picture is not that of the thing, by the square of its extent.
      const double extent2 = std::max(a.spread.trace(), b.spread.trace()),
                   far = limits_.epipolar_px + kMiddles * extent2 / cameras_[0].lens().fx_px;
      if (off > far || ratio > most) continue;
      const std::array<image::Sighting, 2> rays{{{&cameras_[0], a.mean}, {&cameras_[1], b.mean}}};
      const auto met = image::triangulate(rays);
      // Regions of two things may lie on one line, too: one of the wrong pairs is below the table.
      if (!met || met->p_T.y() < -kBelow || met->p_T.norm() > kFar) continue;
      candidates.push_back({i, k, off / far + ratio / most});
      possible.push_back({{a, b}, met->p_T});
    }
  }
  Choice now, best;
  choose_pairs(candidates, 0, now, best);
  std::vector<Pair> out;
  for (const std::size_t i : best.taken) out.push_back(possible[i]);
  return out;
}

void StereoScene::update(std::span<const Region> left, std::span<const Region> right) {
  changes_.clear();
  unmatched_ = 0;
  regions_ = {left, right};
  for (const Kind kind : kThings) {
    std::vector<Pair> found = pairs(kind, left, right);
    const auto shows = [&](std::span<const Region> regions) {
      return std::ranges::any_of(regions, [&](const Region& r) {
        return r.kind == kind && r.moments.area >= 10 * limits_.min_area;
      });
    };
    unmatched_ += found.empty() && shows(left) && shows(right) ? 1 : 0;
    if (kind == Kind::object) objects_ = found;
    follow(kind, std::move(found));
  }
  const auto gone = [this](const Track& t) {
    if (t.missing <= limits_.gone_pictures) return false;
    if (t.announced)
      changes_.push_back(fmt::format("{} {} is gone", name(t.thing.kind), t.thing.id));
    return true;
  };
  std::erase_if(tracks_, gone);
  version_ += static_cast<int>(changes_.size());
  things_.clear();
  for (const Track& t : tracks_) {
    if (t.known) things_.push_back(t.thing);
  }
}

void StereoScene::follow(Kind kind, std::vector<Pair> pairs) {
  std::vector<Track*> waiting;
  for (Track& t : tracks_) {
    if (t.thing.kind == kind) waiting.push_back(&t);
  }
  // The nearest first, wherever it was last.
  while (!waiting.empty() && !pairs.empty()) {
    double least = std::numeric_limits<double>::infinity();
    std::size_t track = 0, pair = 0;
    for (std::size_t i = 0; i < waiting.size(); ++i) {
      for (std::size_t k = 0; k < pairs.size(); ++k) {
        const double far = (pairs[k].middle - waiting[i]->last).norm();
        if (far < least) std::tie(least, track, pair) = std::tuple(far, i, k);
      }
    }
    // The only one of its kind may have been moved unseen. Specks do not count.
    if (least > kHere) {
      const auto lone = sole_move(waiting, pairs);
      if (!lone) break;
      std::tie(track, pair) = *lone;
    }
    see(*waiting[track], pairs[pair]);
    waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(track));
    pairs.erase(pairs.begin() + static_cast<std::ptrdiff_t>(pair));
  }
  for (Track* t : waiting) {
    ++t->missing;
    t->thing.seen = false;
  }
  for (const Pair& pair : pairs) {
    Track t;
    t.thing.kind = kind;
    t.thing.id = ++ids_;
    restart(t, pair);
    tracks_.push_back(std::move(t));
  }
}

/// The only known thing that waits and the only pair that shows a fifth of its area or more, if
/// there is one of each; by their indices.
std::optional<std::pair<std::size_t, std::size_t>> StereoScene::sole_move(
    std::span<Track* const> waiting, std::span<const Pair> pairs) const {
  constexpr double kMuch = 0.2;
  const auto known = [](const Track* t) { return t->announced; };
  if (std::ranges::count_if(waiting, known) != 1) return std::nullopt;
  const auto track = std::ranges::find_if(waiting, known);
  const auto areas = usual_areas(**track);
  const auto much = [&areas](const Pair& p) {
    return p.seen[0].area > kMuch * areas[0] && p.seen[1].area > kMuch * areas[1];
  };
  if (std::ranges::count_if(pairs, much) != 1) return std::nullopt;
  return std::pair(static_cast<std::size_t>(track - waiting.begin()),
                   static_cast<std::size_t>(std::ranges::find_if(pairs, much) - pairs.begin()));
}

void StereoScene::restart(Track& track, const Pair& pair) {
  track.memory = {pair};
  track.next = 1;
  track.count = 1;
  track.missing = track.elsewhere = track.unlike = 0;
  track.known = false;
  track.rows_px.reset();
  track.last = pair.middle;
}

Vector3d StereoScene::usual_place(const Track& track) const {
  Vector3d sum = Vector3d::Zero();
  for (const Pair& p : track.memory) sum += p.middle;
  return sum / static_cast<double>(track.memory.size());
}

std::array<double, 2> StereoScene::usual_areas(const Track& track) const {
  std::array<double, 2> out{};
  for (std::size_t side = 0; side < 2; ++side) {
    std::vector<double> areas;
    for (const Pair& p : track.memory) areas.push_back(p.seen[side].area);
    out[side] = upper_quartile(std::move(areas));
  }
  return out;
}

/// Whether a region of another kind, or of the hand, is beside a thing in one of the pictures: by
/// the boxes around both.
bool StereoScene::covered(Kind kind, const Pair& pair) const {
  const auto half = [](const Outline& o) -> Eigen::Array2d {
    constexpr double kHalf = 2.0;  // of a disc over its standard deviation; a square's is less
    return kHalf * o.spread.diagonal().array().sqrt();
  };
  for (std::size_t side = 0; side < 2; ++side) {
    const Outline& seen = pair.seen[side];
    const auto touches = [&](const Region& r) {
      if (r.kind == kind || r.moments.area < limits_.min_area) return false;
      const Outline other = outline_of(r.moments);
      return ((other.mean - seen.mean).array().abs() < half(other) + half(seen)).all();
    };
    if (std::ranges::any_of(regions_[side], touches)) return true;
  }
  return false;
}

void StereoScene::see(Track& track, const Pair& pair) {
  constexpr int kSudden = 3;       // pictures elsewhere that are no outlier
  constexpr int kPassed = 15;      // pictures in which what hid a part of it has passed
  constexpr double kWhole = 0.12;  // what is all in view keeps its area but for its distance
  track.missing = 0;
  track.thing.seen = true;
  track.last = pair.middle;
  const auto areas = usual_areas(track);
  double change = 0.0, least = 1.0;
  const Vector3d usual = usual_place(track);
  for (std::size_t side = 0; side < 2; ++side) {
    const double nearer = cameras_[side].depth(usual) / cameras_[side].depth(pair.middle);
    const double expected = areas[side] * nearer * nearer;
    const double share = pair.seen[side].area / expected;
    change = std::max(change, std::abs(share - 1.0));
    least = std::min(least, share);
  }
  const double away = (pair.middle - usual).norm();
  const bool part = least < 1.0 - kAlikeAreas;
  if (part && away < kHere && covered(track.thing.kind, pair)) return;
  track.elsewhere = away > limits_.moved_m ? track.elsewhere + 1 : 0;
  track.unlike = change > kWhole ? track.unlike + 1 : 0;
  const int enough = part || away < kHere ? kPassed : kSudden;
  if (track.elsewhere >= enough && (track.unlike == 0 || track.unlike >= kMemory)) {
    if (track.known) {
      changes_.push_back(fmt::format("{} {} moved by {:.0f} mm to {}", name(track.thing.kind),
                                     track.thing.id, 1e3 * away, in_words(pair.middle)));
    }
    return restart(track, pair);
  }
  if (track.elsewhere > 0) return;
  if (track.memory.size() < kMemory) {
    track.memory.push_back(pair);
  } else {
    track.memory[track.next++ % kMemory] = pair;
  }
  ++track.count;
  constexpr int kOften = 5;
  if (track.count <= 2 * limits_.settled_pictures || track.count % kOften == 0) measure(track);
}

void StereoScene::measure(Track& track) {
  constexpr double kFloor_px = 0.25, kNoise_px = 0.3;  // of centroids: bias, and of one picture
  constexpr double kMisfit = 4.0;                      // standard deviations
  const auto areas = usual_areas(track);
  std::array<Outline, 2> mean{};
  int whole = 0;
  for (const Pair& p : track.memory) {
    const bool all = std::abs(p.seen[0].area / areas[0] - 1.0) < kAlikeAreas &&
                     std::abs(p.seen[1].area / areas[1] - 1.0) < kAlikeAreas;
    if (!all) continue;
    ++whole;
    for (std::size_t side = 0; side < 2; ++side) {
      mean[side].area += p.seen[side].area;
      mean[side].mean += p.seen[side].mean;
      mean[side].spread += p.seen[side].spread;
    }
  }
  if (whole < limits_.pictures) return;
  for (Outline& o : mean) {
    o.area /= whole;
    o.mean /= whole;
    o.spread /= whole;
  }
  Solid form;
  if (track.thing.kind == Kind::bar) {
    form.form = Form::bar;
    form.aspect = limits_.bar_aspect;
  } else if (track.thing.kind != Kind::object && limits_.goal_form == "block") {
    form.form = Form::block;
  }
  const auto found =
      fit_solid(form, cameras_, mean, std::hypot(kFloor_px, kNoise_px / std::sqrt(whole)));
  if (found) track.rows_px = rows_px(found->solid, mean);
  const bool likely = found && found->misfit < kMisfit &&
                      found->solid.half_width > limits_.smallest_m &&
                      found->solid.length < limits_.largest_m;
  if (!likely) return;
  track.thing.solid = found->solid;
  // Pixels that no solid explains add to the uncertainty of the place.
  track.thing.covariance_m2 = std::max(1.0, found->misfit * found->misfit) * found->covariance_m2 +
                              rig_covariance(found->solid.center);
  track.thing.pictures = whole;
  track.known = true;
  if (track.announced) return;
  track.announced = true;
  changes_.push_back(fmt::format("{} {} appeared at {}", name(track.thing.kind), track.thing.id,
                                 in_words(found->solid.center)));
}

double StereoScene::rows_px(const Solid& solid, const std::array<Outline, 2>& seen) const {
  constexpr double kStep = 1e-3;  // [m]
  const Vector3d along = kStep * (cameras_[1].eye() - cameras_[0].eye()).normalized();
  std::array<double, 2> off{};
  for (std::size_t side = 0; side < 2; ++side) {
    const Eigen::Vector2d row = (cameras_[side].project(solid.center + along) -
                                 cameras_[side].project(solid.center - along))
                                    .normalized();
    const Eigen::Vector2d away =
        seen[side].mean - outline(cameras_[side], solid.body(), solid.center).mean;
    off[side] = row.x() * away.y() - row.y() * away.x();
  }
  return off[1] - off[0];
}

std::optional<double> StereoScene::rows_off_px() const {
  double squares = 0.0, worst = 0.0;
  int count = 0;
  for (const Track& t : tracks_) {
    if (!t.rows_px || t.missing > 0) continue;
    const double square = *t.rows_px * *t.rows_px;
    squares += square;
    worst = std::max(worst, square);
    ++count;
  }
  if (count < 3) return std::nullopt;
  return std::sqrt((squares - worst) / (count - 1));
}

/// What the errors of the calibration add: each of them alone moves the point in which the rays
/// meet.
Eigen::Matrix3d StereoScene::rig_covariance(const Vector3d& center) const {
  const std::array<Eigen::Vector2d, 2> pixels{cameras_[0].project(center),
                                              cameras_[1].project(center)};
  Eigen::Matrix3d out = Eigen::Matrix3d::Zero();
  const auto add = [&](double focal, const Vector3d& turn, const Vector3d& place, bool both) {
    std::array<image::Camera, 2> off = cameras_;
    for (std::size_t k = both ? 0 : 1; k < 2; ++k) {
      image::Lens lens = off[k].lens();
      lens.fx_px *= 1.0 + focal;
      lens.fy_px *= 1.0 + focal;
      const Eigen::Matrix3d r =
          Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
      off[k] = image::Camera(lens, r * off[k].R_CT(), off[k].eye() + place);
    }
    const std::array<image::Sighting, 2> rays{{{&off[0], pixels[0]}, {&off[1], pixels[1]}}};
    const auto met = image::triangulate(rays);
    if (met) out += (met->p_T - center) * (met->p_T - center).transpose();
  };
  const RigAccuracy& rig = limits_.rig;
  const Vector3d none = Vector3d::Zero();
  add(rig.focal, none, none, true);
  for (int i = 0; i < 3; ++i) {
    add(0.0, rig.turn_rad * Vector3d::Unit(i), none, true);
    add(0.0, none, rig.place_m * Vector3d::Unit(i), true);
    add(0.0, rig.pair_turn_rad * Vector3d::Unit(i), none, false);
    add(0.0, none, rig.pair_place_m * Vector3d::Unit(i), false);
  }
  return out;
}

bool StereoScene::settled() const {
  return std::ranges::all_of(tracks_, [this](const Track& t) {
    return !t.announced || (t.known && t.thing.pictures >= limits_.settled_pictures);
  });
}

std::vector<Thing> StereoScene::of(Kind kind) const {
  std::vector<Thing> out;
  std::ranges::copy_if(things_, std::back_inserter(out),
                       [kind](const Thing& t) { return t.kind == kind; });
  std::ranges::stable_sort(out, std::greater{}, [](const Thing& t) { return t.solid.top(); });
  return out;
}

std::optional<Vector3d> StereoScene::object_at(const Eigen::Vector2d& left_px) const {
  const auto nearest = std::ranges::min_element(
      objects_, {}, [&left_px](const Pair& p) { return (p.seen[0].mean - left_px).norm(); });
  if (nearest == objects_.end()) return std::nullopt;
  return nearest->middle;
}

const Thing* StereoScene::bar() const {
  const auto it = std::ranges::find(things_, Kind::bar, &Thing::kind);
  return it == things_.end() ? nullptr : &*it;
}

std::vector<Thing> StereoScene::goals() const {
  std::vector<Thing> out = of(Kind::goal_high), more = of(Kind::goal_low);
  out.insert(out.end(), more.begin(), more.end());
  std::ranges::stable_sort(out, std::greater{}, [](const Thing& t) { return t.solid.top(); });
  return out;
}

}  // namespace mimesis::vision
