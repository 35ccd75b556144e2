// A camera for tests, preloaded into a program that opens the file named by MIMESIS_FAKE_CAMERA:
// plugged in as long as the file is there, 30 frames a second, each brighter than the last. Its
// modes are those of MIMESIS_FAKE_MODES, "YUYV 640x480 30, MJPG 640x480 60"; without it, it lists
// none and takes YUYV. What its controls are set to is added to that file's name and `.controls`;
// all have the value 123.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

using std::chrono::microseconds;

int g_camera = -1;
unsigned g_frame = 0, g_bytes = 0;
microseconds g_due{};

std::string path_of_camera() {
  const char* path = std::getenv("MIMESIS_FAKE_CAMERA");
  return path == nullptr ? "" : path;
}

struct Mode {
  std::string fourcc;
  unsigned width = 0, height = 0, rate_hz = 0;
};

std::vector<Mode> modes() {
  std::vector<Mode> all;
  const char* text = std::getenv("MIMESIS_FAKE_MODES");
  std::istringstream in(text == nullptr ? "" : text);
  for (std::string one; std::getline(in, one, ',');) {
    std::istringstream words(one);
    Mode mode;
    char by = 0;
    words >> mode.fourcc >> mode.width >> by >> mode.height >> mode.rate_hz;
    all.push_back(mode);
  }
  return all;
}

std::string text_of(std::uint32_t fourcc) {
  return {char(fourcc), char(fourcc >> 8), char(fourcc >> 16), char(fourcc >> 24)};
}

template <class Asked>
std::vector<Mode> modes_of(const Asked& asked) {
  std::vector<Mode> of = modes();
  std::erase_if(of, [&](const Mode& mode) {
    if (mode.fourcc != text_of(asked.pixel_format)) return true;
    if constexpr (requires { asked.width; })
      return mode.width != asked.width || mode.height != asked.height;
    return false;
  });
  return of;
}

/// Entry `index` of what is listed; EINVAL behind the last.
template <class T, class Put>
int entry(const std::vector<T>& list, unsigned index, const Put& put) {
  if (index >= list.size()) {
    errno = EINVAL;
    return -1;
  }
  put(list[index]);
  return 0;
}

int list_formats(v4l2_fmtdesc& out) {
  std::vector<std::string> names;
  for (const Mode& mode : modes()) {
    if (names.empty() || names.back() != mode.fourcc) names.push_back(mode.fourcc);
  }
  return entry(names, out.index, [&](const std::string& f) {
    out.pixelformat = v4l2_fourcc(std::uint32_t(f[0]), std::uint32_t(f[1]), std::uint32_t(f[2]),
                                  std::uint32_t(f[3]));
  });
}

int list_sizes(v4l2_frmsizeenum& out) {
  return entry(modes_of(out), out.index, [&](const Mode& mode) {
    out.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    out.discrete = {mode.width, mode.height};
  });
}

int list_rates(v4l2_frmivalenum& out) {
  return entry(modes_of(out), out.index, [&](const Mode& mode) {
    out.type = V4L2_FRMIVAL_TYPE_DISCRETE;
    out.discrete = {1, mode.rate_hz};
  });
}

int dequeue(v4l2_buffer& buffer) {
  const auto now =
      std::chrono::duration_cast<microseconds>(std::chrono::steady_clock::now().time_since_epoch());
  if (now < g_due) {
    errno = EAGAIN;
    return -1;
  }
  g_due = now + microseconds(33'333);
  buffer.index = g_frame % 4;
  buffer.bytesused = g_bytes;
  buffer.timestamp.tv_sec = now.count() / 1'000'000;
  buffer.timestamp.tv_usec = now.count() % 1'000'000;
  const std::string pixels(g_bytes, static_cast<char>(60 + g_frame++ % 60));
  const auto written = pwrite(g_camera, pixels.data(), g_bytes, off_t{buffer.index} * g_bytes);
  return written == static_cast<ssize_t>(g_bytes) ? 0 : -1;
}

int answer(unsigned long request, void* argument) {
  if (access(path_of_camera().c_str(), F_OK) != 0) {
    errno = ENODEV;
    return -1;
  }
  if (request == VIDIOC_QUERYCAP) {
    auto& capability = *static_cast<v4l2_capability*>(argument);
    capability.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    std::strcpy(reinterpret_cast<char*>(capability.card), "Fake camera");
    std::strcpy(reinterpret_cast<char*>(capability.driver), "fake");
  } else if (request == VIDIOC_S_FMT) {
    v4l2_pix_format& format = static_cast<v4l2_format*>(argument)->fmt.pix;
    if (modes().empty()) format.pixelformat = V4L2_PIX_FMT_YUYV;
    format.bytesperline = (text_of(format.pixelformat) == "GREY" ? 1 : 2) * format.width;
    g_bytes = format.sizeimage = format.bytesperline * format.height;
  } else if (request == VIDIOC_ENUM_FMT) {
    return list_formats(*static_cast<v4l2_fmtdesc*>(argument));
  } else if (request == VIDIOC_ENUM_FRAMESIZES) {
    return list_sizes(*static_cast<v4l2_frmsizeenum*>(argument));
  } else if (request == VIDIOC_ENUM_FRAMEINTERVALS) {
    return list_rates(*static_cast<v4l2_frmivalenum*>(argument));
  } else if (request == VIDIOC_REQBUFS) {
    return ftruncate(g_camera, off_t{4} * g_bytes);
  } else if (request == VIDIOC_QUERYBUF) {
    auto& buffer = *static_cast<v4l2_buffer*>(argument);
    buffer.length = g_bytes;
    buffer.m.offset = buffer.index * g_bytes;
  } else if (request == VIDIOC_QUERYCTRL &&
             (static_cast<v4l2_queryctrl*>(argument)->id & V4L2_CTRL_FLAG_NEXT_CTRL) != 0) {
    auto& query = *static_cast<v4l2_queryctrl*>(argument);
    if (query.id != V4L2_CTRL_FLAG_NEXT_CTRL) {
      errno = EINVAL;
      return -1;
    }
    query = {V4L2_CID_BRIGHTNESS, V4L2_CTRL_TYPE_INTEGER, "Brightness", -64, 64, 1, 0, 0, {}};
  } else if (request == VIDIOC_QUERYCTRL) {
    const bool absent = static_cast<v4l2_queryctrl*>(argument)->id == V4L2_CID_AUTOGAIN;
    if (absent) errno = EINVAL;
    return absent ? -1 : 0;
  } else if (request == VIDIOC_G_CTRL) {
    static_cast<v4l2_control*>(argument)->value = 123;
  } else if (request == VIDIOC_S_CTRL) {
    const auto& control = *static_cast<const v4l2_control*>(argument);
    std::ofstream(path_of_camera() + ".controls", std::ios::app)
        << control.id << '=' << control.value << '\n';
  } else if (request == VIDIOC_DQBUF) {
    return dequeue(*static_cast<v4l2_buffer*>(argument));
  }
  return 0;
}

}  // namespace

extern "C" int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const int mode = (flags & O_CREAT) != 0 ? va_arg(more, int) : 0;
  va_end(more);
  const auto real = reinterpret_cast<int (*)(const char*, int, ...)>(dlsym(RTLD_NEXT, "open"));
  const int fd = real(path, flags, mode);
  if (path == path_of_camera()) g_camera = fd;
  return fd;
}

extern "C" int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list more;
  va_start(more, request);
  void* argument = va_arg(more, void*);
  va_end(more);
  if (fd >= 0 && fd == g_camera) return answer(request, argument);
  const auto real = reinterpret_cast<int (*)(int, unsigned long, ...)>(dlsym(RTLD_NEXT, "ioctl"));
  return real(fd, request, argument);
}
