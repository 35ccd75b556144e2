// Any bytes as a point cloud or a URDF: the first one chooses. The readers survive them, and say
// what is wrong in a line with the file's name.
//   cmake --preset fuzz && ninja -C build-fuzz parts_fuzz && build-fuzz/bin/parts_fuzz
//   -rss_limit_mb=2048 CORPUS
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <string>

#include "common/error.h"
#include "common/robot/point_cloud.h"
#include "common/robot/robot_tree.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mimesis;
  if (size == 0) return 0;
  const int fd = memfd_create("fuzz", MFD_CLOEXEC);
  MIMESIS_ASSERT(write(fd, data + 1, size - 1) == static_cast<ssize_t>(size - 1));
  const std::string file = "/proc/self/fd/" + std::to_string(fd);
  try {
    if (data[0] % 2 == 0) {
      const Eigen::Matrix3Xd points = robot::read_point_cloud(file, robot::Viewpoint::apply);
      MIMESIS_ASSERT(points.allFinite());
    } else {
      robot::read_urdf(file);
    }
  } catch (const ConfigError& e) {
    const std::string line = e.what();
    MIMESIS_ASSERT(line.find(file) != std::string::npos && line.find('\n') == std::string::npos);
  }
  close(fd);
  return 0;
}
