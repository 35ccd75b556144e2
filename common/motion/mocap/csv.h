#pragma once
#include <string>

#include "common/motion/mocap/skeleton.h"

namespace mimesis::mocap {

/// The clip as a table, one row a frame, numbers exact, axes x forward, y left, z up. Columns:
/// time_s; position of the root, ROOT.px_m ROOT.py_m ROOT.pz_m; then of every joint its axis-angle
/// vector relative to the parent, JOINT.x_rad JOINT.y_rad JOINT.z_rad.
/// @throws ConfigError as bvh_text does, but names may be any
std::string csv_text(const Clip& clip);
void write_csv(const Clip& clip, const std::string& file);

}  // namespace mimesis::mocap
