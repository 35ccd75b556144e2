#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <random>

#include "common/image/image.h"
#include "nodes/vision/calibration/board.h"

namespace mimesis::vision {

/// A camera as the tests know it: written again, so that no mistake is made twice alike.
struct TrueCamera {
  int width = 640, height = 480;
  double fx = 600.0, fy = 600.0, cx = 319.5, cy = 239.5;
  std::array<double, 5> k{};  ///< k1 k2 p1 p2 k3
  Eigen::Matrix3d R_CF = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_FC = Eigen::Vector3d::Zero();

  Eigen::Vector2d pixel(const Eigen::Vector3d& p_F) const;
};

/// Two cameras side by side in the frame of the first: lenses, baseline and turn drawn at random.
std::array<TrueCamera, 2> random_pair(std::mt19937& random);

/// The board before a pair, such that both see all of it: place and tilt drawn at random.
Eigen::Isometry3d random_place(const Board& board, const std::array<TrueCamera, 2>& pair,
                               std::mt19937& random);

/// Whether the picture holds the board with its white border.
bool holds(const TrueCamera& camera, const Board& board, const Eigen::Isometry3d& X_FB);

/// What a camera sees of a board before grey: ink of 40 on paper of 215, lit unevenly, each pixel
/// the mean of 9 rays, with noise of `noise` levels.
image::Image board_picture(const TrueCamera& camera, const Board& board,
                           const Eigen::Isometry3d& X_FB, double noise, std::mt19937& random);

/// Corners where the camera sees them.
Corners true_corners(const TrueCamera& camera, const Board& board, const Eigen::Isometry3d& X_FB);

}  // namespace mimesis::vision
