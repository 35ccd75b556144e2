#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/image/rig.h"
#include "common/kin/arm.h"
#include "nodes/vision/calibration/hand_eye.h"

namespace CLI {
class App;
}

// Shared by the parts of `mimesis calibrate`.
namespace mimesis::tool {

struct BoardOptions {
  std::string board = "9x6";
  double square_m = 0.0;
  bool json = false;
};
/// --board, --square-m, --json; `options` outlives the call.
void add_board(CLI::App* verb, BoardOptions& options);

/// A lens for reports: size, focal lengths, centre, distortion.
nlohmann::ordered_json lens_report(const std::string& name, const image::Lens& lens);

/// Replaces the file at once. @throws std::runtime_error if it cannot be written
void write_rig(const std::string& file, const image::Rig& rig);

/// `calibrate hand-eye`.
void add_hand_eye(CLI::App* calibrate, int& exit_code);

/// `calibrate import`.
void add_import(CLI::App* calibrate, int& exit_code);

/// A table of an arm's poses, one row a picture.
struct ArmPoses {
  std::vector<std::string> files;  ///< of the pictures, as written
  std::vector<int> lines;          ///< of the table
  /// The first one is as the columns are named; the others are mistakes that people make.
  std::vector<vision::PoseReading> readings;
};

/// Reads a table (CSV): a line of names, then a line a picture; separated by comma, semicolon or
/// tab; lines that begin with # and empty ones are left out. Columns, in any order:
///   file (or picture, image)
///   x_m y_m z_m (or x_mm ...): place of the flange in the arm's base
///   its turn there: qw qx qy qz; or rotvec_x_rad ...; or roll_rad pitch_rad yaw_rad, R = Rz(yaw)
///     Ry(pitch) Rx(roll); or a_deg b_deg c_deg as KUKA has it, R = Rz(a) Ry(b) Rx(c); each in rad
///     or deg
///   with an arm: A1_rad ... An_rad (or _deg; A1_m of joints that slide) instead of the pose
/// @param name in front of messages
/// @param arm  its end effector is the flange then, and its world the base; null: poses
/// @throws ConfigError "FILE:LINE: ..." for columns without a unit or a convention, unknown or
///   missing ones, values that are none or that no pose and no joint has
ArmPoses read_arm_poses(const std::string& text, const std::string& name, const kin::ArmModel* arm);

}  // namespace mimesis::tool
