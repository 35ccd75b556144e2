#include "nodes/camera/source/capture.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "common/image/image.h"

namespace mimesis::camera {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kSilence{450};  // reported within 0.5 s at 30 Hz
constexpr milliseconds kRetry{500};
constexpr milliseconds kSettled{1000};  // the automatics have found the light

constexpr unsigned kBuffers = 4;

class V4l2Device final : public FrameDevice {
 public:
  V4l2Device(std::string path, int width, int height)
      : path_(std::move(path)), width_(width), height_(height) {}
  ~V4l2Device() override { release(); }

  tl::expected<void, Status> open() override {
    fd_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0) return fail("cannot be opened");
    v4l2_capability capability{};
    if (!control(VIDIOC_QUERYCAP, &capability)) return fail("is no camera");
    const auto can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                         ? capability.device_caps
                         : capability.capabilities;
    if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0) {
      release();
      return tl::unexpected(Status{"is no streaming camera"});
    }
    if (!choose_format(V4L2_PIX_FMT_YUYV) && !choose_format(V4L2_PIX_FMT_MJPEG)) {
      return fail("offers neither YUYV nor MJPEG");
    }
    if (!map_buffers()) return fail("gives no buffers");
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (!control(VIDIOC_STREAMON, &type)) return fail("does not start");
    return {};
  }

  void close() override { release(); }

  tl::expected<void, Status> set_light(Light light) override {
    struct Automatic {
      std::uint32_t id;
      int on, off;
      std::uint32_t value;
      const char* name;
    };
    constexpr std::array<Automatic, 3> kAutomatics{
        {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY, V4L2_EXPOSURE_MANUAL,
          V4L2_CID_EXPOSURE_ABSOLUTE, "exposure"},
         {V4L2_CID_AUTOGAIN, 1, 0, V4L2_CID_GAIN, "gain"},
         {V4L2_CID_AUTO_WHITE_BALANCE, 1, 0, V4L2_CID_WHITE_BALANCE_TEMPERATURE, "white balance"}}};
    const bool lock = light == Light::locked;
    for (const Automatic& a : kAutomatics) {
      v4l2_queryctrl known{};
      known.id = a.id;
      if (!control(VIDIOC_QUERYCTRL, &known)) continue;  // it has no such automatic
      v4l2_control found{a.value, 0}, automatic{a.id, lock ? a.off : a.on};
      const bool keeps = lock && control(VIDIOC_G_CTRL, &found);
      if (control(VIDIOC_S_CTRL, &automatic) && (!keeps || control(VIDIOC_S_CTRL, &found)))
        continue;
      return tl::unexpected(Status{std::string(a.name) +
                                   (lock ? " cannot be locked: " : " cannot be automatic: ") +
                                   std::strerror(errno)});
    }
    return {};
  }

  Taken take_newest(RawFrame& out) override {
    bool found = false;
    for (;;) {
      v4l2_buffer buffer{};
      buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      buffer.memory = V4L2_MEMORY_MMAP;
      if (!control(VIDIOC_DQBUF, &buffer)) {
        if (errno == EAGAIN) return found ? Taken::frame : Taken::none;
        return Taken::gone;  // ENODEV when unplugged; any other error needs a reopening as well
      }
      const bool damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
      if (!damaged && buffer.index < mapped_.size()) {
        take(buffer, out);
        found = true;
      }
      if (!control(VIDIOC_QBUF, &buffer)) return Taken::gone;
    }
  }

 private:
  struct Mapping {
    void* start;
    std::size_t length;
  };

  template <class T>
  bool control(unsigned long request, T* argument) {
    int result = 0;
    do {
      result = ::ioctl(fd_, request, argument);
    } while (result < 0 && errno == EINTR);
    return result == 0;
  }

  tl::unexpected<Status> fail(const char* what) {
    const std::string why = std::string(what) + ": " + std::strerror(errno);
    release();
    return tl::unexpected(Status{why});
  }

  bool choose_format(std::uint32_t fourcc) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = static_cast<std::uint32_t>(width_);
    format.fmt.pix.height = static_cast<std::uint32_t>(height_);
    format.fmt.pix.pixelformat = fourcc;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (!control(VIDIOC_S_FMT, &format) || format.fmt.pix.pixelformat != fourcc) return false;
    format_ = format.fmt.pix;
    return true;
  }

  bool map_buffers() {
    v4l2_requestbuffers request{};
    request.count = kBuffers;
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    if (!control(VIDIOC_REQBUFS, &request) || request.count < 2) return false;
    for (std::uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer buffer{};
      buffer.index = i;
      buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      buffer.memory = V4L2_MEMORY_MMAP;
      if (!control(VIDIOC_QUERYBUF, &buffer)) return false;
      void* start =
          ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, buffer.m.offset);
      if (start == MAP_FAILED) return false;
      mapped_.push_back({start, buffer.length});
      if (!control(VIDIOC_QBUF, &buffer)) return false;
    }
    return true;
  }

  void take(const v4l2_buffer& buffer, RawFrame& out) {
    const Mapping& m = mapped_[buffer.index];
    const auto* data = static_cast<const std::uint8_t*>(m.start);
    out.format = format_.pixelformat == V4L2_PIX_FMT_YUYV ? PixelFormat::yuyv : PixelFormat::mjpeg;
    out.width = static_cast<int>(format_.width);
    out.height = static_cast<int>(format_.height);
    out.row_bytes = static_cast<int>(format_.bytesperline);
    out.bytes.assign(data, data + std::min<std::size_t>(buffer.bytesused, m.length));
    out.captured = std::chrono::seconds(buffer.timestamp.tv_sec) +
                   std::chrono::microseconds(buffer.timestamp.tv_usec);
  }

  void release() {
    for (const Mapping& m : mapped_) ::munmap(m.start, m.length);
    mapped_.clear();
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

  std::string path_;
  int width_, height_;
  int fd_ = -1;
  v4l2_pix_format format_{};
  std::vector<Mapping> mapped_;
};

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

Capture::Capture(std::unique_ptr<FrameDevice> device, std::string name, Clock monotonic,
                 Light light)
    : device_(std::move(device)),
      name_(std::move(name)),
      monotonic_(std::move(monotonic)),
      light_(light) {}

std::string Capture::news() { return std::exchange(news_, {}); }

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
  opened_ = last_frame_ = at;
  light_set_ = light_ != Light::locked;
  if (light_ != Light::device) set_light(Light::followed);
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
  if (!light_set_ && at - opened_ >= kSettled) {
    set_light(Light::locked);
    light_set_ = true;
  }
  // The driver stamps on the monotonic clock; the frame's age is the same on the graph's.
  return Frame{&image_, now - (monotonic_() - raw_.captured)};
}

std::unique_ptr<FrameDevice> v4l2_device(const std::string& path, int width_px, int height_px) {
  return std::make_unique<V4l2Device>(path, width_px, height_px);
}

}  // namespace mimesis::camera
