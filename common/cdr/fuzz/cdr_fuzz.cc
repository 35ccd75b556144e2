// Any bytes as a definition of ROS 2 and a message of it: refused or read, within bounds.
//   cmake --preset fuzz && ninja -C build-fuzz cdr_fuzz && build-fuzz/bin/cdr_fuzz
//   -rss_limit_mb=512
#include <algorithm>
#include <cstdint>
#include <string_view>

#include "common/cdr/ros_type.h"
#include "common/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view all(reinterpret_cast<const char*>(data), size);
  if (all.empty()) return 0;
  const std::size_t end = std::min(all.find('\xff'), all.size());
  try {
    const auto type = mimesis::cdr::RosType::parse(
        "a/msg/B", all[0] % 2 == 0 ? "ros2msg" : "ros2idl", all.substr(1, end - 1));
    const auto message = type->make();
    (void)type->read(all.substr(end), *message);
  } catch (const mimesis::ConfigError&) {
  }
  return 0;
}
