#include "nodes/crowd/crowd_node.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/runtime/outside.h"

namespace mimesis::crowd {
namespace {

using runtime::Time;

TrustSettings trust_of(TrustSettings settings, const Scenario& scenario) {
  settings.stale_s = scenario.stale_s;
  if (settings.forget_s < settings.stale_s) {
    throw ConfigError("crowd.trust.forget_s: less than the scenario's stale_s");
  }
  return settings;
}

/// The agent that a robot is, if there is one.
void check(const RobotParams& robot, const Roster& roster) {
  if (robot.agent < roster.externals()) return;
  throw ConfigError(fmt::format("crowd.robot.agent: {} of {} external agents, they count from 0",
                                robot.agent, roster.externals()));
}

ScenarioRun start(const CrowdParams& params, const RegionMap& map) {
  return ScenarioRun(params.read_scenario(),
                     [&, own = params.regions.own - 1](const auto& p) { return map.of(p) == own; });
}

}  // namespace

void CrowdNode::Took::add(double s, int agents) {
  mean_s += (s - mean_s) / static_cast<double>(++steps);
  worst_s = std::max(worst_s, s);
  sum_s += s;
  agent_steps += agents;
}

CrowdNode::CrowdNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      bus_(bus),
      period_(runtime::from_seconds(1.0 / params.rate_hz)),
      map_(params.regions.map()),
      far_settings_(params.far()),
      run_(start(params, map_)),
      far_(far_settings_, run_),
      externals_(run_.roster().externals(), trust_of(params.trust, run_.scenario())),
      watch_(run_),
      peers_(static_cast<std::size_t>(far_settings_.coordinators)),
      external_reasons_(static_cast<std::size_t>(run_.roster().externals())),
      peers_in_(bus, "peers"),
      handovers_in_(bus, "handovers"),
      agents_in_(bus, "agents"),
      characters_in_(bus, "characters"),
      robot_in_(bus, "robot"),
      styles_in_(bus, "style"),
      states_(bus, "states"),
      handovers_(bus, "handover"),
      command_(bus, "command"),
      style_(bus, "wish"),
      certificate_(bus, "certificate"),
      status_(bus, "status"),
      outcome_(bus, "outcome"),
      info_(bus, "info", {.latched = true}),
      scene_(bus, "scene") {
  if (params.threads > 1) team_.emplace(params.threads);
  check(params.robot, run_.roster());
  const Scenario& scenario = run_.scenario();
  to_proto(run_, states_message_);
  runtime::info("scenario '{}': {} agents in {} groups, {} may come from outside; {} begin here",
                scenario.name, run_.roster().agents(), scenario.groups.size(),
                run_.roster().externals(), states_message_.id_size());
}

void CrowdNode::step(Time now) {
  if (steps_ == 0) {
    v1::CrowdInfo info = to_info(run_, coordinators());
    info_.send(info, now);
  }
  ++steps_;
  const auto begin = std::chrono::steady_clock::now();
  const Time state_time = now - period_;  // of the run and of what others sent last
  take_peers();
  take_handovers(state_time);
  take_agents(now);
  take_characters(now);
  take_robot(now);
  take_styles();
  first_ = params_.regions.own == 1;
  if (!runs_ && (join_others(now) || all_here(now))) {
    runs_ = status_changed_ = true;
    reason_.clear();
  }
  if (runs_) {
    look_after_orphans(now, state_time);
    far_.import(run_, state_time);
    judge_externals(now, state_time);
    observe();
    if (!ended_ && run_.time_s() >= run_.scenario().until_s - 0.5 * run_.crowd().dt_s()) {
      ended_ = true;
      publish_outcome(now);
    }
    advance();
    hand_over(now);
  }
  publish_states(now);
  publish_commands(now);
  publish_styles(now);
  publish_scene(now);
  publish_certificate(now);
  publish_status(now);
  if (!runs_) return;
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  took_.add(runtime::read_outside_value<double>(bus_, "step", elapsed), run_.crowd().size());
}

void CrowdNode::take_peers() {
  while (auto states = peers_in_.pop()) {
    const auto from = static_cast<int>(states->coordinator());
    if (from == params_.regions.own) continue;
    std::string why = fault(*states, run_.scenario());
    if (from < 1 || from > coordinators()) why = fmt::format("there is no coordinator {}", from);
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
    const auto from = static_cast<int>(handover->from()), to = static_cast<int>(handover->to());
    if (from == params_.regions.own) continue;
    if (const std::string why = fault(*handover, run_, coordinators()); !why.empty()) {
      if (bad_handovers_.pass()) runtime::warn("handover: {}; ignored", why);
      continue;
    }
    const Time stamp(handover->header().stamp_ns());
    for (const v1::CrowdTraveller& traveller : handover->agents()) {
      if (to != params_.regions.own) {
        far_.pass(from_proto(traveller), to - 1, stamp);
        continue;
      }
      try {
        far_.take(run_, from_proto(traveller), stamp, state_time);
        ++taken_;
      } catch (const ConfigError& e) {
        say(fmt::format("agent {} of coordinator {} cannot come: {}", traveller.id(), from,
                        e.what()));
      }
    }
  }
}

/// All coordinators hear all, so that all begin at the same time.
bool CrowdNode::all_here(Time now) {
  bool all = true;
  std::string missing;
  for (int c = 0; c < coordinators(); ++c) {
    const bool own = c + 1 == params_.regions.own;
    const Peer& peer = peers_[static_cast<std::size_t>(c)];
    if (!own && !far_.heard(c, now)) {
      missing += fmt::format("{}{}", missing.empty() ? "" : ", ", c + 1);
    }
    all = all && static_cast<int>(own ? states_message_.hears() : peer.hears) == coordinators();
  }
  if (coordinators() == 1) return true;
  reason_ = missing.empty() ? "waits until all coordinators hear each other"
                            : "waits for coordinator " + missing;
  return all && missing.empty();
}

/// Started again while the others walk: they have looked after our region, and hand it back.
bool CrowdNode::join_others(Time now) {
  double time_s = 0.0;
  for (int c = 0; c < coordinators(); ++c) {
    if (far_.heard(c, now)) time_s = std::max(time_s, peers_[static_cast<std::size_t>(c)].time_s);
  }
  if (time_s <= params_.regions.stale_s) return false;
  far_.abandon(run_);
  run_.join(time_s);
  runtime::info("the others are at work since {:.1f} s: they hand over who is here", time_s);
  return true;
}

/// Who falls silent is missed: its agents go on with the coordinator of the nearest region, from
/// where it last had them.
void CrowdNode::look_after_orphans(Time now, Time state_time) {
  const int own = params_.regions.own - 1;
  there_.assign(static_cast<std::size_t>(coordinators()), false);
  for (int c = 0; c < coordinators(); ++c) {
    there_[static_cast<std::size_t>(c)] = c == own || far_.heard(c, now);
  }
  const bool was_first = first_;
  first_ = std::ranges::find(there_, true) - there_.begin() == own;
  for (const FarCrowd::Orphans& orphans : far_.take_orphans(run_, state_time)) {
    const int heir = map_.heir(orphans.coordinator, there_);
    const std::string what = fmt::format("coordinator {} fell silent, {} has its region",
                                         orphans.coordinator + 1, heir + 1);
    runtime::warn("{}; agents that it had: {}", what, orphans.agents.size());
    status_changed_ = true;
    std::vector<int> groups;
    for (const Traveller& agent : orphans.agents) {
      groups.push_back(agent.group);
      if (heir != own) continue;
      try {
        far_.adopt(run_, agent, state_time);
        ++taken_;
      } catch (const ConfigError& e) {
        say(fmt::format("agent {} of coordinator {} is lost: {}", agent.agent.id,
                        orphans.coordinator + 1, e.what()));
      }
    }
    std::ranges::sort(groups);
    groups.erase(std::ranges::unique(groups).begin(), groups.end());
    for (const int g : groups) watch_.disturb(run_, g, what);
  }
  if (first_ && !was_first) status_changed_ = true;
}

/// Everybody at the time of the run's present state.
void CrowdNode::observe() {
  everybody_.clear();
  const Crowd& crowd = run_.crowd();
  const auto known = [&](AgentId id, int group) {
    const AgentTraits& t = run_.roster().start(id).traits;
    Observed o{.id = id, .group = group};
    o.place_m = t.place_m;
    o.lane_m = t.lane_m;
    o.radius_m = t.radius_m;
    o.goal_W_m = t.goal_W_m;
    return o;
  };
  for (int g = 0; g < crowd.groups(); ++g) {
    const Crowd::Rows rows = crowd.rows(g);
    for (int row = rows.first; row < rows.first + rows.count; ++row) {
      const auto r = static_cast<std::size_t>(row);
      const AgentId id = crowd.ids()[r];
      const bool external = run_.roster().external(id) >= 0;
      if (crowd.roles()[r] != Role::own && !(external && first())) continue;
      Observed o = known(id, g);
      o.coupled = is_coupled(crowd.roles()[r]);
      o.external = external;
      o.p_W_m = {crowd.x_m()[r], crowd.y_m()[r]};
      o.heading_rad = crowd.heading_rad()[r];
      o.phase_rad = crowd.phase_rad()[r];
      o.avoid_rad_s = crowd.avoidance_rad_s(row);
      if (crowd.group(g).rules.heading.kind == HeadingKind::goal) {
        o.goal_W_m = crowd.agent(row).traits.goal_W_m;
      }
      everybody_.push_back(o);
    }
  }
  const std::size_t own = everybody_.size();
  for (const FarAgent& agent : far_.agents()) {
    Observed o = known(agent.id, agent.group);
    o.coupled = agent.trusted;
    o.external = agent.external;
    o.p_W_m = agent.state.position_W_m;
    o.heading_rad = agent.state.heading_rad;
    o.phase_rad = agent.state.phase_rad;
    everybody_.push_back(o);
  }
  if (everybody_.size() > own) {
    std::ranges::sort(everybody_, {}, [](const Observed& o) { return std::pair(o.group, o.id); });
  }
  if (first()) watch_.observe(run_, run_.time_s(), everybody_);
  count_near();
}

/// Pairs with an agent of ours; each pair is counted by one coordinator.
void CrowdNode::count_near() {
  discs_.clear();
  for (const Observed& o : everybody_) {
    const auto far = std::ranges::lower_bound(far_.agents(), o.id, {}, &FarAgent::id);
    const bool ours = far == far_.agents().end() || far->id != o.id;
    discs_.push_back({o.id, o.p_W_m.x(), o.p_W_m.y(), o.radius_m, ours});
  }
  closeness_.observe(discs_);
}

void CrowdNode::advance() {
  try {
    run_.step(team_ ? &*team_ : nullptr);
  } catch (const ConfigError& e) {
    say(e.what());
  }
}

void CrowdNode::say(const std::string& trouble) {
  if (trouble == trouble_) return;
  runtime::warn("{}", trouble);
  trouble_ = trouble;
  status_changed_ = true;
}

/// Who has walked out of our region goes to the coordinator of the next, if that is there.
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
  v1::CrowdHandover message;
  const auto send = [&] {
    if (message.agents_size() > 0) handovers_.send(message, now);
    message.clear_agents();
  };
  for (const auto& [to, id] : leaving) {
    if (static_cast<int>(message.to()) != to + 1) send();
    message.set_from(static_cast<std::uint32_t>(own + 1));
    message.set_to(static_cast<std::uint32_t>(to + 1));
    if (const auto traveller = far_.give(run_, id, to, now)) {
      to_proto(*traveller, *message.add_agents());
      ++given_;
    }
  }
  send();
}

}  // namespace mimesis::crowd
