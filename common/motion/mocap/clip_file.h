#pragma once
#include <string>

#include "common/motion/mocap/skeleton.h"

namespace mimesis::mocap {

/// Interpretation of a motion file where the file itself is not explicit.
struct ReadOptions {
  /// Length of the file's unit. 0: by the kind of file: BVH 1 cm or, with joints named as CMU's
  /// conversion names them, CMU's 2.54/0.45 cm; ASF its own `length` (CMU: 1/0.45 inch).
  double unit_m = 0.0;
  std::string asf{};  ///< skeleton of an AMC; empty: the .asf beside it whose name fits
};

/// Reads a .bvh or .amc file, by its ending. @throws ConfigError "file:line: what, expected ..."
Clip read_clip(const std::string& file, const ReadOptions& options = {});

/// The clip as a table, one row a frame, numbers exact, axes x forward, y left, z up. Columns:
/// time_s; position of the root, ROOT.px_m ROOT.py_m ROOT.pz_m; then of every joint its axis-angle
/// vector relative to the parent, JOINT.x_rad JOINT.y_rad JOINT.z_rad.
/// @throws ConfigError as bvh_text does, but names may be any
std::string csv_text(const Clip& clip);

/// Writes a .bvh or .csv file, by its ending. @throws ConfigError also if it cannot be written
void write_clip(const Clip& clip, const std::string& file);

}  // namespace mimesis::mocap
