#pragma once
#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>

#include "common/motion/mocap/body.h"
#include "common/motion/mocap/markers.h"

namespace mimesis::mocap {

/// Sizes that markers do not show [m].
inline constexpr double kMarkerRadius_m = 0.007, kKneeWidth_m = 0.10, kAnkleWidth_m = 0.07,
                        kElbowWidth_m = 0.08;
inline constexpr double kShoulderDrop_m = 0.05;  ///< joint centre below the shoulder marker

/// Markers of the PluginGait set that the figure is built from.
enum GaitMarker {
  kLFHD,
  kRFHD,
  kLBHD,
  kRBHD,
  kC7,
  kT10,
  kCLAV,
  kSTRN,
  kLASI,
  kRASI,
  kLPSI,
  kRPSI,
  kLSHO,
  kLELB,
  kLWRA,
  kLWRB,
  kLFIN,
  kLKNE,
  kLANK,
  kLHEE,
  kLTOE,
  kRSHO,
  kRELB,
  kRWRA,
  kRWRB,
  kRFIN,
  kRKNE,
  kRANK,
  kRHEE,
  kRTOE,
  kGaitMarkers
};
inline constexpr std::array<std::string_view, kGaitMarkers> kGaitMarkerNames = {
    "LFHD", "RFHD", "LBHD", "RBHD", "C7",   "T10",  "CLAV", "STRN", "LASI", "RASI",
    "LPSI", "RPSI", "LSHO", "LELB", "LWRA", "LWRB", "LFIN", "LKNE", "LANK", "LHEE",
    "LTOE", "RSHO", "RELB", "RWRA", "RWRB", "RFIN", "RKNE", "RANK", "RHEE", "RTOE"};

/// On pelvis or legs.
constexpr bool of_the_legs(std::size_t marker) {
  return (marker >= kLASI && marker <= kRPSI) || (marker >= kLKNE && marker <= kLTOE) ||
         marker >= kRKNE;
}

/// By GaitMarker, a label of a file.
using MarkerLabels = std::array<std::string, kGaitMarkers>;
/// Those of the set that a file has; empty: none.
MarkerLabels find_marker_labels(const Markers& markers);

/// The 17-joint figure from the PluginGait marker set (labels LASI, LKNE, ... with or without
/// "subject:" before, or what CMU, Helen Hayes and others call the same places: L.ASIS, LFWT, VSAC,
/// "r knee", ...). The up axis of the file is the one along which pelvis and toes are farthest
/// apart. Gaps are filled; the clip is the longest run of frames with all markers.
/// @param labels  by marker, its label in the file; empty: by the names above
/// @param legs_only  pelvis and legs alone are used; the part above stands stiff, of standard size,
///        arms sideways
///
/// Conventions, left side (w = distance of LASI and RASI; lateral = outwards):
///   pelvis    y RASI→LASI, x from the PSIS (or SACR) to the ASIS; root: mid of both
///   hip       0.36 w lateral, 0.19 w behind and 0.30 w below the mid of the ASIS (Bell 1990)
///   knee      half its width and a marker radius medial of LKNE, ankle likewise of LANK, along
///             the pelvis' y axis, square to the segment above
///   foot      x LHEE→LTOE; its ground points 3 cm below these markers
///   chest     z from T10/STRN to C7/CLAV, x from C7/T10 to CLAV/STRN
///   head      x from LBHD/RBHD to LFHD/RFHD, y from right to left
///   shoulder  kShoulderDrop_m below LSHO along the chest's z axis
///   elbow     half its width and a marker radius below LELB along its flexion axis; a stretched
///             arm takes the direction LWRB→LWRA instead
///   wrist     mid of LWRA and LWRB; the hand is twice as long as from there to LFIN
/// The T-posture has palms forward. Spine and neck take half of the rotation from pelvis to chest
/// and from chest to head.
/// @throws ConfigError with the labels that are absent or never seen, if no frame shows all, or if
/// the markers are not those of a person (pelvis within 0.3 m of the toes)
BodyClip body_from_markers(const Markers& markers, bool legs_only = false,
                           const MarkerLabels& labels = {});

/// Positions of all of them in one frame [m], z up.
using GaitMarkerSet = Eigen::Matrix<double, 3, kGaitMarkers>;

/// The figure in one frame by the conventions in body_from_markers.h: pose of all joints and
/// points of heels, toes, finger tips (by side) and the head's top, in W [m].
struct MarkerPose {
  BodyPose pose;
  std::array<Eigen::Vector3d, 2> heel, toe, hand;
  Eigen::Vector3d head_top;
};
MarkerPose pose_from_markers(const GaitMarkerSet& m, bool legs_only);

}  // namespace mimesis::mocap
