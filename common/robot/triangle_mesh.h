#pragma once
#include <Eigen/Geometry>
#include <array>
#include <vector>

namespace mimesis::robot {

/// Triangles that bound a body, or several: closed or not, in any orientation that is the same all
/// over. Questions cost O(log n): a tree of boxes, the triangles in its leaves.
class TriangleMesh {
 public:
  using Triangle = std::array<Eigen::Vector3d, 3>;
  /// @throws ConfigError if there is no triangle, or a coordinate is not finite.
  explicit TriangleMesh(std::vector<Triangle> triangles);

  const std::vector<Triangle>& triangles() const { return triangles_; }
  const Eigen::AlignedBox3d& box() const { return nodes_.front().box; }
  double distance(const Eigen::Vector3d& p) const;  ///< to the nearest triangle [m]
  /// How often the triangles go round p: 1 or −1 inside a closed mesh, 0 outside; between them near
  /// the holes of others, where |w| > ½ counts as inside (Jacobson et al., SIGGRAPH 2013). Far
  /// parts of the mesh count as one dipole (Barill et al., SIGGRAPH 2018).
  double winding(const Eigen::Vector3d& p) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    std::size_t begin = 0, end = 0;  // triangles
    std::size_t right = 0;           // child; the left one is the next node; 0: a leaf
    Eigen::Vector3d middle = Eigen::Vector3d::Zero(),
                    area = Eigen::Vector3d::Zero();  // Σ area · normal
    double reach = 0.0;                              // largest distance of a vertex from the middle
  };
  std::size_t build(std::size_t begin, std::size_t end);

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace mimesis::robot
