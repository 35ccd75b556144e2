#include "nodes/crowd/regions/ownership.h"

#include <algorithm>

#include "common/error.h"

namespace mimesis::crowd {

Ownership::Ownership(const OwnershipSettings& settings, int agents, std::vector<AgentId> start)
    : settings_(settings),
      start_(std::move(start)),
      entries_(static_cast<std::size_t>(agents) + 1),
      peers_(static_cast<std::size_t>(settings.coordinators)) {}

/// Half of the coordinators are a majority if coordinator 0 is among them: any two majorities have
/// a member in common.
bool Ownership::majority(int members, bool with_first) const {
  return 2 * members > settings_.coordinators ||
         (2 * members == settings_.coordinators && with_first);
}

/// Newest report of b that a has told us to have; long ago if it has none.
Time Ownership::heard(int a, int b) const {
  const auto& theirs = peer(a).report.heard;
  const Time stamp = a == settings_.own ? peer(b).report.stamp
                     : theirs.empty()   ? Time{}
                                        : theirs[static_cast<std::size_t>(b)].stamp;
  return stamp == Time{} ? Time::min() / 2 : stamp;
}

/// We may own agents until this time: a majority had our reports `stale` before. No later majority
/// can leave us out and give our agents away before (settle).
Time Ownership::lease_end() const {
  std::vector<std::pair<Time, int>> acked;
  for (int c = 0; c < settings_.coordinators; ++c) {
    acked.emplace_back(c == settings_.own ? now_ : peer(c).acked, c);
  }
  std::ranges::sort(acked, std::greater<>());
  bool with_first = false;
  for (std::size_t k = 0; k < acked.size(); ++k) {
    with_first |= acked[k].second == 0;
    if (majority(static_cast<int>(k) + 1, with_first)) return acked[k].first + settings_.stale;
  }
  return {};
}

/// A new life: nothing is ours.
void Ownership::drop(Time after) {
  for (Entry& entry : entries_) entry = {};
  for (Peer& p : peers_) p.acked = {};
  held_ = 0;
  orphans_.clear();
  since_ = std::max({now_, after + Time(1), since_ + Time(1)});
}

/// What came since the last step cannot fill a gap between: somebody else may have acted in it.
void Ownership::begin_step(Time now) {
  now_ = now;
  if (since_ == Time{}) since_ = std::max(now, Time(1));  // zero is none
  if (held_ > 0 && now > lease_end()) drop(view_.stamp);
}

void Ownership::hear(const OwnershipReport& report) {
  Peer& p = peer(report.from);
  if (report.stamp <= p.report.stamp) return;
  if (report.view.id() > view_.id()) enter(report.view);
  // One that our view has left out is not acknowledged before it knows: its lease has to end.
  const bool counts = view_.has(report.from, report.since);
  if (report.view.id() < view_.id() && !counts) return;
  p.report = report;
  const OwnershipReport::Heard& ours = report.heard[static_cast<std::size_t>(settings_.own)];
  if (ours.since == since_ && ours.stamp <= now_ && (counts || !started())) {
    p.acked = std::max(p.acked, ours.stamp);
  }
  settled_ |= report.settled && report.view.id() == view_.id();
  for (const Claim& claim : report.owned) {
    Entry& entry = entries_[claim.id];
    const bool arrived = entry.state == State::offered && entry.peer == report.from;
    const bool known = entry.state == State::elsewhere && report.view.id() == view_.id();
    if ((!arrived && !known) || claim.epoch < entry.epoch) continue;
    held_ -= arrived ? 1 : 0;
    entry = {.epoch = claim.epoch};
  }
}

/// Reports and offers of older views count no more, so that epochs may begin anew.
void Ownership::enter(const View& view) {
  const bool member = view.has(settings_.own, since_), first = view.leader < 0;
  if (!member || (!started() && !first)) drop(view.stamp);
  const auto stays = [&](int c) {
    return c >= 0 && view_.has(c, view.since[static_cast<std::size_t>(c)]);
  };
  for (Entry& entry : entries_) {
    if (entry.state == State::owned) {
      if (!stays(entry.peer)) entry.peer = -1;
    } else if (entry.state == State::elsewhere) {
      entry.epoch = 0;
    } else if (!stays(entry.peer)) {  // it may have taken it: nobody's, for the new leader
      entry = {};
      --held_;
    }
  }
  if (member && !started()) {
    for (const AgentId id : first ? start_ : std::vector<AgentId>{}) {
      entries_[id] = {.epoch = 0, .state = State::owned};
      ++held_;
    }
  }
  view_ = view;
  settled_ = first;
  orphans_.clear();
}

/// One that an earlier view began waits until this one is settled: its leader has to see all
/// agents.
bool Ownership::acceptable(const Offer& offer) const {
  const Entry& entry = entries_[offer.claim.id];
  return offer.to == settings_.own && offer.view == view_.id() && settled_ && now_ < offer.until &&
         may_own() && entry.state == State::elsewhere && offer.claim.epoch > entry.epoch;
}

void Ownership::take(const Offer& offer) {
  entries_[offer.claim.id] = {
      .epoch = offer.claim.epoch, .state = State::owned, .peer = offer.from, .time = now_};
  ++held_;
}

void Ownership::adopt(AgentId id) {
  Entry& entry = entries_[id];
  entry = {.epoch = entry.epoch + 1, .state = State::owned};
  ++held_;
  std::erase(orphans_, id);
}

/// It reported after the end of the offer, and does not have the agent. It cannot have passed it on
/// before we knew that it had it (can_offer).
bool Ownership::refused(AgentId id) const {
  const Entry& entry = entries_[id];
  return entry.state == State::offered && may_own() &&
         view_.has(entry.peer, peer(entry.peer).report.since) &&
         peer(entry.peer).report.stamp >= entry.time;
}

void Ownership::take_back(AgentId id) {
  entries_[id] = {.epoch = entries_[id].epoch + 1, .state = State::owned};
}

bool Ownership::can_offer(AgentId id, int to) const {
  const Entry& entry = entries_[id];
  const OwnershipReport& target = peer(to).report;
  return entry.state == State::owned && settled_ && may_own() && to != settings_.own &&
         view_.has(to, target.since) && now_ - target.stamp <= settings_.stale &&
         (entry.peer < 0 || peer(entry.peer).acked >= entry.time);
}

Offer Ownership::offer(AgentId id, int to) {
  Entry& entry = entries_[id];
  entry = {.epoch = entry.epoch + 1,
           .state = State::offered,
           .peer = to,
           .time = now_ + settings_.stale};
  return repeat(id);
}

Offer Ownership::repeat(AgentId id) const {
  const Entry& entry = entries_[id];
  return {.from = settings_.own,
          .to = entry.peer,
          .claim = {id, entry.epoch},
          .view = view_.id(),
          .until = entry.time};
}

OwnershipReport Ownership::report() const {
  OwnershipReport out{
      .from = settings_.own, .stamp = now_, .since = since_, .view = view_, .settled = settled_};
  for (const Peer& p : peers_) out.heard.push_back({p.report.since, p.report.stamp});
  for (AgentId id = 1; id < entries_.size(); ++id) {
    if (owns(id)) out.owned.push_back({id, epoch(id)});
    if (offered(id)) out.offered.push_back(id);
  }
  return out;
}

void Ownership::decide() {
  if (!started()) return begin_with_all();
  propose();
  settle();
}

/// The first view: all have heard each other, in their present lives, and nobody knows of a view.
/// All come to the same one, each by itself: two with different lives of a coordinator would each
/// need a report of the other that acknowledges another one.
void Ownership::begin_with_all() {
  View all{.stamp = {}, .leader = -1, .since = std::vector<Time>(peers_.size())};
  const auto life = [this](int c) { return c == settings_.own ? since_ : peer(c).report.since; };
  for (int a = 0; a < settings_.coordinators; ++a) {
    const OwnershipReport& theirs = peer(a).report;
    const bool other = a != settings_.own;
    if (other && now_ - heard(settings_.own, a) > settings_.stale) return;
    for (int b = 0; other && b < settings_.coordinators; ++b) {
      if (b != a && theirs.heard[static_cast<std::size_t>(b)].since != life(b)) return;
    }
    all.since[static_cast<std::size_t>(a)] = life(a);
    all.stamp = std::max(all.stamp, life(a));
  }
  enter(all);
}

/// We hear each other.
bool Ownership::linked(int c) const {
  return now_ - heard(settings_.own, c) <= settings_.stale &&
         now_ - heard(c, settings_.own) <= 2 * settings_.stale;
}

/// Those of us who all hear each other: the worst connected are left out.
std::vector<int> Ownership::reachable() const {
  std::vector<int> members;
  for (int c = 0; c < settings_.coordinators; ++c) {
    if (c == settings_.own || linked(c)) members.push_back(c);
  }
  const auto apart = [&](int a, int b) {
    const Time limit = now_ - 2 * settings_.stale;
    const bool with_us = a == settings_.own || b == settings_.own;
    return a != b && !with_us && (heard(a, b) < limit || heard(b, a) < limit);
  };
  for (;;) {
    int worst = -1;
    std::ptrdiff_t most = 0;
    for (const int a : members) {
      const auto gaps = std::ranges::count_if(members, [&](int b) { return apart(a, b); });
      if (gaps > 0 && gaps >= most) most = gaps, worst = a;
    }
    if (worst < 0) return members;
    std::erase(members, worst);
  }
}

/// The view's members change it, of them the first that is alive, as far as somebody of us knows.
/// If none of them is left, any other may.
bool Ownership::leads(const std::vector<int>& members) const {
  const auto alive = [&](int c, int who) { return now_ - heard(who, c) <= settings_.stale; };
  const auto listed = [&](int c) {
    return c == settings_.own ? member() : view_.has(c, peer(c).report.since);
  };
  for (int c = 0; c < settings_.coordinators; ++c) {
    if (c == settings_.own || peer(c).report.view.stamp == Time{}) continue;
    if (!member() && listed(c) && alive(c, settings_.own)) return false;
    const bool before_us = c < settings_.own && listed(c) == member();
    const bool there = before_us && std::ranges::any_of(members, [&](int who) {
                         return who != c && alive(c, who);
                       });
    if (there && now_ - wanted_since_ <= 2 * settings_.stale) return false;
  }
  return true;
}

void Ownership::propose() {
  const std::vector<int> members = reachable();
  View next{.stamp = std::max(now_, view_.stamp + Time(1)),
            .leader = settings_.own,
            .since = std::vector<Time>(peers_.size())};
  for (const int c : members) {
    const Time since = c == settings_.own ? since_ : peer(c).report.since;
    next.since[static_cast<std::size_t>(c)] = since;
    next.stamp = std::max(next.stamp, since);
  }
  const bool wanted =
      next.since != view_.since && majority(static_cast<int>(members.size()), members.front() == 0);
  if (!wanted) wanted_since_ = now_;
  if (wanted && leads(members)) enter(next);
}

/// Finds who has no owner, once nobody else can have one. Members report in this view what they own
/// and neither give nor take before it is settled. One that is left out owned agents at c, the time
/// until which we know, only if a majority had its reports of c − stale; one of them is a member
/// here and has not, or has ended its earlier life by then.
void Ownership::settle() {
  if (settled_ || view_.leader != settings_.own || !may_own()) return;
  std::vector<bool> held(entries_.size(), false);
  Time c = now_;
  for (int r = 0; r < settings_.coordinators; ++r) {
    const OwnershipReport& theirs = peer(r).report;
    if (r == settings_.own || view_.since[static_cast<std::size_t>(r)] == Time{}) continue;
    if (theirs.view.id() != view_.id() || !view_.has(r, theirs.since)) return;
    c = std::min(c, theirs.stamp);
    for (const Claim& claim : theirs.owned) held[claim.id] = true;
    for (const AgentId id : theirs.offered) held[id] = true;
  }
  for (std::size_t j = 0; j < peers_.size(); ++j) {
    if (view_.since[j] != Time{}) continue;
    Time last{};
    bool ended = false;  // its life: somebody heard of the next
    for (int r = 0; r < settings_.coordinators; ++r) {
      const Time since = view_.since[static_cast<std::size_t>(r)];
      if (since == Time{}) continue;
      const OwnershipReport& theirs = r == settings_.own ? peers_[j].report : peer(r).report;
      const OwnershipReport::Heard of_j =
          r == settings_.own ? OwnershipReport::Heard{theirs.since, theirs.stamp} : theirs.heard[j];
      ended |= of_j.since > view_.stamp;
      last = std::max({last, of_j.stamp, since});
    }
    if (!ended && c <= last + settings_.stale + settings_.slack) return;
  }
  settled_ = true;
  for (AgentId id = 1; id < entries_.size(); ++id) {
    if (!held[id] && entries_[id].state == State::elsewhere) orphans_.push_back(id);
  }
}

}  // namespace mimesis::crowd
