#pragma once
#include <Eigen/Core>
#include <chrono>
#include <string>
#include <vector>

namespace mimesis::crowd {

/// State of an agent that another process or a robot moves, at one instant.
struct AgentReport {
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;
  double phase_rad = 0.0;  ///< phase of the gait cycle, 0 at left heel strike
  double phase_rate_rad_s = 0.0;
  double speed_m_s = 0.0;  ///< along its heading
};

struct TrustSettings {
  double stale_s = 0.3;   ///< an older report is not trusted
  double forget_s = 2.0;  ///< an agent without a fresh report for this long is gone
  /// an agent that lagged is trusted again after this time without delay
  double return_s = 0.5;
  double most_m_s = 4.0;     ///< faster reports are not believed
  double most_rad_s = 20.0;  ///< larger phase rates are not believed
  double far_m = 1e5;        ///< places farther away are not believed
  double slack_m = 0.3;      ///< allowed deviation of a report from the prediction of the last one
};

enum class Trust {
  absent,   ///< no report yet, has left, or was forgotten
  trusted,  ///< takes part
  lagging   ///< late or implausible: an obstacle that goes straight on, not coupled
};

/// Agents that other programs move: which of them take part, and their trusted state. Pure: times
/// are given, and the same reports give the same trust.
///
///   absent ──report──> trusted ──older than stale, or implausible──> lagging ──in time──> trusted
///      ^                  │ leaves                                       │ forget_s
///      └──────────────────┴──────────────────────────────────────────────┘
class ExternalAgents {
 public:
  using Time = std::chrono::nanoseconds;

  struct Change {
    int agent = 0;
    Trust from = Trust::absent, to = Trust::absent;
    std::string reason;
  };

  ExternalAgents(int count, const TrustSettings& settings);

  int size() const { return static_cast<int>(agents_.size()); }
  /// A report of time `stamp`, received at `now`. Returns why it is not trusted, or empty. Reports
  /// older than an earlier one are skipped.
  std::string hear(int agent, const AgentReport& report, Time stamp, Time now);
  /// The agent reports that it takes part no longer.
  void leave(int agent);
  /// Judges all agents at `now`. Returns the changes since the last call, in the order of agents;
  /// valid until the next call.
  const std::vector<Change>& update(Time now);

  Trust trust(int agent) const { return at(agent).trust; }
  /// A report came since the last `taken`.
  bool fresh(int agent) const { return at(agent).fresh; }
  void taken(int agent) { agents_[static_cast<std::size_t>(agent)].fresh = false; }
  /// Extrapolated from the last trusted report. Precondition: not absent.
  AgentReport believed(int agent, Time now) const;
  double age_s(int agent, Time now) const;  ///< age of the last trusted report

 private:
  struct Agent {
    Trust trust = Trust::absent, told = Trust::absent;
    AgentReport report;
    Time stamp{};          // stamp of the report
    Time in_time_since{};  // start of timely reports while lagging
    bool fresh = false, left = false;
    std::string reason;
  };
  const Agent& at(int agent) const { return agents_[static_cast<std::size_t>(agent)]; }
  std::string fault(const Agent& agent, const AgentReport& report, Time stamp) const;
  void judge(Agent& agent, Time now) const;

  TrustSettings settings_;
  std::vector<Agent> agents_;
  std::vector<Change> changes_;
};

}  // namespace mimesis::crowd
