#pragma once
#include <span>
#include <string>
#include <vector>

#include "common/image/rig.h"

namespace mimesis::tool {

/// A file as another program wrote it.
struct ForeignFile {
  std::string name, text;
};

/// What files of others leave open.
struct ImportOptions {
  std::string date;     ///< of the calibration, YYYY-MM-DD
  std::string lens{};   ///< plumb_bob or equidistant, where a file does not name it
  double unit_m = 0.0;  ///< metres that 1 of a translation is; 0: as the files' kind says
  int width_px = 0, height_px = 0;   ///< where a file does not say it; 0: unknown
  std::vector<std::string> names{};  ///< of the cameras; empty: camera; left, right; cam0, cam1 ..
};

struct Imported {
  image::Rig rig;                 ///< in the frame of the first camera
  std::string kind;               ///< "a ROS camera_info"
  std::vector<std::string> said;  ///< what was assumed, left out or approximated, one line each
};

/// Reads ROS camera_info (YAML of camera_calibration, or an echoed message), OpenCV FileStorage
/// (YAML, XML, JSON), Kalibr camchains, camodocal's PINHOLE and KANNALA_BRANDT, and ORB-SLAM
/// settings. A pair is two camera_info, whose projection matrices tell the baseline [REP 104]; R
/// and T of OpenCV, p_2 = R p_1 + T; T_cn_cnm1, T_cam_imu or T_imu_cam of Kalibr; T_c1_c2 of
/// ORB-SLAM. Lenses that k1 k2 p1 p2 k3 do not hold (rational, thin prism, equidistant, omni) are
/// fitted by them, least squares over the picture, and refused if a pixel of it is off by more than
/// 0.25.
/// @throws ConfigError "FILE:LINE:COLUMN: ..." for what is no calibration, is one of a lens that no
///   rig holds, or leaves open what `options` does not say
Imported import_calibration(std::span<const ForeignFile> files, const ImportOptions& options);

}  // namespace mimesis::tool
