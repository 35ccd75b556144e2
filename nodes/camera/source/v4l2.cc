#include "nodes/camera/source/v4l2.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <tuple>
#include <utility>

namespace mimesis::camera {
namespace {

constexpr unsigned kBuffers = 4;

struct KnownFormat {
  std::uint32_t fourcc;
  PixelFormat format;
  int rank;  ///< 0: the best
};
constexpr std::array kFormats{KnownFormat{V4L2_PIX_FMT_YUYV, PixelFormat::yuyv, 0},
                              KnownFormat{V4L2_PIX_FMT_UYVY, PixelFormat::uyvy, 0},
                              KnownFormat{V4L2_PIX_FMT_YVYU, PixelFormat::yvyu, 0},
                              KnownFormat{V4L2_PIX_FMT_RGB24, PixelFormat::rgb3, 0},
                              KnownFormat{V4L2_PIX_FMT_NV12, PixelFormat::nv12, 1},
                              KnownFormat{V4L2_PIX_FMT_YUV420, PixelFormat::yu12, 1},
                              KnownFormat{V4L2_PIX_FMT_MJPEG, PixelFormat::mjpeg, 2},
                              KnownFormat{V4L2_PIX_FMT_JPEG, PixelFormat::mjpeg, 2},
                              KnownFormat{V4L2_PIX_FMT_SRGGB8, PixelFormat::rggb, 3},
                              KnownFormat{V4L2_PIX_FMT_SGRBG8, PixelFormat::grbg, 3},
                              KnownFormat{V4L2_PIX_FMT_SGBRG8, PixelFormat::gbrg, 3},
                              KnownFormat{V4L2_PIX_FMT_SBGGR8, PixelFormat::bggr, 3},
                              KnownFormat{V4L2_PIX_FMT_GREY, PixelFormat::grey, 4}};

std::string text_of(std::uint32_t fourcc) {
  std::string text;
  for (int k = 0; k < 4; ++k) {
    const char c = static_cast<char>(fourcc >> (8 * k));
    text += c > ' ' && c <= '~' ? c : ' ';
  }
  return text.substr(0, text.find_last_not_of(' ') + 1);
}

const KnownFormat* known(const std::string& fourcc) {
  const auto found =
      std::ranges::find(kFormats, fourcc, [](const KnownFormat& f) { return text_of(f.fourcc); });
  return found == kFormats.end() ? nullptr : &*found;
}

std::pair<int, int> nearest_size(const CameraMode& mode, const CameraWish& wish) {
  if (mode.width == 0) return {wish.width, wish.height};
  return {std::clamp(wish.width, mode.width, std::max(mode.width, mode.most_width)),
          std::clamp(wish.height, mode.height, std::max(mode.height, mode.most_height))};
}

/// An open device.
class Descriptor {
 public:
  ~Descriptor() { close(); }
  bool open(const std::string& path) {
    fd_ = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return fd_ >= 0;
  }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  template <class T>
  bool control(unsigned long request, T* argument) const {
    int result = 0;
    do {
      result = ::ioctl(fd_, request, argument);
    } while (result < 0 && errno == EINTR);
    return result == 0;
  }
  int fd() const { return fd_; }

 private:
  int fd_ = -1;
};

std::string with_errno(const std::string& what) { return what + ": " + std::strerror(errno); }

/// Empty, or why it is no camera that is read.
std::string open_camera(const std::string& path, Descriptor& device, v4l2_capability& capability) {
  if (!device.open(path)) return with_errno("cannot be opened");
  if (!device.control(VIDIOC_QUERYCAP, &capability)) return with_errno("is no camera");
  const auto can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                         : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0 && (can & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    return "gives pictures in several planes, expected one (V4L2_CAP_VIDEO_CAPTURE)";
  }
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0) {
    return "is no streaming camera";
  }
  return {};
}

/// The largest rate of a size; 0: not said.
double fastest_hz(const Descriptor& device, std::uint32_t fourcc, std::uint32_t width,
                  std::uint32_t height) {
  double most = 0.0;
  v4l2_frmivalenum interval{};
  interval.pixel_format = fourcc;
  interval.width = width;
  interval.height = height;
  for (; device.control(VIDIOC_ENUM_FRAMEINTERVALS, &interval); ++interval.index) {
    const bool discrete = interval.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const v4l2_fract& time = discrete ? interval.discrete : interval.stepwise.min;
    if (time.numerator > 0) most = std::max(most, double(time.denominator) / time.numerator);
    if (!discrete) break;
  }
  return most;
}

std::vector<CameraMode> modes_of(const Descriptor& device) {
  constexpr std::uint32_t kMost = 256;  // of formats, and of sizes: no driver ends the loop
  std::vector<CameraMode> modes;
  v4l2_fmtdesc format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; format.index < kMost && device.control(VIDIOC_ENUM_FMT, &format); ++format.index) {
    const std::string fourcc = text_of(format.pixelformat);
    const std::size_t before = modes.size();
    v4l2_frmsizeenum size{};
    size.pixel_format = format.pixelformat;
    for (; size.index < kMost && device.control(VIDIOC_ENUM_FRAMESIZES, &size); ++size.index) {
      if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
        const auto [width, height] = size.discrete;
        modes.push_back({fourcc, int(width), int(height), 0, 0,
                         fastest_hz(device, format.pixelformat, width, height)});
        continue;
      }
      const v4l2_frmsize_stepwise& range = size.stepwise;
      modes.push_back({fourcc, int(range.min_width), int(range.min_height), int(range.max_width),
                       int(range.max_height),
                       fastest_hz(device, format.pixelformat, range.max_width, range.max_height)});
      break;
    }
    if (modes.size() == before) modes.push_back({.fourcc = fourcc});  // sizes are not listed
  }
  return modes;
}

std::vector<CameraControl> controls_of(const Descriptor& device) {
  std::vector<CameraControl> controls;
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (device.control(VIDIOC_QUERYCTRL, &query)) {
    const std::uint32_t id = query.id;
    const bool value = query.type == V4L2_CTRL_TYPE_INTEGER ||
                       query.type == V4L2_CTRL_TYPE_BOOLEAN || query.type == V4L2_CTRL_TYPE_MENU;
    v4l2_control now{id, 0};
    if (value && (query.flags & V4L2_CTRL_FLAG_DISABLED) == 0 &&
        device.control(VIDIOC_G_CTRL, &now)) {
      const auto* name = reinterpret_cast<const char*>(query.name);
      controls.push_back({std::string(name, strnlen(name, sizeof query.name)), query.minimum,
                          query.maximum, query.step, query.default_value, now.value});
    }
    query = {};
    query.id = id | V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return controls;
}

class V4l2Device final : public FrameDevice {
 public:
  V4l2Device(std::string path, CameraWish wish) : path_(std::move(path)), wish_(std::move(wish)) {}
  ~V4l2Device() override { release(); }

  tl::expected<std::string, Status> open() override {
    v4l2_capability capability{};
    if (std::string why = open_camera(path_, device_, capability); !why.empty()) {
      release();
      return tl::unexpected(Status{std::move(why)});
    }
    if (std::string why = set_mode(); !why.empty()) {
      release();
      return tl::unexpected(Status{std::move(why)});
    }
    const double rate_hz = set_rate();
    if (!map_buffers()) return fail("gives no buffers");
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (!device_.control(VIDIOC_STREAMON, &type)) return fail("does not start");
    return fmt::format("{}x{} {}{}", format_.width, format_.height, text_of(format_.pixelformat),
                       rate_hz > 0.0 ? fmt::format(", {:g} Hz", std::round(10.0 * rate_hz) / 10.0)
                                     : std::string());
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
      if (!device_.control(VIDIOC_QUERYCTRL, &known)) continue;  // it has no such automatic
      v4l2_control found{a.value, 0}, automatic{a.id, lock ? a.off : a.on};
      const bool keeps = lock && device_.control(VIDIOC_G_CTRL, &found);
      if (device_.control(VIDIOC_S_CTRL, &automatic) &&
          (!keeps || device_.control(VIDIOC_S_CTRL, &found)))
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
      if (!device_.control(VIDIOC_DQBUF, &buffer)) {
        if (errno == EAGAIN) return found ? Taken::frame : Taken::none;
        return Taken::gone;  // ENODEV when unplugged; any other error needs a reopening as well
      }
      const bool damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
      if (!damaged && buffer.index < mapped_.size()) {
        take(buffer, out);
        found = true;
      }
      if (!device_.control(VIDIOC_QBUF, &buffer)) return Taken::gone;
    }
  }

 private:
  struct Mapping {
    void* start;
    std::size_t length;
  };

  tl::unexpected<Status> fail(const char* what) {
    const std::string why = with_errno(what);
    release();
    return tl::unexpected(Status{why});
  }

  /// Empty, or why there is none.
  std::string set_mode() {
    const std::vector<CameraMode> modes = modes_of(device_);
    if (modes.empty()) {  // the driver lists nothing
      for (const KnownFormat& f : kFormats) {
        if (wish_.format != "any" && wish_.format != text_of(f.fourcc)) continue;
        if (set_format(f, wish_.width, wish_.height)) return {};
      }
      return "takes no format that is read";
    }
    const CameraMode* mode = choose_mode(modes, wish_);
    if (mode == nullptr) {
      std::vector<std::string> offered;
      for (const CameraMode& m : modes) {
        if (offered.empty() || offered.back() != m.fourcc) offered.push_back(m.fourcc);
      }
      return fmt::format("offers {}, expected {}", fmt::join(offered, ", "),
                         wish_.format == "any" ? "a format that is read" : wish_.format);
    }
    const auto [width, height] = nearest_size(*mode, wish_);
    if (set_format(*known(mode->fourcc), width, height)) return {};
    return with_errno("lists " + mode->fourcc + " and does not take it");
  }

  bool set_format(const KnownFormat& wanted, int width, int height) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = static_cast<std::uint32_t>(width);
    format.fmt.pix.height = static_cast<std::uint32_t>(height);
    format.fmt.pix.pixelformat = wanted.fourcc;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (!device_.control(VIDIOC_S_FMT, &format)) return false;
    if (format.fmt.pix.pixelformat != wanted.fourcc) {  // drivers put in what they like
      errno = EINVAL;
      return false;
    }
    format_ = format.fmt.pix;
    pixels_ = wanted.format;
    return true;
  }

  /// The rate that the driver then has [Hz]; 0: it does not say.
  double set_rate() {
    v4l2_streamparm rate{};
    rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    v4l2_captureparm& capture = rate.parm.capture;
    if (!device_.control(VIDIOC_G_PARM, &rate)) return 0.0;
    if ((capture.capability & V4L2_CAP_TIMEPERFRAME) != 0) {
      capture.timeperframe = {1000u, static_cast<std::uint32_t>(std::lround(1e3 * wish_.rate_hz))};
      if (!device_.control(VIDIOC_S_PARM, &rate) && !device_.control(VIDIOC_G_PARM, &rate))
        return 0.0;
    }
    const v4l2_fract& time = capture.timeperframe;
    return time.numerator > 0 ? double(time.denominator) / time.numerator : 0.0;
  }

  bool map_buffers() {
    v4l2_requestbuffers request{};
    request.count = kBuffers;
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    if (!device_.control(VIDIOC_REQBUFS, &request) || request.count < 2) return false;
    for (std::uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer buffer{};
      buffer.index = i;
      buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      buffer.memory = V4L2_MEMORY_MMAP;
      if (!device_.control(VIDIOC_QUERYBUF, &buffer)) return false;
      void* start = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, device_.fd(),
                           buffer.m.offset);
      if (start == MAP_FAILED) return false;
      mapped_.push_back({start, buffer.length});
      if (!device_.control(VIDIOC_QBUF, &buffer)) return false;
    }
    return true;
  }

  void take(const v4l2_buffer& buffer, RawFrame& out) {
    const Mapping& m = mapped_[buffer.index];
    const auto* data = static_cast<const std::uint8_t*>(m.start);
    out.format = pixels_;
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
    device_.close();
  }

  std::string path_;
  CameraWish wish_;
  Descriptor device_;
  v4l2_pix_format format_{};
  PixelFormat pixels_ = PixelFormat::yuyv;
  std::vector<Mapping> mapped_;
};

}  // namespace

tl::expected<CameraInfo, Status> describe_camera(const std::string& path) {
  Descriptor device;
  v4l2_capability capability{};
  if (std::string why = open_camera(path, device, capability); !why.empty()) {
    return tl::unexpected(Status{std::move(why)});
  }
  const auto text = [](const auto& field) {
    const auto* bytes = reinterpret_cast<const char*>(field);
    return std::string(bytes, strnlen(bytes, sizeof field));
  };
  return CameraInfo{text(capability.card), text(capability.driver), modes_of(device),
                    controls_of(device)};
}

std::optional<PixelFormat> format_of(const std::string& fourcc) {
  const KnownFormat* found = known(fourcc);
  return found == nullptr ? std::nullopt : std::optional(found->format);
}

const CameraMode* choose_mode(std::span<const CameraMode> modes, const CameraWish& wish) {
  const auto key = [&](const CameraMode& mode) {
    const auto [width, height] = nearest_size(mode, wish);
    const double off = std::hypot(width - wish.width, height - wish.height);
    const bool slow = mode.rate_hz > 0.0 && mode.rate_hz < 0.98 * wish.rate_hz;
    return std::tuple(off, slow, slow ? -mode.rate_hz : 0.0, known(mode.fourcc)->rank);
  };
  const CameraMode* best = nullptr;
  for (const CameraMode& mode : modes) {
    if (known(mode.fourcc) == nullptr) continue;
    if (wish.format != "any" && wish.format != mode.fourcc) continue;
    if (best == nullptr || key(mode) < key(*best)) best = &mode;
  }
  return best;
}

std::unique_ptr<FrameDevice> v4l2_device(const std::string& path, const CameraWish& wish) {
  return std::make_unique<V4l2Device>(path, wish);
}

}  // namespace mimesis::camera
