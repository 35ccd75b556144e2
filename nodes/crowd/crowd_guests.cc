#include "nodes/crowd/crowd_guests.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/time.h"
#include "nodes/crowd/crowd_messages.h"

namespace mimesis::crowd {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFarBody_m = 1e5, kLongest_s = 10.0;
constexpr double kRates_s = 0.05;
constexpr Guests::Time kTwice = std::chrono::seconds(2);  // that two move an agent is said for

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

Guests::Guests(const CrowdParams& params, runtime::Bus& bus, ScenarioRun& run)
    : params_(params),
      run_(run),
      agents_(run.roster().externals(), params.trust_in(run.scenario())),
      reasons_(static_cast<std::size_t>(run.roster().externals())),
      agents_in_(bus, "agents", true),
      characters_in_(bus, "characters", true),
      robots_in_(bus, "robots", true),
      command_(bus, "command"),
      style_(bus, "wish") {}

void Guests::take(Time now) {
  while (const auto states = agents_in_.pop()) take_agents(*states, now);
  while (const auto batch = characters_in_.pop()) take_characters(*batch, now);
  while (const auto robot = robots_in_.pop()) take_robot(*robot, now);
}

void Guests::take_agents(const v1::CrowdStates& states, Time now) {
  if (const std::string why = fault(states, run_.scenario()); !why.empty()) {
    if (bad_.pass()) runtime::warn("agents: {}; ignored", why);
    return;
  }
  const Time stamp(states.header().stamp_ns());
  const std::string& node = agents_in_.source();
  for (int i = 0; i < states.id_size(); ++i) {
    const int e = run_.roster().external(states.id(i));
    if (e >= 0 && moves(node, e, now)) hear(e, to_report(states, i), stamp, now);
    if (e < 0 && bad_.pass()) {
      runtime::warn("agent {} of '{}' is none that may come: the scenario names {} of them",
                    states.id(i), node, run_.roster().externals());
    }
  }
  for (const std::uint64_t id : states.leaving()) {
    const int e = run_.roster().external(id);
    if (e >= 0 && moves(node, e, now)) agents_.leave(e);
  }
}

/// The external agents that have the names of a node's characters. What a message has more of is
/// said once and costs nothing: anybody may publish it.
const std::vector<Guests::Named>& Guests::named(const std::string& node, int characters) {
  const auto [known, first_time] = named_.try_emplace(node);
  std::vector<Named>& found = known->second;
  if (!first_time) return found;
  const auto& externals = run_.scenario().externals;
  for (std::size_t e = 0; e < externals.size(); ++e) {
    const std::string_view name = externals[e].name;
    int character = 0;
    if (name != node) {
      if (!name.starts_with(node + '/')) continue;
      const std::string_view number = name.substr(node.size() + 1);
      const auto [end, bad] = std::from_chars(number.begin(), number.end(), character);
      if (bad != std::errc{} || end != number.end() || character < 0) continue;
    }
    found.push_back({character, static_cast<int>(e)});
  }
  const auto left_out = characters - std::ranges::count_if(found, [&](const Named& n) {
                          return n.character < characters;
                        });
  if (left_out > 0) {
    runtime::warn(
        "{} of {} characters of '{}' take no part: the scenario's `externals` name none "
        "of them, as '{}/0'",
        left_out, characters, node, node);
  }
  return found;
}

/// Whether this node's word on the agent counts: it does while no other node moves it.
bool Guests::moves(const std::string& node, int number, Time now) {
  Author& author = authors_[number];
  if (agents_.trust(number) == Trust::absent) author.node = node;
  if (author.node == node) return true;
  author.other = node;
  author.other_time = now;
  if (twice_.pass()) {
    runtime::warn("agent '{}' is moved by node '{}'; what '{}' says of it is ignored",
                  run_.scenario().externals[static_cast<std::size_t>(number)].name, author.node,
                  node);
  }
  return false;
}

void Guests::hear(int number, const AgentReport& report, Time stamp, Time now) {
  const std::string why = agents_.hear(number, report, stamp, now);
  reasons_[static_cast<std::size_t>(number)] = why;
  if (!why.empty() && bad_.pass()) {
    runtime::warn("agent '{}': {}",
                  run_.scenario().externals[static_cast<std::size_t>(number)].name, why);
  }
}

void Guests::take_characters(const v1::MotionBatch& batch, Time now) {
  const int n = batch.phase_rad_size();
  if (batch.heading_rad_size() < n || batch.position_pelvis_in_world_m_size() < 3 * n) {
    if (bad_.pass()) runtime::warn("characters: lists of different lengths; ignored");
    return;
  }
  const std::string& node = characters_in_.source();
  for (const auto& [i, e] : named(node, n)) {
    if (i >= n || !moves(node, e, now)) continue;
    AgentReport report;
    report.p_W_m = {static_cast<double>(batch.position_pelvis_in_world_m(3 * i)),
                    static_cast<double>(batch.position_pelvis_in_world_m(3 * i + 1))};
    report.heading_rad = static_cast<double>(batch.heading_rad(i));
    report.phase_rad = static_cast<double>(batch.phase_rad(i));
    hear_body(e, i, report, Time(batch.header().stamp_ns()), now);
  }
}

/// Duration of a robot's step: half a cycle of the beat that it is, or of its group's gait.
double Guests::step_s(int number) const {
  const Scenario& scenario = run_.scenario();
  const std::string& name = scenario.externals[static_cast<std::size_t>(number)].name;
  const AgentId id = run_.roster().external_id(number);
  const int group = run_.crowd().group_of(id).value_or(run_.roster().home(id));
  const bool beats = scenario.beat.agent == name && scenario.beat.rate_rad_s > 0.0;
  return kPi / (beats ? scenario.beat.rate_rad_s : run_.eigenfrequency_rad_s(group));
}

/// A robot that waits, or has stopped for safety, takes part no longer.
void Guests::take_robot(const v1::WalkFeedback& robot, Time now) {
  const std::string& node = robots_in_.source();
  const std::vector<Named>& found = named(node, 1);
  const auto robot_of = std::ranges::find(found, 0, &Named::character);
  if (robot_of == found.end() || !moves(node, robot_of->agent, now)) return;
  const int number = robot_of->agent;
  if (!takes_part(robot.state())) {
    agents_.leave(number);
    bodies_.erase(number);
    return;
  }
  const v1::Vector3& pelvis = robot.position_pelvis_in_world_m();
  if (std::max(std::abs(pelvis.x_m()), std::abs(pelvis.y_m())) > kFarBody_m ||
      !(robot.to_landing_s() >= 0.0 && robot.to_landing_s() <= kLongest_s) ||
      std::abs(robot.heading_rad()) > kFarBody_m) {
    if (bad_.pass()) runtime::warn("robot: a place or step that no walker has; ignored");
    return;
  }
  AgentReport report;
  report.p_W_m = {pelvis.x_m(), pelvis.y_m()};
  report.heading_rad = math::wrap_pi(robot.heading_rad());
  const double step = step_s(number);
  report.phase_rad = phase_of(robot, step);
  const bool steps = robot.to_landing_s() > 0.0 && robot.to_landing_s() <= step;
  hear_body(number, 0, report, Time(robot.header().stamp_ns()), now, steps ? kPi / step : 0.0);
}

/// Rates that it does not say are means over kRates_s at least: each state is one step after the
/// one before, but on a busy machine's wall clock it may be stamped much sooner after it. The agent
/// walks where its pelvis does in the mean.
void Guests::hear_body(int number, int character, AgentReport report, Time stamp, Time now,
                       std::optional<double> phase_rate_rad_s) {
  const AgentId id = run_.roster().external_id(number);
  const auto [known, comes] = bodies_.try_emplace(number);
  Body& body = known->second;
  body.character = character;
  if (!comes && stamp <= body.states.back().stamp) return;
  const auto old = [&](const Body::State& s) { return to_seconds(stamp - s.stamp) >= kRates_s; };
  while (body.states.size() > 1 && old(body.states[1])) body.states.pop_front();
  const bool rates = !comes && old(body.states.front());
  if (rates) {
    const Body::State& before = body.states.front();
    const double dt = to_seconds(stamp - before.stamp);
    const Eigen::Vector2d ahead(std::cos(report.heading_rad), std::sin(report.heading_rad));
    report.phase_rate_rad_s =
        phase_rate_rad_s.value_or(math::wrap_pi(report.phase_rad - before.report.phase_rad) / dt);
    report.speed_m_s = (report.p_W_m - before.report.p_W_m).dot(ahead) / dt;
  }
  body.states.push_back({stamp, report});
  const int group = run_.crowd().group_of(id).value_or(run_.roster().home(id));
  const SpeedFunction& gait = run_.crowd().group(group).gait;
  const AgentReport walker = body.path.step(report, stamp, gait);
  body.step.learn(body.asked_m, 0.5 * body.path.cycle_m(), body.path.advance());
  if (body.asked_rad && body.path.cycle_m() > 0.0) {
    body.heading.learn(*body.asked_rad, walker.heading_rad, body.path.advance());
  }
  if (rates) hear(number, walker, stamp, now);
}

std::vector<Guests::Change> Guests::judge(Time now, Time state_time) {
  std::vector<Change> changes;
  for (const ExternalAgents::Change& change : agents_.update(now)) {
    changes.push_back(change_trust(change, state_time));
  }
  for (int e = 0; e < agents_.size(); ++e) {
    if (agents_.trust(e) == Trust::absent || !agents_.fresh(e)) continue;
    agents_.taken(e);
    const AgentId id = run_.roster().external_id(e);
    if (!run_.crowd().group_of(id)) continue;
    MIMESIS_ASSERT(run_.crowd().set_state(id, to_state(agents_.believed(e, state_time))));
  }
  return changes;
}

Guests::Change Guests::change_trust(const ExternalAgents::Change& change, Time state_time) {
  const auto e = static_cast<std::size_t>(change.agent);
  const std::string& name = run_.scenario().externals[e].name;
  const AgentId id = run_.roster().external_id(change.agent);
  reasons_[e] = change.reason;
  Crowd& crowd = run_.crowd();
  const int group = crowd.group_of(id).value_or(run_.roster().home(id));
  switch (change.to) {
    case Trust::absent:
      crowd.remove(id);
      styles_.erase(change.agent);
      bodies_.erase(change.agent);
      runtime::warn("agent '{}' is gone: {}", name, change.reason);
      break;
    case Trust::lagging:
      if (crowd.group_of(id)) MIMESIS_ASSERT(crowd.set_role(id, Role::seen));
      runtime::warn("agent '{}' is not trusted: {}", name, change.reason);
      break;
    case Trust::trusted:
      if (crowd.group_of(id)) {
        MIMESIS_ASSERT(crowd.set_role(id, Role::external));
      } else {
        Agent agent = run_.roster().start(id);
        agent.state = to_state(agents_.believed(change.agent, state_time));
        try {
          crowd.add(group, std::span<const Agent>(&agent, 1));
        } catch (const ConfigError& error) {
          return {group, "", fmt::format("agent '{}' cannot take part: {}", name, error.what())};
        }
      }
      runtime::info("agent '{}' takes part: {}", name, change.reason);
      break;
  }
  return {group, fmt::format("'{}' {}", name, change.reason), ""};
}

void Guests::publish_commands(Time now) {
  command_message_.clear_gaits();
  for (int e = 0; e < agents_.size(); ++e) {
    if (agents_.trust(e) != Trust::trusted) continue;
    const AgentId id = run_.roster().external_id(e);
    const std::optional<Crowd::Wish> wish = run_.crowd().wish(id);
    if (!wish || !run_.crowd().group_of(id)) continue;
    *command_message_.add_gaits() = command_for(e, *wish);
  }
  if (command_message_.gaits_size() > 0) command_.send(command_message_, now);
}

void Guests::publish_styles(Time now) {
  for (int e = 0; e < agents_.size(); ++e) {
    if (agents_.trust(e) == Trust::absent) continue;
    const std::optional<int> group = run_.crowd().group_of(run_.roster().external_id(e));
    if (!group) continue;
    const int gait = run_.gait(*group);
    const auto told = styles_.find(e);
    if (told != styles_.end() && told->second == gait) continue;
    styles_[e] = gait;
    v1::StyleWish wish;
    wish.set_node(authors_[e].node);
    const auto body = bodies_.find(e);
    wish.add_characters(
        static_cast<std::uint32_t>(body == bodies_.end() ? 0 : body->second.character));
    v1::StyleShare& share = *wish.add_shares();
    share.set_style(run_.scenario().gaits[static_cast<std::size_t>(gait)].name);
    share.set_share(1.0);
    style_.send(wish, now);
  }
}

/// A body's steps are requested with a length that results in the length of the rules, and its
/// heading so that its path is the rules'.
v1::GaitCommand Guests::command_for(int number, const Crowd::Wish& wish) {
  const AgentId id = run_.roster().external_id(number);
  const Agent agent = *run_.crowd().find(id);
  const GroupSettings& group = run_.crowd().group(*run_.crowd().group_of(id));
  const double ahead_s =
      std::min(params_.ahead_s, settling_s(group.rules.heading, wish.phase_rate_rad_s));
  double step_m = agent.traits.stride * (1.0 + wish.length) * 0.5 * group.gait.cycle_m();
  double heading = agent.state.heading_rad + ahead_s * wish.heading_rate_rad_s;
  v1::GaitCommand command;
  if (const auto body = bodies_.find(number); body != bodies_.end()) {
    command.set_character(static_cast<std::uint32_t>(body->second.character));
    step_m /= body->second.step.value();
    body->second.asked_m = step_m;
    body->second.asked_rad = heading;
    heading += body->second.path.yaw_rad() + body->second.heading.value_rad();
  }
  command.set_node(authors_[number].node);
  command.set_agent(id);
  command.set_phase_rad(math::wrap_two_pi(agent.state.phase_rad));
  command.set_phase_rate_rad_s(std::max(0.0, wish.phase_rate_rad_s));
  command.set_step_length_m(step_m);
  command.set_heading_rad(math::wrap_pi(heading));
  return command;
}

void Guests::describe(v1::CrowdStatus& status, Time now) const {
  for (int e = 0; e < agents_.size(); ++e) {
    v1::CrowdExternal& external = *status.add_externals();
    external.set_id(run_.roster().external_id(e));
    external.set_name(run_.scenario().externals[static_cast<std::size_t>(e)].name);
    external.set_trust(crowd::to_proto(agents_.trust(e)));
    external.set_reason(reasons_[static_cast<std::size_t>(e)]);
    if (agents_.trust(e) == Trust::absent) continue;
    external.set_age_s(agents_.age_s(e, now));
    const auto author = authors_.find(e);
    if (author == authors_.end()) continue;
    external.set_node(author->second.node);
    if (!author->second.other.empty() && now - author->second.other_time <= kTwice) {
      external.set_reason(fmt::format("moved by node '{}'; what '{}' says of it is ignored",
                                      author->second.node, author->second.other));
    }
  }
}

}  // namespace mimesis::crowd
