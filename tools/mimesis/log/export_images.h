#pragma once
#include <string_view>
#include <tl/expected.hpp>

#include "common/error.h"
#include "common/image/image.h"
#include "proto/foxglove/image.pb.h"

namespace mimesis::tool {

/// A raw image in colour. Encodings: bgr8 8UC3 rgb8 bgra8 8UC4 rgba8 mono8 8UC1 and full-range
/// BT.601 uyvy yuv422 yuyv yuv422_yuy2 nv12. What the size does not agree with is refused.
tl::expected<image::Image, Status> raw_image(const foxglove::RawImage& raw);

}  // namespace mimesis::tool
