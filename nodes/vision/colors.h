#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "common/image/image.h"
#include "nodes/vision/label_kernels.h"

namespace mimesis::vision {

/// Class of a pixel and of a blob; the numbers are those of v1.BlobKind.
enum class Kind : std::uint8_t { none, hand, object, bar, goal_high, goal_low };
inline constexpr std::size_t kKinds = 6;
std::string_view name(Kind kind);

/// Colour in YUV, full range, chroma around 128 (ITU-R BT.601):
/// Y = 0.299 R + 0.587 G + 0.114 B, U = 128 + 0.492 (B - Y), V = 128 + 0.877 (R - Y).
struct Yuv {
  double y, u, v;
};
Yuv to_yuv(double blue, double green, double red);
inline Yuv to_yuv(const Eigen::Vector3d& bgr) { return to_yuv(bgr[0], bgr[1], bgr[2]); }

/// Box in YUV: what belongs to one class. Luma is bounded only against black and glare.
struct ColorBox {
  /// Bounds of the class, 0 to 255; a pixel belongs to it if U, V and Y are within all of them.
  double u_min = 0.0, u_max = 0.0, v_min = 0.0, v_max = 0.0, y_min = 25.0, y_max = 255.0;

  bool contains(const Yuv& c) const {
    return c.u >= u_min && c.u <= u_max && c.v >= v_min && c.v <= v_max && c.y >= y_min &&
           c.y <= y_max;
  }
};

/// The boxes of all classes; where two overlap, the first wins. Defaults: the rendered table; the
/// hand's box also holds real skin in ordinary light.
struct ColorBoxes {
  ColorBox hand{84.0, 117.0, 148.0, 200.0};
  ColorBox object{70.0, 122.0, 40.0, 113.0};
  ColorBox bar{150.0, 235.0, 50.0, 112.0};
  ColorBox goal_high{0.0, 100.0, 118.0, 160.0};
  ColorBox goal_low{145.0, 215.0, 135.0, 200.0};

  const ColorBox& of(Kind kind) const;
};

/// A picture as a camera gives it: Y0 U Y1 V for two pixels (BT.601, luma 16..235).
struct YuyvImage {
  int width = 0, height = 0;        ///< [px], width even
  std::vector<std::uint8_t> bytes;  ///< 2 · width · height
};

/// Blue, green and red, 0..255 and not rounded, of such a pixel.
Eigen::Vector3d bgr_of_yuyv(double y, double u, double v);
/// The same of a pixel of a picture.
Eigen::Vector3d bgr_at(const image::Image& image, int u, int v);
Eigen::Vector3d bgr_at(const YuyvImage& image, int u, int v);

/// Colour of a class as it was taught: the ellipse that its pixels fill in U and V, and its luma. A
/// face in shade has chroma and luma less in the same proportion.
struct ColorSpot {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();            ///< U, V
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();  ///< of U and V
  double y = 0.0;                                            ///< luma; 0: the chroma is of any luma
  double y_min = 25.0, y_max = 255.0;

  /// Squared distance in standard deviations from the chroma that the class has at this luma; a
  /// sixth of the chroma, too, is one. Infinite out of the luma's bounds and for less than half of
  /// the chroma: pixels that show less than half of a thing.
  double distance2(const Yuv& c) const;
};

/// A channel that shows this much is at its end; of what was taught up to `kBehindEnd` times as
/// much may be behind it.
inline constexpr double kChannelEnd = 248.0, kBehindEnd = 1.15;

/// What was taught; a class without a spot is not sought.
struct ColorSpots {
  static constexpr double kReach = 3.0;  ///< standard deviations that belong to a class
  std::array<std::optional<ColorSpot>, kKinds> of;

  /// The class whose spot is nearest in its standard deviations, within kReach.
  Kind nearest(const Yuv& color) const;
};

/// Segmentation by one table look-up per pixel: the 5 leading bits of blue, green and red select a
/// cell that holds the class of the cell's middle, corrected for the light. One table of 32 KiB
/// instead of a colour conversion and five comparisons per pixel (the idea of Bruce, Balch &
/// Veloso, IROS 2000).
class ColorTable {
 public:
  explicit ColorTable(const ColorBoxes& boxes);
  explicit ColorTable(const ColorSpots& spots);

  /// Refills the table for light under which a colour c of the boxes appears as c / gain (per
  /// channel).
  void set_gain(const Eigen::Vector3d& gain_bgr);
  const Eigen::Vector3d& gain() const { return gain_; }

  Kind label(std::uint8_t blue, std::uint8_t green, std::uint8_t red) const {
    return static_cast<Kind>(cells_[cell(blue, green, red)]);
  }
  /// Class of every pixel, row by row. Allocates only if `labels` must grow.
  void apply(const image::Image& image, std::vector<std::uint8_t>& labels) const;
  /// The same without a conversion: the cells have 16 steps of luma and 64 of each chroma. The
  /// first call after a change of gain fills them.
  void apply(const YuyvImage& image, std::vector<std::uint8_t>& labels);

 private:
  static std::size_t cell(unsigned blue, unsigned green, unsigned red) {
    return (blue >> 3) | (green >> 3) << 5 | (red >> 3) << 10;
  }
  ColorBoxes boxes_;
  std::optional<ColorSpots> spots_;  ///< instead of the boxes
  Eigen::Vector3d gain_ = Eigen::Vector3d::Ones();
  Kind nearest(const Yuv& color) const;
  Kind classify(const Eigen::Vector3d& bgr) const;

  static constexpr std::size_t kCells = 32768, kYuyvCells = 65536;
  std::vector<std::uint8_t> cells_ = std::vector<std::uint8_t>(kCells);
  std::optional<YuyvCells> yuyv_cells_;  ///< none: to be filled
};

}  // namespace mimesis::vision
