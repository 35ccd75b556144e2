#include "nodes/crowd/certificate/certificate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/error.h"
#include "nodes/crowd/certificate/certifier.h"

namespace mimesis::crowd {
namespace {

constexpr double kNear_rad = 0.3;   // phases to their leader, for a rate near α
constexpr double kSteep_rad = 0.7;  // e cos e rises by 0.3 e at least up to here
// In one step Adams and Bashforth's method turns exp(−x) into exp(−x + 5/12 x³): 98 % of this x.
constexpr double kFollowed = 0.2;

/// Largest sum of weights at a node.
double most_links(const GraphSettings& settings, int n) {
  if (settings.topology == Topology::none) return 0.0;
  const CouplingGraph graph = coupling(settings, n);
  if (graph.complete()) return n;
  double most = 0.0;
  for (int i = 0; i < n; ++i) most = std::max(most, graph.degree(i));
  return most;
}

std::array<const RuleCertificate*, 5> rules_of(const Certificate& c) {
  return {&c.frequency, &c.length, &c.phase, &c.tracking, &c.heading};
}

}  // namespace

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

Certificate Certifier::run() {
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

void Certifier::phase() {
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
    c = refused(say("k = ", k, ", alpha = ", alpha, ": a negative gain repels phases (4.31, 4.26)"),
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
void Certifier::tracking(double alpha, bool all_to_all) {
  RuleCertificate& t = all_.tracking;
  const double delta = off_leader(), room = sure(all_.phase) ? all_.phase.within : 0.0;
  t.within = std::min(kPi, room);
  t.why = beats() ? say("to the beat at alpha = ", alpha, ", whoever else is there")
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

/// Agents from outside are known late, and know late what to do.
void Certifier::late() {
  const double fast = fastest() * gait_.gait.most(), k = r_.phase.gain_1_s;
  const double alpha = beats() ? gait_.beat_gain_1_s : r_.phase.leader_gain_1_s;
  Certificate& c = all_;
  const bool loop = on(c.frequency) && on(c.length);
  const double phases = k * c.phase.extremes.most + alpha;
  delay(c.phase, loop ? kUnknown : phases);
  delay(c.tracking, loop ? kUnknown : phases + k * c.phase.extremes.most);  // largest error
  delay(
      c.frequency,
      loop ? kUnknown : r_.frequency.gain_rad_m_s * gait_.gait.most() * c.frequency.extremes.most);
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
  const double heard = std::min(most_links(r_.length.graph, n_), static_cast<double>(gait_.guests));
  c.length.remains += std::sqrt(n_) * each * heard * off / c.length.guaranteed_1_s;
}

void Certifier::delay(RuleCertificate& c, double stiffness_1_s) const {
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
void Certifier::while_free() {
  for (RuleCertificate* c : {&all_.frequency, &all_.length, &all_.heading}) hold_up(*c);
  if (!on(all_.frequency)) return;
  hold_up(all_.phase);
  hold_up(all_.tracking);
}

void Certifier::hold_up(RuleCertificate& c) {
  if (!sure(c)) return;
  c.while_free = true;
  c.why += "; none while others, walls or pillars are near, which turn walkers and hold them up";
}

void Certifier::in_steps() {
  const double most = kFollowed / gait_.step_s;
  for (RuleCertificate* c :
       {&all_.frequency, &all_.length, &all_.phase, &all_.tracking, &all_.heading}) {
    if (c->guaranteed_1_s <= most) continue;
    c->guaranteed_1_s = most;
    c->without_link_1_s = std::min(c->without_link_1_s, most);
    c->why += say("; steps of ", gait_.step_s, " s are sure to follow ", most, " 1/s");
  }
}

void Certifier::notes() {
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
