#include "nodes/synthesizer/motion_messages_node.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "common/math/circle.h"
#include "common/motion/model/limits.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kFar_m = 1e4;           // from the origin: beyond it floats of batches get coarse
constexpr double kFastest_rad_s = 50.0;  // of any rhythm
constexpr double kLongestStep_m = 5.0;
constexpr double kLongestChange_s = 600.0;

std::string unknown_character(std::uint32_t character, const Walkers& walkers) {
  if (character < static_cast<std::uint32_t>(walkers.size())) return {};
  return fmt::format("character {}: there are {}, from 0", character, walkers.size());
}

/// Numbers on the wire are finite: ports see to it. They may be absurd.
bool within(double value, double low, double high) { return value >= low && value <= high; }

}  // namespace

std::string fault(const v1::MotionGoal& goal, const Walkers& walkers) {
  if (auto why = unknown_character(goal.character(), walkers); !why.empty()) return why;
  if (goal.kind() == v1::MOTION_GOAL_KIND_STOP) return {};
  if (!v1::MotionGoalKind_IsValid(goal.kind()) || goal.kind() == v1::MOTION_GOAL_KIND_UNSPECIFIED) {
    return fmt::format("kind {} is none of WALK_TO, DRAWER, STOP", static_cast<int>(goal.kind()));
  }
  const double x = goal.position_in_world_m().x_m(), y = goal.position_in_world_m().y_m();
  if (!within(x, -kFar_m, kFar_m) || !within(y, -kFar_m, kFar_m)) {
    return fmt::format("goal at ({:g}, {:g}) m is farther than {:g} m", x, y, kFar_m);
  }
  if (!walkers.moves()) {
    return fmt::format("model '{}' gets nowhere: its steps have no length",
                       walkers.repertoire().model().name);
  }
  if (goal.kind() == v1::MOTION_GOAL_KIND_DRAWER && !within(goal.object_depth_m(), 0.0, 1.0)) {
    return fmt::format("object {:g} m behind the front, expected 0 .. 1", goal.object_depth_m());
  }
  return {};
}

std::string fault(const v1::StyleWish& wish, const Walkers& walkers) {
  for (const std::uint32_t character : wish.characters()) {
    if (auto why = unknown_character(character, walkers); !why.empty()) return why;
  }
  if (wish.shares().empty()) return "names no style; known: " + walkers.repertoire().known();
  for (const v1::StyleShare& share : wish.shares()) {
    if (walkers.repertoire().find(share.style()) < 0) {
      return fmt::format("style '{}' is unknown; known: {}", share.style().substr(0, 60),
                         walkers.repertoire().known());
    }
    if (!(share.share() > 0.0 && share.share() <= 1e6)) {
      return fmt::format("style '{}' has share {:g}, expected more than 0", share.style(),
                         share.share());
    }
  }
  if (!within(wish.duration_s(), 0.0, kLongestChange_s)) {
    return fmt::format("duration {:g} s is outside [0, {:g}]", wish.duration_s(), kLongestChange_s);
  }
  return {};
}

std::string fault(const v1::Beat& beat) {
  if (!within(beat.phase_rate_rad_s(), 0.0, kFastest_rad_s)) {
    return fmt::format("rate {:g} rad/s is outside [0, {:g}]", beat.phase_rate_rad_s(),
                       kFastest_rad_s);
  }
  if (!within(beat.phase_rad(), -1e6, 1e6)) {
    return fmt::format("phase {:g} rad is no phase", beat.phase_rad());
  }
  return {};
}

std::string fault(const v1::GaitCommand& gait, const Walkers& walkers) {
  if (auto why = unknown_character(gait.character(), walkers); !why.empty()) return why;
  if (!within(gait.phase_rate_rad_s(), 0.0, kFastest_rad_s)) {
    return fmt::format("character {}: rate {:g} rad/s is outside [0, {:g}]", gait.character(),
                       gait.phase_rate_rad_s(), kFastest_rad_s);
  }
  if (!within(gait.step_length_m(), 0.0, kLongestStep_m)) {
    return fmt::format("character {}: step of {:g} m is outside [0, {:g}]", gait.character(),
                       gait.step_length_m(), kLongestStep_m);
  }
  if (!within(gait.phase_rad(), -1e6, 1e6) || !within(gait.heading_rad(), -1e6, 1e6)) {
    return fmt::format("character {}: phase {:g} rad, heading {:g} rad are no angles",
                       gait.character(), gait.phase_rad(), gait.heading_rad());
  }
  return {};
}

std::vector<double> to_shares(const v1::StyleWish& wish, const Repertoire& repertoire) {
  std::vector<double> shares(static_cast<std::size_t>(repertoire.style_count()), 0.0);
  double sum = 0.0;
  for (const v1::StyleShare& share : wish.shares()) {
    shares[static_cast<std::size_t>(repertoire.find(share.style()))] += share.share();
    sum += share.share();
  }
  for (double& share : shares) share /= sum;
  return shares;
}

GaitWish to_gait(const v1::GaitCommand& gait) {
  GaitWish wish;
  if (gait.has_phase_rate_rad_s()) wish.phase_rate_rad_s = gait.phase_rate_rad_s();
  if (gait.has_step_length_m()) wish.step_length_m = gait.step_length_m();
  if (gait.has_heading_rad()) wish.heading_rad = gait.heading_rad();
  return wish;
}

void to_proto(const Director& director, int i, const LimitedMotion& limited, v1::Motion& motion) {
  const WalkerState& state = director.state(i);
  motion.set_phase_rad(state.phase_rad);
  motion.set_phase_rate_rad_s(state.phase_rate_rad_s);
  motion.set_velocity_forward_m_s(state.root.velocity_H_m_s.x());
  motion.set_velocity_left_m_s(state.root.velocity_H_m_s.y());
  motion.set_yaw_rate_rad_s(state.root.yaw_rate_rad_s);
  v1::Vector3& p = *motion.mutable_position_pelvis_in_world_m();
  p.set_x_m(state.root.position_W_m.x());
  p.set_y_m(state.root.position_W_m.y());
  p.set_z_m(state.root.height_m);
  motion.set_heading_rad(math::wrap_pi(state.root.heading_rad));
  motion.clear_position_rad();
  motion.clear_velocity_rad_s();
  for (const float angle : limited.angles_rad) motion.add_position_rad(static_cast<double>(angle));
  for (const double rate : limited.velocity_rad_s) motion.add_velocity_rad_s(rate);
  motion.set_smooth_velocity_forward_m_s(limited.smooth_velocity[0]);
  motion.set_smooth_velocity_left_m_s(limited.smooth_velocity[1]);
  motion.set_smooth_yaw_rate_rad_s(limited.smooth_velocity[2]);
  motion.set_support(state.root.support == mocap::kLeft ? v1::FOOT_LEFT : v1::FOOT_RIGHT);
  const Walkers& walkers = director.walkers();
  motion.set_style(walkers.repertoire().style(walkers.walker(i).style().largest()).name);
  motion.set_action(director.action(i));
}

void to_proto(const Director& director, v1::MotionBatch& batch) {
  const int count = director.size(), rows = director.walkers().rows();
  batch.mutable_phase_rad()->Resize(count, 0.0F);
  batch.mutable_heading_rad()->Resize(count, 0.0F);
  batch.mutable_position_pelvis_in_world_m()->Resize(3 * count, 0.0F);
  batch.mutable_position_rad()->Resize(rows * count, 0.0F);
  float* phase = batch.mutable_phase_rad()->mutable_data();
  float* heading = batch.mutable_heading_rad()->mutable_data();
  float* place = batch.mutable_position_pelvis_in_world_m()->mutable_data();
  float* angle = batch.mutable_position_rad()->mutable_data();
  for (int i = 0; i < count; ++i) {
    const WalkerState& state = director.state(i);
    *phase++ = static_cast<float>(state.phase_rad);
    *heading++ = static_cast<float>(math::wrap_pi(state.root.heading_rad));
    *place++ = static_cast<float>(state.root.position_W_m.x());
    *place++ = static_cast<float>(state.root.position_W_m.y());
    *place++ = static_cast<float>(state.root.height_m);
    const auto angles = director.angles(i);
    std::copy(angles.begin(), angles.end(), angle);
    clamp_to_limits(director.walkers().repertoire().model(), std::span(angle, angles.size()));
    angle += angles.size();
  }
}

v1::MotionStatus to_proto(int i, const Progress& progress, const std::vector<PlannedAction>* plan) {
  v1::MotionStatus status;
  status.set_character(static_cast<std::uint32_t>(i));
  switch (progress.kind) {
    case GoalKind::walk_to:
      status.set_kind(v1::MOTION_GOAL_KIND_WALK_TO);
      break;
    case GoalKind::drawer:
      status.set_kind(v1::MOTION_GOAL_KIND_DRAWER);
      break;
    case GoalKind::stop:
      status.set_kind(v1::MOTION_GOAL_KIND_STOP);
      break;
    case GoalKind::none:
      break;
  }
  status.set_reached(progress.reached);
  status.set_reason(progress.reason);
  status.set_goal_distance_m(progress.distance_m);
  if (plan != nullptr) {
    for (const PlannedAction& action : *plan) status.add_step_length_m(action.length_m);
  }
  return status;
}

}  // namespace mimesis::synthesizer
