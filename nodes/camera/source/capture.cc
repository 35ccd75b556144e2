#include "nodes/camera/source/capture.h"

#include <opencv2/imgproc.hpp>
#include <utility>

#include "common/image/image_file.h"

namespace mimesis::camera {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kSilence{450};  // reported within 0.5 s at 30 Hz
constexpr milliseconds kRetry{500};

}  // namespace

tl::expected<void, Status> decode(const RawFrame& raw, image::Image& out) {
  if (raw.format == PixelFormat::mjpeg) return image::decode_jpeg(raw.bytes, out);
  const auto needed =
      static_cast<std::size_t>(raw.row_bytes) * static_cast<std::size_t>(raw.height);
  if (raw.width < 2 || raw.width % 2 != 0 || raw.height < 1 || raw.row_bytes < 2 * raw.width ||
      raw.bytes.size() < needed) {
    return tl::unexpected(Status{std::to_string(raw.bytes.size()) + " bytes are no YUYV frame of " +
                                 std::to_string(raw.width) + "x" + std::to_string(raw.height)});
  }
  if (out.width != raw.width || out.height != raw.height) out = image::Image(raw.width, raw.height);
  const cv::Mat yuyv(raw.height, raw.width, CV_8UC2, const_cast<std::uint8_t*>(raw.bytes.data()),
                     static_cast<std::size_t>(raw.row_bytes));
  cv::Mat bgr(raw.height, raw.width, CV_8UC3, out.bgr.data());
  cv::cvtColor(yuyv, bgr, cv::COLOR_YUV2BGR_YUY2);
  return {};
}

Capture::Capture(std::unique_ptr<FrameDevice> device, std::string name, Clock monotonic)
    : device_(std::move(device)), name_(std::move(name)), monotonic_(std::move(monotonic)) {}

std::string Capture::news() { return std::exchange(news_, {}); }

void Capture::lose(std::chrono::nanoseconds at, const std::string& why) {
  device_->close();
  open_ = false;
  next_try_ = at + kRetry;
  if (!reported_) news_ = name_ + ": " + why + ", trying to reopen";
  reported_ = true;
}

void Capture::reopen(std::chrono::nanoseconds at) {
  if (at < next_try_) return;
  const auto opened = device_->open();
  if (!opened) {
    lose(at, opened.error().reason);
    return;
  }
  open_ = true;
  last_frame_ = at;
}

std::optional<Frame> Capture::next(std::chrono::nanoseconds now) {
  const auto at = monotonic_();
  if (!open_) reopen(at);
  if (!open_) return std::nullopt;
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
  // The driver stamps on the monotonic clock; the frame's age is the same on the graph's.
  return Frame{&image_, now - (monotonic_() - raw_.captured)};
}

}  // namespace mimesis::camera
