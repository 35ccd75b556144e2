#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/interrupt.h"
#include "common/math/convex_part.h"

namespace mimesis::kin {

/// One link of a serial arm in Denavit-Hartenberg form. Standard: T = Rz(q + offset) Tz(d) Tx(a)
/// Rx(alpha). Modified: T = Rx(alpha) Tx(a) Rz(q + offset) Tz(d).
struct DhLink {
  double a = 0.0;       ///< [m]
  double alpha = 0.0;   ///< [rad]
  double d = 0.0;       ///< [m]
  double offset = 0.0;  ///< [rad]
  bool modified = false;
  bool slides = false;   ///< prismatic: T has Rz(offset) and Tz(d + q), q [m]
  bool endless = false;  ///< continuous: q and q + 2π are one place

  /// The parts of T before and after what q moves: Rz(q + offset), or Tz(q).
  Eigen::Isometry3d before_joint() const;
  Eigen::Isometry3d after_joint() const;
};

/// Safety ball [M18 2.3.2], fixed in frame `frame` (0 = base, i = after joint i).
struct SafetyBall {
  int frame = 0;
  int group = 0;           ///< index into ArmModel::groups
  Eigen::Vector3d center;  ///< in that frame [m]
  double radius = 0.0;     ///< [m]
  bool of_part = false;    ///< it covers some of a part: what it touches, the part may not
};

/// Convex part of a link, fixed in frame `frame` as a ball is.
struct SafetyPart {
  int frame = 0;
  int group = 0;
  math::ConvexPart shape;                 ///< in that frame
  std::vector<math::RoundBound> cover{};  ///< balls that hold it, its own or those of its slices
};

/// The parts of a link, ArmModel::parts[begin .. end), and a hull around them.
struct SafetyLink {
  std::size_t begin = 0, end = 0;
  math::ConvexPart hull{};
};

/// Serial arm with n joints; of those that slide, m takes the place of rad. Read from models/*.yaml
/// by common/model.
struct ArmModel {
  std::string name;
  std::vector<DhLink> links;                               ///< n
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();  ///< base in the world
  Eigen::Isometry3d X_LE = Eigen::Isometry3d::Identity();  ///< end effector (grasp centre, z =
                                                           ///< approach) in the last link
  Eigen::VectorXd q_min, q_max;                            ///< n [rad]; of endless joints ∓2π
  Eigen::VectorXd v_max;                                   ///< n [rad/s]
  Eigen::VectorXd a_max;                                   ///< n [rad/s²]
  Eigen::VectorXd j_max;                                   ///< n [rad/s³]; empty: no limit
  std::string drives = "cia402";                           ///< kind of its actuators: hw/bridge
  double rate_hz = 200.0;                                  ///< rate of commands to the joints
  int extrapolated_cycles = 0;  ///< without a command the drives go on at their rate for so long
  Eigen::VectorXd home;         ///< n [rad]
  std::vector<std::string> groups;  ///< names: base, upper, fore, hand
  std::vector<SafetyBall> balls;
  /// Where balls of parts touch, these decide; the balls cover all of them.
  std::vector<SafetyPart> parts;
  std::vector<SafetyLink> part_links;           ///< of all parts
  std::vector<std::pair<int, int>> self_pairs;  ///< groups checked against each other
  std::vector<int> env_groups;                  ///< groups checked against obstacles
  std::vector<std::string> unchecked;  ///< links of no known shape: nothing is proven of them

  int dof() const { return static_cast<int>(links.size()); }
};

/// Poses of all frames in W: X[0] base, X[i] after joint i, size n + 1. Does not allocate if `X` is
/// sized.
void forward(const ArmModel& arm, const Eigen::Ref<const Eigen::VectorXd>& q,
             std::vector<Eigen::Isometry3d>& X);

/// Pose of the end effector in W.
Eigen::Isometry3d end_effector(const ArmModel& arm, const Eigen::Ref<const Eigen::VectorXd>& q);

/// What decides: parts, and balls that are not of a part as parts of one point.
std::vector<SafetyPart> deciding_parts(const ArmModel& arm);

/// Geometric Jacobian of E in W, 6 × n: rows 0-2 linear [m/rad], 3-5 angular [rad/rad].
Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(const ArmModel& arm,
                                                  const Eigen::Ref<const Eigen::VectorXd>& q);

/// Centres of all safety balls in W for the frames of `forward`; `centers` is 3 × balls. Does not
/// allocate if sized.
void ball_centers(const ArmModel& arm, const std::vector<Eigen::Isometry3d>& X,
                  Eigen::Matrix3Xd& centers);

/// Axis of a joint at q = 0: a point on it and its direction, a unit vector.
struct JointAxis {
  Eigen::Vector3d point, direction;
  bool slides = false;  ///< along it, instead of turning about it
};

/// Any chain of joints in standard Denavit-Hartenberg form: frame i lies on axis i + 1, its
/// x axis along the common normal of axes i and i + 1.
struct DhRows {
  std::vector<DhLink> links;
  std::vector<Eigen::Isometry3d> frames;  ///< 0 .. n at q = 0, in the frame of the axes
};
DhRows dh_rows(std::span<const JointAxis> axes);

/// One direction: the unit vector `axis_in_E`, fixed in the end effector, shall point along the
/// unit vector `direction_in_W`. The turn about it stays free.
struct AxisGoal {
  Eigen::Vector3d axis_in_E = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d direction_in_W = -Eigen::Vector3d::UnitZ();
};

/// Where the end effector shall be. Without axes only its position counts; two axes fix its
/// orientation.
struct IkGoal {
  Eigen::Vector3d position_in_W = Eigen::Vector3d::Zero();  ///< wished position of E [m]
  std::vector<AxisGoal> axes;
};

struct IkOptions {
  int max_iterations = 100;
  double position_tolerance = 1e-5;  ///< [m]
  double angle_tolerance = 1e-4;     ///< largest error of each axis [rad]
  double limit_margin = 0.01;        ///< solutions stay this far inside the joint limits [rad]
  Interrupt interrupt{};             ///< asked in each iteration; ends without a solution
};

/// Solves for `goal` from posture `start` (n, [rad]), within the joint limits. Levenberg-Marquardt
/// with the damping of Sugihara (IEEE T-RO 27(5), 2011, eq. 20): Δq = (JᵀJ + (½eᵀe + w̄)I)⁻¹ Jᵀe, e
/// in m and rad, which needs no line search and no special case near singularities. Empty if it
/// does not converge: unreachable, or a bad start.
std::optional<Eigen::VectorXd> solve_ik(const ArmModel& arm, const IkGoal& goal,
                                        const Eigen::Ref<const Eigen::VectorXd>& start,
                                        const IkOptions& options = {});

/// Solutions from `attempts` starts spread evenly (by the generator seeded with `seed`) over the
/// joint limits, in the order of the starts; equal results on every machine. Near-equal solutions
/// are kept.
std::vector<Eigen::VectorXd> solve_ik_anywhere(const ArmModel& arm, const IkGoal& goal,
                                               int attempts, std::uint64_t seed,
                                               const IkOptions& options = {});

}  // namespace mimesis::kin
