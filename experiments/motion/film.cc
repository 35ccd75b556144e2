#include "experiments/motion/film.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/error.h"
#include "common/image/image_file.h"
#include "experiments/motion/film_view.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Vector3d;

constexpr double kFromAbove = 0.16;  // of a side view [rad]: shows the lines on the ground

template <class Visit>
void for_each_point(const FilmFrame& frame, const Visit& visit) {
  for (const FilmLimb& limb : frame.limbs) {
    visit(limb.from, limb.radius_from);
    visit(limb.to, limb.radius_to);
  }
  for (const FilmBox& box : frame.boxes) {
    for (int i = 0; i < 8; ++i) {
      const Vector3d sign((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
      visit(Vector3d(box.center + box.tilt * Eigen::AngleAxisd(box.yaw_rad, Vector3d::UnitZ()) *
                                      box.half_extent.cwiseProduct(sign)),
            0.0);
    }
  }
}

Vector3d middle_of_limbs(const FilmFrame& frame) {
  Vector3d sum = Vector3d::Zero();
  for (const FilmLimb& limb : frame.limbs) sum += 0.5 * (limb.from + limb.to);
  return frame.limbs.empty() ? sum : Vector3d(sum / static_cast<double>(frame.limbs.size()));
}

/// Horizontal unit vector of travel; x of W if there is none to speak of.
Vector3d way(std::span<const FilmFrame> frames) {
  Vector3d way = middle_of_limbs(frames.back()) - middle_of_limbs(frames.front());
  way.z() = 0.0;
  return way.norm() > 0.1 ? Vector3d(way.normalized()) : Vector3d::UnitX();
}

void write(const std::filesystem::path& file, const image::Image& picture) {
  if (const auto written = image::write_png(file, picture); !written) {
    throw std::runtime_error(written.error().reason);
  }
}

}  // namespace

FilmCamera FilmCamera::moved(const Vector3d& by_m) const {
  FilmCamera out = *this;
  out.eye_m += by_m;
  out.target_m += by_m;
  return out;
}

std::string film_time(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "t = %.2f s", seconds);
  return text;
}

FilmCamera side_view(std::span<const FilmFrame> frames, int width_px, int height_px) {
  MIMESIS_ASSERT(!frames.empty());
  FilmCamera camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.height_m = 1.0;
  camera.target_m.setZero();
  const Vector3d ahead = way(frames), left = Vector3d::UnitZ().cross(ahead);
  const Vector3d forward = std::cos(kFromAbove) * left - std::sin(kFromAbove) * Vector3d::UnitZ();
  camera.eye_m = -forward;
  const Eigen::Matrix3d R_CW = FilmView(camera, 1).R_CW;
  Vector3d low = Vector3d::Constant(1e9), high = -low;
  for (const FilmFrame& frame : frames) {
    for_each_point(frame, [&](const Vector3d& p, double radius) {
      low = low.cwiseMin(((R_CW * p).array() - radius).matrix());
      high = high.cwiseMax(((R_CW * p).array() + radius).matrix());
    });
  }
  MIMESIS_ASSERT(high.x() >= low.x());
  const double margin = 1.12, aspect = static_cast<double>(width_px) / height_px;
  const Vector3d extent = high - low;
  camera.height_m = margin * std::max({extent.y(), extent.x() / aspect, 0.1});
  camera.target_m = R_CW.transpose() * (0.5 * (low + high));
  camera.eye_m = camera.target_m - 10.0 * forward;
  return camera;
}

std::vector<std::size_t> evenly_chosen(std::size_t frames, int count) {
  const std::size_t n = std::min(frames, static_cast<std::size_t>(std::max(1, count)));
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < n; ++i) {
    chosen.push_back(n == 1 ? frames - 1 : (i * (frames - 1) + (n - 1) / 2) / (n - 1));
  }
  return chosen;
}

image::Image strip(std::span<const FilmFrame> frames, int count, int cell_width_px) {
  std::vector<cv::Mat> cells;
  for (const std::size_t i : evenly_chosen(frames.size(), count)) {
    image::Image picture = draw(frames[i]);
    const cv::Mat whole(picture.height, picture.width, CV_8UC3, picture.bgr.data());
    const int height =
        static_cast<int>(std::lround(1.0 * cell_width_px * picture.height / picture.width));
    cv::Mat& cell = cells.emplace_back();
    cv::resize(whole, cell, cv::Size(cell_width_px, height), 0.0, 0.0, cv::INTER_AREA);
    if (cells.size() > 1 && cell.rows != cells[0].rows) {
      cv::resize(cell, cell, cells[0].size(), 0.0, 0.0, cv::INTER_AREA);
    }
  }
  cv::Mat joined;
  cv::hconcat(cells, joined);
  image::Image out(joined.cols, joined.rows);
  joined.copyTo(cv::Mat(joined.rows, joined.cols, CV_8UC3, out.bgr.data()));
  return out;
}

image::Image poses_along_path(std::span<const FilmFrame> frames, int count,
                              const FilmCamera& camera) {
  const std::vector<std::size_t> chosen = evenly_chosen(frames.size(), count);
  FilmFrame all = frames.back();
  all.camera = camera;
  for (std::size_t k = 0; k + 1 < chosen.size(); ++k) {
    const double pale =
        0.6 * (1.0 - static_cast<double>(k + 1) / static_cast<double>(chosen.size()));
    for (FilmLimb limb : frames[chosen[k]].limbs) {
      limb.colour = paler(limb.colour, pale);
      all.limbs.push_back(limb);
    }
  }
  return draw(all);
}

std::vector<std::filesystem::path> write_film(std::span<const FilmFrame> frames,
                                              const std::filesystem::path& folder,
                                              const std::string& name,
                                              const StripOptions& options) {
  MIMESIS_ASSERT(!frames.empty());
  const std::filesystem::path pictures = folder / name, sheet = folder / (name + ".png");
  std::error_code failed;
  std::filesystem::create_directories(pictures, failed);
  if (failed) throw std::runtime_error(pictures.string() + ": " + failed.message());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    char file[32];
    std::snprintf(file, sizeof file, "frame_%04zu.png", i);
    write(pictures / file, draw(frames[i]));
  }
  write(sheet, options.along_path ? poses_along_path(frames, options.count, *options.along_path)
                                  : strip(frames, options.count, options.cell_width_px));
  return {sheet, pictures};
}

}  // namespace mimesis::synthesizer
