#include "tests/sight/demonstration.h"

namespace mimesis {
namespace {

vision::Transport expected(camera::Transport t) {
  return t == camera::Transport::above ? vision::Transport::above : vision::Transport::below;
}
vision::Goal expected(camera::Goal goal) {
  return goal == camera::Goal::high ? vision::Goal::high : vision::Goal::low;
}
vision::Color expected(camera::Color color) {
  return color == camera::Color::light ? vision::Color::light : vision::Color::dark;
}

}  // namespace

vision::Grip expected(camera::Grip grip) {
  return grip == camera::Grip::precision ? vision::Grip::precision : vision::Grip::full;
}
Verdict watch(const camera::Picture& picture) {
  camera::Renderer renderer(picture);
  vision::TableWatcher watcher{vision::WatcherSetup{}};
  image::Image frame;
  Verdict verdict;
  double touched_s = -1.0, decided_s = -1.0;
  auto grip = vision::Grip::unknown;
  auto transport = vision::Transport::unknown;
  auto goal = vision::Goal::unknown;
  const auto follow = [&verdict](auto& before, auto now) {
    if (before != decltype(now)::unknown && now != before) ++verdict.flips;
    before = now;
  };
  for (double t = 0.0; t < renderer.end_s() + 0.3; t += kFrame) {
    renderer.render(t, frame);
    watcher.watch(frame);
    const vision::ActionRecognizer& action = watcher.action();
    if (renderer.truth(t).held && touched_s < 0.0) touched_s = t;
    if (action.grip().value != vision::Grip::unknown && decided_s < 0.0) decided_s = t;
    follow(grip, action.grip().value);
    follow(transport, action.transport().value);
    follow(goal, action.goal().value);
  }
  const camera::Lesson& lesson = picture.script.lesson;
  verdict.grip = grip == expected(lesson.grip);
  verdict.transport = transport == expected(lesson.transport);
  verdict.goal = goal == expected(lesson.goal);
  verdict.color = watcher.action().color().value == expected(picture.script.color);
  verdict.complete = watcher.action().complete();
  verdict.abstained = watcher.action().grip_abstentions();
  verdict.decided_s = decided_s - touched_s;
  return verdict;
}

camera::Lesson lesson(int k) {
  return {k & 4 ? camera::Grip::full : camera::Grip::precision,
          k & 2 ? camera::Transport::below : camera::Transport::above,
          k & 1 ? camera::Goal::low : camera::Goal::high};
}

const std::vector<Conditions>& all_conditions() {
  static const std::vector<Conditions> kAll{
      {"as calibrated", 3.0, 0.6, 1.0, 1.0, 0.20, camera::Color::light},
      {"noise 8", 8.0, 0.6, 1.0, 1.0, 0.20, camera::Color::dark},
      {"dim", 4.0, 0.6, 0.6, 1.0, 0.20, camera::Color::light},
      {"bright", 4.0, 0.6, 1.4, 1.0, 0.20, camera::Color::dark},
      {"warm", 4.0, 0.6, 1.0, 1.25, 0.20, camera::Color::light},
      {"cool", 4.0, 0.6, 1.0, 0.80, 0.20, camera::Color::dark},
      {"high bridge, blurred", 4.0, 2.0, 0.8, 1.1, 0.25, camera::Color::light},
      {"low bridge", 6.0, 1.0, 1.2, 0.9, 0.185, camera::Color::dark},
  };
  return kAll;
}

camera::Picture picture_of(const camera::Lesson& lesson, const Conditions& c, std::uint64_t seed) {
  camera::Picture picture;
  picture.script.lesson = lesson;
  picture.script.color = c.color;
  picture.table.bridge_height_m = c.bridge_height_m;
  picture.faults = {c.noise, c.blur_px, c.gain, c.warmth};
  picture.seed = seed;
  return picture;
}

}  // namespace mimesis
