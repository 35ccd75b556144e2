// External agents that are bodies: characters of the synthesizer, a walking robot.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/circle.h"
#include "nodes/crowd/crowd_node.h"

namespace mimesis::crowd {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFar_m = 1e5, kLongest_s = 10.0;

double seconds(runtime::Time t) { return std::chrono::duration<double>(t).count(); }

bool takes_part(v1::WalkState state) {
  return state == v1::WALK_STATE_STANDING || state == v1::WALK_STATE_STARTING ||
         state == v1::WALK_STATE_WALKING || state == v1::WALK_STATE_STOPPING;
}

/// The right foot swings in the first half of a cycle, and lands at π. Before the first step the
/// weight is shifted: the phase rests.
double phase_of(const v1::WalkFeedback& robot, double step_s) {
  const double from = robot.swing() == v1::FOOT_LEFT ? kPi : 0.0;
  if (robot.to_landing_s() <= 0.0) return from;
  return from + kPi * std::clamp(1.0 - robot.to_landing_s() / step_s, 0.0, 1.0);
}

}  // namespace

void CrowdNode::take_characters(Time now) {
  const v1::MotionBatch* batch = characters_in_.take();
  if (batch == nullptr || !first()) return;
  const int n =
      std::min(batch->phase_rad_size(), run_.roster().externals() - params_.first_character);
  if (batch->heading_rad_size() < n || batch->position_pelvis_in_world_m_size() < 3 * n) {
    if (bad_agents_.pass()) runtime::warn("characters: lists of different lengths; ignored");
    return;
  }
  for (int i = 0; i < n; ++i) {
    AgentReport report;
    report.p_W_m = {static_cast<double>(batch->position_pelvis_in_world_m(3 * i)),
                    static_cast<double>(batch->position_pelvis_in_world_m(3 * i + 1))};
    report.heading_rad = static_cast<double>(batch->heading_rad(i));
    report.phase_rad = static_cast<double>(batch->phase_rad(i));
    hear_body(params_.first_character + i, report, characters_in_.stamp(), now);
  }
}

const SpeedFunction& CrowdNode::gait_of(AgentId id) const {
  const int group = run_.crowd().group_of(id).value_or(run_.roster().home(id));
  return run_.crowd().group(group).gait;
}

/// Rates that it does not say are those since the message before; it walks where its pelvis does in
/// the mean.
void CrowdNode::hear_body(int external, AgentReport report, Time stamp, Time now,
                          std::optional<double> phase_rate_rad_s) {
  const AgentId id = run_.roster().external_id(external);
  const auto [known, comes] = bodies_.try_emplace(external);
  Body& body = known->second;
  if (!comes && stamp <= body.stamp) return;
  const double dt = seconds(stamp - body.stamp);
  if (!comes) {
    const Eigen::Vector2d ahead(std::cos(report.heading_rad), std::sin(report.heading_rad));
    report.phase_rate_rad_s =
        phase_rate_rad_s.value_or(math::wrap_pi(report.phase_rad - body.report.phase_rad) / dt);
    report.speed_m_s = (report.p_W_m - body.report.p_W_m).dot(ahead) / dt;
  }
  body.report = report;
  body.stamp = stamp;
  const AgentReport walker = body.path.step(report, stamp, gait_of(id));
  body.step.learn(body.asked_m, 0.5 * body.path.cycle_m(), body.path.advance());
  if (body.asked_rad && body.path.cycle_m() > 0.0) {
    body.heading.learn(*body.asked_rad, walker.heading_rad, body.path.advance());
  }
  if (!comes) hear_external(id, walker, stamp, now);
}

/// A robot that waits, or has stopped for safety, takes part no longer.
void CrowdNode::take_robot(Time now) {
  const v1::WalkFeedback* robot = robot_in_.take();
  if (robot == nullptr || params_.robot.agent < 0 || !first()) return;
  if (!takes_part(robot->state())) {
    externals_.leave(params_.robot.agent);
    bodies_.erase(params_.robot.agent);
    return;
  }
  const v1::Vector3& pelvis = robot->position_pelvis_in_world_m();
  if (std::max(std::abs(pelvis.x_m()), std::abs(pelvis.y_m())) > kFar_m ||
      !(robot->to_landing_s() >= 0.0 && robot->to_landing_s() <= kLongest_s) ||
      std::abs(robot->heading_rad()) > kFar_m) {
    if (bad_agents_.pass()) runtime::warn("robot: a place or step that no walker has; ignored");
    return;
  }
  AgentReport report;
  report.p_W_m = {pelvis.x_m(), pelvis.y_m()};
  report.heading_rad = math::wrap_pi(robot->heading_rad());
  report.phase_rad = phase_of(*robot, params_.robot.step_s);
  const bool steps = robot->to_landing_s() > 0.0 && robot->to_landing_s() <= params_.robot.step_s;
  hear_body(params_.robot.agent, report, robot_in_.stamp(), now,
            steps ? kPi / params_.robot.step_s : 0.0);
}

/// A body's steps are asked to be so long that they come out as long as the rules want them, and
/// its heading so that its way is the rules'.
v1::GaitCommand CrowdNode::command_for(int external, const Crowd::Wish& wish) {
  const AgentId id = run_.roster().external_id(external);
  const Agent agent = *run_.crowd().find(id);
  const GroupSettings& group = run_.crowd().group(*run_.crowd().group_of(id));
  const double ahead_s =
      std::min(params_.ahead_s, settling_s(group.rules.heading, wish.phase_rate_rad_s));
  double step_m = agent.traits.stride * (1.0 + wish.length) * 0.5 * group.gait.cycle_m();
  double heading = agent.state.heading_rad + ahead_s * wish.heading_rate_rad_s;
  if (const auto body = bodies_.find(external); body != bodies_.end()) {
    step_m /= body->second.step.value();
    body->second.asked_m = step_m;
    body->second.asked_rad = heading;
    heading += body->second.path.yaw_rad() + body->second.heading.value_rad();
  }
  v1::GaitCommand command;
  command.set_character(static_cast<std::uint32_t>(external - params_.first_character));
  command.set_phase_rad(math::wrap_two_pi(agent.state.phase_rad));
  command.set_phase_rate_rad_s(std::max(0.0, wish.phase_rate_rad_s));
  command.set_step_length_m(step_m);
  command.set_heading_rad(math::wrap_pi(heading));
  return command;
}

}  // namespace mimesis::crowd
