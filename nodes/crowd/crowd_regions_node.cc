// Several coordinators share the plane: what they say, who walks from one to another, who is
// missed.
#include <algorithm>

#include "common/error.h"
#include "nodes/crowd/crowd_node.h"

namespace mimesis::crowd {

void CrowdNode::take_peers(Time now) {
  while (auto states = peers_in_.pop()) {
    const auto from = static_cast<int>(states->coordinator());
    if (from == params_.regions.own) continue;
    std::string why = fault(*states, run_.scenario());
    if (from < 1 || from > coordinators()) why = fmt::format("there is no coordinator {}", from);
    const Time stamp(states->header().stamp_ns());
    if (stamp > now + runtime::from_seconds(params_.regions.stale_s)) {
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
