#pragma once
#include <cstdint>
#include <optional>

#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/certificate/rate_fit.h"

namespace mimesis::crowd {

/// Errors of a group that decay if its rules converge. NaN: not measured.
struct GroupErrors {
  double dispersion = 0.0;    ///< R̂ of phases (of followers, if there is a leader) [1]
  double tracking_rad = 0.0;  ///< largest |φ − φ₀|, if there is a leader
  double spacing_m = 0.0;     ///< max − min of z − d
  double heading_rad = 0.0;   ///< largest distance from the heading wished, where all are free
};

/// Guaranteed, expected and measured side by side, of one rule.
struct RuleReport {
  Guarantee guarantee = Guarantee::off;
  double guaranteed_1_s = 0.0, expected_1_s = 0.0;
  std::optional<double> measured_1_s{};  ///< since the last disturbance, once it is known
  /// Measured, and slower than guaranteed by more than 5 %.
  bool broken() const {
    return guarantee == Guarantee::contracting && measured_1_s &&
           *measured_1_s < 0.95 * guaranteed_1_s;
  }
};

struct MonitorReport {
  bool valid = false;  ///< there is a certificate
  int agents = 0;
  RuleReport phase, tracking, spacing, heading;  ///< spacing: rule II, or I if that is off
};

/// Watches one group while it runs. Pure: gets time, errors and changes as arguments. Steps do not
/// allocate.
class Monitor {
 public:
  Monitor();

  /// Starts a new measurement with this certificate, except for values per agent that have the same
  /// rate as before.
  void certify(Certificate certificate);
  /// @param t_s  of the simulation, increasing
  void step(double t_s, const GroupErrors& errors);
  /// One agent's heading where avoidance turns some, or agents come and go: how far it is from the
  /// wished one, in the metric of its rule; NaN while something else turns it. Allocates for a new
  /// agent.
  void turn(std::uint64_t agent, double t_s, double error);
  /// One agent's |φ − φ₀| [rad] where agents come and go. As `turn`.
  void track(std::uint64_t agent, double t_s, double error_rad);

  MonitorReport report() const;
  const Certificate& certificate() const { return certificate_; }

 private:
  Certificate certificate_;
  bool valid_ = false;
  RateFit phase_, tracking_, spacing_, heading_;
  TurnFit turns_, tracks_;
  bool by_turns_ = false, by_tracks_ = false;  // measured by agent
};

}  // namespace mimesis::crowd
