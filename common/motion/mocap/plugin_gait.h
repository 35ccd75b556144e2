#pragma once
#include <Eigen/Core>
#include <array>
#include <string_view>

#include "common/motion/mocap/body.h"
#include "common/motion/mocap/body_from_markers.h"

namespace mimesis::mocap {

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

/// Positions of all of them in one frame [m], z up.
using GaitMarkerSet = Eigen::Matrix<double, 3, kGaitMarkers>;

/// The figure in one frame by the conventions in body_from_markers.h: pose of all joints and
/// points of heels, toes, finger tips (by side) and the head's top, in W [m].
struct MarkerPose {
  BodyPose pose;
  std::array<Eigen::Vector3d, 2> heel, toe, hand;
  Eigen::Vector3d head_top;
};
MarkerPose pose_from_markers(const GaitMarkerSet& m, const MarkerBodyOptions& options);

}  // namespace mimesis::mocap
