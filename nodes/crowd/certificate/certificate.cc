#include "nodes/crowd/certificate/certificate.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <sstream>
#include <utility>

#include "common/error.h"
#include "common/math/circle.h"

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
    return extremes(graph);
  } catch (const ConfigError& e) {
    refusal = refused(e.what(), {"another graph, or more agents"});
    return {};
  }
}

/// The rate is proportional to λ⁺.
void add_lost_link(RuleCertificate& c, const GraphSettings& graph, int n) {
  c.without_link_1_s =
      c.guaranteed_1_s * connectivity_without_link(coupling(graph, n)) / c.extremes.least;
}

/// Adds the verdict of theorem 6 on this graph and this ratio β of speeds.
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
  double zero = 0.5 * kPi;  // zero of the slope
  for (double delta = 0.0; delta < 0.5 * kPi; delta += 1e-3) {
    if (pull_slope(delta, r.spread_rad) > 0.0) continue;
    zero = delta;
    break;
  }
  c.guarantee = Guarantee::contracting;
  c.within = 2.0 / 3.0 * zero;
  c.expected_1_s = r.gain * c.extremes.least;
  c.guaranteed_1_s = c.expected_1_s * pull_slope(c.within, r.spread_rad);
  c.without_link_1_s =
      c.guaranteed_1_s * connectivity_without_link(coupling(r.graph, n)) / c.extremes.least;
  c.why = say("contracts while all headings are within ", zero,
              " rad of each other (4.45); rate >= k lambda+ f'(", c.within,
              ") = ", c.guaranteed_1_s, " up to ", c.within, " rad");
  return c;
}

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
  const int coupled = alpha > 0.0 && !beat ? n - 1 : n;  // the leader is coupled to no agent
  std::optional<RuleCertificate> refusal;
  if (k > 0.0 && coupled > 1) c.extremes = extremes_of(r.graph, coupled, refusal);
  if (refusal && alpha == 0.0) {
    c = *refusal;
    return;
  }
  c.guarantee = Guarantee::contracting;
  c.guaranteed_1_s = c.expected_1_s = k * c.extremes.least + alpha;
  c.without_link_1_s =
      alpha +
      (c.extremes.least > 0.0 ? k * connectivity_without_link(coupling(r.graph, coupled)) : 0.0);
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
    // A walker beside the direction to its goal turns that direction: with e = ψ − ψ_goal at the
    // distance r ė = −(k − v/r) sin e, so tan(e/2) decays at k − v/r.
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

std::array<const RuleCertificate*, 5> rules_of(const Certificate& c) {
  return {&c.frequency, &c.length, &c.phase, &c.tracking, &c.heading};
}

double periodic_range_m(const SpeedFunction& g) {
  constexpr int kSamples = 360;
  double least = 0.0, most = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    const double phi = math::kTwoPi * i / kSamples;
    const double part = g.integral(phi) - g.mean() * phi;
    least = std::min(least, part);
    most = std::max(most, part);
  }
  return most - least;
}

/// √(xᵀLx/2) of where agents begin, or the most that agents within `error` of each other have.
double begin_of(const RuleCertificate& c, const LengthRule& rule, int n, double error,
                std::span<const double> ahead) {
  const double most = std::sqrt(c.extremes.most * n / 8.0) * error;
  if (static_cast<int>(ahead.size()) != n) return most;
  const std::vector<double> nowhere(ahead.size(), 0.0);
  std::vector<double> summed(ahead.size());
  spacing_errors(coupling(rule.graph, n), ahead, nowhere, summed);
  return std::min(most, std::sqrt(0.5 * std::max(0.0, std::inner_product(ahead.begin(), ahead.end(),
                                                                         summed.begin(), 0.0))));
}

/// Longest way along the path [m] until x = z − d, that begins with max − min = `error` and is
/// moved by `shift` on the way, has ‖x‖ √2 <= tolerance, with dx/ds = −clamp(m L x, ±limit): speeds
/// agree, s is the way walked.
double way_m(const RuleCertificate& c, const LengthRule& rule, int n, double error, double shift,
             std::span<const double> ahead, double tolerance) {
  const double m = rule.gain_1_m, limit = rule.limit;
  if (rule.graph.topology == Topology::all_to_all) {
    // max − min shrinks by min(m N (max − min), limit) per way at least.
    const double apart = error + shift;
    const double linear = std::min(apart, limit / (m * n));
    return (apart - linear) / limit + std::log(std::max(1.0, linear / tolerance)) / (m * n);
  }
  // V = xᵀLx/2, √V a norm, so at most that of the start and that of the shift. With e = L x, dV/ds
  // = −Σ |eᵢ| min(m |eᵢ|, limit) <= −‖e‖ min(m ‖e‖, limit): where agents are clamped, E = √(Σ eᵢ²)
  // over them is limit/m or more, and E limit + m r² >= limit √(E² + r²) with r the root over the
  // others. As ‖e‖² >= 2 λ⁺ V, √V falls by limit √(λ⁺/2) per way at least, and once √(2 λ⁺ V) <=
  // limit/m as exp(−m λ⁺ s). Then ‖x‖ <= √(2 V/λ⁺).
  const double begin =
      begin_of(c, rule, n, error, ahead) + std::sqrt(c.extremes.most * n / 8.0) * shift;
  const double linear = std::min(begin, limit / m / std::sqrt(2.0 * c.extremes.least));
  const double end = tolerance * 0.5 * std::sqrt(c.extremes.least);
  return (begin - linear) / (limit * std::sqrt(0.5 * c.extremes.least)) +
         std::log(std::max(1.0, linear / end)) / (m * c.extremes.least);
}

GaitRange range_of(const Scenario& scenario, const Stage& stage, const Group& group) {
  const Gait* gait = scenario.gait(stage.gait);
  return {gait->speed(), gait->eigenfrequency_rad_s, group.spread_rad_s, group.beat_gain_1_s,
          gait->sway()};
}

Certificate certified(const Scenario& scenario, const Stage& stage, const Group& group) {
  const GaitRange gait = range_of(scenario, stage, group);
  // A beat leads any agent of a group, also those that come later.
  const int least = group.beat_gain_1_s > 0.0 ? 1 : 0;
  Certificate c = certify(stage.rules, std::max(least, stage.agents), gait);
  c.agents = stage.agents;
  const double off = gait.eigenfrequency_rad_s - scenario.beat.rate_rad_s;
  if (group.beat_gain_1_s > 0.0 && off != 0.0) {
    c.notes.push_back(say("omega_0 is off the beat by ", off, " rad/s: feet are ",
                          off / group.beat_gain_1_s, " rad ahead of it"));
  }
  return c;
}

/// From where the group's agents stand at the beginning.
std::optional<double> formation_time(const Scenario& scenario, const Group& group,
                                     const Stage& stage) {
  if (group.formation.shape == Shape::none || group.count < 2) return std::nullopt;
  const GaitRange gait = range_of(scenario, stage, group);
  const auto begin = starts(group, gait.eigenfrequency_rad_s, static_cast<unsigned>(scenario.seed));
  const auto wished = places(group);
  const Eigen::Vector2d along(std::cos(group.heading_rad), std::sin(group.heading_rad));
  const Eigen::Vector2d left(-along.y(), along.x());
  const Eigen::Vector2d origin(group.origin_x_m, group.origin_y_m);
  double least = std::numeric_limits<double>::infinity(), most = -least, lane = 0.0;
  std::vector<double> all_ahead;
  for (std::size_t i = 0; i < begin.size(); ++i) {
    const Eigen::Vector2d p = begin[i].p_W_m - origin;
    const double ahead = along.dot(p) - wished[i].place_m;
    all_ahead.push_back(ahead);
    least = std::min(least, ahead);
    most = std::max(most, ahead);
    lane = std::max(lane, std::abs(left.dot(p) - wished[i].lane_m));
  }
  if (stage.rules.heading.kind == HeadingKind::keep) lane = 0.0;  // lanes are not controlled
  return formation_time_s(stage.certificate, stage.rules, gait, most - least, lane,
                          scenario.formed_m, all_ahead);
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
  Certificate c;
  c.agents = n;
  certify_phase(rules.phase, n, gait.beat_gain_1_s, c);
  const bool phases_agree = c.phase.guarantee == Guarantee::contracting && gait.spread_rad_s == 0.0;
  c.frequency = certify_frequency(rules.frequency, n, gait);
  c.length = certify_length(rules.length, n, gait, phases_agree);
  const double stretch = rules.length.gain_1_m != 0.0 ? 1.0 + rules.length.limit : 1.0;
  c.heading = certify_heading(rules.heading, n, gait, stretch);
  const bool distances =
      c.frequency.guarantee != Guarantee::off || c.length.guarantee != Guarantee::off;
  if (distances && c.phase.guarantee != Guarantee::contracting) {
    c.residual_m = periodic_range_m(gait.gait);
    c.notes.push_back(say("distances oscillate by up to ", c.residual_m,
                          " m where phases differ, as g(phi) does: rule III takes that away"));
  }
  if (c.frequency.guarantee != Guarantee::off && c.phase.guarantee != Guarantee::off &&
      c.length.guarantee == Guarantee::off) {
    c.notes.push_back(
        say("I and III both set the phase: distances and phases agree together only "
            "where distances are whole cycles of ",
            gait.gait.cycle_m(), " m; rule II frees them"));
  }
  if (gait.spread_rad_s > 0.0 && c.phase.guarantee == Guarantee::contracting) {
    c.notes.push_back(say("eigenfrequencies differ by ", 2.0 * gait.spread_rad_s,
                          " rad/s: phases lock, apart by about ",
                          2.0 * gait.spread_rad_s / c.phase.expected_1_s, " rad"));
  }
  return c;
}

std::optional<double> formation_time_s(const Certificate& certificate, const Rules& rules,
                                       const GaitRange& gait, double error_m, double lane_m,
                                       double tolerance_m, std::span<const double> ahead_m) {
  const bool certified = certificate.length.guarantee == Guarantee::contracting &&
                         certificate.phase.guarantee == Guarantee::contracting &&
                         certificate.frequency.guarantee == Guarantee::off;
  const HeadingKind kind = rules.heading.kind;
  const bool lanes = kind == HeadingKind::lane && !rules.heading.avoid;
  if (!certified || !(tolerance_m > 0.0) || gait.spread_rad_s != 0.0 ||
      (!lanes && kind != HeadingKind::keep) || (kind == HeadingKind::keep && lane_m != 0.0)) {
    return std::nullopt;
  }
  const SpeedFunction& g = gait.gait;
  const double stretch = 1.0 + rules.length.limit;  // stretch of the longest steps
  // First phases, until their errors move no agent by a quarter of the tolerance; meanwhile two
  // agents part by one longest cycle at most.
  const double rate =
      certificate.tracking.guarantee == Guarantee::contracting
          ? std::min(certificate.tracking.guaranteed_1_s, certificate.phase.guaranteed_1_s)
          : certificate.phase.guaranteed_1_s;
  const double in_phase_rad = 0.25 * tolerance_m / (stretch * g.most());
  const double phases_s =
      std::log(2.0 * kPi * std::sqrt(static_cast<double>(certificate.agents)) / in_phase_rad) /
      rate;
  double shift_m = stretch * 2.0 * kPi * g.most();
  double lanes_s = 0.0;
  if (lanes) {
    // A way at the angle ψ loses 1 − cos ψ: ∫ tan(ψ/2) dξ to the lane, and while turning from ±π/2
    // (⟨g⟩/m_ψ) ln 2.
    const double slope = std::atan(lane_m / rules.heading.ahead_m);
    shift_m +=
        std::tan(0.5 * slope) * lane_m + stretch * g.mean() / rules.heading.gain * std::log(2.0);
    const double off_m = std::max(lane_m, g.mean() / rules.heading.gain);
    lanes_s =
        std::log(std::max(1.0, 2.0 * kPi * off_m / tolerance_m)) / certificate.heading.expected_1_s;
  }
  const double way = way_m(certificate.length, rules.length, certificate.agents, error_m, shift_m,
                           ahead_m, 0.5 * tolerance_m) +
                     2.0 * kPi * g.mean();  // a cycle may begin at its slow end
  return std::max(phases_s, lanes_s) + way / (gait.eigenfrequency_rad_s * g.mean());
}

std::vector<Stage> certify(const Scenario& scenario) {
  std::vector<Stage> stages;
  for (const Group& group : scenario.groups) {
    const auto comes = [&](const External& e) { return e.group == group.name; };
    const int agents =
        group.count + static_cast<int>(std::ranges::count_if(scenario.externals, comes));
    Stage stage{group.name, group.gait, 0.0, group.rules, agents};
    stage.certificate = certified(scenario, stage, group);
    stage.formation_s = formation_time(scenario, group, stage);
    stages.push_back(stage);
    for (const Change& change : scenario.schedule) {
      if (change.group != group.name) continue;
      stage.from_s = change.at_s;
      stage.rules = change.rules;
      if (!change.gait.empty()) stage.gait = change.gait;
      stage.certificate = certified(scenario, stage, group);
      stage.formation_s.reset();
      stages.push_back(stage);
    }
  }
  return stages;
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
