#pragma once
#include <optional>
#include <string>

#include "common/image/rig.h"

namespace mimesis::model {

/// Reads a rig that `mimesis calibrate` wrote. @throws ConfigError "file:line:col: ..." for another
/// format or version, unknown or missing keys, values that no camera has.
image::Rig load_rig(const std::string& file);

/// Reads the text of such a file. @param name in front of messages
image::Rig parse_rig(const std::string& text, const std::string& name);

/// The text of such a file.
std::string rig_text(const image::Rig& rig);

/// The rig's camera `name` (empty: its first one), which knows the table. @throws ConfigError if
/// there is none, or `mimesis calibrate table` has not placed the rig yet.
image::Camera camera_on_table(const image::Rig& rig, const std::string& file,
                              const std::string& name);

/// Calibrations of other programs, which `mimesis calibrate import` reads.
enum class Foreign { none, camera_info, opencv, kalibr, camodocal, orb_slam };

/// By the keys that a text has; none for a rig, and for what is no calibration.
Foreign foreign_kind(const std::string& text);
/// "a ROS camera_info"
std::string described(Foreign kind);

/// Days since 1970-01-01 of "YYYY-MM-DD"; nothing if it is no date.
std::optional<int> day_number(const std::string& date);

}  // namespace mimesis::model
