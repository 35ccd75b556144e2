#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/schedule.h"
#include "common/time.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// Decides in lock-step which node steps when, and which messages the step sees. Time stands still
/// until every participant has joined; then it advances to the earliest due time, all nodes due
/// then step in parallel, and only when all have reported does it go on. Messages published at time
/// t are visible to steps after t, in the order (t, name of the publisher, publication): a function
/// of the nodes alone, whatever the machine's speed. Pure: no sockets, no clock.
class Conductor {
 public:
  /// @param participants  names of the nodes without which time does not begin
  /// @param until         last time of a step; later than any due time: no end
  Conductor(std::vector<std::string> participants, Time until);

  struct Go {
    std::uint64_t start_id = 0;  ///< id of the node it is for
    v1::StepGo message;
  };

  /// A node joins; it takes part from the next `advance` on.
  void join(const v1::LockstepJoin& join);
  /// A node has gone: the conductor no longer waits for it.
  void leave(std::uint64_t start_id);
  void report(std::uint64_t start_id, const v1::StepReport& report);

  /// The next steps; none while a step is running, a participant is missing or there is no
  /// participant.
  std::vector<Go> advance();

  Time time() const { return time_; }  ///< time of the steps last released
  bool ended() const { return ended_; }
  /// Names of participants that have not joined yet.
  std::vector<std::string> missing() const;
  std::size_t members() const { return members_.size(); }

 private:
  using Published = google::protobuf::RepeatedPtrField<v1::Publication>;
  struct Member {
    std::string name;
    Schedule schedule;
    std::optional<Time> next = {};  ///< as reported, instead of the schedule
    std::set<std::string> inputs;
    bool stepping = false;
    Published pending;  ///< for its next step
    Time due() const { return next ? *next : schedule.due(); }
  };

  void admit();
  void distribute(const Published& published);

  std::set<std::string> awaited_;
  Time until_, time_{};
  bool begun_ = false, ended_ = false;
  std::uint64_t generation_ = 0;
  std::map<std::string, v1::LockstepJoin> joining_;  // by name
  std::map<std::uint64_t, Member> members_;          // by start_id
  std::map<std::string, Published> reported_;        // reports of the running step, by name
  std::map<std::pair<std::string, std::uint64_t>, v1::Publication> latched_;  // by topic, publisher
};

}  // namespace mimesis::runtime
