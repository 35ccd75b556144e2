// Guarantees of rules I and II, alone, with III, and all three as one loop.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "nodes/crowd/certificate/certifier.h"

namespace mimesis::crowd {
namespace {

constexpr double kOnPath_rad = 1e-6;  // headings that are kept

/// Adds the verdict of theorem 6 on this graph and this ratio β of speeds.
void add_theorem6(RuleCertificate& c, const GraphSettings& graph, int n, double beta, bool advise) {
  c.theorem6 = theorem6_sum(c.extremes.ratio(), beta);
  if (graph.topology != Topology::weighted) {
    c.largest_agents = largest_agents(graph.topology, beta, Condition::theorem6);
  }
  if (c.theorem6 < 1.0) return;
  if (!advise) {
    c.why += say("; theorem 6 does not hold (", c.theorem6,
                 ") but is not needed once phases agree by III");
    return;
  }
  c.why += say("; theorem 6 does not hold (zeta^2 + eta^2 = ", c.theorem6,
               "): differences may first grow, by ", c.overshoot, " at most");
  if (c.largest_agents) {
    c.change.push_back(say("at most N = ", *c.largest_agents, " agents in a ",
                           to_string(graph.topology), " (there are ", n, ")"));
  }
  c.change.push_back(say("or all_to_all, which allows any N; or a smoother gait, g_min/g_max > ",
                         least_gait_ratio(c.extremes.ratio()), " (it is ", beta, ")"));
}

bool same(const GraphSettings& a, const GraphSettings& b) {
  const auto equal = [](const Edge& x, const Edge& y) {
    return x.i == y.i && x.j == y.j && x.weight == y.weight;
  };
  return a.topology == b.topology && a.directed == b.directed &&
         std::ranges::equal(a.edges, b.edges, equal);
}

}  // namespace

/// Rules I and II act along the path only if headings do.
bool Certifier::off_path(RuleCertificate& c) const {
  const HeadingKind kind = r_.heading.kind;
  if (kind == HeadingKind::lane) return false;
  if (kind == HeadingKind::keep && gait_.off_path_rad <= kOnPath_rad) return false;
  refuse(c, "headings do not follow the path along which distances are kept (ż = v cos psi)",
         "headings along the path, or to lanes");
  return true;
}

bool Certifier::repels(RuleCertificate& c, const char* gain, double value, double factor) const {
  if (value > 0.0) return false;
  refuse(c,
         say(gain, " = ", value, " < 0: agents drive each other apart, at up to ",
             -value * factor * gait_.gait.most() * c.extremes.most, " 1/s (4.28, 4.30)"),
         say(gain, " > 0"));
  return true;
}

/// φ̇ = ω − m L (z − d), z = G(φ) + c, with the mean phase as an input, which nothing but ω moves:
/// J = −m L D contracts in the metric L⁺ [M18 4.4.2, 2; B.3], towards a motion in which distances
/// oscillate.
void Certifier::frequency() {
  RuleCertificate& c = all_.frequency;
  const FrequencyRule& r = r_.frequency;
  const SpeedFunction& g = gait_.gait;
  const double m = r.gain_rad_m_s;
  const bool filtered = r.low_pass_rad_s > 0.0;
  const auto give_up = [&](const std::string& why, const std::string& change) {
    if (on(all_.phase)) refuse(all_.phase, "I moves phases, and is not certified: " + why, change);
    if (on(all_.tracking)) all_.tracking = all_.phase;
    refuse(c, why, change);  // last: they may be its own
  };
  if (c.extremes.least == 0.0 || repels(c, "m_d", m, 1.0) || off_path(c)) {
    return give_up(c.why, c.change[0]);
  }
  if (on(all_.phase)) {
    return give_up("no bound is known for I and III without II", "I alone, or II and III");
  }
  if (r.saturation_m > 0.0) {
    return give_up("a saturation moves the mean phase: no bound is known", "no saturation");
  }
  const double least = c.extremes.least, most = c.extremes.most;
  if (c.extremes.directed && (!even() || !alike() || filtered)) {
    return give_up("no bound is known along a directed graph but for an even gait",
                   "II and III, or a graph without directions");
  }
  c.overshoot = growth(c.extremes);
  c.within = slowest() / m;
  const double slow = std::cos(most_sway()) * g.least();  // ż = v cos ψ
  const auto rate = [&](double connectivity) {
    return filtered ? low_pass_rate(m, r.low_pass_rad_s, slow, g.most(), connectivity, most)
                    : m * slow * connectivity;
  };
  promise(c, rate(least), m * g.mean() * least, std::max(0.0, rate(lost(r.graph))));
  c.why = say("rate >= m_d g_min lambda+ = ", m, " * ", slow, " * ", least,
              " while sums of errors are below ", c.within, " m, where nobody has to wait");
  if (filtered) {
    const double alpha = r.low_pass_rad_s, bound = m * g.most() * most;
    c.in_the_end = true;
    c.overshoot *= std::numbers::sqrt2;
    c.expected_1_s = low_pass_mode_rate(alpha, c.expected_1_s);
    c.why += say("; low-pass: alpha = ", alpha, " against m_d g_max lambda_max = ", bound);
    if (c.guaranteed_1_s <= 0.0) {
      return give_up(
          c.why, say("low_pass_rad_s above ", bound, ", or m_d below ", alpha / (g.most() * most)));
    }
  }
  if (!c.extremes.directed) add_theorem6(c, r.graph, n_, g.least() / g.most(), true);
  if (!even()) c.remains = kUnknown;  // distances oscillate with g(φ)
}

/// ẋ = −m Φ̇ D L x: contracts in the metric L whatever the phases are, if they advance [M18 4.4.2,
/// 3]. Once they agree Φ̇ D is φ̇ g(φ) I, and x decays as exp(−m λ⁺ ∫ g dφ).
void Certifier::length() {
  RuleCertificate& c = all_.length;
  const LengthRule& r = r_.length;
  const SpeedFunction& g = gait_.gait;
  const double m = r.gain_1_m, omega = pace();
  if (c.extremes.least == 0.0 || repels(c, "m_z", m, omega) || off_path(c) || uneven_along(c)) {
    return;
  }
  if (!(slowest() > 0.0)) {
    return refuse(c, "a phase does not advance: contraction needs omega > 0 (4.4.2)",
                  "a spread of eigenfrequencies below omega_0");
  }
  const double along = std::cos(most_sway());  // ż = v cos ψ
  const double each = m * along * (agree() ? g.mean() : g.least());
  const auto rate = [&](double connectivity) {
    return std::max(each * slowest() * connectivity, agree() || c.extremes.directed || sways()
                                                         ? 0.0
                                                         : averaged(connectivity, c.extremes));
  };
  promise(c, rate(c.extremes.least), m * along * omega * g.mean() * c.extremes.least,
          rate(lost(r.graph)));
  c.within = r.limit / m;
  c.overshoot = growth(c.extremes);
  const bool by_cycles = c.guaranteed_1_s > each * slowest() * c.extremes.least;
  if (by_cycles) c.overshoot *= (1.0 + swing(c.extremes)) / (1.0 - swing(c.extremes));
  c.why = say("rate m_z omega ", agree() || by_cycles ? "<g>" : "g_min", " lambda+",
              by_cycles ? " but for what g swings: " : " = ", c.guaranteed_1_s, " 1/s",
              ", while sums of errors are below ", c.within, " m (|mu| <= ", r.limit, ")");
  const double beta = slowest() * g.least() / (fastest() * g.most());
  if (!c.extremes.directed) add_theorem6(c, r.graph, n_, beta, !agree());
  // Distances oscillate with g(φ), and unequal paces keep walkers apart.
  if (!agree() || (gait_.spread_rad_s > 0.0 && !sure(all_.phase))) c.remains = kUnknown;
  behind_phases(c);
}

/// m_z times half the range of ∫ (g − ⟨g⟩) dφ times λ_max: ε.
double Certifier::swing(const Extremes& e) const {
  double least = 0.0, most = 0.0;
  constexpr int kSamples = 720;
  for (int i = 1; i < kSamples; ++i) {
    const double phi = 2.0 * kPi * i / kSamples;
    const double off = gait_.gait.integral(phi) - gait_.gait.mean() * phi;
    least = std::min(least, off), most = std::max(most, off);
  }
  return r_.length.gain_1_m * 0.501 * (most - least) * e.most;
}

/// Rate of II whatever the phases are, by averaging: with s = L^½ x, A = L^½ Φ̇ D L^½ and
/// Q = L^½ diag(∫ (g − ⟨g⟩) dφᵢ) L^½, y = (I + m Q) s decays by
///   ẏ = −m (⟨g⟩ L^½ Φ̇ L^½ + m Q A) (I + m Q)⁻¹ y,  ‖m Q‖ <= ε.
double Certifier::averaged(double connectivity, const Extremes& e) const {
  const double eps = swing(e), mean = gait_.gait.mean();
  if (eps >= 1.0) return 0.0;
  const double lost = eps / (1.0 - eps) * fastest() * e.most * (mean + gait_.gait.most());
  return r_.length.gain_1_m * (mean * slowest() * connectivity - lost);
}

/// I, II and III: with y = z − d − g δφ of agents near formation and an eigenvalue λ of L
///   δφ̇ = −(m_d g + k) λ δφ − m_d λ y,  ẏ = −ω m_z g λ (g δφ + y),
/// g = g(ωt); for constant g s² + (a + b + c) s + a c = 0, a = k λ, b = m_d g λ, c = m_z ω g λ.
/// Not a hierarchy: the slow mode is slower than each of a, b, c. [M18 4.4.2, 4] shows it,
/// without a bound.
void Certifier::joint() {
  const double m_d = r_.frequency.gain_rad_m_s, m_z = r_.length.gain_1_m;
  const double k = r_.phase.gain_1_s, omega = own_pace();
  const SpeedFunction& g = gait_.gait;
  const double along = std::cos(most_sway());  // ż = v cos ψ
  const auto rate = [&](double least, double most) {
    constexpr int kModes = 8;
    double slow = least > 0.0 ? std::numeric_limits<double>::infinity() : 0.0;
    for (int i = 0; slow > 0.0 && i <= (most > least ? kModes : 0); ++i) {
      const double lambda = least + (most - least) * i / kModes;
      slow = std::min(slow, omega * periodic_rate([&](double phi) {
                              const double at = along * g(phi);
                              return Eigen::Matrix2d{
                                  {-(m_d * at + k) * lambda / omega, -m_d * lambda / omega},
                                  {-m_z * lambda * at * at, -m_z * lambda * at}};
                            }));
    }
    return slow;
  };
  RuleCertificate c = all_.frequency;
  std::string why;
  if (c.extremes.least == 0.0 || repels(c, "m_d", m_d, 1.0) || repels(c, "m_z", m_z, omega) ||
      off_path(c)) {
    why = c.why;
  } else if (!sure(all_.phase) || led() || gait_.spread_rad_s != 0.0) {
    why = "no bound is known for I and II but with III, without leader and with one eigenfrequency";
  } else if (!same(r_.frequency.graph, r_.length.graph) ||
             !same(r_.frequency.graph, r_.phase.graph)) {
    why = "no bound is known for I, II and III along different graphs";
  } else if (c.extremes.directed) {
    why = "no bound is known for I, II and III along a directed graph";
  } else if (r_.frequency.low_pass_rad_s > 0.0) {
    why = "no bound is known for I, II and III with a low-pass";
  } else {
    const double together = rate(c.extremes.least, c.extremes.most);
    if (together <= 0.0) why = "I, II and III: the slow mode grows";
    promise(c, together, together, rate(lost(r_.frequency.graph), c.extremes.most));
  }
  c.in_the_end = true;
  c.why = say("I, II and III are one loop: the slow mode near formation decays at ",
              c.guaranteed_1_s, " 1/s");
  for (RuleCertificate* rule : {&all_.frequency, &all_.length, &all_.phase, &all_.tracking}) {
    if (!on(*rule)) continue;
    if (why.empty()) {
      *rule = c;
    } else {
      refuse(*rule, why, "I alone, or II and III");
    }
  }
}

}  // namespace mimesis::crowd
