#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "nodes/camera/source/capture.h"

namespace mimesis::camera {

/// One way in which a camera sends pictures.
struct CameraMode {
  std::string fourcc;                   ///< as V4L2 writes it: "YUYV"
  int width = 0, height = 0;            ///< 0: the driver does not say
  int most_width = 0, most_height = 0;  ///< of sizes that may be chosen up to these; 0: of one size
  double rate_hz = 0.0;                 ///< largest; 0: the driver does not say
};

struct CameraControl {
  std::string name;
  std::int64_t least = 0, most = 0, step = 0, usual = 0, value = 0;
};

/// What a camera says of itself.
struct CameraInfo {
  std::string card, driver;
  std::vector<CameraMode> modes;
  std::vector<CameraControl> controls;
};

/// Asks a device. Status: why it is no camera.
tl::expected<CameraInfo, Status> describe_camera(const std::string& path);

/// The format of pictures with this name; none: it is not read.
std::optional<PixelFormat> format_of(const std::string& fourcc);

struct CameraWish {
  std::string format = "any";
  int width = 640, height = 480;
  double rate_hz = 30.0;
};

/// Of the modes that are read, those of the wished format and of the size nearest to the wish; of
/// them one that reaches the rate, else the fastest; of those that do raw colour, MJPG, Bayer, grey
/// in this order. Null if none is left. Pure.
const CameraMode* choose_mode(std::span<const CameraMode> modes, const CameraWish& wish);

/// Opens /dev/videoN with 4 mapped buffers in the mode nearest to the wish; of a driver that lists
/// none, in the first format that it takes.
std::unique_ptr<FrameDevice> v4l2_device(const std::string& path, const CameraWish& wish);

}  // namespace mimesis::camera
