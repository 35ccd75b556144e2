#include "common/kin/ik.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "common/error.h"

namespace mimesis::kin {
namespace {

constexpr double kBaseDamping = 1e-6;  // w̄: keeps the system regular where e vanishes

/// Angle between two unit vectors, exact also near 0 and π.
double angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Rotation vector that turns `from` into `to` on the shortest way. Opposite vectors turn about any
/// normal.
Eigen::Vector3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d normal = from.cross(to);
  const double s = normal.norm();
  if (s > 1e-9) return normal / s * angle(from, to);
  return from.dot(to) > 0.0 ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                            : from.unitOrthogonal() * M_PI;
}

double uniform(
    std::mt19937_64& generator) {  // [0, 1); the standard's distributions differ by library
  return static_cast<double>(generator() >> 11) * 0x1p-53;
}

}  // namespace

std::optional<Eigen::VectorXd> solve_ik(const ArmModel& arm, const IkGoal& goal,
                                        const Eigen::Ref<const Eigen::VectorXd>& start,
                                        const IkOptions& options) {
  MIMESIS_ASSERT(start.size() == arm.dof());
  const Eigen::VectorXd lo = arm.q_min.array() + options.limit_margin;
  const Eigen::VectorXd hi = arm.q_max.array() - options.limit_margin;
  const auto rows = static_cast<Eigen::Index>(3 + 3 * goal.axes.size());
  Eigen::VectorXd q = start.cwiseMax(lo).cwiseMin(hi);
  Eigen::VectorXd e(rows);
  Eigen::MatrixXd J(rows, arm.dof());

  for (int iteration = 0; iteration <= options.max_iterations && !options.interrupt.now();
       ++iteration) {
    const Eigen::Isometry3d X_WE = end_effector(arm, q);
    const Eigen::Matrix<double, 6, Eigen::Dynamic> J_E = jacobian(arm, q);
    e.head<3>() = goal.position_in_W - X_WE.translation();
    J.topRows<3>() = J_E.topRows<3>();
    bool converged = e.head<3>().norm() < options.position_tolerance;
    for (std::size_t i = 0; i < goal.axes.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(3 + 3 * i);
      const Eigen::Vector3d axis = X_WE.linear() * goal.axes[i].axis_in_E;
      const Eigen::Vector3d turn = rotation_between(axis, goal.axes[i].direction_in_W);
      e.segment<3>(row) = turn;
      // A turn about the axis itself changes nothing that is asked for.
      J.middleRows<3>(row) =
          (Eigen::Matrix3d::Identity() - axis * axis.transpose()) * J_E.bottomRows<3>();
      converged = converged && turn.norm() < options.angle_tolerance;
    }
    if (converged) return q;

    Eigen::MatrixXd H = J.transpose() * J;
    H.diagonal().array() += 0.5 * e.squaredNorm() + kBaseDamping;
    q = (q + H.ldlt().solve(J.transpose() * e)).cwiseMax(lo).cwiseMin(hi);
  }
  return std::nullopt;
}

std::vector<Eigen::VectorXd> solve_ik_anywhere(const ArmModel& arm, const IkGoal& goal,
                                               int attempts, std::uint64_t seed,
                                               const IkOptions& options) {
  std::mt19937_64 generator(seed);
  std::vector<Eigen::VectorXd> solutions;
  Eigen::VectorXd start(arm.dof());
  for (int i = 0; i < attempts && !options.interrupt.told(); ++i) {
    for (Eigen::Index j = 0; j < start.size(); ++j) {
      start[j] = arm.q_min[j] + (arm.q_max[j] - arm.q_min[j]) * uniform(generator);
    }
    if (auto q = solve_ik(arm, goal, start, options)) solutions.push_back(std::move(*q));
  }
  return solutions;
}

}  // namespace mimesis::kin
