#include "nodes/camera/source/capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "common/image/image.h"
#include "common/time.h"

namespace mimesis::camera {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kSilence{450};  // reported within 0.5 s at 30 Hz
constexpr milliseconds kRetry{500};
constexpr milliseconds kSettled{1000};          // the automatics have found the light
constexpr milliseconds kAhead{-5}, kOld{1000};  // ages that a frame may have when it is taken
constexpr milliseconds kOnItsWay{500};          // from exposure to the driver's queue
constexpr int kOddStamps = 3;                   // one after the other: it is the clock

}  // namespace

tl::expected<void, Status> decode(const RawFrame& raw, image::Image& out) {
  if (raw.format == PixelFormat::mjpeg) return image::decode_jpeg(raw.bytes, out);
  struct Layout {
    PixelFormat format;
    int to_bgr;       ///< OpenCV's code
    int row_bytes;    ///< bytes of a pixel in a row of the first plane
    int half_planes;  ///< more rows, of planes of colour: in halves of the height
    const char* name;
  };
  constexpr std::array kLayouts{Layout{PixelFormat::yuyv, cv::COLOR_YUV2BGR_YUY2, 2, 0, "YUYV"},
                                Layout{PixelFormat::uyvy, cv::COLOR_YUV2BGR_UYVY, 2, 0, "UYVY"},
                                Layout{PixelFormat::yvyu, cv::COLOR_YUV2BGR_YVYU, 2, 0, "YVYU"},
                                Layout{PixelFormat::nv12, cv::COLOR_YUV2BGR_NV12, 1, 1, "NV12"},
                                Layout{PixelFormat::yu12, cv::COLOR_YUV2BGR_I420, 1, 1, "YU12"},
                                Layout{PixelFormat::grey, cv::COLOR_GRAY2BGR, 1, 0, "GREY"},
                                Layout{PixelFormat::rgb3, cv::COLOR_RGB2BGR, 3, 0, "RGB3"},
                                // OpenCV names a Bayer pattern by its second row
                                Layout{PixelFormat::rggb, cv::COLOR_BayerBG2BGR, 1, 0, "RGGB"},
                                Layout{PixelFormat::grbg, cv::COLOR_BayerGB2BGR, 1, 0, "GRBG"},
                                Layout{PixelFormat::gbrg, cv::COLOR_BayerGR2BGR, 1, 0, "GBRG"},
                                Layout{PixelFormat::bggr, cv::COLOR_BayerRG2BGR, 1, 0, "BA81"}};
  const auto layout = std::ranges::find(kLayouts, raw.format, &Layout::format);
  if (layout == kLayouts.end()) return tl::unexpected(Status{"a format that is not read"});
  const int rows = raw.height + layout->half_planes * raw.height / 2;
  const auto needed = static_cast<std::size_t>(raw.row_bytes) * static_cast<std::size_t>(rows);
  // YU12's rows of colour are half as long: with gaps behind them, OpenCV would not find them
  const bool odd = raw.width % 2 != 0 || (layout->half_planes > 0 && raw.height % 2 != 0) ||
                   (raw.format == PixelFormat::yu12 && raw.row_bytes != raw.width);
  if (raw.width < 2 || raw.height < 1 || odd || raw.row_bytes < layout->row_bytes * raw.width ||
      raw.bytes.size() < needed) {
    return tl::unexpected(
        Status{fmt::format("{} bytes in rows of {} are no {} frame of {}x{}", raw.bytes.size(),
                           raw.row_bytes, layout->name, raw.width, raw.height)});
  }
  if (out.width != raw.width || out.height != raw.height) out = image::Image(raw.width, raw.height);
  const cv::Mat from(rows, raw.width, CV_8UC(layout->row_bytes),
                     const_cast<std::uint8_t*>(raw.bytes.data()),
                     static_cast<std::size_t>(raw.row_bytes));
  cv::Mat bgr(raw.height, raw.width, CV_8UC3, out.bgr.data());
  cv::cvtColor(from, bgr, layout->to_bgr);
  return {};
}

Capture::Capture(std::unique_ptr<FrameDevice> device, std::string name, Clock monotonic,
                 Light light)
    : device_(std::move(device)),
      name_(std::move(name)),
      monotonic_(std::move(monotonic)),
      light_(light) {}

std::string Capture::news() { return std::exchange(news_, {}); }
std::string Capture::opened() { return std::exchange(mode_, {}); }

void Capture::lose(std::chrono::nanoseconds at, const std::string& why) {
  device_->close();
  open_ = false;
  next_try_ = at + kRetry;
  if (!reported_) news_ = name_ + ": " + why + ", trying to reopen";
  reported_ = true;
}

void Capture::set_light(Light light) {
  const auto set = device_->set_light(light);
  if (!set) news_ = name_ + ": " + set.error().reason;
}

void Capture::reopen(std::chrono::nanoseconds at) {
  if (at < next_try_) return;
  const auto opened = device_->open();
  if (!opened) {
    lose(at, opened.error().reason);
    return;
  }
  open_ = true;
  if (!opened->empty()) mode_ = name_ + ": " + *opened;
  odd_stamps_ = 0;
  stamps_on_arrival_ = false;
  last_captured_.reset();
  opened_ = last_frame_ = polled_ = at;
  light_set_ = light_ != Light::locked;
  if (light_ != Light::device) set_light(Light::followed);
}

std::optional<Frame> Capture::next(std::chrono::nanoseconds now) {
  const auto at = monotonic_();
  if (!open_) reopen(at);
  if (!open_) return std::nullopt;
  const auto polled = std::exchange(polled_, at);
  const Taken taken = device_->take_newest(raw_);
  if (taken == Taken::gone) {
    lose(at, "unplugged");
    return std::nullopt;
  }
  if (taken == Taken::none) {
    if (at - last_frame_ > kSilence) lose(at, "no frame for 0.45 s");
    return std::nullopt;
  }
  last_frame_ = at;
  const auto decoded = decode(raw_, image_);
  if (!decoded) {
    news_ = name_ + ": frame left out: " + decoded.error().reason;
    return std::nullopt;
  }
  if (reported_) news_ = name_ + ": frames again";
  reported_ = false;
  if (!light_set_ && at - opened_ >= kSettled) {
    set_light(Light::locked);
    light_set_ = true;
  }
  // The driver should stamp on the monotonic clock; the frame's age is the same on the graph's.
  const auto age = monotonic_() - raw_.captured;
  if (!believes(age, polled)) return std::nullopt;
  return Frame{&image_, stamps_on_arrival_ ? now : now - age};
}

/// Whether the frame counts. It came to the queue after `polled`, when that was emptied last. A
/// stamp that does not fit to that may be one driver's slip; if all are, its clock is another one,
/// it has none, or it counts from another event.
bool Capture::believes(std::chrono::nanoseconds age, std::chrono::nanoseconds polled) {
  const bool stands_still = last_captured_ == raw_.captured;
  last_captured_ = raw_.captured;
  if (stamps_on_arrival_) return true;
  if (age >= kAhead && raw_.captured >= polled - kOnItsWay && !stands_still) {
    odd_stamps_ = 0;
    return age <= kOld;  // else it waited for us
  }
  if (++odd_stamps_ < kOddStamps) return false;
  stamps_on_arrival_ = true;
  news_ = fmt::format(
      "{}: the driver's stamps {}: images are stamped when they arrive", name_,
      stands_still ? std::string("stand still")
                   : fmt::format("are {:.3g} s {} the monotonic clock", std::abs(to_seconds(age)),
                                 age.count() < 0 ? "ahead of" : "behind"));
  return true;
}

}  // namespace mimesis::camera
