#include "nodes/crowd/certificate/certificate.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>
#include <utility>

#include "common/error.h"
#include "nodes/crowd/certificate/swaying_way.h"

namespace mimesis::crowd {
namespace {

/// Words and numbers in one line; numbers with four digits.
template <class... Part>
std::string say(const Part&... part) {
  std::ostringstream out;
  out.precision(4);
  (out << ... << part);
  return out.str();
}

RuleCertificate refused(std::string why, std::vector<std::string> change) {
  RuleCertificate c;
  c.guarantee = Guarantee::none;
  c.why = std::move(why);
  c.change = std::move(change);
  return c;
}

RuleCertificate alone(int n) {
  RuleCertificate c;
  c.why = say("N = ", n, ": the Laplacian is 0, there is nobody to agree with");
  return c;
}

Extremes extremes_of(const GraphSettings& settings, int n,
                     std::optional<RuleCertificate>& refusal) {
  try {
    const CouplingGraph graph = coupling(settings, n);
    if (settings.topology == Topology::none || !graph.connected()) {
      refusal = refused(say("the coupling graph of ", n,
                            " agents is not connected: lambda_2 = 0, its parts do not agree"),
                        {"join the parts by links: lambda+ > 0"});
      return {};
    }
    const Extremes found = extremes(graph);
    if (found.directed && found.least == 0.0) {
      refusal = refused(
          "not everybody is heard by everybody, directly or through others (or there are more than "
          "600): no bound is known along such a directed graph (4.28)",
          {"links that make it strongly connected"});
      return {};
    }
    return found;
  } catch (const ConfigError& e) {
    refusal = refused(e.what(), {"another graph, or more agents"});
    return {};
  }
}

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

constexpr double kPi = std::numbers::pi;
constexpr double kFar = 5.0;        // v/k that goals are away at least
constexpr double kNear_rad = 0.3;   // phases to their leader, for a rate near α
constexpr double kSteep_rad = 0.7;  // e cos e rises by 0.3 e at least up to here
constexpr double kUnknown = std::numeric_limits<double>::infinity();
constexpr double kOnPath_rad = 1e-6;  // headings that are kept
// In one step Adams and Bashforth's method turns exp(−x) into exp(−x + 5/12 x³): 98 % of this x.
constexpr double kFollowed = 0.2;

/// Derivative of sin Δ exp(−Δ²/2σ²), σ = 0: of sin Δ.
double pull_slope(double delta, double sigma) {
  if (sigma == 0.0) return std::cos(delta);
  const double s2 = sigma * sigma;
  return (std::cos(delta) - delta / s2 * std::sin(delta)) * std::exp(-0.5 * delta * delta / s2);
}

bool same(const GraphSettings& a, const GraphSettings& b) {
  const auto equal = [](const Edge& x, const Edge& y) {
    return x.i == y.i && x.j == y.j && x.weight == y.weight;
  };
  return a.topology == b.topology && a.directed == b.directed &&
         std::ranges::equal(a.edges, b.edges, equal);
}

/// Largest sum of weights at a node.
double most_links(const GraphSettings& settings, int n) {
  if (settings.topology == Topology::none) return 0.0;
  const CouplingGraph graph = coupling(settings, n);
  if (graph.complete()) return n;
  double most = 0.0;
  for (int i = 0; i < n; ++i) most = std::max(most, graph.degree(i));
  return most;
}

/// What the rules of one group guarantee together. Which acts on which decides: III is autonomous
/// without I; phases drive II, both drive lanes, and lanes drive the way along the path by cos ψ.
/// In such a hierarchy the slowest rate above a rule is its own [M18 4.4.2, 3]. I closes a loop
/// with II and III, for which there is one joint certificate.
class Certifier {
 public:
  Certifier(const Rules& rules, int n, const GaitRange& gait) : r_(rules), n_(n), gait_(gait) {}

  Certificate run() {
    all_.agents = n_;
    phase();
    all_.frequency = graphed(r_.frequency.gain_rad_m_s, r_.frequency.graph);
    all_.length = graphed(r_.length.gain_1_m, r_.length.graph);
    if (on(all_.frequency) && on(all_.length)) {
      joint();
    } else if (on(all_.frequency)) {
      frequency();
    } else if (on(all_.length)) {
      length();
    }
    heading();
    if (r_.heading.kind == HeadingKind::lane) {
      for (RuleCertificate* rule : {&all_.frequency, &all_.length}) behind_lanes(*rule);
      if (on(all_.frequency)) behind_lanes(all_.phase);
    }
    if (gait_.guests > 0) late();
    if (r_.heading.avoid) while_free();
    if (gait_.step_s > 0.0) in_steps();
    notes();
    return std::move(all_);
  }

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

  void phase() {
    const bool beat = gait_.beat_gain_1_s != 0.0;
    const double k = r_.phase.gain_1_s;
    const double alpha = beat ? gait_.beat_gain_1_s : r_.phase.leader_gain_1_s;
    RuleCertificate& c = all_.phase;
    if (k == 0.0 && alpha == 0.0) return;
    if (n_ < (beat ? 1 : 2)) {
      c = alone(n_);
      return;
    }
    if (k < 0.0 || alpha < 0.0) {
      c = refused(
          say("k = ", k, ", alpha = ", alpha, ": a negative gain repels phases (4.31, 4.26)"),
          {"k > 0", "alpha >= 0"});
      return;
    }
    const int coupled = alpha > 0.0 && !beat ? n_ - 1 : n_;  // the leader is coupled to no agent
    std::optional<RuleCertificate> refusal;
    if (k > 0.0 && coupled > 1) c.extremes = extremes_of(r_.phase.graph, coupled, refusal);
    if (refusal && (alpha == 0.0 || r_.phase.graph.directed)) {
      c = *refusal;
      return;
    }
    const bool joined = c.extremes.most > 0.0,
               all_to_all = r_.phase.graph.topology == Topology::all_to_all;
    const double rate = k * c.extremes.least + alpha;
    promise(
        c, rate, rate,
        alpha + (joined ? k * connectivity_without_link(coupling(r_.phase.graph, coupled)) : 0.0));
    c.why = alpha > 0.0 ? say("rate of followers k lambda+ + alpha = ", k, " * ", c.extremes.least,
                              " + ", alpha)
                        : say("rate k lambda+ = ", k, " * ", c.extremes.least, " for every k > 0");
    // Nobody walks backwards: the engine's φ̇ >= 0 slows down who is further ahead. All-to-all
    // agents follow the circular mean, which is among them if they are in half a circle.
    const double pull = (joined ? k * most_links(r_.phase.graph, coupled) : 0.0) + alpha;
    c.within = slowest() / pull;
    if (all_to_all || !joined) c.within = std::min(kPi, c.within);
    c.why += say(" while phases are within ", c.within, " rad, where nobody has to wait");
    // (k L + α) e = ω − mean: all-to-all 2 s/rate apart; else |e| <= √n s/rate and apart by √2 |e|.
    const double spread = gait_.spread_rad_s;
    c.remains = all_to_all || coupled < 2
                    ? 2.0 * spread / rate
                    : std::sqrt(2.0 * coupled) * c.extremes.skew * spread / rate;
    c.overshoot = c.extremes.skew;
    if (spread > 0.0) {
      c.why += say("; eigenfrequencies that differ by up to ", 2.0 * spread, " rad/s lock up to ",
                   c.remains, " rad apart");
    }
    if (c.remains >= c.within) {
      refuse(c, say(c.why, ", which is not within"), "a smaller spread, or a larger k");
    }
    c.within -= c.remains;
    if (alpha > 0.0) tracking(alpha, all_to_all && joined);
  }

  /// Followers at e of their leader: ė = δ − (k L + α) e, where paces differ by δ at most. Along a
  /// graph, and alone, |e| decays at α to δ/α at most, since rows of (k L + α)⁻¹ add up to 1/α. All
  /// to all they go to arg(k Σ e^{iφ} + α e^{iφ₀}), so the farthest, at e, comes at
  /// (k N + α) atan2(α sin e, k N + α cos e) >= α e cos e, and beyond the root of α e cos e = δ at
  /// the slope of that at least.
  void tracking(double alpha, bool all_to_all) {
    RuleCertificate& t = all_.tracking;
    const double delta = off_leader(), room = sure(all_.phase) ? all_.phase.within : 0.0;
    t.within = std::min(kPi, room);
    t.why = beats()
                ? say("to the beat at alpha = ", alpha, ", whoever else is there")
                : say("to the leader at alpha = ", alpha,
                      " alone: coupling among followers does not move their mean (eigenvalue 0)");
    promise(t, alpha, alpha, alpha);
    t.remains = delta / alpha;
    if (all_to_all) {
      t.within = std::min(0.5 * room, kNear_rad);
      while (t.within * std::cos(t.within) < 1.2 * t.remains &&
             t.within < std::min(0.5 * room, kSteep_rad)) {
        t.within += 0.01;
      }
      const double slope = std::cos(t.within) - (delta > 0.0 ? t.within * std::sin(t.within) : 0.0);
      t.guaranteed_1_s = t.without_link_1_s = alpha * slope;
      const double most = t.within * std::cos(t.within);
      t.remains = t.remains < most ? t.remains * t.within / most : kUnknown;  // it is concave
      t.why += say("; at ", t.guaranteed_1_s, " at least while within ", t.within, " rad");
    }
    if (delta == 0.0) return;
    const std::string whose = beats() ? "the beat's pace" : "the leader's pace";
    t.why += say("; ", whose, " may differ by ", delta, " rad/s: they lock up to ", t.remains,
                 " rad beside it");
    if (t.remains < t.within && t.guaranteed_1_s > 0.0) {
      t.within -= all_to_all ? 0.0 : t.remains;
      return;
    }
    refuse(t,
           say(whose, " may differ by ", delta, " rad/s: alpha = ", alpha,
               " does not hold followers within ", t.within, " rad of it, they may slip past"),
           say("alpha above ", 4.0 * delta, ", or paces that differ less"));
  }

  /// Rules I and II act along the path only if headings do.
  bool off_path(RuleCertificate& c) const {
    const HeadingKind kind = r_.heading.kind;
    if (kind == HeadingKind::lane) return false;
    if (kind == HeadingKind::keep && gait_.off_path_rad <= kOnPath_rad) return false;
    refuse(c, "headings do not follow the path along which distances are kept (ż = v cos psi)",
           "headings along the path, or to lanes");
    return true;
  }

  bool repels(RuleCertificate& c, const char* gain, double value, double factor) const {
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
  void frequency() {
    RuleCertificate& c = all_.frequency;
    const FrequencyRule& r = r_.frequency;
    const SpeedFunction& g = gait_.gait;
    const double m = r.gain_rad_m_s;
    const bool filtered = r.low_pass_rad_s > 0.0;
    const auto give_up = [&](const std::string& why, const std::string& change) {
      if (on(all_.phase))
        refuse(all_.phase, "I moves phases, and is not certified: " + why, change);
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
        return give_up(c.why, say("low_pass_rad_s above ", bound, ", or m_d below ",
                                  alpha / (g.most() * most)));
      }
    }
    if (!c.extremes.directed) add_theorem6(c, r.graph, n_, g.least() / g.most(), true);
    if (!even()) c.remains = kUnknown;  // distances oscillate with g(φ)
  }

  /// ẋ = −m Φ̇ D L x: contracts in the metric L whatever the phases are, if they advance [M18 4.4.2,
  /// 3]. Once they agree Φ̇ D is φ̇ g(φ) I, and x decays as exp(−m λ⁺ ∫ g dφ).
  void length() {
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
  double swing(const Extremes& e) const {
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
  double averaged(double connectivity, const Extremes& e) const {
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
  void joint() {
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
      why =
          "no bound is known for I and II but with III, without leader and with one eigenfrequency";
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

  void heading() {
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
    } else if ((on(all_.phase) && !sure(all_.phase)) ||
               (on(all_.tracking) && !sure(all_.tracking))) {
      refuse(c, "nothing is known of phases", "see rule III");
    } else if (r.kind == HeadingKind::goal) {
      goals(c);
    } else if (r.kind == HeadingKind::consensus) {
      consensus(c);
    } else {
      lanes(c);
    }
  }

  void coupled_headings(RuleCertificate& c) const {
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
  void goals(RuleCertificate& c) const {
    const double k = r_.heading.gain;
    const double stretch = on(all_.length) ? 1.0 + r_.length.limit : 1.0;
    const double fastest = stretch * this->fastest() * gait_.gait.most();
    promise(c, k * (1.0 - 1.0 / kFar), k, 0.0);
    c.within = kPi;
    c.beyond_m = kFar * fastest / k;
    c.why =
        say("contracts up to pi from its attractor in the metric 1/(1 + cos), rate k - v/r = ", k,
            " - v/r, r the way to the goal: at least ", c.guaranteed_1_s,
            " while that is more than ", c.beyond_m, " m");
    c.in_the_end = on(all_.phase) || on(all_.frequency);  // may hurry until phases agree
  }

  /// All in an arc D < π turn towards χ among them: with a + b = D
  /// Ḋ = −m (φ̇₁ sin a + φ̇₂ sin b) <= −m ω sin D, so tan(D/2) decays at m ω [M18 eq. 4.33, 4.35].
  void consensus(RuleCertificate& c) const {
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
  void lanes(RuleCertificate& c) {
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
      c.why +=
          say("; sway keeps them within ", c.remains, " (angle, and way over ahead_m) of them");
    }
    const double least = 4.0 * g.mean() / ahead;
    if (m < least) c.change.push_back(say("m_psi above ", least, ": lanes do not overshoot"));
  }

  /// II and lanes about the swaying way, with eigenvalue λ of L and x = z − d, of walkers in step:
  /// x' = −m_z λ g cos ψ* x − g sin ψ* δψ, and μ = −m_z λ x moves y. [1/s]
  double with_length(const SwayingWay& way) const {
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

  /// Agents from outside are known late, and know late what to do.
  void late() {
    const double fast = fastest() * gait_.gait.most(), k = r_.phase.gain_1_s;
    const double alpha = beats() ? gait_.beat_gain_1_s : r_.phase.leader_gain_1_s;
    Certificate& c = all_;
    const bool loop = on(c.frequency) && on(c.length);
    const double phases = k * c.phase.extremes.most + alpha;
    delay(c.phase, loop ? kUnknown : phases);
    delay(c.tracking, loop ? kUnknown : phases + k * c.phase.extremes.most);  // largest error
    delay(c.frequency,
          loop ? kUnknown
               : r_.frequency.gain_rad_m_s * gait_.gait.most() * c.frequency.extremes.most);
    const double each = r_.length.gain_1_m * fast;
    delay(c.length, loop ? kUnknown : each * c.length.extremes.most);
    const HeadingKind kind = r_.heading.kind;
    if (kind == HeadingKind::coupled) delay(c.heading, r_.heading.gain * c.heading.extremes.most);
    if (kind == HeadingKind::consensus) delay(c.heading, 2.0 * r_.heading.gain * fastest());
    for (const RuleCertificate* first : {&c.phase, &c.tracking}) {
      behind(c.length, *first, "phases");
      if (kind == HeadingKind::consensus && !gait_.sway.none()) behind(c.heading, *first, "phases");
    }
    if (!sure(c.length)) return;
    // Carried on at its speed an agent is up to ½ τ² v̇ off, with v = φ̇ g(φ).
    double steep = 0.0;
    for (int i = 0; i < 64; ++i) {
      const double phi = 2.0 * kPi * i / 64, h = 1e-3;
      steep = std::max(steep, std::abs(gait_.gait(phi + h) - gait_.gait(phi - h)) / (2.0 * h));
    }
    const double off = 0.5 * std::pow(gait_.age_s * fastest(), 2) * steep;
    const double heard =
        std::min(most_links(r_.length.graph, n_), static_cast<double>(gait_.guests));
    c.length.remains += std::sqrt(n_) * each * heard * off / c.length.guaranteed_1_s;
  }
  void delay(RuleCertificate& c, double stiffness_1_s) const {
    if (!sure(c)) return;
    const double rate = late_rate(c.guaranteed_1_s, stiffness_1_s, gait_.age_s);
    const std::string of =
        say(gait_.guests, " agents from outside, with states up to ", gait_.age_s, " s old");
    if (!(rate > 0.0)) {
      return refuse(c, say("no bound is known with ", of, ", and this gain"),
                    "a smaller gain, or reports more often");
    }
    c.overshoot *= std::exp(3.0 * gait_.age_s * rate);
    c.guaranteed_1_s = rate;
    c.without_link_1_s = std::min(c.without_link_1_s, rate);
    c.why += say("; ", rate, " 1/s with ", of, ", if they do what they are told");
  }

  /// Whoever avoids others is held up and turned by them, by walls and pillars; phases continue,
  /// but where rule I moves them.
  void while_free() {
    for (RuleCertificate* c : {&all_.frequency, &all_.length, &all_.heading}) hold_up(*c);
    if (!on(all_.frequency)) return;
    hold_up(all_.phase);
    hold_up(all_.tracking);
  }
  static void hold_up(RuleCertificate& c) {
    if (!sure(c)) return;
    c.while_free = true;
    c.why += "; none while others, walls or pillars are near, which turn walkers and hold them up";
  }

  void in_steps() {
    const double most = kFollowed / gait_.step_s;
    for (RuleCertificate* c :
         {&all_.frequency, &all_.length, &all_.phase, &all_.tracking, &all_.heading}) {
      if (c->guaranteed_1_s <= most) continue;
      c->guaranteed_1_s = most;
      c->without_link_1_s = std::min(c->without_link_1_s, most);
      c->why += say("; steps of ", gait_.step_s, " s are sure to follow ", most, " 1/s");
    }
  }

  void notes() {
    Certificate& c = all_;
    const bool distances = on(c.frequency) || on(c.length);
    if (distances && !even() && !(sure(c.phase) && (on(c.length) || !on(c.frequency)))) {
      c.notes.push_back(
          "distances keep oscillating where phases differ, as g(phi) does: rule III takes that "
          "away");
    }
    if (on(c.frequency) && on(c.phase) && !on(c.length)) {
      c.notes.push_back(
          say("I and III both set the phase: distances and phases agree together only "
              "where distances are whole cycles of ",
              gait_.gait.cycle_m(), " m; rule II frees them"));
    }
  }

  const Rules& r_;
  int n_;
  const GaitRange& gait_;
  Certificate all_;
};

std::array<const RuleCertificate*, 5> rules_of(const Certificate& c) {
  return {&c.frequency, &c.length, &c.phase, &c.tracking, &c.heading};
}

}  // namespace

const char* to_string(Guarantee guarantee) {
  constexpr std::array kNames = {"off", "none", "contracting"};
  return kNames.at(static_cast<std::size_t>(guarantee));
}

bool Certificate::holds() const {
  return std::ranges::none_of(
      rules_of(*this), [](const RuleCertificate* r) { return r->guarantee == Guarantee::none; });
}

std::optional<double> Certificate::rate_1_s() const {
  std::optional<double> least;
  for (const RuleCertificate* r : rules_of(*this)) {
    if (r->guarantee == Guarantee::off) continue;
    if (r->guarantee != Guarantee::contracting) return std::nullopt;
    least = std::min(least.value_or(r->guaranteed_1_s), r->guaranteed_1_s);
  }
  return least;
}

Certificate certify(const Rules& rules, int n, const GaitRange& gait) {
  return Certifier(rules, n, gait).run();
}

std::vector<TopologyLimit> topology_limits(const SpeedFunction& gait) {
  const double beta = gait.least() / gait.most();
  std::vector<TopologyLimit> limits;
  for (const Topology topology :
       {Topology::chain, Topology::ring, Topology::star, Topology::wheel, Topology::all_to_all}) {
    limits.push_back({topology, largest_agents(topology, beta, Condition::theorem6),
                      largest_agents(topology, beta, Condition::weak)});
  }
  return limits;
}

}  // namespace mimesis::crowd
