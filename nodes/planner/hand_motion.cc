#include "nodes/planner/hand_motion.h"

#include <algorithm>
#include <cmath>

namespace mimesis::planner {
namespace {

/// A step to the next posture that is longer than this is a jump to another branch of solutions
/// [rad].
constexpr double kJump = 0.35;

}  // namespace

std::optional<std::vector<Eigen::VectorXd>> straight_way(const kin::ArmModel& arm,
                                                         const Eigen::VectorXd& start,
                                                         const kin::IkGoal& goal, double step_m) {
  const Eigen::Vector3d from = kin::end_effector(arm, start).translation();
  const Eigen::Vector3d whole = goal.position_in_W - from;
  const int steps = std::max(1, static_cast<int>(std::ceil(whole.norm() / step_m)));
  std::vector<Eigen::VectorXd> way{start};
  for (int i = 1; i <= steps; ++i) {
    const auto q = kin::solve_ik(arm, {from + whole * i / steps, goal.axes}, way.back());
    if (!q || (*q - way.back()).cwiseAbs().maxCoeff() > kJump) return std::nullopt;
    way.push_back(*q);
  }
  return way;
}

std::vector<Eigen::VectorXd> reaching_postures(const kin::ArmModel& arm,
                                               const Eigen::VectorXd& start,
                                               const kin::IkGoal& goal, int count) {
  const Eigen::Vector3d from = kin::end_effector(arm, start).translation();
  const Eigen::Vector3d whole = goal.position_in_W - from;
  std::vector<Eigen::VectorXd> way;
  for (int i = 1; i <= count; ++i) {
    const kin::IkGoal part{from + whole * i / count,
                           i == count ? goal.axes : decltype(goal.axes){}};
    const auto q = kin::solve_ik(arm, part, way.empty() ? start : way.back());
    if (!q) break;
    way.push_back(*q);
  }
  return way;
}

}  // namespace mimesis::planner
