#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>

#include "common/model/files.h"
#include "nodes/camera/random_scene.h"
#include "nodes/camera/robot_renderer.h"
#include "nodes/vision/files/colors_file.h"
#include "nodes/vision/robot_table.h"
#include "nodes/vision/vision_node.h"
#include "tests/sight/demonstration.h"

namespace mimesis {
namespace {

TEST(Sight, TellsEachDemonstrationUnderOtherConditions) {
  const auto& conditions = all_conditions();
  for (const int k : {3, 6}) {  // sight_slow_test: all
    const Conditions& c = conditions[static_cast<std::size_t>(k)];
    const Verdict v = watch(picture_of(demonstration(k), c, static_cast<std::uint64_t>(200 + k)));
    EXPECT_TRUE(v.right()) << c.what << ", demonstration " << k << ": grip " << v.grip
                           << " transport " << v.transport << " goal " << v.goal << " color "
                           << v.color << " complete " << v.complete;
    EXPECT_EQ(v.flips, 0) << c.what;
    EXPECT_LT(v.decided_s, 0.3) << c.what;
  }
}

TEST(Sight, MeasuresTheTableWithinMillimetres) {
  camera::Picture picture;
  picture.faults.noise = 8.0;
  for (const double height : {0.16, 0.20, 0.25}) {
    picture.script.demonstration = demonstration(0);
    picture.table.bar_height_m = height;
    camera::Renderer renderer(picture);
    vision::TableWatcher watcher{vision::WatcherSetup{}};
    image::Image frame;
    for (double t = 0.0; t < 0.4; t += kFrame) {
      renderer.render(t, frame);
      watcher.watch(frame);
    }
    const camera::Truth truth = renderer.truth(0.0);
    const vision::Sight& s = watcher.sight();
    ASSERT_TRUE(s.object && s.bar && s.goal_high && s.goal_low);
    const Eigen::Vector2d up(0.0, 0.5 * picture.table.object_height_m);
    EXPECT_LT((*s.object - truth.object).norm(), 0.005);
    EXPECT_LT((*s.goal_high - up - truth.goal_high).norm(), 0.005);
    EXPECT_LT((*s.goal_low - up - truth.goal_low).norm(), 0.005);
    EXPECT_NEAR(*watcher.bar_height_m(), height, 0.005);
  }
}

/// Light that changes within 3 s to anything between gain 0.6 and 1.4, warm or cool by 1.3.
TEST(Sight, ClassesSurviveChangesOfLight) {
  std::mt19937 random(4711);
  const auto between = [&random](double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random);
  };
  for (int run = 0; run < 2; ++run) {
    camera::Picture picture;
    picture.seed = static_cast<std::uint64_t>(50 + run);
    picture.clutter = 0;  // coloured things would be no false ones
    picture.faults.noise = 8.0;
    camera::Renderer renderer(picture);
    vision::TableWatcher watcher{vision::WatcherSetup{}};
    const double gain = between(0.6, 1.4), warmth = std::pow(1.3, between(-1.0, 1.0));
    std::array<double, vision::kKinds> area{};
    image::Image frame;
    for (int i = 0; i <= 90; i += 5) {
      camera::Faults faults = picture.faults;
      faults.gain = 1.0 + (gain - 1.0) * i / 90.0;
      faults.warmth = 1.0 + (warmth - 1.0) * i / 90.0;
      renderer.change_faults(faults);
      for (int k = 0; k < 5; ++k) {  // the light meter follows pictures, not time
        renderer.render(0.0, frame);
        watcher.watch(frame);
      }
      for (const auto kind : {vision::Kind::object, vision::Kind::bar, vision::Kind::goal_high,
                              vision::Kind::goal_low}) {
        double& usual = area.at(static_cast<std::size_t>(kind));
        const double now = watcher.blob(kind).moments.area;
        if (i == 0) usual = now;
        ASSERT_GT(usual, 100.0) << vision::name(kind);
        EXPECT_NEAR(now / usual, 1.0, 0.15)
            << vision::name(kind) << ", gain " << faults.gain << ", warmth " << faults.warmth;
        for (std::size_t r = 0; r < watcher.regions().size(); ++r) {
          const vision::Region& region = watcher.regions()[r];
          const auto& mine = watcher.blob(kind).regions;
          if (region.kind != kind || std::ranges::binary_search(mine, static_cast<int>(r)))
            continue;
          EXPECT_LT(region.moments.area, 30.0) << "a false " << vision::name(kind);
        }
      }
    }
  }
}

TEST(Sight, AGoalIsHighByItsHeightNotByItsColour) {
  camera::Picture picture;
  picture.script.demonstration = demonstration(1);
  std::swap(picture.table.goal_low_y_m, picture.table.goal_high_y_m);
  const Verdict v = watch(picture);
  EXPECT_TRUE(v.complete && v.transport);
  EXPECT_FALSE(v.goal);  // what was shown goes by the colour
}

TEST(Sight, FollowsObjectAndHandThroughTheMotion) {
  camera::Picture picture;
  picture.script.demonstration = demonstration(4);
  camera::Renderer renderer(picture);
  vision::TableWatcher watcher{vision::WatcherSetup{}};
  image::Image frame;
  double object2 = 0.0, palm2 = 0.0;
  int objects = 0, palms = 0, frames = 0;
  for (double t = 1.2; t < 5.4; t += kFrame, ++frames) {
    renderer.render(t, frame);
    watcher.watch(frame);
    const camera::Truth truth = renderer.truth(t);
    if (watcher.sight().object) {
      object2 += (*watcher.sight().object - truth.object).squaredNorm();
      ++objects;
    }
    if (watcher.sight().palm && truth.hand_in_view) {
      palm2 += (*watcher.sight().palm - truth.palm).squaredNorm();
      ++palms;
    }
  }
  EXPECT_EQ(objects, frames);
  EXPECT_GT(palms, frames * 9 / 10);
  EXPECT_LT(std::sqrt(object2 / objects), 0.015);
  EXPECT_LT(std::sqrt(palm2 / palms), 0.045);
}

TEST(Sight, CentroidsKeepStillWithinHalfAPixelUnderNoise) {
  camera::Picture clean;
  clean.faults.noise = 0.0;
  camera::Picture noisy = clean;
  noisy.faults.noise = 8.0;
  camera::Renderer clean_renderer(clean), noisy_renderer(noisy);
  vision::TableWatcher reference{vision::WatcherSetup{}}, watcher{vision::WatcherSetup{}};
  image::Image frame;
  clean_renderer.render(0.0, frame);
  reference.watch(frame);
  double sum = 0.0;
  int count = 0;
  for (int k = 0; k < 40; ++k) {
    noisy_renderer.render(0.01 * k, frame);
    watcher.watch(frame);
    for (const vision::Kind kind : {vision::Kind::object, vision::Kind::bar,
                                    vision::Kind::goal_high, vision::Kind::goal_low}) {
      const vision::Moments& a = reference.blob(kind).moments;
      const vision::Moments& b = watcher.blob(kind).moments;
      ASSERT_GT(a.area, 0.0);
      ASSERT_GT(b.area, 0.0);
      const double du = a.mean_u() - b.mean_u(), dv = a.mean_v() - b.mean_v();
      sum += du * du + dv * dv;
      ++count;
    }
    EXPECT_FALSE(watcher.blob(vision::Kind::hand).found()) << "frame " << k;
  }
  const double rms = std::sqrt(sum / count);
  std::printf("centroid error at noise 8: %.3f px rms\n", rms);
  EXPECT_LT(rms, 0.5);
}

TEST(Sight, SeesOnlyTheGripWhenTheTeacherStopsAfterGrasping) {  // [M18 Fig. 2.20]
  camera::Picture picture;
  picture.script.demonstration = demonstration(4);
  picture.script.only_grasp = true;
  camera::Renderer renderer(picture);
  vision::TableWatcher watcher{vision::WatcherSetup{}};
  image::Image frame;
  for (double t = 0.0; t < 6.0; t += kFrame) {
    renderer.render(t, frame);
    watcher.watch(frame);
  }
  EXPECT_EQ(watcher.action().grip().value, picture.script.demonstration.grip);
  EXPECT_EQ(watcher.action().transport().value, task::Transport::unknown);
  EXPECT_EQ(watcher.action().goal().value, task::Goal::unknown);
  EXPECT_FALSE(watcher.action().complete());
}

TEST(Sight, SeesTheGoalButNoTransportWithoutTheBar) {  // [M18 Fig. 2.21]
  camera::Picture picture;
  picture.script.demonstration = {task::Grip::full, task::Transport::below, task::Goal::high};
  picture.table.bar_removed = true;
  const Verdict v = watch(picture);
  EXPECT_TRUE(v.grip && v.goal && v.complete);
  EXPECT_FALSE(v.transport);
}

TEST(Sight, StartsAnewWithTheSecondDemonstration) {
  camera::Picture picture;
  picture.script.repeat = 2;
  camera::Renderer renderer(picture);
  vision::TableWatcher watcher{vision::WatcherSetup{}};
  image::Image frame;
  int completions = 0;
  bool before = false;
  for (double t = 0.0; t < renderer.end_s() + 0.3; t += kFrame) {
    renderer.render(t, frame);
    watcher.watch(frame);
    completions += watcher.action().complete() && !before ? 1 : 0;
    before = watcher.action().complete();
  }
  EXPECT_EQ(completions, 2);
  EXPECT_EQ(watcher.action().transport().value, task::Transport::above);
}

/// A tear that nothing tells, rows of the picture before below any row, changes no symbol.
TEST(Sight, TearsAreHarmless) {
  std::mt19937 random(2929);
  camera::Picture picture;
  picture.script.demonstration = demonstration(6);
  camera::Renderer renderer(picture);
  vision::TableWatcher watcher{vision::WatcherSetup{}};
  image::Image frame, before;
  for (double t = 0.0; t < renderer.end_s() + 0.3; t += kFrame) {
    renderer.render(t, frame);
    image::Image torn = frame;
    if (!before.bgr.empty() && random() % 4 == 0) {
      const auto from = static_cast<std::ptrdiff_t>(3 * 640 * (random() % 480));
      std::copy(before.bgr.begin() + from, before.bgr.end(), torn.bgr.begin() + from);
    }
    watcher.watch(torn);
    before = frame;
  }
  const vision::ActionRecognizer& action = watcher.action();
  EXPECT_EQ(action.grip().value, picture.script.demonstration.grip);
  EXPECT_EQ(action.transport().value, task::Transport::below);
  EXPECT_EQ(action.goal().value, task::Goal::high);
  EXPECT_TRUE(action.complete());
}

TEST(Renderer, IsAPureFunctionOfTimeAndSeed) {
  camera::Picture picture;
  camera::Renderer a(picture), b(picture);
  image::Image first, second, other;
  a.render(2.0, first);
  b.render(0.7, second);
  b.render(2.0, second);
  EXPECT_EQ(first.bgr, second.bgr);
  picture.seed = 2;
  camera::Renderer c(picture);
  c.render(2.0, other);
  EXPECT_NE(first.bgr, other.bgr);
}

/// With two cameras the grip is read off the palm of the hand model: also where the palm is tilted
/// and the hand is larger than told.
TEST(Sight, TwoCamerasFollowTheHandItself) {
  for (const int k : {0, 3}) {
    const bool full = k % 2 == 1;
    camera::Picture picture;
    picture.looks.right_hand = k > 1;
    picture.script.demonstration = demonstration(full ? 4 : 0);
    picture.script.tilt_rad = full ? 0.25 : -0.25;
    picture.script.hand_scale = 1.05;
    const auto cameras = camera::usual_cameras(picture.view, 0.3);
    camera::Renderer left(picture, cameras[0], 0), right(picture, cameras[1], 1);
    vision::WatcherSetup setup;
    setup.camera = cameras[0];
    setup.right = cameras[1];
    vision::TableWatcher watcher(setup);
    image::Image a, b;
    const double grasp_s = picture.script.start_s + 0.24 * picture.script.duration_s;
    for (double t = 0.0; t < grasp_s + 0.4; t += kFrame) {
      left.render(t, a);
      right.render(t, b);
      watcher.watch_right(b);
      watcher.watch(a);
    }
    ASSERT_TRUE(watcher.hand() != nullptr && watcher.hand()->sight());
    const vision::HandSight& hand = *watcher.hand()->sight();
    const camera::TeacherPose truth =
        camera::TeacherMotion(picture.script, picture.table).pose(grasp_s + 0.4);
    EXPECT_LT((hand.wrist - truth.wrist).norm(), 0.05) << k;
    const double angle = std::acos(-truth.palm_normal.normalized().y());
    EXPECT_NEAR(hand.palm_angle_rad, angle, 0.3) << k;
    EXPECT_EQ(watcher.action().grip().value, full ? task::Grip::full : task::Grip::precision);
    // Drawn where it is, on a table that stands turned and elsewhere.
    vision::RobotTableSetup table;
    table.origin_m = {1.7, 0.2, -0.01};
    table.yaw_rad = 2.0;
    const Eigen::Isometry3d X_WT = vision::table_in_world(table);
    const auto drawn = vision::draw_sight(watcher, X_WT, std::chrono::seconds(3));
    ASSERT_EQ(drawn.entities_size(), 2);
    EXPECT_EQ(drawn.entities(1).id(), "hand");
    EXPECT_GT(drawn.entities(1).spheres_size(), 15);
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto& ball : drawn.entities(1).spheres()) {
      const auto& p = ball.pose().position();
      middle += Eigen::Vector3d(p.x(), p.y(), p.z()) / drawn.entities(1).spheres_size();
    }
    EXPECT_LT((middle - X_WT * hand.palm).norm(), 0.08) << k;
  }
}

/// The hand model turns this small hand on its side, but it is right above the object.
TEST(Sight, APalmThatIsTurnedWrongDoesNotChangeTheGrip) {
  constexpr std::uint64_t kSeed = 6159;
  camera::Picture usual;
  usual.script.demonstration = {task::Grip::precision, task::Transport::above, task::Goal::high};
  usual.script.demonstration.color = task::Color::dark;
  usual.script.duration_s = 5.569968;
  const camera::RandomScene scene = camera::random_scene(usual, kSeed);
  camera::Renderer left(scene.picture, scene.cameras[0], 0),
      right(scene.picture, scene.cameras[1], 1);
  const auto cameras = camera::calibrated(scene.cameras, kSeed);
  vision::WatcherSetup setup;
  setup.camera = cameras[0];
  setup.right = cameras[1];
  vision::TableWatcher watcher(setup);
  image::Image a, b;
  left.render(0.0, a);
  std::vector<vision::TaughtRegion> lesson;
  for (const camera::Click& c : camera::clicks(scene.picture, scene.cameras[0]))
    lesson.push_back({vision::kind_named(c.name, "click"), c.left, c.top, c.width, c.height});
  ASSERT_TRUE(watcher.teach(a, lesson));
  for (double t = 0.0; t < 2.8; t += kFrame) {
    left.render(t, a);
    right.render(t, b);
    watcher.watch_right(b);
    watcher.watch(a);
  }
  EXPECT_EQ(watcher.action().grip().value, task::Grip::precision);
}

/// A lesson comes between the two cameras' pictures: what one saw in the colours before measures
/// nothing, and does not pass for the usual for seconds.
TEST(Sight, AfterALessonAllIsMeasuredAnew) {
  const kin::Table table = model::load_table("bar_table.yaml");
  image::View view;
  view.eye_m = {0.25, 0.95, 1.0};
  view.target_m = {0.0, 0.2, 0.0};
  const auto cameras = camera::usual_cameras(view, 0.35);
  const camera::Picture picture;
  const Eigen::Vector3d origin(0.52, 0.0, -0.01);
  camera::RobotRenderer left(table, picture.table.paints, picture.room, origin, cameras[0],
                             picture.faults, 1, 0),
      right(table, picture.table.paints, picture.room, origin, cameras[1], picture.faults, 1, 1);
  vision::WatcherSetup setup;
  setup.camera = cameras[0];
  setup.right = cameras[1];
  setup.stereo.goal_form = "block";
  vision::TableWatcher watcher(setup);
  image::Image a, b;
  for (int i = 0; i < 12; ++i) {
    left.render({}, table.object, 0.1 * i, a);
    right.render({}, table.object, 0.1 * i, b);
    watcher.watch_right(b);
    if (i == 0) {
      std::vector<vision::TaughtRegion> lesson;
      for (const camera::Click& c : left.clicks())
        lesson.push_back({vision::kind_named(c.name, "click"), c.left, c.top, c.width, c.height});
      ASSERT_TRUE(watcher.teach(a, lesson));
    }
    watcher.watch(a);
  }
  EXPECT_EQ(watcher.stereo()->things().size(), 4U);
  EXPECT_TRUE(watcher.stereo()->settled());
}

}  // namespace
}  // namespace mimesis
