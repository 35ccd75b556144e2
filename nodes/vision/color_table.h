#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/image/image.h"

namespace mimesis::vision {

/// Class of a pixel and of a blob; the numbers are those of v1.BlobKind.
enum class Kind : std::uint8_t { none, hand, object, bridge, goal_high, goal_low };
inline constexpr std::size_t kKinds = 6;
std::string_view name(Kind kind);

/// Colour in YUV, full range, chroma around 128 (ITU-R BT.601):
/// Y = 0.299 R + 0.587 G + 0.114 B, U = 128 + 0.492 (B - Y), V = 128 + 0.877 (R - Y).
struct Yuv {
  double y, u, v;
};
Yuv to_yuv(double blue, double green, double red);

/// Box in YUV: what belongs to one class. Luma is bounded only against black and glare.
struct ColorBox {
  double u_min = 0.0, u_max = 0.0, v_min = 0.0, v_max = 0.0, y_min = 25.0, y_max = 255.0;

  bool contains(const Yuv& c) const {
    return c.u >= u_min && c.u <= u_max && c.v >= v_min && c.v <= v_max && c.y >= y_min &&
           c.y <= y_max;
  }
  template <class Visitor>
  void visit(Visitor& g) {
    g("u_min", u_min, 0.0, 255.0);
    g("u_max", u_max, 0.0, 255.0);
    g("v_min", v_min, 0.0, 255.0);
    g("v_max", v_max, 0.0, 255.0);
    g("y_min", y_min, 0.0, 255.0);
    g("y_max", y_max, 0.0, 255.0);
  }
};

/// The boxes of all classes; where two overlap, the first wins. Defaults: the rendered table; the
/// hand's box also holds real skin in ordinary light.
struct ColorBoxes {
  ColorBox hand{84.0, 117.0, 148.0, 200.0};
  ColorBox object{70.0, 122.0, 40.0, 113.0};
  ColorBox bridge{150.0, 235.0, 50.0, 112.0};
  ColorBox goal_high{0.0, 100.0, 118.0, 160.0};
  ColorBox goal_low{145.0, 215.0, 135.0, 200.0};

  const ColorBox& of(Kind kind) const;
};

/// Segmentation by one table look-up per pixel: the 5 leading bits of blue, green and red select a
/// cell that holds the class of the cell's middle, corrected for the light. One table of 32 KiB
/// instead of a colour conversion and five comparisons per pixel (the idea of Bruce, Balch &
/// Veloso, IROS 2000).
class ColorTable {
 public:
  explicit ColorTable(const ColorBoxes& boxes);

  /// Fills the table anew for light under which a colour c of the boxes appears as c / gain (per
  /// channel).
  void set_gain(const Eigen::Vector3d& gain_bgr);
  const Eigen::Vector3d& gain() const { return gain_; }

  Kind label(std::uint8_t blue, std::uint8_t green, std::uint8_t red) const {
    return static_cast<Kind>(cells_[cell(blue, green, red)]);
  }
  /// Class of every pixel, row by row. Allocates only if `labels` must grow.
  void apply(const image::Image& image, std::vector<std::uint8_t>& labels) const;

 private:
  static std::size_t cell(unsigned blue, unsigned green, unsigned red) {
    return (blue >> 3) | (green >> 3) << 5 | (red >> 3) << 10;
  }
  ColorBoxes boxes_;
  Eigen::Vector3d gain_ = Eigen::Vector3d::Ones();
  std::array<std::uint8_t, 32768> cells_{};
};

/// Follows the light: the picture's median colour is mostly table, which keeps its true colour.
class LightMeter {
 public:
  /// @param reference_bgr median colour of a frame under the light for which the boxes hold; zero:
  /// no correction
  explicit LightMeter(const Eigen::Vector3d& reference_bgr) : reference_(reference_bgr) {}

  /// Gain per channel that turns the picture's colours into those of the reference light, smoothed
  /// over time, within [0.4, 2.5].
  const Eigen::Vector3d& update(const image::Image& image);

 private:
  Eigen::Vector3d reference_;
  Eigen::Vector3d gain_ = Eigen::Vector3d::Ones();
  bool started_ = false;
};

/// Median of each channel over every 7th pixel.
Eigen::Vector3d median_bgr(const image::Image& image);

}  // namespace mimesis::vision
