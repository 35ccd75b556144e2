#include "tools/mimesis/log/view_camera.h"

#include "common/model/drawing.h"

namespace mimesis::tool {
namespace {

constexpr double kTeacher = 2.6;  // x of T in W [m]

}  // namespace

foxglove::CameraCalibration to_calibration(const image::View& view,
                                           std::chrono::nanoseconds stamp) {
  const double cx = 0.5 * (view.width_px - 1), cy = 0.5 * (view.height_px - 1);
  const double f = view.focal_px;
  foxglove::CameraCalibration out;
  *out.mutable_timestamp() = model::to_timestamp(stamp);
  out.set_frame_id("camera");
  out.set_width(static_cast<std::uint32_t>(view.width_px));
  out.set_height(static_cast<std::uint32_t>(view.height_px));
  out.set_distortion_model("plumb_bob");
  for (int i = 0; i < 5; ++i) out.add_d(0.0);
  for (const double k : {f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0}) out.add_k(k);
  for (const double r : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) out.add_r(r);
  for (const double p : {f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0}) out.add_p(p);
  return out;
}

foxglove::FrameTransforms to_camera_frames(const image::View& view,
                                           std::chrono::nanoseconds stamp) {
  Eigen::Isometry3d X_WT(Eigen::Translation3d(kTeacher, 0.0, 0.0));
  X_WT.linear() << 0.0, 0.0, -1.0,  // x_T = −y_W, y_T = z_W, z_T = −x_W
      -1.0, 0.0, 0.0,               //
      0.0, 1.0, 0.0;
  const image::Pinhole pinhole(view);
  Eigen::Isometry3d X_TC(Eigen::Translation3d(pinhole.eye()));
  X_TC.linear() = pinhole.R_CT().transpose();
  foxglove::FrameTransforms frames;
  model::add_frame(frames, "world", "teacher", X_WT, stamp);
  model::add_frame(frames, "teacher", "camera", X_TC, stamp);
  return frames;
}

}  // namespace mimesis::tool
