#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "common/interrupt.h"
#include "common/kin/arm.h"

namespace mimesis::kin {

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
