#pragma once
#include <Eigen/Core>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "common/motion/mocap/markers.h"
#include "common/motion/mocap/rigid_fit.h"

namespace mimesis::mocap {

/// Markers that sit on one rigid segment.
struct MarkerGroup {
  std::string name;
  std::vector<Eigen::Index> markers;  ///< indices in Markers::labels; may sit in several groups
};

/// The group's markers in a frame of its own [m], 3×N: mean over the frames that show them all,
/// each turned onto the first of them (the nominal geometry [M18 3.3.2]).
/// Status: fewer than three markers, on one line, or never seen together.
tl::expected<Eigen::Matrix3Xd, Status> nominal_geometry(const Markers& markers,
                                                        const MarkerGroup& group);

/// Motion of a group, frame by frame; nothing where fewer than three of its markers are seen.
std::vector<std::optional<RigidFit>> group_motion(const Markers& markers, const MarkerGroup& group,
                                                  const Eigen::Matrix3Xd& nominal);

/// Where two segments are linked, in the frame of each.
struct CentreOfRotation {
  Eigen::Vector3d p_A, p_B;
  double rms_m = 0.0;       ///< distance of the two estimates in W, over the frames
  int free_directions = 0;  ///< of 3, along which the motion says nothing (a hinge: 1)
};

/// Centre of rotation between segments A and B: the two points, each fixed to its segment, that
/// stay nearest to each other, min Σ ‖R_WA p_A + p_WA − R_WB p_B − p_WB‖² (symmetrical estimation,
/// Ehrig et al. 2006). Where the segments hardly turn against each other (singular value of the
/// stacked rotations below 0.06, about 5° of motion) the points stay as near as possible to
/// `prior_A` and `prior_B`, an anatomical guess of the same point.
/// Status: fewer than ten frames in which both are seen, or no relative rotation at all.
tl::expected<CentreOfRotation, Status> centre_of_rotation(
    std::span<const std::optional<RigidFit>> A, std::span<const std::optional<RigidFit>> B,
    const Eigen::Vector3d& prior_A, const Eigen::Vector3d& prior_B);

}  // namespace mimesis::mocap
