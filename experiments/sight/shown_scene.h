#pragma once
#include "nodes/camera/random_scene.h"
#include "nodes/vision/table_watcher.h"

namespace mimesis::sight {

/// A scene that vision does not know, with both cameras.
struct Shown {
  explicit Shown(const camera::RandomScene& random)
      : scene(random),
        left(scene.picture, scene.cameras[0], 0),
        right(scene.picture, scene.cameras[1], 1) {}
  camera::RandomScene scene;
  camera::Renderer left, right;
  image::Image seen_left, seen_right;

  void render(double t_s) {
    left.render(t_s, seen_left);
    right.render(t_s, seen_right);
  }
};

/// Teaches vision the colours of what was clicked on. @throws std::runtime_error
void teach(vision::TableWatcher& watcher, const image::Image& shown,
           const std::vector<camera::Click>& clicks);

/// Vision with the calibration and a lesson of a few clicks.
vision::TableWatcher watcher_for(Shown& shown, std::uint64_t seed);

/// Shows it both pictures of a moment.
void watch(vision::TableWatcher& watcher, Shown& shown, double t_s);

}  // namespace mimesis::sight
