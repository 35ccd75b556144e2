#pragma once
#include <string>
#include <vector>

#include "nodes/crowd/engine/agent.h"
#include "nodes/crowd/scenario/arrangement.h"

namespace mimesis::crowd {

/// Who is who in a scenario: the same ids in every process. Id 0 is the beat; agents count from 1,
/// group by group, then the external ones in their order.
class Roster {
 public:
  static constexpr AgentId kBeat = 0;

  /// @throws ConfigError as starts(), places() and first_goals()
  explicit Roster(const Scenario& scenario);

  int agents() const { return static_cast<int>(first_external_ - 1); }  ///< without external ones
  int externals() const { return static_cast<int>(agents_.size()) - agents(); }
  AgentId external_id(int external) const {
    return first_external_ + static_cast<AgentId>(external);
  }
  /// Number of the external agent, or −1.
  int external(AgentId id) const;
  bool known(AgentId id) const { return id >= 1 && id <= agents_.size(); }

  /// As it begins; an external agent with the traits that it will have. Precondition: known(id).
  const Agent& start(AgentId id) const { return agents_[id - 1]; }
  int home(AgentId id) const { return homes_[id - 1]; }  ///< group that it begins in

 private:
  std::vector<Agent> agents_;
  std::vector<int> homes_;
  AgentId first_external_ = 1;
};

}  // namespace mimesis::crowd
