#include "nodes/camera/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

namespace mimesis::camera {
namespace {

constexpr std::size_t kPool = 1u << 18;  // noise samples; rows start at random places in it

/// Mixes bits (splitmix64), so that neighbouring frames and rows get unrelated noise.
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// Normal deviate from two uniform ones (Box & Muller), the same on every platform.
double normal(std::mt19937_64& random) {
  const double a = static_cast<double>((random() >> 11) + 1) * 0x1.0p-53;
  const double b = static_cast<double>(random() >> 11) * 0x1.0p-53;
  return std::sqrt(-2.0 * std::log(a)) * std::cos(2.0 * M_PI * b);
}

}  // namespace

PictureFaults::PictureFaults(const Faults& faults, std::uint64_t seed)
    : faults_(faults), seed_(seed) {
  if (faults.noise <= 0.0) return;
  std::mt19937_64 random(seed);
  noise_.resize(kPool);
  for (std::int8_t& n : noise_) {
    n = static_cast<std::int8_t>(
        std::clamp(std::lround(faults.noise * normal(random)), -127l, 127l));
  }
}

void PictureFaults::apply(std::uint64_t frame, image::Image& image) const {
  cv::Mat view(image.height, image.width, CV_8UC3, image.bgr.data());
  if (faults_.blur_px > 0.0) cv::GaussianBlur(view, view, cv::Size(), faults_.blur_px);
  if (faults_.gain != 1.0 || faults_.warmth != 1.0) {
    const std::array<double, 3> factor{faults_.gain / faults_.warmth, faults_.gain,
                                       faults_.gain * faults_.warmth};
    std::array<std::array<std::uint8_t, 256>, 3> table{};
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < 256; ++i) {
        table[c][i] = static_cast<std::uint8_t>(
            std::min(std::lround(factor[c] * static_cast<double>(i)), 255l));
      }
    }
    for (std::size_t i = 0; i < image.bgr.size(); i += 3) {
      for (std::size_t c = 0; c < 3; ++c) image.bgr[i + c] = table[c][image.bgr[i + c]];
    }
  }
  if (!noise_.empty()) add_noise(frame, image);
}

void PictureFaults::add_noise(std::uint64_t frame, image::Image& image) const {
  const std::size_t row = 3 * static_cast<std::size_t>(image.width);
  if (row > kPool) return;
  for (int v = 0; v < image.height; ++v) {
    const std::uint64_t key = mix(mix(seed_ + frame) + static_cast<std::uint64_t>(v));
    const std::int8_t* noise = noise_.data() + key % (kPool - row + 1);
    cv::Mat sum(1, static_cast<int>(row), CV_8U, image.at(0, v));
    cv::add(sum, cv::Mat(1, sum.cols, CV_8S, const_cast<std::int8_t*>(noise)), sum, {}, CV_8U);
  }
}

Renderer::Renderer(const Picture& picture, const image::Camera& camera, int eye)
    : picture_(picture),
      camera_(camera),
      noise_seed_(picture.seed + (static_cast<std::uint64_t>(eye) << 40)),
      motion_(picture.script, picture.table),
      table_(draw_table(picture.table, camera_, picture.room,
                        {picture.clutter, picture.skin_clutter, picture.looks.skin, picture.seed})),
      layer_(camera_, table_),
      faults_(picture.faults, noise_seed_) {}

void Renderer::render(double t_s, image::Image& out) {
  const TeacherPose pose = motion_.pose(t_s);
  out = table_.color;
  hand_capsules(pose, picture_.script.demonstration.grip, picture_.looks, hand_);
  if (const auto passer = picture_.passer.at(t_s)) hand_.push_back(*passer);
  const Paints& paints = picture_.table.paints;
  const bool light = picture_.script.demonstration.color != Color::dark;
  const Bgr& color = light ? paints.light_object : paints.dark_object;
  layer_.draw(hand_,
              {pose.object, picture_.table.object_radius_m, picture_.table.object_height_m, color},
              out);
  faults_.apply(static_cast<std::uint64_t>(std::llround(1e6 * t_s)), out);
}

Truth Renderer::truth(double t_s) const {
  const TeacherPose pose = motion_.pose(t_s);
  const TeacherTable& table = picture_.table;
  Truth truth;
  truth.object = pose.object.head<2>();
  truth.palm = pose.palm.head<2>();
  truth.goal_high = {table.goal_high_x_m, table.goal_high_y_m};
  truth.goal_low = {table.goal_low_x_m, table.goal_low_y_m};
  truth.bar_height = table.bar_height_m;
  truth.bar_in_view = !table.bar_removed;
  truth.held = pose.held;
  const Eigen::Vector2d pixel = camera_.project(pose.palm);
  truth.hand_in_view = pixel.x() >= 0.0 && pixel.x() < camera_.width() && pixel.y() >= 0.0 &&
                       pixel.y() < camera_.height();
  return truth;
}

}  // namespace mimesis::camera
