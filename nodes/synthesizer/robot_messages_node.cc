#include "nodes/synthesizer/robot_messages_node.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kFar_m = 1e4, kLongest_s = 60.0;

bool near(double x) { return std::abs(x) <= kFar_m; }
bool near(const v1::Vector3& p) { return near(p.x_m()) && near(p.y_m()) && near(p.z_m()); }

Eigen::Vector3d to_eigen(const v1::Vector3& p) { return {p.x_m(), p.y_m(), p.z_m()}; }

mocap::Side side(v1::Foot foot) { return foot == v1::FOOT_LEFT ? mocap::kLeft : mocap::kRight; }
v1::Foot foot(mocap::Side side) { return side == mocap::kLeft ? v1::FOOT_LEFT : v1::FOOT_RIGHT; }

SolePrint to_print(const v1::Footprint& message) {
  return {.side = side(message.foot()),
          .p_W_m = to_eigen(message.position_in_world_m()).head<2>(),
          .yaw_rad = message.yaw_rad()};
}

RobotGait to_gait(v1::WalkState state) {
  switch (state) {
    case v1::WALK_STATE_STANDING:
      return RobotGait::standing;
    case v1::WALK_STATE_STARTING:
      return RobotGait::starting;
    case v1::WALK_STATE_WALKING:
      return RobotGait::walking;
    case v1::WALK_STATE_STOPPING:
      return RobotGait::stopping;
    case v1::WALK_STATE_SAFE:
      return RobotGait::safe;
    default:
      return RobotGait::waiting;
  }
}

void set(v1::Vector3& message, const Eigen::Vector3d& p) {
  message.set_x_m(p.x());
  message.set_y_m(p.y());
  message.set_z_m(p.z());
}

std::string hands_fault(const google::protobuf::RepeatedPtrField<v1::Vector3>& hands) {
  if (hands.size() != 0 && hands.size() != 2) {
    return fmt::format("{} hands, expected none or two", hands.size());
  }
  return std::ranges::all_of(hands, [](const v1::Vector3& p) { return near(p); })
             ? ""
             : "a hand is nowhere";
}

}  // namespace

std::string fault(const v1::WalkFeedback& f) {
  if (!v1::WalkState_IsValid(f.state()) || f.state() == v1::WALK_STATE_UNSPECIFIED) {
    return fmt::format("state {} is none of a walker", static_cast<int>(f.state()));
  }
  if (!near(f.position_pelvis_in_world_m()) || !near(f.heading_rad())) {
    return fmt::format("pelvis at ({:g}, {:g}) m, heading {:g} rad is nowhere",
                       f.position_pelvis_in_world_m().x_m(), f.position_pelvis_in_world_m().y_m(),
                       f.heading_rad());
  }
  if (!(f.to_landing_s() >= 0.0 && f.to_landing_s() <= kLongest_s)) {
    return fmt::format("{:g} s to the landing, expected 0 .. {:g}", f.to_landing_s(), kLongest_s);
  }
  if (f.to_landing_s() > 0.0 && f.swing() != v1::FOOT_LEFT && f.swing() != v1::FOOT_RIGHT) {
    return "a step of no foot";
  }
  if (f.feet_size() != 2 || f.feet(0).foot() != v1::FOOT_LEFT ||
      f.feet(1).foot() != v1::FOOT_RIGHT) {
    return fmt::format("{} feet, expected the left and the right one", f.feet_size());
  }
  for (const v1::Footprint& print : {f.feet(0), f.feet(1), f.landing()}) {
    if (!near(print.position_in_world_m()) || !near(print.yaw_rad())) return "a foot is nowhere";
  }
  return hands_fault(f.hands_in_world_m());
}

RobotFeedback to_feedback(const v1::WalkFeedback& m) {
  RobotFeedback f;
  f.gait = to_gait(m.state());
  f.pelvis_W_m = to_eigen(m.position_pelvis_in_world_m());
  f.heading_rad = math::wrap_pi(m.heading_rad());
  f.swing = side(m.swing());
  f.to_landing_s = m.to_landing_s();
  f.landing = to_print(m.landing());
  f.feet = {to_print(m.feet(0)), to_print(m.feet(1))};
  f.steps = static_cast<int>(m.steps() & 0x7fffffffU);
  f.hands_known = m.hands_in_world_m_size() == 2;
  for (int i = 0; i < m.hands_in_world_m_size(); ++i) {
    f.hand_W_m[static_cast<std::size_t>(i)] = to_eigen(m.hands_in_world_m(i));
  }
  return f;
}

std::string fault(const v1::DrawerState& d) {
  if (!near(d.front_in_world_m()) || !near(d.handle_in_world_m()) || !near(d.object_in_world_m())) {
    return "front, handle or object is nowhere";
  }
  if (!(d.opened_m() >= -0.1 && d.opened_m() <= 2.0)) {
    return fmt::format("{:g} m open, expected 0 .. 2", d.opened_m());
  }
  return hands_fault(d.hands_in_world_m());
}

DrawerSeen to_seen(const v1::DrawerState& m) {
  DrawerSeen seen{.front_W_m = to_eigen(m.front_in_world_m()).head<2>(),
                  .handle_W_m = to_eigen(m.handle_in_world_m()),
                  .object_W_m = to_eigen(m.object_in_world_m()),
                  .opened_m = m.opened_m(),
                  .held = m.held(),
                  .taken = m.taken()};
  if (m.hands_in_world_m_size() == 2) {
    seen.hand_W_m = {to_eigen(m.hands_in_world_m(0)), to_eigen(m.hands_in_world_m(1))};
  }
  return seen;
}

void to_proto(const RobotMotion& motion, const LimitedMotion& limited, v1::Motion& message) {
  message.set_phase_rad(motion.phase_rad);
  message.set_phase_rate_rad_s(motion.phase_rate_rad_s);
  message.set_velocity_forward_m_s(motion.velocity[0]);
  message.set_velocity_left_m_s(motion.velocity[1]);
  message.set_yaw_rate_rad_s(motion.velocity[2]);
  set(*message.mutable_position_pelvis_in_world_m(), motion.pelvis_W_m);
  message.set_heading_rad(math::wrap_pi(motion.heading_rad));
  message.clear_position_rad();
  message.clear_velocity_rad_s();
  for (const float angle : limited.angles_rad) message.add_position_rad(static_cast<double>(angle));
  for (const double rate : limited.velocity_rad_s) message.add_velocity_rad_s(rate);
  message.set_smooth_velocity_forward_m_s(limited.smooth_velocity[0]);
  message.set_smooth_velocity_left_m_s(limited.smooth_velocity[1]);
  message.set_smooth_yaw_rate_rad_s(limited.smooth_velocity[2]);
  message.set_support(foot(motion.support));
  message.set_action(motion.action);
  message.clear_hands();
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
    if (!motion.hand[i]) continue;
    v1::HandGoal& goal = *message.add_hands();
    goal.set_left(i == 0);
    set(*goal.mutable_position_in_world_m(), motion.hand[i]->p_W_m);
    goal.set_share(motion.hand[i]->share);
  }
  message.clear_landings();
  for (const auto& landing : motion.landing) {
    if (!landing) break;
    v1::Footprint& print = *message.add_landings();
    print.set_foot(foot(landing->side));
    set(*print.mutable_position_in_world_m(), {landing->p_W_m.x(), landing->p_W_m.y(), 0.0});
    print.set_yaw_rad(landing->yaw_rad);
  }
  message.set_stands(motion.stands);
}

}  // namespace mimesis::synthesizer
