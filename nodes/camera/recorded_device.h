#pragma once
#include <memory>

#include "common/runtime/bus.h"
#include "nodes/camera/source/capture.h"

namespace mimesis::camera {

/// A camera whose answers pass `graph.outside()` under the name "camera". Layout, little-endian;
/// logs rely on it:
///   open         u8 1 and what was chosen, or 0 and why it did not open
///   set_light    u8 1, or 0 and the reason
///   take_newest  u8 what there is (Taken); of a frame also u8 format (PixelFormat), u32 width,
///                u32 height, u32 row bytes, u64 captured [ns], its bytes
/// @param device not used in a replay, may be null then
std::unique_ptr<FrameDevice> record_device(std::unique_ptr<FrameDevice> device,
                                           runtime::Bus& graph);

/// The clock that frames are stamped on, under the name "camera_clock": i64 [ns].
Capture::Clock record_clock(Capture::Clock clock, runtime::Bus& graph);

}  // namespace mimesis::camera
