#include <algorithm>
#include <cmath>

#include "nodes/crowd/certificate/contraction.h"
#include "nodes/crowd/certificate/rule_certificates.h"
#include "nodes/crowd/certificate/say.h"

namespace mimesis::crowd {
namespace {

/// The rate is proportional to λ⁺.
void add_lost_link(RuleCertificate& c, const GraphSettings& graph, int n) {
  c.without_link_1_s = c.guaranteed_1_s * connectivity_without_link(graph, n) / c.extremes.least;
}

/// What theorem 6 says about this graph and this ratio β of speeds.
void add_theorem6(RuleCertificate& c, const GraphSettings& graph, int n, double beta) {
  c.theorem6 = theorem6_sum(c.extremes.ratio(), beta);
  if (graph.topology != Topology::weighted) {
    c.largest_agents = largest_agents(graph.topology, beta, Condition::theorem6);
  }
  if (c.theorem6 < 1.0) return;
  c.overshoot = std::sqrt(1.0 / c.extremes.ratio());
  c.why += say("; theorem 6 does not hold (zeta^2 + eta^2 = ", c.theorem6,
               "): differences may first grow, by ", c.overshoot, " at most");
  if (c.largest_agents) {
    c.change.push_back(say("at most N = ", *c.largest_agents, " agents in a ",
                           to_string(graph.topology), " (there are ", n, ")"));
  }
  c.change.push_back(say("or all_to_all, which allows any N; or a smoother gait, g_min/g_max > ",
                         least_gait_ratio(c.extremes.ratio()), " (it is ", beta, ")"));
}

}  // namespace

RuleCertificate certify_frequency(const FrequencyRule& r, int n, const GaitRange& gait) {
  RuleCertificate c;
  if (r.gain_rad_m_s == 0.0) return c;
  if (n < 2) return alone(n);
  std::optional<RuleCertificate> refusal;
  c.extremes = extremes_of(r.graph, n, refusal);
  if (refusal) return *refusal;
  const SpeedFunction& g = gait.gait;
  const double m = r.gain_rad_m_s;
  if (m < 0.0) {
    return refused(say("m_d = ", m, " < 0: agents drive each other apart, at up to ",
                       -m * g.most() * c.extremes.most, " 1/s (4.28)"),
                   {"m_d > 0"});
  }
  c.guarantee = Guarantee::contracting;
  c.expected_1_s = m * g.mean() * c.extremes.least;
  c.guaranteed_1_s = m * g.least() * c.extremes.least;
  c.why = say("rate >= m_d g_min lambda+ = ", m, " * ", g.least(), " * ", c.extremes.least);
  add_lost_link(c, r.graph, n);
  add_theorem6(c, r.graph, n, g.least() / g.most());
  if (r.low_pass_rad_s > 0.0) {
    const double alpha = r.low_pass_rad_s, bound = m * g.most() * c.extremes.most;
    c.expected_1_s = low_pass_mode_rate(alpha, c.expected_1_s);
    c.guaranteed_1_s =
        low_pass_rate(m, alpha, g.least(), g.most(), c.extremes.least, c.extremes.most);
    c.why += say("; low-pass: alpha = ", alpha, " against m_d g_max lambda_max = ", bound);
    // A lost link makes no eigenvalue larger [M18 A.7]: the bound by λ_max stays.
    c.without_link_1_s = std::min(c.without_link_1_s, c.guaranteed_1_s);
    if (c.guaranteed_1_s <= 0.0) {
      c.guarantee = Guarantee::none;
      c.guaranteed_1_s = c.without_link_1_s = 0.0;
      c.change.push_back(say("low_pass_rad_s above ", bound, ", or m_d below ",
                             alpha / (g.most() * c.extremes.most)));
    }
  }
  if (r.saturation_m > 0.0 && c.guarantee == Guarantee::contracting) {
    // With e = L (z − d), V = (z − d)ᵀe/2 has V̇ = −m_d Σ g eᵢ sat(eᵢ), and sat(e)/e falls slowly.
    constexpr double kPart = 0.25;
    c.within = kPart * r.saturation_m;
    c.guaranteed_1_s *= std::tanh(kPart) / kPart;
    c.without_link_1_s *= std::tanh(kPart) / kPart;
    c.why += say("; while sums of errors are below ", c.within, " m; beyond, the saturation of ",
                 r.saturation_m, " m slows it down, and V = (z-d)' L (z-d)/2 still falls");
  }
  return c;
}

RuleCertificate certify_length(const LengthRule& r, int n, const GaitRange& gait,
                               bool phases_agree) {
  RuleCertificate c;
  if (r.gain_1_m == 0.0) return c;
  if (n < 2) return alone(n);
  std::optional<RuleCertificate> refusal;
  c.extremes = extremes_of(r.graph, n, refusal);
  if (refusal) return *refusal;
  const SpeedFunction& g = gait.gait;
  const double m = r.gain_1_m, omega = gait.eigenfrequency_rad_s;
  if (m < 0.0) {
    return refused(say("m_z = ", m, " < 0: agents drive each other apart, at up to ",
                       -m * omega * g.most() * c.extremes.most, " 1/s (4.30)"),
                   {"m_z > 0"});
  }
  const double slowest = omega - gait.spread_rad_s, fastest = omega + gait.spread_rad_s;
  if (!(slowest > 0.0)) {
    return refused("a phase does not advance: contraction needs omega > 0 (4.4.2)",
                   {"a spread of eigenfrequencies below omega_0"});
  }
  c.guarantee = Guarantee::contracting;
  c.within = r.limit / m;
  c.expected_1_s = m * omega * g.mean() * c.extremes.least;
  c.guaranteed_1_s = m * slowest * g.least() * c.extremes.least;
  c.why = say("rate >= m_z omega g_min lambda+ = ", m, " * ", slowest, " * ", g.least(), " * ",
              c.extremes.least, ", while sums of errors are below ", c.within,
              " m (|mu| <= ", r.limit, ")");
  add_lost_link(c, r.graph, n);
  const double beta = slowest * g.least() / (fastest * g.most());
  if (!phases_agree) {
    add_theorem6(c, r.graph, n, beta);
    return c;
  }
  // Once phases agree D is g(φ) I, which commutes with L.
  RuleCertificate before = c;
  add_theorem6(before, r.graph, n, beta);
  c.theorem6 = before.theorem6;
  c.largest_agents = before.largest_agents;
  if (before.theorem6 >= 1.0) {
    c.why += say("; theorem 6 does not hold (", c.theorem6,
                 ") but is not needed once phases agree by III");
  }
  return c;
}

}  // namespace mimesis::crowd
