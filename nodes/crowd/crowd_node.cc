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
  take_peers(now);
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
    if (const std::string why = far_.import(run_, state_time); !why.empty()) say(why);
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

}  // namespace mimesis::crowd
