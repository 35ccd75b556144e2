#include "experiments/sight/shown_scene.h"

#include <stdexcept>

#include "nodes/vision/files/colors_file.h"

namespace mimesis::sight {

void teach(vision::TableWatcher& watcher, const image::Image& shown,
           const std::vector<camera::Click>& clicks) {
  std::vector<vision::TaughtRegion> regions;
  for (const camera::Click& c : clicks) {
    const auto kind = vision::kind_named(c.name, "click");
    regions.push_back({kind, c.left, c.top, c.width, c.height});
  }
  const auto taught = watcher.teach(shown, regions);
  if (!taught) throw std::runtime_error(taught.error().reason);
}

vision::TableWatcher watcher_for(Shown& shown, std::uint64_t seed) {
  const auto cameras = camera::calibrated(shown.scene.cameras, seed);
  vision::WatcherSetup setup;
  setup.camera = cameras[0];
  setup.right = cameras[1];
  vision::TableWatcher watcher(setup);
  shown.render(0.0);
  teach(watcher, shown.seen_left, camera::clicks(shown.scene.picture, shown.scene.cameras[0]));
  return watcher;
}

void watch(vision::TableWatcher& watcher, Shown& shown, double t_s) {
  shown.render(t_s);
  watcher.watch_right(shown.seen_right);
  watcher.watch(shown.seen_left);
}

}  // namespace mimesis::sight
