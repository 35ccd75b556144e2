#pragma once
#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace mimesis::mocap {

/// Optical markers over time, as a C3D file holds them. A missing marker is NaN.
struct Markers {
  std::string name;  ///< file name without folder
  std::vector<std::string> labels;
  double rate_hz = 0.0;
  long first_frame = 1;  ///< number of column 0 in the recording
  /// Rows 3m..3m+2 of marker m in the file's axes [m], one column a frame.
  Eigen::MatrixXd position_m;
  /// Rows: analog channels in their units; columns: samples. Empty if there are none.
  Eigen::MatrixXd analog;
  std::vector<std::string> analog_labels;
  double analog_rate_hz = 0.0;

  Eigen::Index frames() const { return position_m.cols(); }
};

/// Reads a C3D file: Intel, DEC and SGI/MIPS processors, integer and real.
/// @throws ConfigError "file: what (at which byte or parameter), expected ..."
Markers read_c3d(const std::string& file);

}  // namespace mimesis::mocap
