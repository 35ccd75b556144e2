#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "common/time.h"
#include "nodes/crowd/engine/agent.h"

namespace mimesis::crowd {

/// The coordinators that may own agents, each since a time that names its present life: a restart
/// and the loss of its agents begin a new one. Views are ordered by stamp, then leader.
struct View {
  Time stamp{};     ///< when it was proposed; zero: none yet
  int leader = -1;  ///< who proposed it, from 0; −1: the first view, of all at the start
  std::vector<Time> since{};  ///< lives of the members, by coordinator; zero: not a member

  std::pair<Time, int> id() const { return {stamp, leader}; }
  bool has(int coordinator, Time life) const {
    const auto c = static_cast<std::size_t>(coordinator);
    return c < since.size() && life != Time{} && since[c] == life;
  }
};

/// An agent and the number of times that it changed its owner in this view.
struct Claim {
  AgentId id = 0;
  std::uint32_t epoch = 0;
};

/// What a coordinator reports every step about ownership.
struct OwnershipReport {
  /// The newest report that it has of another coordinator: an acknowledgement.
  struct Heard {
    Time since{}, stamp{};
  };
  int from = 0;           ///< from 0
  Time stamp{}, since{};  ///< time of the report; life of the sender
  View view{};
  bool settled = false;        ///< all agents have an owner, who may hand them over
  std::vector<Heard> heard{};  ///< by coordinator
  std::vector<Claim> owned{};  ///< agents that it moves
  std::vector<AgentId>
      offered{};  ///< agents that it has offered and that stand until that is settled
};

/// An agent offered to another coordinator, in a view.
struct Offer {
  int from = 0, to = 0;
  Claim claim{};  ///< with its new epoch
  std::pair<Time, int> view{};
  Time until{};  ///< not to be taken at this time or later
};

struct OwnershipSettings {
  int coordinators = 1;
  int own = 0;
  /// A coordinator silent for this long is left out of the next view; one that no majority has
  /// acknowledged for this long owns nothing any more. Offers are valid for as long.
  Time stale = std::chrono::milliseconds(500);
  /// Twice the largest offset between two clocks, and one step.
  Time slack = std::chrono::milliseconds(24);
};

/// Which coordinator owns an agent, and so may move it: at most one at any time, whatever messages
/// are lost, late, doubled or out of order, for any partition and restart, if clocks run alike and
/// differ by less than `slack`. Pure: time and messages in, messages out. See docs/crowd.md for
/// the protocol and why it is safe.
///
/// A step: begin_step, then hear and take for each message, decide, then adopt, take_back and
/// offer, then report. Nothing allocates per agent after the constructor.
class Ownership {
 public:
  /// @param start  agents of 1..agents that are ours if the first view begins with us
  Ownership(const OwnershipSettings& settings, int agents, std::vector<AgentId> start);

  void begin_step(Time now);
  /// A report; those older than the last of the same coordinator are passed over.
  void hear(const OwnershipReport& report);
  /// The offer is to us and can be taken now.
  bool acceptable(const Offer& offer) const;
  void take(const Offer& offer);
  /// Begins, proposes a view, finds agents without an owner, as far as it is ours to do so.
  void decide();

  /// Agents that nobody owns, for us to adopt: first of this view's leader.
  const std::vector<AgentId>& orphans() const { return orphans_; }
  void adopt(AgentId id);
  /// An agent that we offered, and that will never be taken.
  bool refused(AgentId id) const;
  void take_back(AgentId id);

  /// Whether the agent can be offered to a coordinator now.
  bool can_offer(AgentId id, int to) const;
  Offer offer(AgentId id, int to);
  /// The offer, to be sent again. Precondition: offered(id).
  Offer repeat(AgentId id) const;

  OwnershipReport report() const;

  bool started() const { return view_.stamp != Time{}; }
  bool owns(AgentId id) const { return entries_[id].state == State::owned; }
  bool offered(AgentId id) const { return entries_[id].state == State::offered; }
  std::uint32_t epoch(AgentId id) const { return entries_[id].epoch; }
  const View& view() const { return view_; }
  /// Whether we are a member of the view.
  bool member() const { return view_.has(settings_.own, since_); }
  /// Whether we may take agents and move ours at this time.
  bool may_own() const { return member() && now_ <= lease_end(); }
  /// Our life; when it changes we own nothing any more.
  Time since() const { return since_; }

 private:
  enum class State : std::uint8_t { elsewhere, owned, offered };
  struct Entry {
    std::uint32_t epoch = 0;  // highest known
    State state = State::elsewhere;
    int peer = -1;  // owned: who gave it and may not know yet; offered: to whom
    Time time{};    // owned: when it was taken; offered: end of the offer
  };
  struct Peer {
    OwnershipReport report;  // newest
    Time acked{};            // newest of our reports that it has
  };

  Peer& peer(int c) { return peers_[static_cast<std::size_t>(c)]; }
  const Peer& peer(int c) const { return peers_[static_cast<std::size_t>(c)]; }
  Time heard(int a, int b) const;
  bool linked(int c) const;
  bool majority(int members, bool with_first) const;
  Time lease_end() const;
  void enter(const View& view);
  void drop(Time after);
  void begin_with_all();
  std::vector<int> reachable() const;
  bool leads(const std::vector<int>& members) const;
  void propose();
  void settle();

  OwnershipSettings settings_;
  std::vector<AgentId> start_;
  std::vector<Entry> entries_;  // by id
  std::vector<Peer> peers_;
  View view_;
  bool settled_ = false;
  Time now_{}, since_{}, wanted_since_{};
  int held_ = 0;  // owned and offered
  std::vector<AgentId> orphans_;
};

}  // namespace mimesis::crowd
