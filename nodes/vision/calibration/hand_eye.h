#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "common/image/rig.h"
#include "nodes/vision/calibration/board.h"
#include "nodes/vision/calibration/calibration.h"

namespace mimesis::vision {

// Frames: W, in which the arm's poses are given (its base); F, its flange or whatever link they
// are of; C, the camera (x right, y down, z forward); B, the board (board.h).

/// What the arm carries; the other one stands still in W.
enum class OnArm { camera, board };

/// A picture of the board, and which row of the poses is its own.
struct ArmShot {
  std::string name;
  std::size_t row = 0;
  Corners seen;
};

/// The arm's poses, a row each, as one way to understand what was written; X_WF, [m].
struct PoseReading {
  std::string name;  ///< what would be so: "the angles are degrees, not radians"
  std::vector<Eigen::Isometry3d> X_WF;
};

/// How a picture fits the poses.
struct PoseFit {
  std::string name;
  double rms_px = 0.0;       ///< distance of corners
  double held_out_px = 0.0;  ///< the same, from what the other pictures say
  double distance_m = 0.0;   ///< of the board's middle
  double off_m = 0.0;        ///< of the board's middle, from where this picture alone has it
};

struct HandEye {
  Eigen::Isometry3d X_camera = Eigen::Isometry3d::Identity();  ///< X_FC, or X_WC: board on the arm
  Eigen::Isometry3d X_board = Eigen::Isometry3d::Identity();   ///< X_WB, or X_FB: board on the arm
  /// Standard deviations of X_camera along and about the axes of F (W: board on the arm): those of
  /// the least squares, or of the jackknife over the pictures if that is larger.
  Eigen::Vector3d position_sigma_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotation_sigma_rad = Eigen::Vector3d::Zero();
  /// How the arm errs, as the pictures tell: deviation of its poses along and about each axis of F.
  double arm_sigma_m = 0.0, arm_sigma_rad = 0.0;
  /// Size of the squares by the arm's motions, over the one that was said, and its deviation [1].
  double square_ratio = 1.0, square_ratio_sigma = 0.0;
  double rms_px = 0.0;
  std::vector<PoseFit> fits;  ///< of the pictures that were used
  std::vector<Rejected> rejected;
  std::string helps;  ///< the view that would tell most: "the board turned by 35° about ..."

  double position_2sigma_m() const { return 2.0 * position_sigma_m.norm(); }
  double rotation_2sigma_rad() const { return 2.0 * rotation_sigma_rad.norm(); }
};

/// Where the camera is on the arm, or before it: X_camera and X_board with
///   X_WF X_FC X_CB = X_WB  for every picture (camera on the arm), or  X_FW X_WC X_CB = X_FB.
/// The rotation begins with that which turns the axes of the camera's motions onto the arm's (Park
/// and Martin, IEEE T-RA 10(5), 1994; by Kabsch's method, which needs two axes only), the positions
/// with linear least squares; then corners are brought to where the pictures have them
/// (Levenberg-Marquardt). Corners of a picture err together if the arm errs, so that each picture
/// counts by what its corners tell of the board's pose (6 numbers, with their covariance) and by
/// the arm's deviations, which are estimated with it (restricted maximum likelihood). A picture
/// that the others do not predict is rejected.
/// @param readings the poses as they are meant; behind them other readings, which are tried if
///   these do not fit, as are poses that are the other way round or belong to the picture before or
///   after, and another unit of length or size of the squares
/// @returns a reason if there are fewer than 4 pictures, if the motions do not bound the result (no
///   motion, no turn, turns about one axis, 2 sigma above 2 % of the board's distance or 0.02 rad),
///   if a third of the pictures contradict the others, if the arm's motions make the squares 2 %
///   and four deviations larger or smaller, or if another reading fits five times better, by its
///   name
tl::expected<HandEye, Status> calibrate_hand_eye(const Board& board, const image::Lens& lens,
                                                 OnArm on_arm, std::vector<ArmShot> shots,
                                                 std::span<const PoseReading> readings);

}  // namespace mimesis::vision
