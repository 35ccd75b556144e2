#pragma once
#include <Eigen/Geometry>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mimesis::robot {

/// How a link moves against its parent.
enum class JointType { fixed, revolute, prismatic };

/// Mass distribution of a link. A link without mass (a frame) has zeros.
struct Inertia {
  double mass_kg = 0.0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();            ///< in the link's frame
  Eigen::Matrix3d about_com_kg_m2 = Eigen::Matrix3d::Zero();  ///< axes of the link's frame
};

/// A link L and the joint that carries it.
struct Link {
  std::string name;
  std::string joint;  ///< name of the joint; empty for the root
  int parent = -1;    ///< index, below this link's own; -1 for the root
  JointType type = JointType::fixed;
  Eigen::Isometry3d X_PJ = Eigen::Isometry3d::Identity();  ///< in the parent link's frame at q = 0
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();         ///< unit vector, in J
  double lower = 0.0, upper = 0.0;  ///< [rad] or [m]; ±infinity for a joint without limits
  double max_speed = 0.0;           ///< [rad/s] or [m/s]
  double max_effort = 0.0;          ///< [N m] or [N]
  /// Joint that this one follows by a gear (URDF "mimic"); it has a position of its own all the
  /// same. Empty: none.
  std::string mimics;
  double mimic_factor = 1.0, mimic_offset = 0.0;  ///< q = factor · (that joint's) + offset
  Inertia inertia;
  int dof = -1;  ///< index into q; -1 if the joint is fixed (set by RobotTree)

  /// X_PL(q): X_PJ, then a rotation or shift by q along `axis`.
  Eigen::Isometry3d at(double q) const;
};

/// A robot as links, parents first, on a base that floats: its root link's pose X_WB comes beside
/// the joint positions q.
class RobotTree {
 public:
  /// @throws ConfigError if a parent does not come before its link, an axis has no length, or names
  ///         occur twice.
  RobotTree(std::string name, std::vector<Link> links);
  /// What moves by forces needs more than its places.
  /// @throws ConfigError if limits of a joint are empty or not numbers, a mass is negative or its
  ///         inertia is none of a body.
  void require_dynamics() const;

  const std::string& name() const { return name_; }
  const std::vector<Link>& links() const { return links_; }
  const Link& link(int index) const { return links_[static_cast<std::size_t>(index)]; }
  int dof() const { return static_cast<int>(moved_.size()); }  ///< joints that move
  /// The link that joint number `dof` carries, and its index.
  const Link& moved(int dof) const { return link(moved_link(dof)); }
  int moved_link(int dof) const { return moved_[static_cast<std::size_t>(dof)]; }
  double mass_kg() const;
  std::vector<std::string> joint_names() const;  ///< in the order of q
  Eigen::VectorXd lower() const, upper() const;  ///< dof, [rad] or [m]
  Eigen::VectorXd max_speed() const;             ///< dof, [rad/s] or [m/s]

  int find_link(std::string_view name) const;   ///< index, or -1
  int find_joint(std::string_view name) const;  ///< index into q, or -1
  /// @throws ConfigError that names the robot and the missing part
  int require_link(std::string_view name) const;
  int require_joint(std::string_view name) const;
  /// True if link `ancestor` is `link` or carries it.
  bool carries(int ancestor, int link) const;

 private:
  std::string name_;
  std::vector<Link> links_;
  std::vector<int> moved_;  ///< link of every dof
};

/// Where some joints are, by their names [rad] or [m].
using JointPlaces = std::vector<std::pair<std::string, double>>;

/// The robot with the joints of `fixed` held where it says, and with those that follow others by a
/// gear held, too: where these are in `posture`, else at 0 or the limit nearest to it.
/// @throws ConfigError that names a joint: unknown, held beyond its limits, or following itself
RobotTree held(const RobotTree& tree, const JointPlaces& fixed, const JointPlaces& posture = {});

/// The robot whose fixed links weigh nothing: the links that carry them have their masses. A fixed
/// link may be a point: it needs no moment of inertia of its own.
/// @throws ConfigError that names a fixed link whose mass is none
RobotTree merged(const RobotTree& tree);

/// The robot with inertias that no body has made those of bodies: where a principal moment exceeds
/// the sum of the other two these are raised, as if the link were so much thicker. Moments that are
/// not above 0 stay. @param changed  names of the links that it changed are added
RobotTree balanced(const RobotTree& tree, std::vector<std::string>* changed = nullptr);

/// Reads a URDF file: revolute, continuous, prismatic and fixed joints. Links come in the order of
/// a walk from the root that goes down first, siblings by name of joint.
/// @throws ConfigError "FILE: ELEMENT: what, expected ..." in one line
RobotTree read_urdf(const std::string& file);

}  // namespace mimesis::robot
