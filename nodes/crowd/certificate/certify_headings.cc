// Guarantees of rule IV: to neighbours, goals, the common heading and lanes.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "nodes/crowd/certificate/certifier.h"

namespace mimesis::crowd {
namespace {

constexpr double kFar = 5.0;  // v/k that goals are away at least

/// Derivative of sin Δ exp(−Δ²/2σ²), σ = 0: of sin Δ.
double pull_slope(double delta, double sigma) {
  if (sigma == 0.0) return std::cos(delta);
  const double s2 = sigma * sigma;
  return (std::cos(delta) - delta / s2 * std::sin(delta)) * std::exp(-0.5 * delta * delta / s2);
}

}  // namespace

void Certifier::heading() {
  const HeadingRule& r = r_.heading;
  if (r.kind == HeadingKind::keep) return;
  RuleCertificate& c = all_.heading;
  if (!(r.gain > 0.0)) {
    c = refused(say("gain ", r.gain, ": headings are repelled or free (4.32, 4.41)"),
                {"a gain > 0"});
  } else if (r.kind == HeadingKind::coupled) {
    coupled_headings(c);
  } else if (on(all_.frequency) && !sure(all_.frequency)) {
    refuse(c, "I moves phases, and is not certified", "see rule I");
  } else if ((on(all_.phase) && !sure(all_.phase)) || (on(all_.tracking) && !sure(all_.tracking))) {
    refuse(c, "nothing is known of phases", "see rule III");
  } else if (r.kind == HeadingKind::goal) {
    goals(c);
  } else if (r.kind == HeadingKind::consensus) {
    consensus(c);
  } else {
    lanes(c);
  }
}

void Certifier::coupled_headings(RuleCertificate& c) const {
  const HeadingRule& r = r_.heading;
  if (n_ < 2) {
    c = alone(n_);
    return;
  }
  c = graphed(r.gain, r.graph);
  if (c.extremes.least == 0.0) return;
  if (c.extremes.directed) {
    return refuse(c, "no bound is known for headings along a directed graph", "one without");
  }
  double zero = 0.5 * kPi;  // zero of the slope
  for (double delta = 0.0; delta < 0.5 * kPi; delta += 1e-3) {
    if (pull_slope(delta, r.spread_rad) > 0.0) continue;
    zero = delta;
    break;
  }
  c.within = zero / 3.0;
  const double per_link = r.gain * pull_slope(c.within, r.spread_rad);
  promise(c, per_link * c.extremes.least, r.gain * c.extremes.least, per_link * lost(r.graph));
  c.why = say("contracts while all headings are within ", zero,
              " rad of each other (4.45); rate >= k lambda+ f'(", c.within,
              ") = ", c.guaranteed_1_s, " up to ", c.within, " rad");
}

/// A walker beside the direction to its goal turns that direction: with e = ψ − ψ_goal at the
/// distance r ė = −(k − v/r) sin e, so tan(e/2) decays at k − v/r.
void Certifier::goals(RuleCertificate& c) const {
  const double k = r_.heading.gain;
  const double stretch = on(all_.length) ? 1.0 + r_.length.limit : 1.0;
  const double fastest = stretch * this->fastest() * gait_.gait.most();
  promise(c, k * (1.0 - 1.0 / kFar), k, 0.0);
  c.within = kPi;
  c.beyond_m = kFar * fastest / k;
  c.why = say("contracts up to pi from its attractor in the metric 1/(1 + cos), rate k - v/r = ", k,
              " - v/r, r the way to the goal: at least ", c.guaranteed_1_s,
              " while that is more than ", c.beyond_m, " m");
  c.in_the_end = on(all_.phase) || on(all_.frequency);  // may hurry until phases agree
}

/// All in an arc D < π turn towards χ among them: with a + b = D
/// Ḋ = −m (φ̇₁ sin a + φ̇₂ sin b) <= −m ω sin D, so tan(D/2) decays at m ω [M18 eq. 4.33, 4.35].
void Certifier::consensus(RuleCertificate& c) const {
  if (n_ < 2) {
    c = alone(n_);
    return;
  }
  const double rate = r_.heading.gain * slowest();
  if (on(all_.frequency) && !on(all_.length)) {
    return refuse(c, "I lets phases advance unevenly for ever: omega is no bound", "II instead");
  }
  if (!gait_.sway.none() && !(sure(all_.phase) && gait_.spread_rad_s == 0.0)) {
    return refuse(c, "headings sway (g^psi) with phases that do not agree", "rule III");
  }
  promise(c, rate, r_.heading.gain * pace(), 0.0);
  c.in_the_end = on(all_.phase) || r_.heading.low_pass_s > 0.0;
  c.within = kPi;
  c.why = say("rate m_psi omega = ", rate,
              c.in_the_end ? " near the common heading" : " of tan(D/2), all in an arc D < pi");
  if (!gait_.sway.none()) behind_phases(c);  // all sway as one once phases agree
}

/// Per radian of gait, with y = ξ/Δz: ψ' = −m sin(ψ + atan y) + g^ψ, y' = g sin ψ/Δz
/// [M18 eq. 4.32]. Sway is an input of it [M18 4.4.2, 5]: walkers end on the one swaying way
/// (ψ*, y*) of period 2π, and come to it at the rate of what is linear about it, periodic too, so
/// of a whole cycle: roots for one g say nothing.
void Certifier::lanes(RuleCertificate& c) {
  const double m = r_.heading.gain, ahead = r_.heading.ahead_m;
  const SpeedFunction& g = gait_.gait;
  if (on(all_.length) && !(sure(all_.length) && (agree() || on(all_.frequency)))) {
    return refuse(c, "step lengths vary for ever (II without III), and lanes with them",
                  "rule III");
  }
  if (sways() && on(all_.frequency) && on(all_.length)) {
    return refuse(c, "headings sway (g^psi): no bound is known with I and II", "no sway");
  }
  const std::optional<SwayingWay> way = swaying_way(g, gait_.sway, m, ahead);
  double rate = way ? slowest() * periodic_rate([&](double phi) {
                        const auto [psi, y] = way->at(phi);
                        const double face = std::cos(psi + std::atan(y));
                        return Eigen::Matrix2d{{-m * face, -m * face / (1.0 + y * y)},
                                               {g(phi) * std::cos(psi) / ahead, 0.0}};
                      })
                    : 0.0;
  if (!(rate > 0.0)) {
    return refuse(c, "walkers swing about their lanes more and more, at the pace of their steps",
                  "a larger m_psi, or a goal further ahead");
  }
  if (sways() && on(all_.length)) {
    rate = std::min(rate, with_length(*way));
    if (!(rate > 0.0))
      return refuse(c, "with sway II and lanes are one loop, which grows", "no sway");
    RuleCertificate& ii = all_.length;
    promise(ii, std::min(rate, ii.guaranteed_1_s), std::min(rate, ii.expected_1_s), 0.0);
    ii.in_the_end = true;
    ii.why += say("; with sway II and lanes are one loop, at ", rate, " 1/s");
  }
  promise(c, rate, rate, 0.0);
  c.in_the_end = true;
  c.remains = way->most;
  for (const double y : way->y) all_.sway_m = std::max(all_.sway_m, std::abs(y) * ahead);
  c.why = say("walkers near their lanes come to them at ", rate, " 1/s, averaged over a cycle");
  if (c.remains > 0.0) {
    c.why += say("; sway keeps them within ", c.remains, " (angle, and way over ahead_m) of them");
  }
  const double least = 4.0 * g.mean() / ahead;
  if (m < least) c.change.push_back(say("m_psi above ", least, ": lanes do not overshoot"));
}

/// II and lanes about the swaying way, with eigenvalue λ of L and x = z − d, of walkers in step:
/// x' = −m_z λ g cos ψ* x − g sin ψ* δψ, and μ = −m_z λ x moves y. [1/s]
double Certifier::with_length(const SwayingWay& way) const {
  const double m = r_.heading.gain, ahead = r_.heading.ahead_m, m_z = r_.length.gain_1_m;
  const Extremes& e = all_.length.extremes;
  constexpr int kModes = 8;
  double slow = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= (e.most > e.least ? kModes : 0); ++i) {
    const double lambda = m_z * (e.least + (e.most - e.least) * i / kModes);
    slow = std::min(slow, slowest() * periodic_rate_of_three([&](double phi) {
                            const auto [psi, y] = way.at(phi);
                            const double at = gait_.gait(phi), c = at * std::cos(psi),
                                         s = at * std::sin(psi),
                                         face = m * std::cos(psi + std::atan(y));
                            return Eigen::Matrix3d{{-face, -face / (1.0 + y * y), 0.0},
                                                   {c / ahead, 0.0, -lambda * s / ahead},
                                                   {-s, 0.0, -lambda * c}};
                          }));
  }
  return slow;
}

}  // namespace mimesis::crowd
