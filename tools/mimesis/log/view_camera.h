#pragma once
#include "common/image/pinhole.h"
#include "proto/foxglove/image.pb.h"
#include "proto/foxglove/transform.pb.h"
#include "tools/mimesis/log/view_drawing.h"

namespace mimesis::tool {

/// The camera's calibration in frame "camera".
foxglove::CameraCalibration to_calibration(const image::View& view, std::chrono::nanoseconds stamp);

/// The teacher's table T as frame "teacher" in "world", the camera as "camera" in "teacher". Nobody
/// measures where the teacher's table is: it is shown 2.6 m in front of the robot, facing it.
foxglove::FrameTransforms to_camera_frames(const image::View& view, std::chrono::nanoseconds stamp);

}  // namespace mimesis::tool
