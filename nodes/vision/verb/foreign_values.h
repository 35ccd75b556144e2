#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "common/runtime/yaml_document.h"
#include "nodes/vision/verb/foreign_calibration.h"

/// Values in calibrations of other programs. All throw ConfigError "FILE:LINE:COLUMN: ...".
namespace mimesis::tool::foreign {

using runtime::Place;
using runtime::Yaml;
using Numbers = std::vector<double>;
using Keys = std::vector<std::string>;

/// @throws ConfigError always; `what` may hold words of the file
[[noreturn]] void fail(const Place& place, const std::string& what);

/// YAML, JSON, or OpenCV's XML as its YAML would be.
Yaml read_text(const ForeignFile& file);

double number(const Yaml& value, const std::string& key);
/// A matrix of OpenCV or ROS (rows, cols, data), or a list, which may be one of rows.
Numbers numbers(const Yaml& value, const std::string& key);

struct Value {
  const Yaml* yaml = nullptr;
  std::string key;
  explicit operator bool() const { return yaml != nullptr; }
};
/// One of several names of one thing; nothing if it is not there.
Value find(const Yaml& map, const Keys& keys);
/// The same, which must be there.
Value need(const Yaml& map, const Keys& keys);
Numbers numbers(const Value& value, std::size_t size);

/// The rotation that is nearest to `given`, within its rounding.
Eigen::Matrix3d rotation(const Eigen::Matrix3d& given, const Place& place, const std::string& key);
Eigen::Matrix3d rotation(const Value& value);
/// Of a matrix 4x4.
Eigen::Isometry3d pose(const Value& value);

}  // namespace mimesis::tool::foreign
