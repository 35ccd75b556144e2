#pragma once
#include <google/protobuf/message.h>

#include <memory>
#include <string>
#include <string_view>

namespace mimesis::cdr {

/// A message type of ROS 2, known by its definition, as a Protobuf type, so that whatever shows
/// Protobuf shows ROS. Fields keep their names. uint8, byte and char are 8 bits without a sign;
/// lists of them become `bytes`, other arrays and sequences repeated fields, wstrings UTF-8.
/// Constants and default values are left out.
class RosType {
 public:
  /// @param name      "sensor_msgs/msg/Imu", also without "msg"; "pkg/srv/Name_Event" with the
  ///                  definition of the service is its service event
  /// @param encoding  "ros2msg" or "ros2idl", as schemas of MCAP say
  /// @param text      the definition, behind it those of all types that it uses
  /// @throws ConfigError: line, what is there, what was expected
  static std::shared_ptr<const RosType> parse(const std::string& name, std::string_view encoding,
                                              std::string_view text);
  static bool reads(std::string_view encoding) {
    return encoding == "ros2msg" || encoding == "ros2idl";
  }
  ~RosType();

  /// An empty one. The type must outlive it.
  std::unique_ptr<google::protobuf::Message> make() const;
  /// Reads the CDR bytes of one message: XCDR 1 and plain XCDR 2, either byte order [OMG
  /// XTypes 1.3, 7.4]. Returns why they are none, with the field; empty: done.
  std::string read(std::string_view bytes, google::protobuf::Message& into) const;

 private:
  struct Impl;
  explicit RosType(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::cdr
