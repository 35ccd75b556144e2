#pragma once
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/certificate/swaying_way.h"

// Inside of certify(): phases and what is common (certificate.cc), places (certify_places.cc),
// headings (certify_headings.cc).
namespace mimesis::crowd {

/// Words and numbers in one line; numbers with four digits.
template <class... Part>
std::string say(const Part&... part) {
  std::ostringstream out;
  out.precision(4);
  (out << ... << part);
  return out.str();
}

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kUnknown = std::numeric_limits<double>::infinity();

/// No guarantee, why not, and what would change that.
RuleCertificate refused(std::string why, std::vector<std::string> change);
RuleCertificate alone(int n);
/// Of the graph; sets `refusal` where it does not hold a group together.
Extremes extremes_of(const GraphSettings& settings, int n, std::optional<RuleCertificate>& refusal);

/// What the rules of one group guarantee together. Which acts on which decides: III is autonomous
/// without I; phases drive II, both drive lanes, and lanes drive the way along the path by cos ψ.
/// In such a hierarchy the slowest rate above a rule is its own [M18 4.4.2, 3]. I closes a loop
/// with II and III, for which there is one joint certificate.
class Certifier {
 public:
  Certifier(const Rules& rules, int n, const GaitRange& gait) : r_(rules), n_(n), gait_(gait) {}
  Certificate run();

 private:
  static bool on(const RuleCertificate& c) { return c.guarantee != Guarantee::off; }
  static bool sure(const RuleCertificate& c) { return c.guarantee == Guarantee::contracting; }
  static void refuse(RuleCertificate& c, std::string why, std::string change) {
    const Extremes kept = c.extremes;
    c = refused(std::move(why), {std::move(change)});
    c.extremes = kept;
  }
  /// Factor by which errors may first grow [Euclidean against L⁺, L, or Π].
  static double growth(const Extremes& e) {
    return e.directed ? e.skew : std::sqrt(e.most / e.least);
  }
  /// In the metric Π all speeds must be equal.
  bool alike() const { return gait_.spread_rad_s == 0.0 && !sways() && agree(); }
  bool uneven_along(RuleCertificate& c) const {
    if (!c.extremes.directed || alike()) return false;
    refuse(c, "no bound is known along a directed graph with speeds that differ",
           "equal eigenfrequencies and II with III, or a graph without directions");
    return true;
  }
  static void promise(RuleCertificate& c, double guaranteed, double expected, double without_link) {
    c.guarantee = Guarantee::contracting;
    c.guaranteed_1_s = guaranteed;
    c.expected_1_s = expected;
    c.without_link_1_s = without_link;
  }
  /// A rule that another one disturbs ends no faster than that one.
  static void behind(RuleCertificate& c, const RuleCertificate& first, const char* what,
                     double power = 1.0) {
    if (!sure(c) || !on(first)) return;
    if (!sure(first)) return refuse(c, say("nothing is known of ", what), say("see ", what));
    c.in_the_end = true;
    const double other = power * first.guaranteed_1_s;
    if (other >= c.guaranteed_1_s) return;
    c.why += say("; waits for ", what, " at ", other, " 1/s");
    for (double* rate : {&c.guaranteed_1_s, &c.expected_1_s, &c.without_link_1_s}) {
      *rate = std::min(*rate, other);
    }
  }
  /// ẋ = −r x + f with f <= f₀ exp(−s t), s > r: what f makes of x is f₀/(s − r) at most. 0: x
  /// follows f.
  static double adds(double f0, double s, double r) { return s > r ? f0 / (s - r) : 0.0; }
  bool sways() const { return r_.heading.kind == HeadingKind::lane && !gait_.sway.none(); }
  /// ż = v cos ψ, and 1 − cos ψ is ψ²/2; about a swaying way it changes with the first power.
  void behind_lanes(RuleCertificate& c) const {
    if (sways()) return behind(c, all_.heading, "lanes");
    c.per_lane_m = adds(0.5 * fastest() * gait_.gait.most(), 2.0 * all_.heading.guaranteed_1_s,
                        c.guaranteed_1_s);
    behind(c, all_.heading, "lanes", 2.0);
  }
  /// x = y + G(φᵢ) − G(φ): ẏ = −r x.
  void behind_phases(RuleCertificate& c) const {
    const double r = c.guaranteed_1_s, g = gait_.gait.most();
    for (const auto& [first, what] :
         {std::pair(&all_.phase, "phases"), std::pair(&all_.tracking, "the leader's phase")}) {
      if (sure(*first) && first->guaranteed_1_s > r) {
        c.per_phase_m_rad = std::max(c.per_phase_m_rad, g + adds(r * g, first->guaranteed_1_s, r));
      }
      behind(c, *first, what);
    }
  }
  bool beats() const { return gait_.beat_gain_1_s != 0.0; }
  double own_pace() const { return gait_.eigenfrequency_rad_s; }
  /// Of the phases in the end, or less: a beat may be slower than the gait.
  double pace() const { return beats() ? std::min(own_pace(), gait_.beat_rate_rad_s) : own_pace(); }
  double slowest() const {
    const double own = own_pace() - gait_.spread_rad_s;
    return beats() ? std::min(own, gait_.beat_rate_rad_s) : own;
  }
  double fastest() const {
    const double own = own_pace() + gait_.spread_rad_s;
    return beats() ? std::max(own, gait_.beat_rate_rad_s) : own;
  }
  /// How much the pace of a follower may differ from that of the beat, or of the leader, which has
  /// one of the group's paces.
  double off_leader() const {
    return beats() ? std::abs(own_pace() - gait_.beat_rate_rad_s) + gait_.spread_rad_s
                   : 2.0 * gait_.spread_rad_s;
  }
  bool led() const { return beats() || r_.phase.leader_gain_1_s != 0.0; }
  bool even() const { return gait_.gait.least() == gait_.gait.most(); }
  /// In the end g(φ) is the same for all.
  bool agree() const {
    return (even() && !sways()) ||
           (sure(all_.phase) && gait_.spread_rad_s == 0.0 && !on(all_.frequency));
  }
  /// Largest angle to the path of those who sway about their lanes.
  double most_sway() const {
    const HeadingRule& h = r_.heading;
    if (!sways() || !(h.gain > 0.0)) return 0.0;
    const auto way = swaying_way(gait_.gait, gait_.sway, h.gain, h.ahead_m);
    return way ? std::min(way->most, 0.5 * kPi) : 0.5 * kPi;
  }
  double lost(const GraphSettings& graph) const {
    return connectivity_without_link(coupling(graph, n_));
  }
  RuleCertificate graphed(double gain, const GraphSettings& graph) const {
    if (gain == 0.0) return {};
    if (n_ < 2) return alone(n_);
    std::optional<RuleCertificate> refusal;
    RuleCertificate c;
    c.extremes = extremes_of(graph, n_, refusal);
    if (refusal) return *refusal;
    c.guarantee = Guarantee::none;
    return c;
  }
  void phase();
  void tracking(double alpha, bool all_to_all);
  void late();
  void delay(RuleCertificate& c, double stiffness_1_s) const;
  void while_free();
  static void hold_up(RuleCertificate& c);
  void in_steps();
  void notes();
  bool off_path(RuleCertificate& c) const;
  bool repels(RuleCertificate& c, const char* gain, double value, double factor) const;
  void frequency();
  void length();
  double swing(const Extremes& e) const;
  double averaged(double connectivity, const Extremes& e) const;
  void joint();
  void heading();
  void coupled_headings(RuleCertificate& c) const;
  void goals(RuleCertificate& c) const;
  void consensus(RuleCertificate& c) const;
  void lanes(RuleCertificate& c);
  double with_length(const SwayingWay& way) const;

  const Rules& r_;
  int n_;
  const GaitRange& gait_;
  Certificate all_;
};

}  // namespace mimesis::crowd
