#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/certificate/rate_fit.h"

namespace mimesis::crowd {

/// Errors of a group that decay if its rules converge. NaN: not measured.
struct GroupErrors {
  double dispersion = 0.0;    ///< R̂ of phases (of followers, if there is a leader) [1]
  double tracking_rad = 0.0;  ///< largest |φ − φ₀|, if there is a leader
  double spacing_m = 0.0;     ///< max − min of z − d
  /// largest distance from the heading wished, where all are free; of lanes √(ψ² + (ξ/Δz)²)
  double heading_rad = 0.0;
  double phases_rad = 0.0;  ///< range of phases, the leader's too
};

/// Guaranteed, expected and measured side by side, of one rule.
struct RuleReport {
  Guarantee guarantee = Guarantee::off;
  double guaranteed_1_s = 0.0, expected_1_s = 0.0;
  std::optional<double> measured_1_s{};  ///< since the last disturbance, once it is known
  /// what a first growth along a directed graph may take from the measured rate
  double growth_1_s = 0.0;
  /// Measured, and slower than guaranteed by more than 2 %.
  bool broken() const {
    return guarantee == Guarantee::contracting && measured_1_s &&
           *measured_1_s < 0.98 * guaranteed_1_s - growth_1_s;
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
  Monitor()
      : phase_(kLeastR, kMostR),
        tracking_(kLeast_rad, kMost_rad),
        spacing_(kLeast_m, kMost_m),
        heading_(kLeast_rad, kMost_rad),
        turns_(kLeastTurn, kMostTurn),
        tracks_(kLeastTurn, kMostTurn) {}

  /// Starts a new measurement with this certificate, except for values per agent that have the same
  /// rate as before.
  void certify(Certificate certificate) {
    if (!same_rates(certificate.heading, certificate_.heading)) {
      turns_.restart();
      by_turns_ = false;
    }
    if (!same_rates(certificate.tracking, certificate_.tracking)) {
      tracks_.restart();
      by_tracks_ = false;
    }
    certificate_ = std::move(certificate);
    valid_ = true;
    for (RateFit* fit : {&phase_, &tracking_, &spacing_, &heading_}) fit->restart();
    // R̂ of phases within a range is a third of it at most.
    phase_.set_least(std::max(kLeastR, kAbove * certificate_.phase.remains / 3.0));
    tracking_.set_least(std::max(kLeast_rad, kAbove * certificate_.tracking.remains));
    spacing_.set_least(std::max(kLeast_m, kAbove * rule_of_spacing().remains));
    heading_.set_least(std::max(kLeast_rad, kAbove * certificate_.heading.remains));
    tracks_.set_least(std::max(kLeastTurn, kAbove * certificate_.tracking.remains));
    turns_.set_least(std::max(kLeastTurn, kAbove * certificate_.heading.remains));
  }
  /// @param t_s  of the simulation, increasing
  void step(double t_s, const GroupErrors& errors) {
    phase_.add(t_s, errors.dispersion);
    tracking_.add(t_s, errors.tracking_rad);
    // What waits for others has its rate once they have settled.
    const RuleCertificate& rule = rule_of_spacing();
    const double phases = or_none(errors.phases_rad);
    const double lanes = or_none(errors.heading_rad - certificate_.heading.remains);
    const bool in_step = !(errors.dispersion > kSettled);
    const double added = rule.per_phase_m_rad * phases + rule.per_lane_m * lanes * lanes;
    const bool settled = in_step && lanes <= kMost_rad && !(added > kRemainder * errors.spacing_m);
    if (!rule.in_the_end || settled) {
      spacing_.add(t_s, errors.spacing_m);
    } else if (errors.spacing_m >= kLeast_m) {  // below, what is left is rounding
      spacing_.restart();
    }
    if (certificate_.heading.in_the_end && !in_step) heading_.restart();
    heading_.add(t_s, errors.heading_rad);
  }
  /// One agent's heading where avoidance turns some, or agents come and go: how far it is from the
  /// wished one, in the metric of its rule; NaN while something else turns it. Allocates for a new
  /// agent.
  void turn(std::uint64_t agent, double t_s, double error) {
    by_turns_ = true;
    turns_.add(agent, t_s, error);
  }
  /// One agent's |φ − φ₀| [rad] where agents come and go. As `turn`.
  void track(std::uint64_t agent, double t_s, double error_rad) {
    by_tracks_ = true;
    tracks_.add(agent, t_s, error_rad);
  }

  MonitorReport report() const {
    MonitorReport r;
    r.valid = valid_;
    r.agents = certificate_.agents;
    r.phase = beside(certificate_.phase, phase_);
    r.tracking = beside(certificate_.tracking, tracking_);
    r.spacing = beside(rule_of_spacing(), spacing_);
    r.heading = beside(certificate_.heading, heading_);
    if (by_tracks_) r.tracking.measured_1_s = tracks_.rate_1_s();
    if (by_turns_) r.heading.measured_1_s = turns_.rate_1_s();
    return r;
  }
  const Certificate& certificate() const { return certificate_; }

 private:
  // Bands in which errors decay exponentially: linear above rounding and single precision states.
  static constexpr double kLeastR = 1e-6, kMostR = 3e-2;
  static constexpr double kLeast_rad = 1e-5, kMost_rad = 0.1;
  static constexpr double kLeast_m = 1e-6, kMost_m = 1.0;
  static constexpr double kAbove =
      50.0;  // times what remains of an error, so that it counts little
  static constexpr double kSettled = 1e-2;    // dispersion
  static constexpr double kRemainder = 1e-2;  // of the error, what others add to it
  static double or_none(double x) { return x > 0.0 ? x : 0.0; }  // 0 of NaN
  const RuleCertificate& rule_of_spacing() const {
    return certificate_.length.guarantee != Guarantee::off ? certificate_.length
                                                           : certificate_.frequency;
  }
  static constexpr double kLeastTurn = 1e-3, kMostTurn = 1.5;
  static RuleReport beside(const RuleCertificate& c, const RateFit& fit) {
    // A line through a fall that is flat for log(skew)/rate at first is flatter by half as much
    // more.
    const double grew = 1.5 * std::log(c.extremes.skew);
    return {c.guarantee, c.guaranteed_1_s, c.expected_1_s, fit.rate_1_s(),
            grew > 0.0 ? grew / fit.lasted_s() : 0.0};
  }
  static bool same_rates(const RuleCertificate& a, const RuleCertificate& b) {
    return a.guaranteed_1_s == b.guaranteed_1_s && a.expected_1_s == b.expected_1_s;
  }

  Certificate certificate_;
  bool valid_ = false;
  RateFit phase_, tracking_, spacing_, heading_;
  TurnFit turns_, tracks_;
  bool by_turns_ = false, by_tracks_ = false;  // measured by agent
};

}  // namespace mimesis::crowd
