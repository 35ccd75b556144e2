#include "experiments/sight/shown_scene.h"

#include <stdexcept>

#include "nodes/vision/files/colors_file.h"

namespace mimesis::sight {

vision::TableWatcher watcher_for(Shown& shown, std::uint64_t seed) {
  const auto cameras = camera::calibrated(shown.scene.cameras, seed);
  vision::WatcherSetup setup;
  setup.camera = cameras[0];
  setup.right = cameras[1];
  vision::TableWatcher watcher(setup);
  shown.render(0.0);
  std::vector<vision::TaughtRegion> regions;
  for (const camera::Click& c : camera::clicks(shown.scene.picture, shown.scene.cameras[0])) {
    const auto kind = vision::kind_named(c.name, "click");
    regions.push_back({kind, c.left, c.top, c.width, c.height});
  }
  const auto taught = watcher.teach(shown.seen_left, regions);
  if (!taught) throw std::runtime_error(taught.error().reason);
  return watcher;
}

void watch(vision::TableWatcher& watcher, Shown& shown, double t_s) {
  shown.render(t_s);
  watcher.watch_right(shown.seen_right);
  watcher.watch(shown.seen_left);
}

}  // namespace mimesis::sight
