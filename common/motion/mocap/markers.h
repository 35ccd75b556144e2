#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
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
  Eigen::Index frames() const { return position_m.cols(); }
};

/// Pose of a rigid body: p_W = R_WB p_B + p_WB.
struct RigidFit {
  Eigen::Matrix3d R_WB;
  Eigen::Vector3d p_WB;
};

/// The rotation and translation that bring `body` nearest to `world` in the least-squares sense
/// (orthogonal Procrustes problem by SVD, reflections excluded; Kabsch 1976, [M18 3.3.2]).
/// @param body, world  3×N, the same points; columns in which either is NaN do not count
/// @returns nothing with fewer than three points, or if they lie on a line to 1 mm
std::optional<RigidFit> fit_rigid(const Eigen::Ref<const Eigen::Matrix3Xd>& body,
                                  const Eigen::Ref<const Eigen::Matrix3Xd>& world);

/// Markers that sit on one rigid segment: indices in Markers::labels, may sit in several groups.
using MarkerGroup = std::vector<Eigen::Index>;

/// Fills missing (NaN) marker positions in place. A marker of a group of which three others are
/// seen is put at its place in the group's nominal geometry [M18 3.3.2]; the deviation of its own
/// positions from there at the ends of the gap fades linearly through it, so that nothing jumps.
/// Remaining gaps of at most `longest_s` are bridged by a natural cubic spline through the marker's
/// own positions. Longer gaps, and those at the ends of the recording, stay NaN; groups without a
/// geometry (fewer than three markers, on one line, or never seen together) are left to
/// the splines.
void fill_gaps(Markers& markers, std::span<const MarkerGroup> groups, double longest_s = 0.3);

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
