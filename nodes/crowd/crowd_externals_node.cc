// Agents that other processes move: port `agents`, who of them is trusted, what is wished of them.
#include <cmath>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/crowd/crowd_node.h"

namespace mimesis::crowd {

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

/// What the crowd wishes of its external agents: that they walk as the rules would move them.
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

}  // namespace mimesis::crowd
