// A camera for tests, preloaded into a program that opens the file named by MIMESIS_FAKE_CAMERA:
// plugged in as long as the file is there, 30 frames a second in YUYV, each brighter than the last.
// What its controls are set to is added to that file's name and `.controls`; all have the value
// 123.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdarg>
#include <cstdlib>
#include <fstream>
#include <string>

namespace {

using std::chrono::microseconds;

int g_camera = -1;
unsigned g_frame = 0, g_bytes = 0;
microseconds g_due{};

std::string path_of_camera() {
  const char* path = std::getenv("MIMESIS_FAKE_CAMERA");
  return path == nullptr ? "" : path;
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
    static_cast<v4l2_capability*>(argument)->capabilities =
        V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  } else if (request == VIDIOC_S_FMT) {
    v4l2_pix_format& format = static_cast<v4l2_format*>(argument)->fmt.pix;
    format.bytesperline = 2 * format.width;
    g_bytes = format.sizeimage = format.bytesperline * format.height;
  } else if (request == VIDIOC_REQBUFS) {
    return ftruncate(g_camera, off_t{4} * g_bytes);
  } else if (request == VIDIOC_QUERYBUF) {
    auto& buffer = *static_cast<v4l2_buffer*>(argument);
    buffer.length = g_bytes;
    buffer.m.offset = buffer.index * g_bytes;
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
