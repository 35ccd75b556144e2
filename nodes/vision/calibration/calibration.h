#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/image/rig.h"
#include "nodes/vision/calibration/board.h"

namespace mimesis::vision {

/// Size of a camera's pictures [px].
struct PictureSize {
  int width = 0, height = 0;
};

/// One position of the board: `seen[c]` are its corners in camera c. A single camera has one.
struct Shot {
  std::string name;  ///< of the picture or of the pair, for messages
  std::vector<Corners> seen;
};

struct Rejected {
  std::string name, reason;
};

/// How one position of the board fits the calibration that the others give.
struct HeldOut {
  std::string name;
  double reprojection_px = 0.0;  ///< rms distance of corners, the board's pose fitted to them
  double epipolar_px = 0.0;      ///< mean distance to epipolar lines per side; 0 with one camera
  double baseline = 0.0;         ///< of the calibration without it [m]
  std::vector<double> fx_px{};   ///< of each camera without it
};

/// How well a lens is known: standard deviations; infinite where the views bound nothing.
struct LensSigma {
  double fx_px = 0.0, fy_px = 0.0, cx_px = 0.0, cy_px = 0.0;
  std::string helps;  ///< the view that would tell most of fx: "the board tilted by 40°, ..."
};

/// What the pictures have shown of a lens.
struct Coverage {
  double cells = 0.0;     ///< share of 8 x 6 cells of the picture that held a corner [1]
  double tilt_deg = 0.0;  ///< largest angle between the board's normal and the axis
  double nearest_m = 0.0, farthest_m = 0.0;  ///< distances of the board
  std::vector<std::string> missing;  ///< "upper left", ...: quarters of the picture without corners
};

struct Calibrated {
  std::vector<image::Camera> cameras;  ///< in the frame of the first one
  std::vector<Shot> shots;             ///< those that were used
  std::vector<Rejected> rejected;
  std::vector<double> mono_rms_px;  ///< of each camera by itself
  double rms_px = 0.0;              ///< distance of corners, all cameras
  std::vector<HeldOut> held_out;    ///< per shot
  std::vector<Coverage> coverage;   ///< per camera
  /// Per camera: of the least squares, each view's pose unknown, with the residuals as noise; or of
  /// the jackknife over the views if that is larger, since corners of one view err together.
  std::vector<LensSigma> sigma;

  double baseline_m() const { return (cameras.at(1).eye() - cameras.at(0).eye()).norm(); }
};

/// Means over the shots of a calibration's held-out errors, and their largest.
struct HeldOutSummary {
  double reprojection_px = 0.0, epipolar_px = 0.0, worst_epipolar_px = 0.0;
  double baseline_spread = 0.0;  ///< standard deviation over mean [1]
  std::string worst;             ///< shot with the largest reprojection error
};
HeldOutSummary summary(std::span<const HeldOut> held_out);

/// Calibrates one camera or a pair from positions of a board [M18 2.1.1: semi-automatic]. Each
/// camera by itself, then both together: from any other start the joint fit of few pairs ends in
/// local minima. Every position is left out once; one that the others do not predict (board moved
/// between the two pictures, wrong partner) is rejected by name and the rest starts anew.
///
/// A board without a beginning (Board::has_a_beginning) is numbered in the second camera so that
/// the cameras are turned against each other by less than a right angle.
/// @returns a reason if fewer than 4 positions are left, more than a third are rejected, or the
/// result is no pair of cameras that anybody built: fx/fy beyond 1.05, the picture's centre out of
/// its middle half, a focal length that is not known to 2 % (2 sigma), a distortion that folds, the
/// second camera not to the right of the first, a baseline that is not 2 % to 150 % of the board's
/// distance.
tl::expected<Calibrated, Status> calibrate(const Board& board, std::span<const PictureSize> sizes,
                                           std::vector<Shot> shots);

/// Pose of a board, seen by cameras whose poses are known in one frame, in that frame.
struct BoardPose {
  Eigen::Isometry3d X_FB = Eigen::Isometry3d::Identity();
  double rms_px = 0.0;  ///< distance of corners
};
BoardPose locate_board(const Board& board, std::span<const image::Camera> cameras,
                       std::span<const Corners> seen);

/// On which side of the table the first camera stands.
enum class Side {
  near,  ///< T's z points towards it, x to the right of its picture
  far    ///< T's z points away from it, x to the left
};

/// The cameras in the table's frame T, from a board that lies on the table: y up out of the board,
/// x along that edge of the board which is nearest to the picture's horizontal. The origin is
/// below the board's middle, shifted by `middle_m` = (x, z) of that middle in T.
/// @param thickness_m height of the print above the table
/// @returns a reason if the board lies askew (within 10° of a diagonal), or does not fit the rig:
/// rms above `most_px`.
struct OnTable {
  std::vector<image::Camera> cameras;
  double rms_px = 0.0;
};
tl::expected<OnTable, Status> place_on_table(const Board& board,
                                             std::span<const image::Camera> cameras,
                                             std::span<const Corners> seen, Side side,
                                             double thickness_m, const Eigen::Vector2d& middle_m,
                                             double most_px);

}  // namespace mimesis::vision
