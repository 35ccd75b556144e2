#include "experiments/motion/film.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "common/image/image_file.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using mocap::kBodyRows;

std::filesystem::path fresh_folder() {
  const auto folder =
      std::filesystem::path(::testing::TempDir()) /
      ("film_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
  std::filesystem::remove_all(folder);
  return folder;
}

/// Camera that looks along y of W (x to the right), 1 m high, 200 px.
FilmCamera flat_camera() {
  FilmCamera camera;
  camera.eye_m = {0.0, -3.0, 0.5};
  camera.target_m = {0.0, 0.0, 0.5};
  camera.height_m = 1.0;
  camera.width_px = camera.height_px = 200;
  return camera;
}

struct Bgr {
  int blue, green, red;
};
Bgr at(const image::Image& image, int u, int v) {
  return {image.at(u, v)[0], image.at(u, v)[1], image.at(u, v)[2]};
}
bool reddish(const Bgr& c) { return c.red > 2 * c.blue && c.red > 60; }
bool bluish(const Bgr& c) { return c.blue > 2 * c.red && c.blue > 60; }

TEST(FilmView, PutsRightToTheRightAndUpUp) {
  FilmCamera camera;
  camera.eye_m = {0.0, -4.0, 1.0};
  camera.target_m = {0.0, 0.0, 1.0};
  camera.field_of_view_rad = 2.0 * std::atan(0.25);  // 2 m high at 4 m
  camera.width_px = 301;
  camera.height_px = 201;
  const FilmView view(camera, 1);
  EXPECT_LT((view.pixel({0, 0, 1}) - Vector2d(150, 100)).norm(), 1e-9);
  EXPECT_LT((view.pixel({1, 0, 1}) - Vector2d(250.5, 100)).norm(), 1e-9);
  EXPECT_LT((view.pixel({0, 0, 2}) - Vector2d(150, -0.5)).norm(), 1e-9);
  EXPECT_LT((view.pixel({1, 4, 1}) - Vector2d(150 + 50.25, 100)).norm(), 1e-9);  // twice as far
  EXPECT_LT((view.point(250.5, 100, 4.0) - Vector3d(1, 0, 1)).norm(), 1e-9);
  camera.height_m = 2.0;
  const FilmView flat(camera, 1);
  EXPECT_LT((flat.pixel({1, 4, 1}) - flat.pixel({1, 0, 1})).norm(), 1e-9);
  EXPECT_LT((flat.pixel({1, 4, 1}) - Vector2d(250.5, 100)).norm(), 1e-9);
}

TEST(Film, NearThingsHideFarOnesInAnyOrder) {
  for (const bool red_first : {true, false}) {
    FilmFrame frame;
    frame.camera = flat_camera();
    const FilmLimb red{{-0.3, 0.2, 0.5}, {0.3, 0.2, 0.5}, 0.05, 0.05, {220, 30, 30}};
    const FilmLimb blue{{0.0, -0.2, 0.2}, {0.0, -0.2, 0.8}, 0.05, 0.05, {30, 30, 220}};
    frame.limbs = red_first ? std::vector{red, blue} : std::vector{blue, red};
    const image::Image picture = draw(frame);
    EXPECT_TRUE(bluish(at(picture, 100, 100)));
    EXPECT_TRUE(reddish(at(picture, 60, 100)));
    EXPECT_TRUE(bluish(at(picture, 100, 60)));
    EXPECT_FALSE(reddish(at(picture, 60, 60)));
    frame.boxes.push_back({{0.0, -0.5, 0.5}, {0.1, 0.1, 0.1}, 0.3, {30, 220, 30}});
    const Bgr centre = at(draw(frame), 100, 100);
    EXPECT_GT(centre.green, 2 * centre.blue);
  }
}

TEST(Film, AStandingFigureTouchesTheGroundAndHasItsSidesApart) {
  const mocap::Body body = mocap::standard_body();
  const std::array<double, kBodyRows> zero{};
  FilmFrame frame;
  add_body(frame, body, forward_kinematics(body, zero, {0, 0, 0.965}));
  double lowest = 1.0;
  for (const FilmLimb& l : frame.limbs) {
    lowest = std::min({lowest, l.from.z() - l.radius_from, l.to.z() - l.radius_to});
  }
  EXPECT_NEAR(lowest, 0.0, 1e-9);  // the soles: hip 0.05 + leg 0.835 + ankle 0.08
  frame.camera = flat_camera();
  frame.camera.eye_m = {3.0, 0.0, 0.5};  // from the front: its left side is on our right
  frame.camera.target_m = {0.0, 0.0, 0.5};
  const image::Image picture = draw(frame);
  const int knee_v = static_cast<int>(200 * (1.0 - 0.5));
  EXPECT_TRUE(bluish(at(picture, 100 + 17, knee_v)));
  EXPECT_TRUE(reddish(at(picture, 100 - 17, knee_v)));
}

TEST(Film, ASideViewHoldsTheWholeWayFromLeftToRight) {
  std::vector<FilmFrame> frames(3);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double y = 3.0 * static_cast<double>(i);
    frames[i].limbs.push_back({{0, y, 0.1}, {0, y, 1.7}, 0.05, 0.05, {}});
  }
  const FilmCamera camera = side_view(frames, 800, 300);
  const FilmView view(camera, 1);
  const Vector2d first = view.pixel({0, 0, 0.1}), last = view.pixel({0, 6, 1.7});
  EXPECT_LT(first.x(), last.x());
  EXPECT_GT(first.y(), last.y());
  for (const Vector2d& p : {first, last}) {
    EXPECT_TRUE(p.x() > 0 && p.x() < 800 && p.y() > 0 && p.y() < 300) << p.transpose();
  }
  EXPECT_GT(last.x() - first.x(), 600);  // the curve fills the picture
}

TEST(Film, ChoosesFramesEvenly) {
  EXPECT_EQ(evenly_chosen(11, 3), (std::vector<std::size_t>{0, 5, 10}));
  EXPECT_EQ(evenly_chosen(2, 6), (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(evenly_chosen(5, 1), (std::vector<std::size_t>{4}));
}

TEST(Film, WritesFramesAndStrip) {
  const mocap::Body body = mocap::standard_body();
  std::vector<FilmFrame> frames(4);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    std::array<double, kBodyRows> q{};
    q[3 * mocap::kLeftHip + 1] = -0.15 * static_cast<double>(i);
    frames[i].camera.width_px = 160;
    frames[i].camera.height_px = 120;
    frames[i].label = film_time(0.25 * static_cast<double>(i));
    add_body(frames[i], body,
             forward_kinematics(body, q, {0.3 * static_cast<double>(i), 0, 0.965}));
    add_dot(frames[i], {1.0, 0.0, 1.0}, 0.05, {30, 160, 60});
  }
  const auto folder = fresh_folder();
  const auto files = write_film(frames, folder, "walk", {.count = 3, .cell_width_px = 80});
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0], folder / "walk.png");
  EXPECT_TRUE(std::filesystem::exists(folder / "walk" / "frame_0003.png"));
  const auto sheet = image::read_image(files[0]);
  ASSERT_TRUE(sheet.has_value());
  EXPECT_EQ(sheet->width, 240);
  EXPECT_EQ(sheet->height, 60);
  const FilmCamera camera = side_view(frames, 900, 400);
  const auto path = write_film(frames, folder, "path", {.count = 4, .along_path = camera});
  EXPECT_EQ(image::read_image(path[0])->width, 900);
  EXPECT_EQ(draw(frames[1]).bgr, draw(frames[1]).bgr);  // same bits again
}

TEST(Film, SaysWhereItCouldNotWrite) {
  std::vector<FilmFrame> frames(1);
  const auto folder = fresh_folder();
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "walk") << "in the way";
  try {
    write_film(frames, folder, "walk");
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("walk"), std::string::npos);
  }
}

}  // namespace
}  // namespace mimesis::synthesizer
