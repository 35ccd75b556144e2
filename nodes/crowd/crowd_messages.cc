#include "nodes/crowd/crowd_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/circle.h"
#include "common/model/drawing.h"

namespace mimesis::crowd {

namespace {

constexpr double kFar_m = 1e6, kFast = 1e3, kTurns_rad = 1e9, kLarge_m = 100.0;

bool within(double value, double most) { return std::abs(value) <= most; }

template <class Values>
bool all_within(const Values& values, double most) {
  for (const auto value : values) {
    if (!within(static_cast<double>(value), most)) return false;
  }
  return true;
}

/// Sums of no more agents than exist, each within the largest possible value.
bool possible(const v1::CrowdSums& sums, const Scenario& scenario) {
  double most = static_cast<double>(scenario.externals.size());
  for (const Group& group : scenario.groups) most += group.count;
  const double n = sums.agents();
  const double circular = n * (1.0 + 1e-6);  // rounding of n cosines
  const double fast = std::max(std::abs(sums.phase_rate_rad_s()), std::abs(sums.speed_m_s()));
  return n <= most &&
         all_within(
             std::array{sums.cos_phase(), sums.sin_phase(), sums.cos_heading(), sums.sin_heading()},
             circular) &&
         within(sums.error_m(), 2.0 * kFar_m * n) && within(fast, 2.0 * kFast * n) &&
         within(sums.leader_phase_rad(), kTurns_rad);
}

/// Checks that a group can continue with this traveller.
bool possible(const v1::CrowdTraveller& t, const Group& group) {
  const bool on_route = group.goals.aim == Aim::route;
  return all_within(
             std::array{t.x_m(), t.y_m(), t.goal_x_m(), t.goal_y_m(), t.place_m(), t.lane_m()},
             kFar_m) &&
         all_within(std::array{t.velocity_x_m_s(), t.velocity_y_m_s(), t.phase_rate_rad_s(),
                               t.heading_rate_rad_s(), t.omega_rad_s(), t.stride()},
                    kFast) &&
         all_within(std::array{t.heading_rad(), t.phase_rad(), t.smoothed_error_m()}, kTurns_rad) &&
         within(t.length(), 1.0) && within(t.radius_m(), kLarge_m) && t.omega_rad_s() >= 0.0 &&
         t.stride() > 0.0 && t.radius_m() >= 0.0 &&
         (!on_route || t.leg() < group.goals.position_m.size() / 2);
}

using model::Rgba;

constexpr std::array<Rgba, 8> kGroups{{{0.20, 0.45, 0.85, 1.0},
                                       {0.90, 0.40, 0.15, 1.0},
                                       {0.20, 0.65, 0.35, 1.0},
                                       {0.65, 0.35, 0.75, 1.0},
                                       {0.85, 0.70, 0.15, 1.0},
                                       {0.15, 0.70, 0.75, 1.0},
                                       {0.85, 0.30, 0.50, 1.0},
                                       {0.45, 0.45, 0.45, 1.0}}};
constexpr Rgba kStone{0.55, 0.52, 0.50, 1.0}, kGoal{0.90, 0.20, 0.20, 0.5};
constexpr double kTall_m = 1.7, kStroke_m = 0.5, kStroke_px = 3.0;
constexpr std::size_t kMostDiscs = 500;

void paint_still(const Scenario& scenario, foxglove::SceneEntity& entity) {
  for (const Pillar& p : scenario.pillars) {
    model::add_rod(entity, {p.position_W_m.x(), p.position_W_m.y(), 0.0},
                   {p.position_W_m.x(), p.position_W_m.y(), kTall_m}, p.radius_m, kStone);
  }
  for (const Wall& w : scenario.walls) {
    model::add_rod(entity, {w.from_W_m.x(), w.from_W_m.y(), 0.1}, {w.to_W_m.x(), w.to_W_m.y(), 0.1},
                   0.05, kStone);
  }
  for (const Group& group : scenario.groups) {
    const std::vector<double>& xy = group.goals.position_m;
    for (std::size_t i = 0; i + 1 < xy.size(); i += 2) {
      model::add_ball(entity, {xy[i], xy[i + 1], 0.05}, 0.15, kGoal);
    }
  }
}

}  // namespace

std::string fault(const v1::CrowdStates& states, const Scenario& scenario, int coordinators) {
  const int n = states.id_size();
  const bool coordinates = states.coordinator() > 0;
  const bool fits = states.position_in_world_m_size() == 2 * n && states.heading_rad_size() == n &&
                    states.velocity_in_world_m_s_size() == 2 * n && states.phase_rad_size() == n &&
                    states.phase_rate_rad_s_size() == n &&
                    (!coordinates || (states.group_size() == n && states.external_size() == n));
  if (!fits) return fmt::format("{} agents, but lists of other lengths", n);
  const v1::CrowdOwnership& ownership = states.ownership();
  const int members = ownership.member_since_ns_size();
  if (coordinators > 0 && states.has_ownership() &&
      ((members != 0 && members != coordinators) || (members == 0) != (ownership.view_ns() == 0) ||
       ownership.leader() > static_cast<std::uint32_t>(coordinators) ||
       ownership.heard_ns_size() != coordinators ||
       ownership.heard_since_ns_size() != coordinators ||
       (ownership.epoch_size() != 0 && ownership.epoch_size() != n))) {
    return fmt::format("ownership among {} coordinators, but lists of other lengths", coordinators);
  }
  if (!all_within(states.position_in_world_m(), kFar_m) ||
      !all_within(states.velocity_in_world_m_s(), kFast) ||
      !all_within(states.heading_rad(), kTurns_rad) ||
      !all_within(states.phase_rad(), kTurns_rad) ||
      !all_within(states.phase_rate_rad_s(), kFast)) {
    return "a place, speed, angle or rate that no walker has";
  }
  for (const std::uint32_t group : states.group()) {
    if (group >= scenario.groups.size()) {
      return fmt::format("group {}: there are {}", group, scenario.groups.size());
    }
  }
  for (const v1::CrowdSums& sums : states.sums()) {
    if (sums.group() >= scenario.groups.size()) {
      return fmt::format("sums of group {}: there are {}", sums.group(), scenario.groups.size());
    }
    if (!possible(sums, scenario)) {
      return fmt::format("sums of group {}: what {} agents cannot add up to", sums.group(),
                         sums.agents());
    }
  }
  return {};
}

std::string fault(const v1::CrowdHandover& handover, const ScenarioRun& run, int coordinators) {
  const auto is_one = [&](std::uint32_t c) {
    return c >= 1 && c <= static_cast<std::uint32_t>(coordinators);
  };
  if (!is_one(handover.from()) || !is_one(handover.to())) {
    return fmt::format("from coordinator {} to {}: there are {}", handover.from(), handover.to(),
                       coordinators);
  }
  for (const v1::CrowdTraveller& t : handover.agents()) {
    const bool moved_by_us = run.roster().known(t.id()) && run.roster().external(t.id()) < 0;
    if (!moved_by_us || t.group() >= run.scenario().groups.size()) {
      return fmt::format("agent {} of group {}: unknown", t.id(), t.group());
    }
    if (!possible(t, run.scenario().groups[t.group()])) {
      return fmt::format("agent {}: a state that no walker has", t.id());
    }
  }
  return {};
}

void to_proto(const ScenarioRun& run, v1::CrowdStates& states) {
  const Crowd& crowd = run.crowd();
  states.clear_id();
  states.clear_group();
  states.clear_position_in_world_m();
  states.clear_velocity_in_world_m_s();
  states.clear_heading_rad();
  states.clear_phase_rad();
  states.clear_phase_rate_rad_s();
  states.clear_external();
  states.clear_sums();
  for (int g = 0; g < crowd.groups(); ++g) {
    const Crowd::Rows rows = crowd.rows(g);
    for (int row = rows.first; row < rows.first + rows.count; ++row) {
      const auto r = static_cast<std::size_t>(row);
      const Role role = crowd.roles()[r];
      const bool external = run.roster().external(crowd.ids()[r]) >= 0;
      if (role != Role::own && !external) continue;
      states.add_id(crowd.ids()[r]);
      states.add_group(static_cast<std::uint32_t>(g));
      states.add_position_in_world_m(crowd.x_m()[r]);
      states.add_position_in_world_m(crowd.y_m()[r]);
      states.add_velocity_in_world_m_s(crowd.velocity_x_m_s()[r]);
      states.add_velocity_in_world_m_s(crowd.velocity_y_m_s()[r]);
      states.add_heading_rad(crowd.heading_rad()[r]);
      states.add_phase_rad(crowd.phase_rad()[r]);
      const double rate = crowd.phase_rate_rad_s()[r];
      states.add_phase_rate_rad_s(std::isfinite(rate) ? rate : 0.0);
      states.add_external(!external ? 0U : role == Role::external ? 1U : 2U);
    }
    const FarSums own = own_sums(run, g);
    if (own.sums.count == 0.0) continue;
    v1::CrowdSums& sums = *states.add_sums();
    sums.set_group(static_cast<std::uint32_t>(g));
    sums.set_agents(static_cast<std::uint32_t>(own.sums.count));
    sums.set_cos_phase(own.sums.cos_phase);
    sums.set_sin_phase(own.sums.sin_phase);
    sums.set_error_m(own.sums.error_m);
    sums.set_cos_heading(own.sums.cos_heading);
    sums.set_sin_heading(own.sums.sin_heading);
    sums.set_phase_rate_rad_s(own.phase_rate_rad_s);
    sums.set_speed_m_s(own.speed_m_s);
    sums.set_leader(own.sums.leader);
    sums.set_leader_phase_rad(own.sums.leader_phase_rad);
  }
}

namespace {

std::uint64_t ns(Time t) { return static_cast<std::uint64_t>(t.count()); }
Time time(std::uint64_t ns) { return Time(static_cast<Time::rep>(ns)); }

/// Without the agents: to_far.
OwnershipReport from_proto(const v1::CrowdOwnership& in) {
  OwnershipReport report;
  report.since = time(in.since_ns());
  report.settled = in.settled();
  report.view = {.stamp = time(in.view_ns()), .leader = static_cast<int>(in.leader()) - 1};
  for (const std::uint64_t since : in.member_since_ns()) report.view.since.push_back(time(since));
  for (int c = 0; c < in.heard_ns_size(); ++c) {
    report.heard.push_back({time(in.heard_since_ns(c)), time(in.heard_ns(c))});
  }
  return report;
}

}  // namespace

/// Epochs in the order of the agents; all 0, as most of the time, they are left out.
void to_proto(const OwnershipReport& report, v1::CrowdStates& states) {
  v1::CrowdOwnership& out = *states.mutable_ownership();
  out.Clear();
  out.set_since_ns(ns(report.since));
  out.set_view_ns(ns(report.view.stamp));
  out.set_leader(static_cast<std::uint32_t>(report.view.leader + 1));
  out.set_settled(report.settled);
  for (const Time since : report.view.since) out.add_member_since_ns(ns(since));
  for (const OwnershipReport::Heard& heard : report.heard) {
    out.add_heard_since_ns(ns(heard.since));
    out.add_heard_ns(ns(heard.stamp));
  }
  for (const AgentId id : report.offered) out.add_offered(id);
  const auto changed = [](const Claim& claim) { return claim.epoch > 0; };
  if (std::ranges::none_of(report.owned, changed)) return;
  for (const std::uint64_t id : states.id()) {
    const auto claim = std::ranges::lower_bound(report.owned, id, {}, &Claim::id);
    out.add_epoch(claim != report.owned.end() && claim->id == id ? claim->epoch : 0);
  }
}

FarReport to_far(const v1::CrowdStates& states, const Roster& roster) {
  FarReport report;
  report.stamp = time(states.header().stamp_ns());
  const bool begun = states.ownership().view_ns() > 0;
  const auto owned_here = [&](AgentId id) { return roster.known(id) && roster.external(id) < 0; };
  report.ownership = from_proto(states.ownership());
  report.ownership.from = static_cast<int>(states.coordinator()) - 1;
  report.ownership.stamp = report.stamp;
  for (const AgentId id : states.ownership().offered()) {
    if (owned_here(id)) report.ownership.offered.push_back(id);
  }
  report.agents.reserve(static_cast<std::size_t>(states.id_size()));
  for (int i = 0; i < states.id_size(); ++i) {
    FarAgent agent{.id = states.id(i), .group = static_cast<int>(states.group(i))};
    if (!roster.known(agent.id)) continue;
    agent.state.position_W_m = {states.position_in_world_m(2 * i),
                                states.position_in_world_m(2 * i + 1)};
    agent.state.velocity_W_m_s = {static_cast<double>(states.velocity_in_world_m_s(2 * i)),
                                  static_cast<double>(states.velocity_in_world_m_s(2 * i + 1))};
    agent.state.heading_rad = states.heading_rad(i);
    agent.state.phase_rad = states.phase_rad(i);
    agent.state.phase_rate_rad_s = states.phase_rate_rad_s(i);
    agent.external = states.external(i) != 0;
    agent.trusted = states.external(i) != 2;
    if (i < states.ownership().epoch_size()) agent.epoch = states.ownership().epoch(i);
    if (begun && owned_here(agent.id)) {
      report.ownership.owned.push_back({agent.id, agent.epoch});
    }
    report.agents.push_back(agent);
  }
  for (const v1::CrowdSums& s : states.sums()) {
    FarSums far{.group = static_cast<int>(s.group())};
    far.sums = {.count = static_cast<double>(s.agents()),
                .cos_phase = s.cos_phase(),
                .sin_phase = s.sin_phase(),
                .error_m = s.error_m(),
                .cos_heading = s.cos_heading(),
                .sin_heading = s.sin_heading()};
    if (s.has_leader()) far.sums.leader = s.leader();
    far.sums.leader_phase_rad = s.leader_phase_rad();
    far.phase_rate_rad_s = s.phase_rate_rad_s();
    far.speed_m_s = s.speed_m_s();
    report.sums.push_back(far);
  }
  return report;
}

AgentReport to_report(const v1::CrowdStates& states, int i) {
  const Eigen::Vector2d velocity(static_cast<double>(states.velocity_in_world_m_s(2 * i)),
                                 static_cast<double>(states.velocity_in_world_m_s(2 * i + 1)));
  const double heading = states.heading_rad(i);
  return {.p_W_m = {states.position_in_world_m(2 * i), states.position_in_world_m(2 * i + 1)},
          .heading_rad = heading,
          .phase_rad = states.phase_rad(i),
          .phase_rate_rad_s = states.phase_rate_rad_s(i),
          .speed_m_s = velocity.dot(Eigen::Vector2d(std::cos(heading), std::sin(heading)))};
}

AgentState to_state(const AgentReport& report) {
  AgentState state;
  state.position_W_m = report.p_W_m;
  state.velocity_W_m_s = report.speed_m_s * Eigen::Vector2d(std::cos(report.heading_rad),
                                                            std::sin(report.heading_rad));
  state.heading_rad = math::wrap_pi(report.heading_rad);
  state.phase_rad = report.phase_rad;
  state.phase_rate_rad_s = report.phase_rate_rad_s;
  return state;
}

void to_proto(const Traveller& traveller, v1::CrowdTraveller& out) {
  const Agent& agent = traveller.agent;
  const AgentState& s = agent.state;
  const AgentTraits& t = agent.traits;
  out.set_id(agent.id);
  out.set_group(static_cast<std::uint32_t>(traveller.group));
  out.set_x_m(s.position_W_m.x());
  out.set_y_m(s.position_W_m.y());
  out.set_velocity_x_m_s(s.velocity_W_m_s.x());
  out.set_velocity_y_m_s(s.velocity_W_m_s.y());
  out.set_heading_rad(s.heading_rad);
  out.set_phase_rad(s.phase_rad);
  out.set_length(s.length);
  if (std::isfinite(s.phase_rate_rad_s)) out.set_phase_rate_rad_s(s.phase_rate_rad_s);
  if (std::isfinite(s.heading_rate_rad_s)) out.set_heading_rate_rad_s(s.heading_rate_rad_s);
  out.set_smoothed_error_m(s.smoothed_error_m);
  out.set_pressed(static_cast<std::uint32_t>(s.pressed));
  out.set_omega_rad_s(t.omega_rad_s);
  out.set_stride(t.stride);
  out.set_radius_m(t.radius_m);
  out.set_place_m(t.place_m);
  out.set_lane_m(t.lane_m);
  out.set_goal_x_m(t.goal_W_m.x());
  out.set_goal_y_m(t.goal_W_m.y());
  out.set_leg(static_cast<std::uint32_t>(traveller.leg));
  out.set_waiting(traveller.waiting);
}

namespace {

Traveller from_proto(const v1::CrowdTraveller& in) {
  Traveller traveller{.group = static_cast<int>(in.group())};
  traveller.agent.id = in.id();
  AgentState& s = traveller.agent.state;
  s.position_W_m = {in.x_m(), in.y_m()};
  s.velocity_W_m_s = {in.velocity_x_m_s(), in.velocity_y_m_s()};
  s.heading_rad = in.heading_rad();
  s.phase_rad = in.phase_rad();
  s.length = in.length();
  // Absent for "not a number", which ports do not take.
  if (in.has_phase_rate_rad_s()) s.phase_rate_rad_s = in.phase_rate_rad_s();
  if (in.has_heading_rate_rad_s()) s.heading_rate_rad_s = in.heading_rate_rad_s();
  s.smoothed_error_m = in.smoothed_error_m();
  s.pressed = static_cast<int>(std::min<std::uint32_t>(in.pressed(), AgentState::kMostPressed));
  AgentTraits& t = traveller.agent.traits;
  t.omega_rad_s = in.omega_rad_s();
  t.stride = in.stride();
  t.radius_m = in.radius_m();
  t.place_m = in.place_m();
  t.lane_m = in.lane_m();
  t.goal_W_m = {in.goal_x_m(), in.goal_y_m()};
  traveller.leg = static_cast<int>(in.leg());
  traveller.waiting = in.waiting();
  return traveller;
}

}  // namespace

void to_proto(std::span<const Passing> passing, v1::CrowdHandover& out) {
  const Offer& offer = passing.front().offer;
  out.set_from(static_cast<std::uint32_t>(offer.from + 1));
  out.set_to(static_cast<std::uint32_t>(offer.to + 1));
  out.set_view_ns(ns(offer.view.first));
  out.set_leader(static_cast<std::uint32_t>(offer.view.second + 1));
  out.set_until_ns(ns(offer.until));
  out.clear_agents();
  for (const Passing& p : passing) {
    v1::CrowdTraveller& traveller = *out.add_agents();
    to_proto(p.traveller, traveller);
    traveller.set_epoch(p.offer.claim.epoch);
  }
}

std::vector<Passing> from_proto(const v1::CrowdHandover& in) {
  std::vector<Passing> out;
  for (const v1::CrowdTraveller& agent : in.agents()) {
    out.push_back({.traveller = from_proto(agent),
                   .offer = {.from = static_cast<int>(in.from()) - 1,
                             .to = static_cast<int>(in.to()) - 1,
                             .claim = {agent.id(), agent.epoch()},
                             .view = {time(in.view_ns()), static_cast<int>(in.leader()) - 1},
                             .until = time(in.until_ns())},
                   .stamp = time(in.header().stamp_ns())});
  }
  return out;
}

v1::CrowdInfo to_info(const ScenarioRun& run, int coordinators) {
  const Scenario& scenario = run.scenario();
  v1::CrowdInfo info;
  info.set_scenario(scenario.name);
  info.set_coordinators(static_cast<std::uint32_t>(coordinators));
  info.set_agents(static_cast<std::uint32_t>(run.roster().agents()));
  for (const Group& group : scenario.groups) {
    info.add_groups(group.name);
    info.add_gaits(group.gait);
  }
  for (int e = 0; e < run.roster().externals(); ++e) {
    info.add_external_names(scenario.externals[static_cast<std::size_t>(e)].name);
    info.add_external_ids(run.roster().external_id(e));
  }
  return info;
}

v1::CrowdTrust to_proto(Trust trust) {
  switch (trust) {
    case Trust::trusted:
      return v1::CROWD_TRUST_TRUSTED;
    case Trust::lagging:
      return v1::CROWD_TRUST_LAGGING;
    case Trust::absent:
      break;
  }
  return v1::CROWD_TRUST_ABSENT;
}

foxglove::SceneUpdate paint(const Scenario& scenario, std::span<const Observed> agents,
                            std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  paint_still(scenario, model::add_entity(update, "place", "world", stamp));
  for (std::size_t g = 0; g < scenario.groups.size(); ++g) {
    const Rgba& color = kGroups[g % kGroups.size()];
    foxglove::SceneEntity& entity =
        model::add_entity(update, "group/" + scenario.groups[g].name, "world", stamp);
    foxglove::LinePrimitive& strokes =
        model::add_line(entity, foxglove::LinePrimitive::LINE_LIST, kStroke_px, color);
    for (const Observed& agent : agents) {
      if (agent.group != static_cast<int>(g)) continue;
      const Eigen::Vector3d p(agent.p_W_m.x(), agent.p_W_m.y(), 0.0);
      const Eigen::Vector3d ahead(std::cos(agent.heading_rad), std::sin(agent.heading_rad), 0.0);
      model::add_point(strokes, p);
      model::add_point(strokes, p + kStroke_m * ahead);
      if (agents.size() > kMostDiscs) continue;
      model::add_rod(entity, p, p + Eigen::Vector3d(0.0, 0.0, 0.05), scenario.groups[g].radius_m,
                     color);
    }
  }
  return update;
}

}  // namespace mimesis::crowd
