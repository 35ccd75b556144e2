#pragma once
#include <Eigen/Core>
#include <vector>

namespace mimesis::crowd {

/// The plane cut into rectangles along x and y of W, each the region of one coordinator. Region
/// r = column + columns · row, columns towards +x, rows towards +y; the outer ones have no end.
class RegionMap {
 public:
  /// @param cuts_x_m, cuts_y_m  where the plane is cut, ascending; none: one region
  /// @throws ConfigError for cuts that are not ascending or not finite
  RegionMap(std::vector<double> cuts_x_m, std::vector<double> cuts_y_m);

  int count() const;
  /// Region that holds p; a point on a cut belongs to the upper side.
  int of(const Eigen::Vector2d& p_W_m) const;
  /// How far p is outside of a region; 0 inside.
  double outside_m(int region, const Eigen::Vector2d& p_W_m) const;
  /// Region that should move an agent at p that `region` moves: it keeps the agent up to `margin_m`
  /// beyond its border, so that who walks along a cut is not handed to and fro.
  int owner(int region, const Eigen::Vector2d& p_W_m, double margin_m) const;
  /// Who looks after a region: its own coordinator; if that is gone, that of the nearest region
  /// (in columns and rows) that is there, of several the first. Precondition: one is there.
  int heir(int region, const std::vector<bool>& there) const;

 private:
  std::vector<double> cuts_x_, cuts_y_;
};

}  // namespace mimesis::crowd
