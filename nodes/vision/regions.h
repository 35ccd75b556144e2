#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/image/image.h"
#include "nodes/vision/colors.h"
#include "nodes/vision/light.h"

namespace mimesis::vision {

/// Pixels of one class beside each other in one row: columns [begin, end).
struct Run {
  int row, begin, end;
  Kind kind;
  int region;  ///< index into the regions of the same picture
};

/// Sums over pixels, exact: area, centroid and shape follow from them, and they add up over
/// regions.
struct Moments {
  double area = 0.0, u = 0.0, v = 0.0, uu = 0.0, uv = 0.0, vv = 0.0;
  int left = 1 << 30, top = 1 << 30, right = -1, bottom = -1;  ///< inclusive

  void add(const Run& run);
  void add(const Moments& other);
  double mean_u() const { return u / area; }
  double mean_v() const { return v / area; }
};

/// Direction and ratio of the axes of the ellipse with the same second moments.
struct Axes {
  double angle_rad;   ///< major axis, from +u towards +v, (-π/2, π/2]
  double elongation;  ///< major / minor, >= 1
};
Axes axes(const Moments& moments);

/// Connected pixels (8 neighbours) of one class.
struct Region {
  Kind kind = Kind::none;
  Moments moments;
};

/// Connected components of all classes in one pass over the label image: runs, joined row by row
/// with union-find. Storage is reused: no allocation once pictures of one kind have been seen.
class RegionFinder {
 public:
  /// @param labels class of every pixel, width · height, row by row
  void find(std::span<const std::uint8_t> labels, int width, int height);
  /// In order of their first pixel.
  std::span<const Region> regions() const { return regions_; }
  /// This region is of no class.
  void leave_out(std::size_t region) { regions_[region].kind = Kind::none; }
  std::span<const Run> runs() const { return runs_; }

 private:
  void scan_row(const std::uint8_t* labels, int row, int width);
  void join(std::size_t above_begin, std::size_t above_end);
  int root(int i);

  std::vector<Run> runs_;
  std::vector<int> parent_;  ///< parent of each run
  std::vector<Region> regions_;
};

/// From a picture to regions: the table that follows the light, labels, regions.
class Segmentation {
 public:
  /// @param open remove what is thinner than 3 pixels before regions are sought
  Segmentation(ColorTable table, LightMeter light, bool open)
      : table_(std::move(table)), light_(std::move(light)), open_(open) {}
  void segment(const image::Image& picture) { segment_any(picture); }
  void segment(const YuyvImage& picture) { segment_any(picture); }
  /// From now on other colours, and what tells their light.
  void learn(ColorTable table, LightMeter light) {
    table_ = std::move(table);
    light_ = std::move(light);
  }

  std::span<const Region> regions() const { return finder_.regions(); }
  void leave_out(std::size_t region) { finder_.leave_out(region); }
  std::span<const Run> runs() const { return finder_.runs(); }
  std::span<const std::uint8_t> labels() const { return labels_; }
  const Eigen::Vector3d& gain() const { return table_.gain(); }
  const LightMeter& light() const { return light_; }

 private:
  template <class Picture>
  void segment_any(const Picture& picture);

  ColorTable table_;
  LightMeter light_;
  RegionFinder finder_;
  bool open_;
  std::vector<std::uint8_t> labels_, rows_, opened_;
};

}  // namespace mimesis::vision
