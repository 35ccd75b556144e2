#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/image/image.h"
#include "nodes/vision/hand/hand_raster.h"

namespace mimesis::vision {

/// Density of colours on the hand and elsewhere, learned from pictures in which the hand was fitted
/// and then changed slowly. A density that is estimated anew from each candidate's own labels
/// rewards the explanation of any coloured region: such a tracker slides away within ten pictures.
/// Colours are chromaticities (shares of red and blue), which shading does not change; a cell for
/// what is too dark to have one.
class SkinDensity {
 public:
  /// @param width, height of the pictures [px]
  SkinDensity(int width, int height);

  int factor() const { return factor_; }  ///< pixels along the edge of a cell
  int raster_width() const { return width_ / factor_; }
  int raster_height() const { return height_ / factor_; }

  /// Reads a picture: luma, and the class of colour of each quarter of a cell.
  void read(const image::Image& image, Evidence& out);
  /// First densities: the hand has the colours of human skin that are seen within `radius` cells of
  /// (u, v); all that is farther away is background.
  void begin(float u, float v, float radius);
  /// Learns from a fitted hand: its inner cells, and those well away from it and the forearm.
  void learn(const HandRaster& fitted, double rate);
  /// Writes log p(c | hand) − log p(c | background) of every cell of the picture read last.
  void judge(Evidence& out) const;

 private:
  static constexpr int kShares = 64;  ///< cells of a share, 0..1
  static constexpr std::size_t kColors = kShares * kShares + 1;
  using Histogram = std::array<float, kColors>;
  static void normalize(Histogram& h);
  void refresh();

  int width_, height_, factor_;
  std::vector<std::uint16_t> colors_;  ///< 4 of each cell
  std::vector<std::uint8_t> near_, grown_;
  std::vector<float> share_of_;  ///< 1 / sum
  Histogram hand_{}, elsewhere_{}, fresh_{}, ratio_{};
};

}  // namespace mimesis::vision
