#pragma once
#include <Eigen/Geometry>
#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
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

/// A solid that a link is made of, in the link's frame L.
struct Solid {
  enum class Kind { box, ball, cylinder, mesh } kind = Kind::box;
  Eigen::Isometry3d X_LS = Eigen::Isometry3d::Identity();  ///< its middle, or the mesh's frame
  /// Half edges of a box; radius of a ball, in x; radius in x and half length, along z, in z of a
  /// cylinder [m]
  Eigen::Vector3d half_m = Eigen::Vector3d::Zero();
  std::shared_ptr<const TriangleMesh> mesh{};  ///< in S
};

/// Distance of p from the union of solids; below 0 inside, where p may be deeper than it says in
/// more than one of them. An open mesh is inside where its triangles go round p by more than half.
double signed_distance(std::span<const Solid> solids, const Eigen::Vector3d& p_L);

Eigen::AlignedBox3d box_of(std::span<const Solid> solids);  ///< in L

/// What a URDF says of the shape of a link.
struct LinkParts {
  bool collision = false, visual = false;  ///< it has such elements
};

/// Of all links of a URDF; reads no mesh. @throws ConfigError as below
std::map<std::string, LinkParts> link_parts(const std::string& urdf_file);

/// How names of meshes begin, and what stands there instead: of files that were made elsewhere.
using MeshPaths = std::vector<std::pair<std::string, std::string>>;

/// A mesh that a file beside `beside` names. Meshes may be STL, OBJ, Collada and whatever else
/// assimp reads; a Collada file's up axis is ignored, as in ROS, its unit is not.
/// "package://NAME/PATH" is PATH in the folder NAME that holds the file or lies in a folder around
/// it, or in one of $ROS_PACKAGE_PATH; other names count from the file's folder.
/// @throws ConfigError in one line, without the name of the file
std::shared_ptr<const TriangleMesh> load_mesh(const std::string& beside, const std::string& name,
                                              const Eigen::Vector3d& scale,
                                              const MeshPaths* paths = nullptr);

/// Solids of the `<collision>` elements of these links of a URDF; links without any are left out.
/// @param use_visual  links without `<collision>` have the solids of their `<visual>`
/// @throws ConfigError "FILE: link 'L': what, expected ..." in one line
std::map<std::string, std::vector<Solid>> link_solids(const std::string& urdf_file,
                                                      const std::vector<std::string>& links,
                                                      bool use_visual = false,
                                                      const MeshPaths& paths = {});

}  // namespace mimesis::robot
