#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "nodes/vision/hand/hand_model.h"

namespace mimesis::vision {

/// What a picture says of each cell of the raster (rows of `width` cells, padded to `stride`).
struct Evidence {
  int width = 0, height = 0, stride = 0;
  /// log p(colour | hand) − log p(colour | background), averaged over the cell's pixels [nat]
  std::vector<float> ratio;
  std::vector<float> luma;  ///< 0..255

  void resize(int w, int h);
};

/// Expected luma of skin whose normal is n (frame of the first camera): bias + slope · n.
struct Shading {
  float bias = 0.0f;
  Eigen::Vector3f slope = Eigen::Vector3f::Zero();
  float weight = 0.0f;  ///< 0: luma does not count; else 1 / (2 σ²) of what the fit leaves over
  float mean = 0.0f;    ///< luma of skin of unknown normal
  float weight_mean = 0.0f;  ///< 1 / (2 σ²) without the fit
};

/// Camera relative to the first one, scaled to the raster: p_k = R p_C + t, u = cu + f x/z, with
/// the radial distortion of the lens.
struct RasterCamera {
  Eigen::Matrix3f R = Eigen::Matrix3f::Identity();
  Eigen::Vector3f t = Eigen::Vector3f::Zero();
  float focal = 1.0f, cu = 0.0f, cv = 0.0f;
  float k1 = 0.0f, k2 = 0.0f;

  /// Cells per metre at a point in the camera's frame.
  float scale(const Eigen::Vector3f& p) const {
    const float r2 = std::min(1.0f, p.head<2>().squaredNorm() / (p.z() * p.z()));
    return focal / p.z() * (1.0f + r2 * (k1 + r2 * k2));
  }
};

/// Sums over the cells that the hand covers, weighted with the share covered.
struct Match {
  float area = 0.0f;     ///< cells
  float ratio = 0.0f;    ///< sum of Evidence::ratio [nat]
  float shading = 0.0f;  ///< sum of log p(luma | normal) − log p(luma) [nat]
  float forearm = 0.0f;  ///< sum of Evidence::ratio on the forearm [nat]
};

/// Draws capsules into a small raster with soft edges and compares it with the picture in the same
/// pass: about 5 µs for a hand. Holds scratch space; does not allocate after construction.
class HandRaster {
 public:
  HandRaster(int width, int height);

  /// Draws and sums. Same bits on every instruction set.
  Match match(const HandCapsules& capsules, const RasterCamera& camera, const Evidence& evidence,
              const Shading& shading);

  /// After a match: the share of each cell that the hand (not the forearm) covers, and the luma
  /// that the shading expects where that is more than a half.
  const std::vector<float>& covered() const { return covered_; }
  const std::vector<float>& expected() const { return expected_; }
  /// Share covered by the forearm.
  const std::vector<float>& forearm() const { return forearm_; }
  struct Window {
    int u0, u1, v0, v1;  ///< half open
  };
  const Window& window() const { return window_; }  ///< cells touched by the last match

  static constexpr int kBlock =
      8;  ///< cells computed at a time: wider ones are taken apart where vectors are shorter
  /// Length of a row in memory: a block may begin at its last cell.
  static constexpr int stride(int width) { return (width / kBlock + 2) * kBlock; }

 private:
  void clear(const Window& window);

  int width_, height_, stride_;
  std::vector<float> covered_, expected_, depth_, forearm_;
  Window window_{0, 0, 0, 0};
};

}  // namespace mimesis::vision
