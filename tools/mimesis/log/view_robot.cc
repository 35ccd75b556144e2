#include "tools/mimesis/log/view_robot.h"

#include <cmath>

#include "common/model/viewer.h"

namespace mimesis::tool {
namespace {

constexpr std::chrono::milliseconds kPeriod(40);
constexpr double kVisible = 0.01;  // change of the hand's closure that is drawn [1]

}  // namespace

bool RobotView::see(const v1::ArmState& state, const Draw& draw) {
  if (state.position_rad_size() != arm_.dof()) return false;
  const auto q = Eigen::VectorXd::Map(state.position_rad().data(), arm_.dof());
  if (!q.allFinite()) return false;
  const std::chrono::nanoseconds stamp(state.header().stamp_ns());
  if (due_ && stamp < *due_) return true;
  due_ = stamp + kPeriod;
  if (!closure_) {
    closure_ = 0.0;
    draw("view/robot", model::to_robot(arm_, *closure_, stamp), stamp);
  }
  kin::forward(arm_, q, X_);
  draw("view/robot_frames", model::to_robot_frames(arm_, X_, stamp), stamp);
  return true;
}

bool RobotView::see(const v1::HandState& state, const Draw& draw) {
  if (!std::isfinite(state.closure())) return false;
  if (closure_ && std::abs(state.closure() - *closure_) < kVisible) return true;
  closure_ = state.closure();
  const std::chrono::nanoseconds stamp(state.header().stamp_ns());
  draw("view/robot", model::to_robot(arm_, *closure_, stamp), stamp);
  return true;
}

}  // namespace mimesis::tool
