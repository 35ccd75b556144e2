#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/time.h"
#include "nodes/crowd/crowd_node.h"

namespace mimesis::crowd {

// Agents that other processes move: port `agents`, their trust, and their commands.

void CrowdNode::take_agents(Time now) {
  while (const auto states = agents_in_.pop()) {
    if (!first()) continue;
    if (const std::string why = fault(*states, run_.scenario()); !why.empty()) {
      if (bad_agents_.pass()) runtime::warn("agents: {}; ignored", why);
      continue;
    }
    const Time stamp(states->header().stamp_ns());
    for (int i = 0; i < states->id_size(); ++i) {
      hear_external(states->id(i), to_report(*states, i), stamp, now);
    }
    for (const std::uint64_t id : states->leaving()) {
      if (const int e = run_.roster().external(id); e >= 0) externals_.leave(e);
    }
  }
}

void CrowdNode::hear_external(AgentId id, const AgentReport& report, Time stamp, Time now) {
  const int e = run_.roster().external(id);
  if (e < 0) {
    if (bad_agents_.pass()) {
      runtime::warn("agent {} is none that may come: the scenario names {} of them", id,
                    run_.roster().externals());
    }
    return;
  }
  const std::string why = externals_.hear(e, report, stamp, now);
  external_reasons_[static_cast<std::size_t>(e)] = why;
  if (!why.empty() && bad_agents_.pass()) {
    runtime::warn("agent '{}': {}", run_.scenario().externals[static_cast<std::size_t>(e)].name,
                  why);
  }
}

void CrowdNode::take_styles() {
  while (const auto wish = styles_in_.pop()) {
    std::string best;
    double most = 0.0;
    for (const v1::StyleShare& share : wish->shares()) {
      if (share.share() > most) best = share.style();
      most = std::max(most, share.share());
    }
    const std::vector<AgentId> ids(wish->characters().begin(), wish->characters().end());
    if (const std::string why = run_.wish_gait(ids, best); !why.empty() && bad_styles_.pass()) {
      runtime::warn("style: {}; ignored", why);
    }
  }
}

void CrowdNode::judge_externals(Time now, Time state_time) {
  if (!first()) return;
  for (const ExternalAgents::Change& change : externals_.update(now)) {
    trust_changed(change, state_time);
  }
  for (int e = 0; e < externals_.size(); ++e) {
    if (externals_.trust(e) == Trust::absent || !externals_.fresh(e)) continue;
    externals_.taken(e);
    const AgentId id = run_.roster().external_id(e);
    if (!run_.crowd().group_of(id)) continue;
    MIMESIS_ASSERT(run_.crowd().set_state(id, to_state(externals_.believed(e, state_time))));
  }
}

void CrowdNode::trust_changed(const ExternalAgents::Change& change, Time state_time) {
  const auto e = static_cast<std::size_t>(change.agent);
  const std::string& name = run_.scenario().externals[e].name;
  const AgentId id = run_.roster().external_id(change.agent);
  external_reasons_[e] = change.reason;
  status_changed_ = true;
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
        agent.state = to_state(externals_.believed(change.agent, state_time));
        try {
          crowd.add(group, std::span<const Agent>(&agent, 1));
        } catch (const ConfigError& error) {
          say(fmt::format("agent '{}' cannot take part: {}", name, error.what()));
          return;
        }
      }
      runtime::info("agent '{}' takes part: {}", name, change.reason);
      break;
  }
  watch_.expect_change(group, fmt::format("'{}' {}", name, change.reason));
}

/// Publishes commands to external agents: to walk as the rules would move them.
void CrowdNode::publish_commands(Time now) {
  if (!first() || !runs_) return;
  command_message_.clear_gaits();
  for (int e = params_.first_character; e < externals_.size(); ++e) {
    if (externals_.trust(e) != Trust::trusted) continue;
    const AgentId id = run_.roster().external_id(e);
    const std::optional<Crowd::Wish> wish = run_.crowd().wish(id);
    if (!wish || !run_.crowd().group_of(id)) continue;
    *command_message_.add_gaits() = command_for(e, *wish);
  }
  if (command_message_.gaits_size() > 0) command_.send(command_message_, now);
}

/// Characters walk as their group does: told when they come and when it changes.
void CrowdNode::publish_styles(Time now) {
  if (!first()) return;
  for (int e = params_.first_character; e < externals_.size(); ++e) {
    if (externals_.trust(e) == Trust::absent) continue;
    const std::optional<int> group = run_.crowd().group_of(run_.roster().external_id(e));
    if (!group) continue;
    const int gait = run_.gait(*group);
    const auto told = styles_.find(e);
    if (told != styles_.end() && told->second == gait) continue;
    styles_[e] = gait;
    v1::StyleWish wish;
    wish.add_characters(static_cast<std::uint32_t>(e - params_.first_character));
    v1::StyleShare& share = *wish.add_shares();
    share.set_style(run_.scenario().gaits[static_cast<std::size_t>(gait)].name);
    share.set_share(1.0);
    style_.send(wish, now);
  }
}

// External agents that are bodies: characters of the synthesizer, a walking robot.

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFarBody_m = 1e5, kLongest_s = 10.0;

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
  const double dt = to_seconds(stamp - body.stamp);
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
  if (std::max(std::abs(pelvis.x_m()), std::abs(pelvis.y_m())) > kFarBody_m ||
      !(robot->to_landing_s() >= 0.0 && robot->to_landing_s() <= kLongest_s) ||
      std::abs(robot->heading_rad()) > kFarBody_m) {
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

/// A body's steps are requested with a length that results in the length of the rules, and its
/// heading so that its path is the rules'.
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

// Several coordinators share the plane: their reports, agents that walk from one to another,
// missing coordinators.

void CrowdNode::take_peers(Time now) {
  while (auto states = peers_in_.pop()) {
    const auto from = static_cast<int>(states->coordinator());
    if (from == params_.regions.own) continue;
    std::string why = fault(*states, run_.scenario(), coordinators());
    if (from < 1 || from > coordinators()) why = fmt::format("there is no coordinator {}", from);
    const Time stamp(states->header().stamp_ns());
    if (std::max(stamp, Time(states->ownership().view_ns())) >
        now + runtime::from_seconds(params_.regions.stale_s)) {
      why = "they are of the future";  // would hide all that comes after them
    }
    if (!why.empty()) {
      if (bad_states_.pass()) runtime::warn("states of coordinator {}: {}; ignored", from, why);
      continue;
    }
    Peer& peer = peers_[static_cast<std::size_t>(from - 1)];
    peer.hears = states->hears();
    peer.time_s = states->time_s();
    peer.collisions = states->collisions();
    if (states->has_least_gap_m()) peer.least_gap_m = states->least_gap_m();
    if (states->has_least_distance_m()) peer.least_distance_m = states->least_distance_m();
    far_.hear(from - 1, to_far(*states, run_.roster()));
  }
}

void CrowdNode::take_handovers(Time state_time) {
  while (const auto handover = handovers_in_.pop()) {
    const auto from = static_cast<int>(handover->from());
    if (from == params_.regions.own) continue;
    if (const std::string why = fault(*handover, run_, coordinators()); !why.empty()) {
      if (bad_handovers_.pass()) runtime::warn("handover: {}; ignored", why);
      continue;
    }
    for (const Passing& passing : from_proto(*handover)) {
      try {
        taken_ += far_.hear(run_, passing, state_time) ? 1 : 0;
      } catch (const ConfigError& e) {
        say(fmt::format("agent {} of coordinator {} cannot come: {}", passing.offer.claim.id, from,
                        e.what()));
      }
    }
  }
}

/// The run begins once all coordinators hear each other. Started again while the others walk: they
/// have looked after our region, and hand it back.
bool CrowdNode::begins(Time now) {
  if (far_.started()) {
    double time_s = 0.0;
    for (const Peer& peer : peers_) time_s = std::max(time_s, peer.time_s);
    if (time_s > 0.0 && !far_.member(params_.regions.own - 1)) {
      run_.join(time_s);
      runtime::info("the others are at work since {:.1f} s: they hand over who is here", time_s);
    }
    return true;
  }
  std::string missing;
  for (int c = 0; c < coordinators(); ++c) {
    if (c + 1 == params_.regions.own || far_.heard(c, now)) continue;
    missing += fmt::format("{}{}", missing.empty() ? "" : ", ", c + 1);
  }
  reason_ = missing.empty() ? "waits until all coordinators hear each other"
                            : "waits for coordinator " + missing;
  return false;
}

/// Adopts agents that nobody owns; what the others' regions are then is for hand_over.
void CrowdNode::share(Time state_time) {
  const int own = params_.regions.own - 1;
  const FarCrowd::Decided decided = far_.decide(run_, state_time);
  if (!far_.started()) return;
  const bool was_first = first_;
  there_.assign(static_cast<std::size_t>(coordinators()), false);
  for (int c = 0; c < coordinators(); ++c) there_[static_cast<std::size_t>(c)] = far_.member(c);
  first_ = std::ranges::find(there_, true) - there_.begin() == own;
  taken_ += static_cast<std::uint64_t>(decided.taken);
  if (!decided.trouble.empty()) say("an agent stands: " + decided.trouble);
  for (const FarCrowd::Left& left : decided.left) {
    const std::string what =
        fmt::format("coordinator {} fell silent, {} has its region", left.coordinator + 1,
                    map_.heir(left.coordinator, there_) + 1);
    runtime::warn("{}", what);
    status_changed_ = true;
    for (const int g : left.groups) watch_.disturb(run_, g, what);
  }
  if (first_ != was_first) status_changed_ = true;
}

/// Hands agents that left our region to the coordinator of the next, if that is there.
void CrowdNode::hand_over(Time now) {
  if (coordinators() == 1) return;
  const Crowd& crowd = run_.crowd();
  const int own = params_.regions.own - 1;
  std::vector<std::pair<int, AgentId>> leaving;
  for (std::size_t r = 0; r < crowd.ids().size(); ++r) {
    if (crowd.roles()[r] != Role::own) continue;
    const int to = map_.heir(
        map_.owner(own, {crowd.x_m()[r], crowd.y_m()[r]}, params_.regions.margin_m), there_);
    if (to != own && far_.heard(to, now)) leaving.emplace_back(to, crowd.ids()[r]);
  }
  std::ranges::sort(leaving);
  std::vector<Passing> offers = far_.repeats(now);
  for (const auto& [to, id] : leaving) {
    if (const auto passing = far_.give(run_, id, to, now)) {
      offers.push_back(*passing);
      ++given_;
    }
  }
  const auto of = [](const Passing& p) { return std::pair(p.stamp, p.offer.to); };
  for (auto first = offers.begin(); first != offers.end();) {
    const auto last =
        std::find_if(first, offers.end(), [&](const Passing& p) { return of(p) != of(*first); });
    v1::CrowdHandover message;
    to_proto(std::span(first, last), message);
    handovers_.send(message, first->stamp);
    first = last;
  }
}

}  // namespace mimesis::crowd
