#include "nodes/vision/sight_drawing.h"

#include <array>
#include <span>

namespace mimesis::vision {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using model::Rgba;

constexpr Rgba kDoubt{0.95, 0.3, 0.2, 0.6};
constexpr std::array<Rgba, kKinds> kColors{{{0.0, 0.0, 0.0},
                                            {1.0, 0.55, 0.35},
                                            {0.2, 0.9, 0.3},
                                            {0.3, 0.5, 1.0},
                                            {1.0, 0.9, 0.2},
                                            {0.9, 0.3, 0.9}}};

void add_solid(foxglove::SceneEntity& entity, const Isometry3d& X_WT, const Thing& thing) {
  const Solid& s = thing.solid;
  const Vector3d half =
      0.5 * s.length *
      (s.form == Form::bar ? Vector3d(std::cos(s.yaw_rad), 0.0, -std::sin(s.yaw_rad))
                           : Vector3d(0.0, 1.0, 0.0));
  if (s.form == Form::block) {
    const Isometry3d pose = X_WT * Eigen::Translation3d(s.center);
    model::add_box(entity, pose, {2.0 * s.half_width, s.length, 2.0 * s.half_width},
                   color_of(thing.kind));
  } else {
    model::add_rod(entity, X_WT * (s.center - half), X_WT * (s.center + half), s.half_width,
                   color_of(thing.kind));
  }
  model::add_uncertainty(entity, X_WT * s.center,
                         X_WT.linear() * thing.covariance_m2 * X_WT.linear().transpose(), kDoubt);
}

}  // namespace

const Rgba& color_of(Kind kind) { return kColors[static_cast<std::size_t>(kind)]; }

foxglove::SceneUpdate draw_sight(const TableWatcher& watcher, const Isometry3d& X_WT,
                                 std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  if (watcher.stereo() == nullptr) return update;
  foxglove::SceneEntity& things = model::add_entity(update, "things", "world", stamp);
  for (const Thing& thing : watcher.stereo()->things()) add_solid(things, X_WT, thing);
  foxglove::SceneEntity& hand = model::add_entity(update, "hand", "world", stamp);  // none: empty
  if (watcher.hand() == nullptr || !watcher.hand()->sight()) return update;
  const HandTracker& tracker = watcher.hand()->tracker();
  HandCapsules capsules;
  tracker.model().capsules(tracker.estimate().pose, capsules);
  const image::Camera& camera = watcher.camera();
  Isometry3d X_WC = X_WT * Eigen::Translation3d(camera.eye());
  X_WC.linear() *= camera.R_CT().transpose();
  for (const Capsule& c : std::span(capsules).first(kHandCapsules - kForearmCapsules)) {
    if (c.radius_a == 0.0F) continue;
    const Vector3d a = X_WC * c.a.cast<double>(), b = X_WC * c.b.cast<double>();
    model::add_rod(hand, a, b, 0.5 * (c.radius_a + c.radius_b), color_of(Kind::hand));
    model::add_ball(hand, b, c.radius_b, color_of(Kind::hand));
  }
  return update;
}

}  // namespace mimesis::vision
