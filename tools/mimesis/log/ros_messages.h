#pragma once
#include <map>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "common/error.h"

// Messages of viewers (foxglove.*) as ROS 2 knows them.
namespace mimesis::tool {

/// "sensor_msgs/msg/Image" for "foxglove.RawImage"; empty: ROS has no such message. Images and
/// their calibration, joint states, transforms, poses, logs, and scenes as markers.
std::string ros_type(std::string_view type);

/// The definition of a type that ros_type() gives, with those that it uses, as rosbag2 stores it
/// ("ros2msg").
std::string ros_definition(const std::string& ros_type);

/// The messages of one channel as ROS sends them: CDR, little endian (XCDR1). What ROS cannot say
/// is left out: taper of cylinders, models of scenes, accelerations of joints. An entity of a scene
/// is markers of its name; those that it has no more are deleted.
class ToRos {
 public:
  /// Status: `payload` is no valid message of `type`.
  tl::expected<std::string, Status> convert(std::string_view type, std::string_view payload);

 private:
  std::map<std::string, int> scene_;  ///< number of markers by entity
};

}  // namespace mimesis::tool
