#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/image/image.h"
#include "nodes/vision/colors.h"

namespace mimesis::vision {

/// Median of each channel over every 7th pixel (every 14th of YUYV, in Y, U and V).
Eigen::Vector3d median_bgr(const image::Image& image);
Eigen::Vector3d median_bgr(const YuyvImage& image);

/// Colours of a picture: in cells of 8 levels of each channel, over the pixels of median_bgr.
class ColorCount {
 public:
  struct Cell {
    Eigen::Vector3d bgr;  ///< its middle
    double count = 0.0;   ///< pixels [1]
  };
  void count(const image::Image& image);
  void count(const YuyvImage& image);
  std::span<const Cell> cells() const { return cells_; }
  /// The median colour, if the pixels that have it, in light or in shade, are half of the picture
  /// or more: one thing fills it.
  std::optional<Eigen::Vector3d> filling_bgr() const;

 private:
  void add(const Eigen::Vector3d& bgr);
  void finish(const Eigen::Vector3d& median_bgr);

  std::vector<std::uint32_t> of_cell_ = std::vector<std::uint32_t>(32768);
  std::vector<std::uint16_t> met_;  ///< cells that are not empty, in order of their first pixel
  std::vector<Cell> cells_;
  Eigen::Vector3d median_ = Eigen::Vector3d::Zero();
};

/// Light relative to that for which colours hold, as the gain that turns a picture's colours into
/// them; `white`: logarithms of blue's and red's gain over green's, `bright`: of green's.
struct Light {
  Eigen::Vector2d white = Eigen::Vector2d::Zero();
  double bright = 0.0;

  static Light of(const Eigen::Vector3d& gain_bgr);
  Eigen::Vector3d gain_bgr() const;
  /// The nearest that is taken for light: the gains of blue and red are within a factor of 1.6 of
  /// green's, which is within [0.4, 2.5].
  Light bounded() const;
  bool is_light() const { return bounded().white == white && bounded().bright == bright; }
};

/// Gain by a table of this colour, if something fills the picture and may be it, see LightMeter.
std::optional<Eigen::Vector3d> gain_by_table(const image::Image& image,
                                             const Eigen::Vector3d& table_bgr);

/// Follows the light, by what is known of the picture.
///
/// Colours of boxes: a table of a stated colour fills every picture, so that the median is that
/// colour. Colours that were taught: each class that is seen tells blue and red against green by
/// its mean chromaticity, as does the table, if one filled the picture of the lesson and one fills
/// this picture. The light is the median of what they tell and of one voice for the light of the
/// lesson, so that no single thing changes it, which may be another of a taught colour. Brightness
/// is told by the table alone: things are brighter here than there, and known in either. The table
/// does not count where the classes contradict it, by more than 20 % in colour or a factor of 1.5
/// in brightness, unless two classes or more, and more than now, are seen in its light; else
/// something else fills the picture. With nothing taught in sight the light returns to that of the
/// lesson.
class LightMeter {
 public:
  /// @param table_bgr median colour of a picture in the light for which the boxes hold; zero: no
  /// correction
  explicit LightMeter(const Eigen::Vector3d& table_bgr) : table_(table_bgr) {}
  /// @param table_bgr colour of the table in the light for which the spots hold; zero: none filled
  ///   the picture of the lesson
  /// @param gain_bgr turns the colours of the lesson's picture into those of the spots
  LightMeter(const ColorSpots& taught, const Eigen::Vector3d& table_bgr,
             const Eigen::Vector3d& gain_bgr = Eigen::Vector3d::Ones());

  /// Gain per channel for this picture. The first one's light is taken at once, from then on a
  /// fifth of what is missing is made up per picture: light changes slowly, the hand passes.
  template <class Picture>
  const Eigen::Vector3d& update(const Picture& picture) {
    if (!taught_) return follow_table(median_bgr(picture));
    colors_.count(picture);
    return follow_taught();
  }
  /// What is to be said of this picture's light; mostly nothing.
  const std::string& remark() const { return remark_; }

 private:
  /// Of one class: pixels; their luma, summed, for a gain of 1 in green; Σ weight; Σ weight ·
  /// colour / its luma in the light that is assumed.
  struct Seen {
    double count = 0.0, luma = 0.0, weight = 0.0;
    Eigen::Vector3d over_luma = Eigen::Vector3d::Zero();
  };
  using Sights = std::array<Seen, kKinds>;

  const Eigen::Vector3d& follow_table(const Eigen::Vector3d& median_bgr);
  const Eigen::Vector3d& follow_taught();
  void approach(const Eigen::Vector3d& gain_bgr);
  Sights look(const Eigen::Vector3d& gain_bgr) const;
  static int classes(const Sights& sights);
  Light consensus(const Sights& sights, const std::optional<Light>& table) const;
  /// Median of the classes' brightness. Precondition: one is seen.
  double brightness(const Sights& sights) const;
  /// The classes that are seen do not speak against what fills the picture being the table.
  bool may_be(const Light& table, const Sights& sights) const;
  void say(const Light& light, bool other_table);

  Eigen::Vector3d table_;
  std::optional<ColorSpots> taught_;
  Light lesson_;
  ColorCount colors_;
  Eigen::Vector3d gain_ = Eigen::Vector3d::Ones();
  bool started_ = false, jumps_ = false, other_table_ = false;
  std::string remark_;
};

}  // namespace mimesis::vision
