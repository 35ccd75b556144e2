#include "nodes/camera/random_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace mimesis::camera {
namespace {

using Eigen::Vector3d;

/// Draws the same on every platform.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed * 0x9e3779b97f4a7c15ull + 1) {}
  double between(double lo, double hi) {
    return lo + (hi - lo) * static_cast<double>(random_() >> 11) * 0x1.0p-53;
  }
  /// Sum of twelve uniform draws: nearly normal.
  double normal(double sigma) {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += between(0.0, 1.0);
    return sigma * sum;
  }
  Vector3d normal3(double sigma) {
    const double x = normal(sigma), y = normal(sigma);
    return {x, y, normal(sigma)};
  }

 private:
  std::mt19937_64 random_;
};

/// Colour of a hue in the plane of U and V with this chroma, whose luma is as near to the wanted
/// one as paint allows. Where paint allows no `least_luma` (bright blue) the chroma is smaller.
Bgr paint(double hue_rad, double chroma, double luma, double least_luma = 0.0) {
  constexpr double kDarkest = 12.0, kBrightest = 225.0;
  // Blue, green and red beyond their luma.
  double blue = chroma * std::cos(hue_rad) / 0.492, red = chroma * std::sin(hue_rad) / 0.877;
  double green = -(0.114 * blue + 0.299 * red) / 0.587, most = std::max({blue, green, red});
  const double grey = std::min(1.0, (kBrightest - least_luma) / most);
  blue *= grey, green *= grey, red *= grey, most *= grey;
  const double least = std::min({blue, green, red});
  luma = std::min(std::max(luma, kDarkest - least), kBrightest - most);
  return Vector3d(luma + blue, luma + green, luma + red).cwiseMax(kDarkest).cast<float>();
}

void draw_paints(Draw& draw, Paints& paints) {
  // Skin and wood lie around 130° in this plane; the four things share the rest of the circle.
  constexpr double kSkinHue = 130.0, kRoom = 360.0 / 5.0, kDegree = std::numbers::pi / 180.0;
  const int first = static_cast<int>(draw.between(0.0, 4.0));
  const auto hue = [&](int k) {
    return kDegree * (kSkinHue + kRoom * (1 + (first + k) % 4) + draw.between(-9.0, 9.0));
  };
  // A light object has a luma of 150 at least, a dark one of 86 at most (the darkest paint bounds
  // it): shade takes 2 to 16 % against the table, whose tone varies by 5 %, and vision abstains
  // from 92 to 116.
  constexpr double kLight = 150.0;
  const double object = hue(0);
  paints.light_object =
      paint(object, draw.between(45.0, 55.0), draw.between(kLight, 180.0), kLight);
  paints.dark_object = paint(object, draw.between(26.0, 36.0), draw.between(60.0, 80.0));
  paints.bar = paint(hue(1), draw.between(45.0, 65.0), draw.between(115.0, 150.0));
  paints.goal_high = paint(hue(2), draw.between(45.0, 65.0), draw.between(100.0, 160.0));
  paints.goal_low = paint(hue(3), draw.between(45.0, 65.0), draw.between(100.0, 160.0));
}

void draw_table_sizes(Draw& draw, TeacherTable& t) {
  t.object_x_m = draw.between(-0.30, -0.24);
  t.object_radius_m = draw.between(0.021, 0.027);
  t.object_height_m = draw.between(0.078, 0.092);
  t.bar_height_m = draw.between(0.19, 0.25);
  t.bar_thickness_m = draw.between(0.026, 0.034);
  t.bar_width_m = t.bar_thickness_m * draw.between(0.95, 1.15);
  t.bar_half_span_m = draw.between(0.11, 0.15);
  t.goal_low_x_m = draw.between(0.17, 0.21);
  t.goal_low_y_m = draw.between(0.02, 0.05);
  t.goal_high_x_m = draw.between(0.33, 0.37);
  t.goal_high_y_m = draw.between(0.10, 0.15);
  t.goal_radius_m = draw.between(0.042, 0.050);
}

/// Table top, light, the teacher's skin and sleeve, what lies about and what comes between. Skin
/// stays lighter than twice the shade that takes its colour, cloth has hardly any: a thing is known
/// by it.
void draw_surroundings(Draw& draw, Picture& p) {
  Room& room = p.room;
  room.lamp_m = {draw.between(-0.9, 0.5), draw.between(1.8, 2.1), draw.between(1.2, 1.6)};
  const double tone = draw.between(0.95, 1.05);
  for (float& c : room.wood) c *= static_cast<float>(tone * draw.between(0.97, 1.03));
  room.grain = draw.between(0.3, 2.0);
  room.plank_m = draw.between(0.08, 0.30);
  Looks& looks = p.looks;
  const double fair = draw.between(0.85, 1.05);
  for (float& c : looks.skin) c *= static_cast<float>(fair * draw.between(0.97, 1.03));
  const auto muted = [&draw] {
    const double hue = draw.between(0.0, 2.0 * std::numbers::pi);
    return paint(hue, draw.between(0.0, 12.0), draw.between(30.0, 200.0));
  };
  looks.cloth = muted();
  looks.bare = draw.between(0.03, 0.9);
  p.skin_clutter = static_cast<int>(draw.between(0.0, 5.0));
  p.clutter += p.skin_clutter;
  Passer& passer = p.passer;
  const bool comes = draw.between(0.0, 1.0) < 0.7;
  const double when = p.script.start_s + p.script.duration_s * draw.between(0.0, 0.8);
  if (comes) passer.begin_s = when;
  passer.speed_m_s = draw.between(0.6, 1.5) * (draw.between(0.0, 1.0) < 0.5 ? -1.0 : 1.0);
  passer.z_m = draw.between(0.30, 0.45);
  passer.lean = draw.between(-0.3, 0.3);
  passer.radius_m = draw.between(0.006, 0.018);
  passer.color = muted();
}

std::array<image::Camera, 2> draw_cameras(Draw& draw, const image::View& usual) {
  image::View view = usual;
  constexpr std::array<std::array<double, 2>, 3> kAside{
      {{-0.3, 0.1}, {-0.08, 0.12}, {-0.05, 0.15}}};
  for (std::size_t i = 0; i < 3; ++i) {
    view.eye_m[i] += draw.between(kAside[i][0], kAside[i][1]);
    view.target_m[i] += draw.between(-0.02, 0.02);
  }
  const image::Camera middle{view};
  const double baseline = draw.between(0.26, 0.36);
  const double distance = (Vector3d::Map(view.target_m.data()) - middle.eye()).norm();
  const auto eye = [&](double side) {
    image::Lens lens = middle.lens();
    lens.fx_px *= draw.between(0.95, 1.03);
    lens.fy_px = lens.fx_px * draw.between(0.998, 1.002);
    lens.cx_px += draw.between(-8.0, 8.0);
    lens.cy_px += draw.between(-8.0, 8.0);
    lens.distortion = {draw.between(-0.12, 0.03), draw.between(-0.02, 0.05),
                       draw.between(-5e-4, 5e-4), draw.between(-5e-4, 5e-4), 0.0};
    // Each looks at the same point, half the angle between them aside; then off by up to 1°.
    const double inwards = side * std::atan2(0.5 * baseline, distance);
    const Vector3d off(draw.between(-0.017, 0.017), draw.between(-0.017, 0.017),
                       draw.between(-0.017, 0.017));
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(inwards, Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(off.norm(), off.normalized()))
                                     .toRotationMatrix();
    return image::Camera(lens, turn * middle.R_CT(),
                         middle.eye() + 0.5 * side * baseline * middle.R_CT().row(0).transpose());
  };
  const image::Camera left = eye(-1.0);
  return {left, eye(1.0)};
}

}  // namespace

RandomScene random_scene(const Picture& usual, std::uint64_t seed) {
  Draw draw(seed);
  Picture picture = usual;
  picture.seed = seed;
  draw_table_sizes(draw, picture.table);
  draw_paints(draw, picture.table.paints);
  picture.faults = {draw.between(2.0, 8.0), draw.between(0.4, 1.2), draw.between(0.8, 1.25),
                    draw.between(0.85, 1.15)};
  picture.clutter = static_cast<int>(draw.between(0.0, 12.0));
  picture.script.hand_scale = draw.between(0.93, 1.07);
  picture.script.tilt_rad = draw.between(-0.26, 0.26);
  draw_surroundings(draw, picture);
  picture.looks.right_hand = draw.between(0.0, 1.0) < 0.5;
  return {picture, random_cameras(usual.view, seed)};
}

std::array<image::Camera, 2> random_cameras(const image::View& usual, std::uint64_t seed,
                                            std::uint64_t attempt) {
  Draw draw(seed + ((attempt + 1) << 32));
  return draw_cameras(draw, usual);
}

std::array<image::Camera, 2> usual_cameras(const image::View& view, double baseline_m) {
  const image::Camera left{view};
  image::View aside = view;
  for (int i = 0; i < 3; ++i)
    aside.eye_m[static_cast<std::size_t>(i)] += baseline_m * left.R_CT()(0, i);
  return {left, image::Camera(aside)};
}

std::array<image::Camera, 2> calibrated(const std::array<image::Camera, 2>& cameras,
                                        std::uint64_t seed) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  Draw draw(~seed);
  const auto off = [](const image::Camera& c, double focal, const Vector3d& turn,
                      const Vector3d& place) {
    image::Lens lens = c.lens();
    lens.fx_px *= 1.0 + focal;
    lens.fy_px *= 1.0 + focal;
    const double angle = turn.norm();
    const Eigen::Matrix3d r =
        Eigen::AngleAxisd(angle, angle > 0.0 ? Vector3d(turn / angle) : Vector3d::UnitX())
            .toRotationMatrix();
    return image::Camera(lens, r * c.R_CT(), c.eye() + place);
  };
  const double focal = draw.normal(5e-4);
  const Vector3d turn = draw.normal3(0.01 * kDegree), place = draw.normal3(3e-4);
  const image::Camera left = off(cameras[0], focal, turn, place);
  const Vector3d second_turn = turn + draw.normal3(0.004 * kDegree);
  return {left, off(cameras[1], focal, second_turn, place + draw.normal3(1e-4))};
}

Click click(const char* name, const Vector3d& place_T, const image::Camera& camera) {
  constexpr double kWide = 0.010, kHigh = 0.007;  // [m]
  const double scale = camera.scale(place_T);
  const int width = std::max(3, static_cast<int>(std::lround(kWide * scale))),
            height = std::max(3, static_cast<int>(std::lround(kHigh * scale)));
  const Eigen::Vector2d pixel = camera.project(place_T);
  return {name, static_cast<int>(std::lround(pixel.x())) - width / 2,
          static_cast<int>(std::lround(pixel.y())) - height / 2, width, height};
}

std::vector<Click> clicks(const Picture& picture, const image::Camera& camera) {
  constexpr double kInCap = 0.008;  // [m] below a stand's upper face
  const TeacherTable& t = picture.table;
  return {click("object", {t.object_x_m, 0.5 * t.object_height_m, 0.0}, camera),
          click("bar", {0.0, t.bar_height_m + 0.5 * t.bar_thickness_m, 0.0}, camera),
          click("goal_high", {t.goal_high_x_m, t.goal_high_y_m - kInCap, 0.0}, camera),
          click("goal_low", {t.goal_low_x_m, t.goal_low_y_m - kInCap, 0.0}, camera)};
}

}  // namespace mimesis::camera
