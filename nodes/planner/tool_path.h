#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "nodes/planner/collision.h"

namespace mimesis::planner {

/// A piece of the way of the end effector E, from where the piece before ends, in W [m].
struct ToolPiece {
  std::optional<Eigen::Vector3d> via{};  ///< on a circle through this point; none: straight
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
};

/// How far E may leave its way.
struct ToolTolerance {
  double position_m = 1e-3;
  double angle_rad = 5e-3;  ///< of its orientation, which is that at the begin
};

/// A way of E with the orientation that it has at its begin.
class ToolPath {
 public:
  /// Fails if a piece has no length, or three points are no circle: says which.
  static tl::expected<ToolPath, Status> make(const Eigen::Isometry3d& X_WE,
                                             const std::vector<ToolPiece>& pieces);

  double length_m() const { return pieces_.empty() ? 0.0 : pieces_.back().end_m; }
  Eigen::Vector3d at(double s_m) const;               ///< 0 .. length
  double distance(const Eigen::Vector3d& p_W) const;  ///< to the nearest point of the way [m]
  double angle(const Eigen::Matrix3d& R_WE) const;    ///< from its orientation [rad]
  const Eigen::Matrix3d& orientation() const { return R_; }  ///< R_WE

 private:
  struct Piece {
    double begin_m = 0.0, end_m = 0.0;
    Eigen::Vector3d from = Eigen::Vector3d::Zero();
    Eigen::Vector3d along = from;  // a unit vector; of an arc: from its centre to its begin
    // Of an arc:
    Eigen::Vector3d center = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    double radius_m = 0.0;  // 0: a line
  };
  static Eigen::Vector3d point(const Piece& piece, double s_m);

  Eigen::Matrix3d R_ = Eigen::Matrix3d::Identity();
  std::vector<Piece> pieces_;
};

/// Whether E stays within the tolerance along a whole Bézier curve of the joints (control points in
/// columns): of parts that are halved until that is proven or seen not to be, E moves at most
///   D ← D + (ρⱼ + D) δⱼ, from the last joint to the first,
/// ρⱼ its distance from axis j, δⱼ half the width of the part.
bool keeps_to(const kin::ArmModel& arm, const ToolPath& path, const ToolTolerance& tolerance,
              const Eigen::MatrixXd& control_points);

/// Postures from `start` on, between which the joints move straight: E keeps to 0.7 of the
/// tolerance, and `checker` certifies each line. Inverse kinematics from one to the next, in steps
/// as long as that allows. Failure: after how many millimetres, and why.
tl::expected<std::vector<Eigen::VectorXd>, Status> tool_way(const kin::ArmModel& arm,
                                                            const ToolPath& path,
                                                            const ToolTolerance& tolerance,
                                                            const Eigen::VectorXd& start,
                                                            CollisionChecker& checker);

}  // namespace mimesis::planner
