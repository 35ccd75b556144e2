#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nodes/crowd/run/observer.h"
#include "nodes/crowd/run/scenario_run.h"

namespace mimesis::crowd {

enum class Rule { frequency, length, phase, tracking, heading };

/// Guaranteed and measured, of one rule of one group.
struct RuleLine {
  int group = 0;
  Rule rule = Rule::phase;
  RuleCertificate certificate{};
  RuleReport report{};
  double disorder = 0.0;  ///< the error that the rate was measured of
};

/// Watches all groups of a run: certificates of the groups as they are, rates measured beside them,
/// since when everything is in order, and how people come into step where a beat is. Bodies of
/// external agents are never quite as theory has them: rates of a group with some are measured
/// until it is in order.
class Watch {
 public:
  /// With the groups as the scenario begins them.
  explicit Watch(const ScenarioRun& run);

  /// Everybody at one time, by group and id. A group that has other members or rules than its
  /// certificate says is certified anew.
  void observe(const ScenarioRun& run, double time_s, std::span<const Observed> everybody);
  /// Why the next change of a group's members will be; else they just changed.
  void expect_change(int group, std::string reason);

  /// A group was disturbed: its certificate is made anew.
  void disturb(const ScenarioRun& run, int group, const std::string& reason);

  std::vector<RuleLine> lines() const;
  /// The rule in force with the least guaranteed rate; one without guarantee goes before all.
  std::optional<RuleLine> weakest() const;
  int number() const { return number_; }  ///< of certificates, from 1
  /// Why the certificates before the present ones do not hold any more, since the last call.
  std::string take_voided();

  bool in_order() const { return since_s_ >= 0.0; }
  double in_order_since_s() const { return since_s_; }  ///< negative: it is not
  int agents(int group) const;                          ///< that its certificate is for
  /// What is not in order, group by group.
  std::string disorder(const ScenarioRun& run) const;
  double place_most_m() const;  ///< farthest from its place, of groups with a formation
  bool broken() const;          ///< something was measured to be slower than guaranteed

  /// Who came into a group that hears the beat, through a zone where people gather: number, and
  /// phase errors as they came.
  struct Entrances {
    int count = 0, wrong_foot = 0;  ///< wrong: more than a quarter of a cycle off
    double most_rad = 0.0;
  };
  const Entrances& entrances() const { return entrances_; }

 private:
  /// What was in order since the certificate, of a group with bodies.
  struct Settled {
    bool phase = false, tracking = false, spacing = false, heading = false;
  };
  struct Kept {
    Monitor monitor;
    GroupOrder order;
    std::string expected;
    Wanted wanted;
    bool passes = false;
    Settled settled;
  };
  void certify(const ScenarioRun& run, int group, int agents, const std::string& why);
  void measure(const ScenarioRun& run, int group, double time_s);
  void greet(const ScenarioRun& run, const Observed& agent, double beat_rad);
  std::string change_of(const ScenarioRun& run, int group, int agents) const;

  std::vector<Kept> groups_;
  std::vector<int> last_group_;  // of every id
  std::vector<Observed> members_;
  Observer observer_;
  std::string voided_;
  int number_ = 1;
  double since_s_ = -1.0;
  Entrances entrances_;
};

}  // namespace mimesis::crowd
