#include "nodes/crowd/crowd_peers.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "nodes/crowd/crowd_messages.h"

namespace mimesis::crowd {

Peers::Peers(const CrowdParams& params, runtime::Bus& bus, ScenarioRun& run)
    : regions_(params.regions),
      map_(regions_.map()),
      settings_(params.far()),
      run_(run),
      far_(settings_, run_),
      peers_(static_cast<std::size_t>(count())),
      peers_in_(bus, "peers", count() == 1),
      handovers_in_(bus, "handovers", count() == 1),
      handovers_(bus, "handover") {}

std::vector<std::string> Peers::take(Time now, Time state_time) {
  far_.begin_step(run_, now);
  while (const auto states = peers_in_.pop()) take_states(*states, now);
  std::vector<std::string> troubles;
  while (const auto handover = handovers_in_.pop()) {
    const auto from = static_cast<int>(handover->from());
    if (from == regions_.own) continue;
    if (const std::string why = fault(*handover, run_, count()); !why.empty()) {
      if (bad_handovers_.pass()) runtime::warn("handover: {}; ignored", why);
      continue;
    }
    for (const Passing& passing : from_proto(*handover)) {
      try {
        taken_ += far_.hear(run_, passing, state_time) ? 1 : 0;
      } catch (const ConfigError& e) {
        troubles.push_back(fmt::format("agent {} of coordinator {} cannot come: {}",
                                       passing.offer.claim.id, from, e.what()));
      }
    }
  }
  return troubles;
}

void Peers::take_states(const v1::CrowdStates& states, Time now) {
  const auto from = static_cast<int>(states.coordinator());
  if (from == regions_.own) return;
  std::string why = fault(states, run_.scenario(), count());
  if (from < 1 || from > count()) why = fmt::format("there is no coordinator {}", from);
  const Time stamp(states.header().stamp_ns());
  if (std::max(stamp, Time(states.ownership().view_ns())) >
      now + runtime::from_seconds(regions_.stale_s)) {
    why = "they are of the future";  // would hide all that comes after them
  }
  if (!why.empty()) {
    if (bad_states_.pass()) runtime::warn("states of coordinator {}: {}; ignored", from, why);
    return;
  }
  Peer& peer = peers_[static_cast<std::size_t>(from - 1)];
  peer.time_s = states.time_s();
  peer.contacts.collisions = states.collisions();
  if (states.has_least_gap_m()) peer.contacts.least_gap_m = states.least_gap_m();
  if (states.has_least_distance_m()) peer.contacts.least_distance_m = states.least_distance_m();
  far_.hear(from - 1, to_far(states, run_.roster()));
}

std::string Peers::waits(Time now) {
  if (far_.started()) {
    double time_s = 0.0;
    for (const Peer& peer : peers_) time_s = std::max(time_s, peer.time_s);
    if (time_s > 0.0 && !far_.member(regions_.own - 1)) {
      run_.join(time_s);
      runtime::info("the others are at work since {:.1f} s: they hand over who is here", time_s);
    }
    return {};
  }
  std::string missing;
  for (int c = 0; c < count(); ++c) {
    if (c + 1 == regions_.own || far_.heard(c, now)) continue;
    missing += fmt::format("{}{}", missing.empty() ? "" : ", ", c + 1);
  }
  return missing.empty() ? "waits until all coordinators hear each other"
                         : "waits for coordinator " + missing;
}

Peers::Shared Peers::share(Time state_time) {
  const int own = regions_.own - 1;
  Shared shared;
  if (!far_.started()) first_ = own == 0;
  const FarCrowd::Decided decided = far_.decide(run_, state_time);
  if (!far_.started()) return shared;
  const bool was_first = first_;
  there_.assign(static_cast<std::size_t>(count()), false);
  for (int c = 0; c < count(); ++c) there_[static_cast<std::size_t>(c)] = far_.member(c);
  first_ = std::ranges::find(there_, true) - there_.begin() == own;
  taken_ += static_cast<std::uint64_t>(decided.taken);
  if (!decided.trouble.empty()) shared.troubles.push_back("an agent stands: " + decided.trouble);
  for (const FarCrowd::Left& left : decided.left) {
    const std::string what =
        fmt::format("coordinator {} fell silent, {} has its region", left.coordinator + 1,
                    map_.heir(left.coordinator, there_) + 1);
    runtime::warn("{}", what);
    shared.changed = true;
    for (const int g : left.groups) shared.disturbed.emplace_back(g, what);
  }
  shared.changed |= first_ != was_first;
  return shared;
}

void Peers::hand_over(Time now) {
  if (count() == 1) return;
  const Crowd& crowd = run_.crowd();
  const int own = regions_.own - 1;
  std::vector<std::pair<int, AgentId>> leaving;
  for (std::size_t r = 0; r < crowd.ids().size(); ++r) {
    if (crowd.roles()[r] != Role::own) continue;
    const int to =
        map_.heir(map_.owner(own, {crowd.x_m()[r], crowd.y_m()[r]}, regions_.margin_m), there_);
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

void Peers::describe(v1::CrowdStates& states, Time now) const {
  std::uint32_t hears = 1;
  for (int c = 0; c < count(); ++c) {
    hears += c + 1 != regions_.own && far_.heard(c, now) ? 1 : 0;
  }
  states.set_coordinator(static_cast<std::uint32_t>(regions_.own));
  states.set_hears(hears);
  if (count() > 1) to_proto(far_.report(), states);
}

void Peers::describe(v1::CrowdStatus& status) const {
  status.set_coordinator(static_cast<std::uint32_t>(regions_.own));
  status.set_seen(static_cast<std::uint32_t>(far_.taken_into_account()));
  status.set_given(given_);
  status.set_taken(taken_);
}

Peers::Contacts Peers::contacts() const {
  Contacts all;
  for (const Peer& peer : peers_) {
    all.collisions += peer.contacts.collisions;
    all.least_gap_m = std::min(all.least_gap_m, peer.contacts.least_gap_m);
    all.least_distance_m = std::min(all.least_distance_m, peer.contacts.least_distance_m);
  }
  return all;
}

}  // namespace mimesis::crowd
