#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "nodes/camera/source/source.h"

namespace mimesis::camera {

/// Layouts of pixels, named as V4L2 does. Logs hold their numbers.
enum class PixelFormat { yuyv, mjpeg, uyvy, yvyu, nv12, yu12, grey, rgb3, rggb, grbg, gbrg, bggr };
inline constexpr PixelFormat kLastFormat = PixelFormat::bggr;

/// A frame as a camera delivers it.
struct RawFrame {
  PixelFormat format = PixelFormat::yuyv;
  int width = 0, height = 0;
  int row_bytes = 0;  ///< bytes of a row (of its first plane), but for mjpeg
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
  /// What was chosen, for people: "1280x720 MJPG, 30 Hz"; may be empty.
  virtual tl::expected<std::string, Status> open() = 0;
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
/// Frames older than 1 s are left out. So are those with stamps from the future, equal to the one
/// before, or of more than 0.5 s before the queue was last empty; after three such in a row frames
/// are stamped when they arrive, which is said.
class Capture final : public Source {
 public:
  using Clock = std::function<std::chrono::nanoseconds()>;  ///< monotonic
  /// @param name of the device, for messages
  Capture(std::unique_ptr<FrameDevice> device, std::string name, Clock monotonic,
          Light light = Light::device);
  std::optional<Frame> next(std::chrono::nanoseconds now) override;
  std::string news() override;
  std::string opened() override;

 private:
  bool believes(std::chrono::nanoseconds age, std::chrono::nanoseconds polled);
  void reopen(std::chrono::nanoseconds at);
  void lose(std::chrono::nanoseconds at, const std::string& why);
  void set_light(Light light);

  std::unique_ptr<FrameDevice> device_;
  std::string name_;
  Clock monotonic_;
  Light light_;
  bool open_ = false, reported_ = false, light_set_ = false, stamps_on_arrival_ = false;
  int odd_stamps_ = 0;
  std::optional<std::chrono::nanoseconds> last_captured_;
  std::chrono::nanoseconds opened_{}, last_frame_{}, polled_{}, next_try_{};
  RawFrame raw_;
  image::Image image_;
  std::string news_, mode_;
};

}  // namespace mimesis::camera
