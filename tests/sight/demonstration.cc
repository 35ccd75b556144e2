#include "tests/sight/demonstration.h"

namespace mimesis {
Verdict watch(const camera::Picture& picture) {
  camera::Renderer renderer(picture);
  vision::TableWatcher watcher{vision::WatcherSetup{}};
  image::Image frame;
  Verdict verdict;
  double touched_s = -1.0, decided_s = -1.0;
  auto grip = task::Grip::unknown;
  auto transport = task::Transport::unknown;
  auto goal = task::Goal::unknown;
  const auto follow = [&verdict](auto& before, auto now) {
    if (before != decltype(now)::unknown && now != before) ++verdict.flips;
    before = now;
  };
  for (double t = 0.0; t < renderer.end_s() + 0.3; t += kFrame) {
    renderer.render(t, frame);
    watcher.watch(frame);
    const vision::ActionRecognizer& action = watcher.action();
    if (renderer.truth(t).held && touched_s < 0.0) touched_s = t;
    if (action.grip().value != task::Grip::unknown && decided_s < 0.0) decided_s = t;
    follow(grip, action.grip().value);
    follow(transport, action.transport().value);
    follow(goal, action.goal().value);
  }
  const task::Demonstration& shown = picture.script.demonstration;
  verdict.grip = grip == shown.grip;
  verdict.transport = transport == shown.transport;
  verdict.goal = goal == shown.goal;
  verdict.color = watcher.action().color().value == shown.color;
  verdict.complete = watcher.action().complete();
  verdict.abstained = watcher.action().grip_abstentions();
  verdict.decided_s = decided_s - touched_s;
  return verdict;
}

task::Demonstration demonstration(int k) {
  return {k & 4 ? task::Grip::full : task::Grip::precision,
          k & 2 ? task::Transport::below : task::Transport::above,
          k & 1 ? task::Goal::low : task::Goal::high, task::Color::light};
}

const std::vector<Conditions>& all_conditions() {
  static const std::vector<Conditions> kAll{
      {"as calibrated", 3.0, 0.6, 1.0, 1.0, 0.20, task::Color::light},
      {"noise 8", 8.0, 0.6, 1.0, 1.0, 0.20, task::Color::dark},
      {"dim", 4.0, 0.6, 0.6, 1.0, 0.20, task::Color::light},
      {"bright", 4.0, 0.6, 1.4, 1.0, 0.20, task::Color::dark},
      {"warm", 4.0, 0.6, 1.0, 1.25, 0.20, task::Color::light},
      {"cool", 4.0, 0.6, 1.0, 0.80, 0.20, task::Color::dark},
      {"high bar, blurred", 4.0, 2.0, 0.8, 1.1, 0.25, task::Color::light},
      {"low bar", 6.0, 1.0, 1.2, 0.9, 0.185, task::Color::dark},
  };
  return kAll;
}

camera::Picture picture_of(const task::Demonstration& shown, const Conditions& c,
                           std::uint64_t seed) {
  camera::Picture picture;
  picture.script.demonstration = shown;
  picture.script.demonstration.color = c.color;
  picture.table.bar_height_m = c.bar_height_m;
  picture.faults = {c.noise, c.blur_px, c.gain, c.warmth};
  picture.seed = seed;
  return picture;
}

}  // namespace mimesis
