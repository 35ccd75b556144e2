#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "common/motion/mocap/markers.h"

namespace mimesis::mocap {

/// Processors whose number formats a C3D file may have, by the byte that names them.
enum class C3dProcessor { intel = 84, dec = 85, mips = 86 };

/// The number of a VAX F float: sign, 8 bits of exponent with bias 128, 23 of a mantissa 0.1f. Its
/// two words are swapped: the high one first. NaN for the reserved operand.
double vax_float(std::uint32_t bits);

/// Reads the bytes of a C3D file (c3d.org's description). Intel, DEC and SGI/MIPS; integer and
/// real. Where header and parameters differ, the parameters hold; missing ones are taken from:
///  - points, scale, rate: the header. Without any rate the file is refused.
///  - frames: the first of POINT:LONG_FRAMES, TRIAL:ACTUAL_START/END_FIELD, POINT:FRAMES (unsigned)
///    and the header for which the file is long enough; if it is for none, it is refused as cut
///    off.
///  - first frame: TRIAL:ACTUAL_START_FIELD, or else the header
///  - data: POINT:DATA_START, or else the header's, or else behind the parameter section; a start
///    within the parameters counts only if both agree (their last ones were overwritten then)
///  - parameters: they may run on to the data where their section is stated too short
///  - labels: LABELS, LABELS2, ...; a point without one is called "point 12"
///  - units: POINT:UNITS mm, cm, m or in; absent or blank: mm, as the format has it
///  - analog samples a frame, which are passed over: ANALOG:RATE over POINT:RATE if that is whole,
///    or else the header's.
/// A point with a negative residual, or a coordinate that is not finite, is missing: NaN.
/// Points that are no markers (angles, forces of modelling software) are read as the file has them,
/// times the unit: choose by label.
/// @param file  named in errors; its base name becomes the recording's
/// @throws ConfigError "file: byte N: ..." or "file: GROUP:PARAMETER ..."
Markers parse_c3d(std::span<const std::byte> bytes, const std::string& file);
/// Reads a file. @throws ConfigError also if it cannot be read
Markers read_c3d(const std::string& file);

}  // namespace mimesis::mocap
