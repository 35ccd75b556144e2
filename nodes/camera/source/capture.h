#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "nodes/camera/source/source.h"

namespace mimesis::camera {

enum class PixelFormat { yuyv, mjpeg };

/// A frame as a camera delivers it.
struct RawFrame {
  PixelFormat format = PixelFormat::yuyv;
  int width = 0, height = 0;
  int row_bytes = 0;  ///< bytes of a row, for yuyv
  std::vector<std::uint8_t> bytes;
  std::chrono::nanoseconds captured{};  ///< on the monotonic clock, by the driver
};

enum class Taken { frame, none, gone };
/// Exposure, gain and white balance: as the camera has them, automatic, or no longer changed.
enum class Light { device, followed, locked };

/// A camera as the kernel offers it; replaced by a fake in tests.
class FrameDevice {
 public:
  virtual ~FrameDevice() = default;
  virtual tl::expected<void, Status> open() = 0;
  virtual void close() = 0;
  /// Hands over the newest frame waiting in the driver and drops older ones; does not wait.
  virtual Taken take_newest(RawFrame& out) = 0;
  /// Switches the camera's automatics on, or off with the values they have found. What a camera
  /// does not have is left alone.
  virtual tl::expected<void, Status> set_light(Light light) = 0;
};

/// Turns a raw frame into an image; a damaged or truncated one is refused with a reason.
tl::expected<void, Status> decode(const RawFrame& raw, image::Image& out);

/// A live camera. One that is unplugged or silent for 0.5 s is reported, closed and reopened every
/// 0.5 s. Light is locked when frames have come for a second: until then the automatics find it.
class Capture final : public Source {
 public:
  using Clock = std::function<std::chrono::nanoseconds()>;  ///< monotonic
  /// @param name of the device, for messages
  Capture(std::unique_ptr<FrameDevice> device, std::string name, Clock monotonic,
          Light light = Light::device);
  std::optional<Frame> next(std::chrono::nanoseconds now) override;
  std::string news() override;

 private:
  void reopen(std::chrono::nanoseconds at);
  void lose(std::chrono::nanoseconds at, const std::string& why);
  void set_light(Light light);

  std::unique_ptr<FrameDevice> device_;
  std::string name_;
  Clock monotonic_;
  Light light_;
  bool open_ = false, reported_ = false, light_set_ = false;
  std::chrono::nanoseconds opened_{}, last_frame_{}, next_try_{};
  RawFrame raw_;
  image::Image image_;
  std::string news_;
};

/// Opens /dev/videoN with 4 mapped buffers, YUYV or else MJPEG, nearest to the wanted size.
std::unique_ptr<FrameDevice> v4l2_device(const std::string& path, int width_px, int height_px);

}  // namespace mimesis::camera
