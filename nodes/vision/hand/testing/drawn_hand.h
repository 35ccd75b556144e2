#pragma once
#include <algorithm>

#include "nodes/vision/hand/hand_tracker.h"

namespace mimesis::vision {

/// Pictures of the tracker's own model, lit from above: for what needs no independent truth.
class DrawnHand {
 public:
  explicit DrawnHand(const image::View& view) : camera(view), raster_(160, 120) {
    evidence_.resize(160, 120);
    raster_camera_.focal = static_cast<float>(view.focal_px / 4.0);
    raster_camera_.cu = 79.5f;
    raster_camera_.cv = 59.5f;
  }
  /// @param first  the camera whose frame the pose refers to
  image::Image draw(const HandModel& model, const HandPose& pose, const image::Camera& first) {
    HandCapsules capsules;
    model.capsules(pose, capsules);
    raster_camera_.R = (camera.R_CT() * first.R_CT().transpose()).cast<float>();
    raster_camera_.t = (camera.R_CT() * (first.eye() - camera.eye())).cast<float>();
    Shading shading;
    shading.bias = 0.7f;
    shading.slope = {0.0f, -0.25f, -0.1f};
    raster_.match(capsules, raster_camera_, evidence_, shading);
    image::Image out(640, 480);
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        const auto at = static_cast<std::size_t>(v / 4 * evidence_.stride + u / 4);
        const float on = raster_.covered()[at], light = raster_.expected()[at];
        const std::array<float, 3> skin{110.0f, 140.0f, 210.0f}, wall{150.0f, 140.0f, 120.0f};
        for (int c = 0; c < 3; ++c) {
          const auto k = static_cast<std::size_t>(c);
          const float value = on * light * skin[k] + (1.0f - on) * wall[k];
          out.at(u, v)[c] = static_cast<std::uint8_t>(std::clamp(value, 0.0f, 255.0f));
        }
      }
    }
    return out;
  }

  image::Camera camera;

 private:
  HandRaster raster_;
  RasterCamera raster_camera_;
  Evidence evidence_;
};

}  // namespace mimesis::vision
