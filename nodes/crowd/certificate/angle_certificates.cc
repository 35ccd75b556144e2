#include <cmath>
#include <numbers>

#include "nodes/crowd/certificate/contraction.h"
#include "nodes/crowd/certificate/rule_certificates.h"
#include "nodes/crowd/certificate/say.h"

namespace mimesis::crowd {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFar = 5.0;           // v/k that goals are away at least
constexpr double kNearLane_rad = 0.3;  // where sines are angles, within 1.5 %

/// Derivative of sin Δ exp(−Δ²/2σ²), σ = 0: of sin Δ.
double pull_slope(double delta, double sigma) {
  if (sigma == 0.0) return std::cos(delta);
  const double s2 = sigma * sigma;
  return (std::cos(delta) - delta / s2 * std::sin(delta)) * std::exp(-0.5 * delta * delta / s2);
}

RuleCertificate certify_coupled_heading(const HeadingRule& r, int n) {
  if (n < 2) return alone(n);
  std::optional<RuleCertificate> refusal;
  RuleCertificate c;
  c.extremes = extremes_of(r.graph, n, refusal);
  if (refusal) return *refusal;
  double zero = 0.5 * kPi;  // of the slope
  for (double delta = 0.0; delta < 0.5 * kPi; delta += 1e-3) {
    if (pull_slope(delta, r.spread_rad) > 0.0) continue;
    zero = delta;
    break;
  }
  c.guarantee = Guarantee::contracting;
  c.within = 2.0 / 3.0 * zero;
  c.expected_1_s = r.gain * c.extremes.least;
  c.guaranteed_1_s = c.expected_1_s * pull_slope(c.within, r.spread_rad);
  c.without_link_1_s = c.guaranteed_1_s * connectivity_without_link(r.graph, n) / c.extremes.least;
  c.why = say("contracts while all headings are within ", zero,
              " rad of each other (4.45); rate >= k lambda+ f'(", c.within,
              ") = ", c.guaranteed_1_s, " up to ", c.within, " rad");
  return c;
}

}  // namespace

void certify_phase(const PhaseRule& r, int n, double beat_gain_1_s, Certificate& all) {
  const bool beat = beat_gain_1_s != 0.0;
  const double k = r.gain_1_s, alpha = beat ? beat_gain_1_s : r.leader_gain_1_s;
  RuleCertificate& c = all.phase;
  if (k == 0.0 && alpha == 0.0) return;
  if (n < (beat ? 1 : 2)) {
    c = alone(n);
    return;
  }
  if (k < 0.0 || alpha < 0.0) {
    c = refused(say("k = ", k, ", alpha = ", alpha, ": a negative gain repels phases (4.31, 4.26)"),
                {"k > 0", "alpha >= 0"});
    return;
  }
  const int coupled = alpha > 0.0 && !beat ? n - 1 : n;  // the leader hears nobody
  std::optional<RuleCertificate> refusal;
  if (k > 0.0 && coupled > 1) c.extremes = extremes_of(r.graph, coupled, refusal);
  if (refusal && alpha == 0.0) {
    c = *refusal;
    return;
  }
  c.guarantee = Guarantee::contracting;
  c.guaranteed_1_s = c.expected_1_s = k * c.extremes.least + alpha;
  c.without_link_1_s =
      alpha + (c.extremes.least > 0.0 ? k * connectivity_without_link(r.graph, coupled) : 0.0);
  c.why = alpha > 0.0 ? say("rate of followers k lambda+ + alpha = ", k, " * ", c.extremes.least,
                            " + ", alpha)
                      : say("rate k lambda+ = ", k, " * ", c.extremes.least, " for every k > 0");
  if (alpha == 0.0) return;
  all.tracking.guarantee = Guarantee::contracting;
  all.tracking.guaranteed_1_s = all.tracking.expected_1_s = alpha;
  all.tracking.why =
      beat ? say("to the beat at alpha = ", alpha, ", whoever else is there")
           : say("to the leader at alpha = ", alpha,
                 " alone: coupling among followers does not move their mean (eigenvalue 0)");
}

RuleCertificate certify_heading(const HeadingRule& r, int n, const GaitRange& gait,
                                double stretch) {
  RuleCertificate c;
  if (r.kind == HeadingKind::keep) return c;
  if (!(r.gain > 0.0)) {
    return refused(say("gain ", r.gain, ": headings are repelled or free (4.32, 4.41)"),
                   {"a gain > 0"});
  }
  if (r.kind == HeadingKind::coupled) return certify_coupled_heading(r, n);
  if (r.kind == HeadingKind::consensus && n < 2) return alone(n);
  const double slowest = gait.eigenfrequency_rad_s - gait.spread_rad_s;
  c.guarantee = Guarantee::contracting;
  c.within = kPi;
  c.guaranteed_1_s = r.gain * slowest;
  c.expected_1_s = r.gain * gait.eigenfrequency_rad_s;
  c.why = "contracts up to pi from its attractor in the metric 1/(1 + cos), rate ";
  if (r.kind == HeadingKind::goal) {
    // Who walks beside the direction of its goal turns that: with e = ψ − ψ_goal at the distance r
    // ė = −(k − v/r) sin e, so tan(e/2) decays at k − v/r.
    const double fastest =
        stretch * (gait.eigenfrequency_rad_s + gait.spread_rad_s) * gait.gait.most();
    c.expected_1_s = r.gain;
    c.guaranteed_1_s = r.gain * (1.0 - 1.0 / kFar);
    c.beyond_m = kFar * fastest / r.gain;
    c.why += say("k - v/r = ", r.gain, " - v/r, r the way to the goal: at least ", c.guaranteed_1_s,
                 " while that is more than ", c.beyond_m, " m");
  } else {
    c.why += say("m_psi omega = ", c.guaranteed_1_s);
  }
  if (r.kind == HeadingKind::lane) {
    // Near the lane ψ̇ = −ω m (ψ + ξ/Δz), ξ̇ = ω g ψ: s² + ω m s + ω² m g/Δz = 0.
    const double omega = gait.eigenfrequency_rad_s;
    const SpeedFunction& g = gait.gait;
    c.expected_1_s = low_pass_mode_rate(omega * r.gain, omega * g.mean() / r.ahead_m);
    c.guaranteed_1_s = low_pass_mode_rate(slowest * r.gain, slowest * g.least() / r.ahead_m);
    c.within = kNearLane_rad;
    c.why +=
        say("; so headings come to their sliding goals, and near their lanes walkers to these at ",
            c.guaranteed_1_s, " 1/s");
    const double least = 4.0 * g.mean() / r.ahead_m;
    if (r.gain < least) c.change.push_back(say("m_psi above ", least, ": lanes do not overshoot"));
  }
  if (!gait.sway.none() && r.kind != HeadingKind::goal) {
    // An input of what contracts: no rate changes [M18 4.4.2].
    c.why += say("; it sways by ", gait.sway.amplitude_rad(r.gain), " rad with the steps (g^psi)");
  }
  if (r.avoid) c.why += "; avoidance disturbs it while others are near";
  return c;
}

}  // namespace mimesis::crowd
