#pragma once
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "nodes/crowd/crowd_params.h"
#include "nodes/crowd/regions/far_crowd.h"
#include "proto/crowd.pb.h"

namespace mimesis::crowd {

/// Several coordinators share the plane, a region each: their reports, agents that walk from one
/// region to another, coordinators that fall silent. Numbers of coordinators are from 0.
class Peers {
 public:
  using Time = runtime::Time;
  /// @param run  outlives it
  Peers(const CrowdParams& params, runtime::Bus& bus, ScenarioRun& run);

  int count() const { return settings_.coordinators; }
  /// Whether we are the first of those that are present.
  bool first() const { return first_; }
  const FarCrowd& far() const { return far_; }

  /// Reads reports and offers of the others. Returns troubles, a line each.
  std::vector<std::string> take(Time now, Time state_time);
  struct Shared {
    bool changed = false;  ///< who is there, or who is the first
    std::vector<std::string> troubles;
    std::vector<std::pair<int, std::string>> disturbed;  ///< group, reason
  };
  /// Adopts agents that nobody owns. In every step, after take().
  Shared share(Time state_time);
  /// Why the run does not begin yet; empty: it does. It begins once all coordinators hear each
  /// other. Of one that is started again while the others walk the region is already looked after:
  /// it joins them, and they hand it back.
  std::string waits(Time now);
  /// See FarCrowd::import.
  std::string import(Time state_time) { return far_.import(run_, state_time); }
  /// Offers agents that left our region to the coordinator of the next, if that is there.
  void hand_over(Time now);

  /// Adds what we report of ownership.
  void describe(v1::CrowdStates& states, Time now) const;
  void describe(v1::CrowdStatus& status) const;
  /// What the others last said of their agents.
  struct Contacts {
    std::uint64_t collisions = 0;
    double least_gap_m = std::numeric_limits<double>::infinity();
    double least_distance_m = std::numeric_limits<double>::infinity();
  };
  Contacts contacts() const;

 private:
  struct Peer {
    double time_s = 0.0;
    Contacts contacts;
  };
  void take_states(const v1::CrowdStates& states, Time now);

  RegionParams regions_;
  RegionMap map_;
  FarSettings settings_;
  ScenarioRun& run_;
  FarCrowd far_;
  std::vector<Peer> peers_;
  bool first_ = false;
  std::vector<bool> there_;
  std::uint64_t given_ = 0, taken_ = 0;  // agents
  runtime::Throttle bad_states_{std::chrono::seconds(1)}, bad_handovers_{std::chrono::seconds(1)};

  runtime::Reliable<v1::CrowdStates> peers_in_;
  runtime::Reliable<v1::CrowdHandover> handovers_in_;
  runtime::Out<v1::CrowdHandover> handovers_;
};

}  // namespace mimesis::crowd
