// Random combinations of rules, gains, gaits, graphs and starts, walked by the engine: nothing may
// be slower than its certificate says. Ranges are the judge's own; the certificates know nothing of
// them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <map>
#include <numbers>
#include <random>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/engine/crowd.h"

namespace mimesis::crowd {
namespace {

using Values = std::vector<double>;
constexpr double kPi = std::numbers::pi;
constexpr double kPath_rad = 0.4;

/// How a group is set up, and how it begins.
struct Trial {
  Rules rules;
  int n = 2;
  double dt_s = 0.01;
  double omega = 5.0, spread = 0.0;
  SpeedFunction gait{0.2, {}, {}};
  HeadingSway sway{};
  bool near = false;  // begins near its goal
  Values omegas, ahead, lane, phase, heading;

  GaitRange range() const {
    double off = 0.0;
    for (const double h : heading) off = std::max(off, std::abs(h));
    return {.gait = gait,
            .eigenfrequency_rad_s = omega,
            .spread_rad_s = spread,
            .sway = sway,
            .off_path_rad = off,
            .step_s = dt_s};
  }
  bool led() const { return rules.phase.leader_gain_1_s > 0.0; }
};

class Dice {
 public:
  explicit Dice(unsigned seed) : random_(seed) {}
  double in(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random_);
  }
  double log_in(double least, double most) { return std::exp(in(std::log(least), std::log(most))); }
  int number(int least, int most) {
    return std::uniform_int_distribution<int>(least, most)(random_);
  }
  bool chance(double p) { return in(0.0, 1.0) < p; }

  GraphSettings graph(int n) {
    constexpr std::array kKinds = {Topology::chain,      Topology::ring,       Topology::star,
                                   Topology::all_to_all, Topology::all_to_all, Topology::weighted};
    GraphSettings g{kKinds[static_cast<std::size_t>(number(0, 5))]};
    if (g.topology != Topology::weighted) return g;
    for (int i = 1; i < n; ++i) g.edges.push_back({number(0, i - 1), i, in(0.3, 2.0)});
    return g;
  }
  Trial trial() {
    Trial t;
    t.n = number(2, 9);
    t.dt_s = log_in(0.005, 0.08);
    t.omega = in(2.5, 8.0);
    if (chance(0.15)) t.spread = t.omega * in(0.0, 0.2);
    const double mean = in(0.08, 0.3), most = chance(0.3) ? 0.0 : in(0.0, 0.8) * mean;
    Values cosine, sine;
    const Values part{in(0, 1), in(0, 1), in(0, 1), in(0, 1)};
    for (const double p : part) {
      const double a = in(-kPi, kPi), r = most * p / (part[0] + part[1] + part[2] + part[3]);
      cosine.push_back(r * std::cos(a));
      sine.push_back(r * std::sin(a));
    }
    t.gait = SpeedFunction(mean, cosine, sine);
    const GraphSettings one = graph(t.n);
    const bool same = chance(0.5);
    const auto any = [&](int n) { return same ? one : graph(n); };
    // Gains by the rate of the fastest error, as engines of other steps allow.
    const auto gain = [&](const GraphSettings& g, double per) {
      return log_in(0.1, 20.0) / (per * (g.topology == Topology::all_to_all ? t.n : 2.0));
    };
    if (chance(0.35)) {
      FrequencyRule& r = t.rules.frequency;
      r.graph = any(t.n);
      r.gain_rad_m_s = gain(r.graph, mean);
      if (chance(0.3)) r.saturation_m = in(0.5, 20.0);
      if (chance(0.3)) r.low_pass_rad_s = log_in(0.3, 30.0);
    }
    if (chance(0.5)) {
      LengthRule& r = t.rules.length;
      r.graph = any(t.n);
      r.gain_1_m = gain(r.graph, mean * t.omega);
      r.limit = in(0.1, 0.8);
    }
    if (chance(0.7)) {
      PhaseRule& r = t.rules.phase;
      const bool leads = t.n > 2 && chance(0.25);
      r.graph = leads ? graph(t.n - 1) : any(t.n);
      r.gain_1_s = gain(r.graph, 1.0);
      if (leads) r.leader_gain_1_s = log_in(0.05, 3.0);
    }
    HeadingRule& h = t.rules.heading;
    const double kind = in(0.0, 1.0);
    if (kind < 0.25) {
      h = {.kind = HeadingKind::lane, .gain = log_in(0.05, 4.0), .ahead_m = log_in(0.02, 5.0)};
    } else if (kind < 0.4) {
      h = {.kind = HeadingKind::consensus, .gain = log_in(0.05, 2.0)};
      if (chance(0.3)) h.low_pass_s = log_in(0.05, 3.0);
    } else if (kind < 0.5) {
      h = {.kind = HeadingKind::coupled, .graph = any(t.n)};
      h.gain = gain(h.graph, 1.0);
      if (chance(0.4)) h.spread_rad = in(0.3, 2.0);
    } else if (kind < 0.6) {
      h = {.kind = HeadingKind::goal, .gain = in(0.3, 2.0)};
    }
    if (chance(0.1)) {
      const Values a{in(-0.1, 0.1), in(-0.1, 0.1)};
      t.sway = HeadingSway::make(a, a);
    }
    t.near = chance(0.5);
    // Rule I alone comes to a motion of its own, which depends on how far a walker got off its
    // lane.
    const bool on_lane = t.rules.frequency.gain_rad_m_s != 0.0 && t.rules.length.gain_1_m == 0.0;
    const double arc = t.near ? 0.02 : chance(0.5) ? kPi : 1.0;
    const bool keeps = h.kind == HeadingKind::keep;
    const double turned = keeps     ? (chance(0.15) ? 1.0 : 0.0)
                          : on_lane ? 0.0
                          : t.near  ? 0.02
                                    : in(0.2, kPi);
    for (int i = 0; i < t.n; ++i) {
      t.omegas.push_back(t.omega + (t.spread > 0.0 ? in(-t.spread, t.spread) : 0.0));
      t.phase.push_back(in(-arc, arc));
      t.heading.push_back(turned > 0.0 ? in(-turned, turned) : 0.0);
      t.ahead.push_back(t.near ? in(-0.01, 0.01) : in(-2.0, 2.0));
      t.lane.push_back(keeps || on_lane ? 0.0
                       : t.near         ? h.ahead_m * in(-0.02, 0.02)
                                        : in(-2.0, 2.0));
    }
    return t;
  }

 private:
  std::mt19937_64 random_;
};

Crowd crowd_of(const Trial& t) {
  Crowd crowd({.dt_s = t.dt_s});
  crowd.add_group(
      {.rules = t.rules, .gait = t.gait, .path = {{1.0, 2.0}, kPath_rad}, .sway = t.sway});
  const Eigen::Vector2d along(std::cos(kPath_rad), std::sin(kPath_rad)),
      left(-along.y(), along.x());
  std::vector<Agent> agents(static_cast<std::size_t>(t.n));
  for (std::size_t i = 0; i < agents.size(); ++i) {
    Agent& a = agents[i];
    a.id = i + 1;
    a.traits.place_m = 1.3 * static_cast<double>(i);
    a.traits.lane_m = 0.7 * static_cast<double>(i);
    a.state.position_W_m = Eigen::Vector2d(1.0, 2.0) + (a.traits.place_m + t.ahead[i]) * along +
                           (a.traits.lane_m + t.lane[i]) * left;
    a.state.heading_rad = kPath_rad + t.heading[i];
    a.state.phase_rad = t.phase[i];
    a.traits.omega_rad_s = t.omegas[i];
    a.traits.goal_W_m = a.state.position_W_m + 400.0 * along;
  }
  crowd.add(0, agents);
  return crowd;
}

/// ‖x − mean x‖
double apart(const Values& x) {
  double mean = 0.0, sum = 0.0;
  for (const double v : x) mean += v / static_cast<double>(x.size());
  for (const double v : x) sum += (v - mean) * (v - mean);
  return std::sqrt(sum);
}

Values spacing(const Crowd& c) {
  Values x(static_cast<std::size_t>(c.size()));
  c.spacing(0, x);
  return x;
}

double most_sum(const Trial& t, const GraphSettings& graph, const Crowd& c) {
  const Values x = spacing(c), nowhere(x.size(), 0.0);
  Values e(x.size());
  spacing_errors(coupling(graph, t.n), x, nowhere, e);
  double most = 0.0;
  for (const double v : e) most = std::max(most, std::abs(v));
  return most;
}

/// Phases against their mean, of all or of the followers: along sparse graphs they are lifted,
/// all-to-all they are on the circle. The leader's comes last.
Values phases(const Trial& t, const Crowd& c, bool leader_too) {
  const auto phi = c.phase_rad().subspan(t.led() ? 1 : 0);
  const Topology graph = t.rules.phase.graph.topology;
  const bool lifted = graph != Topology::all_to_all && !(graph == Topology::none && t.led());
  double mean = circular_sum(phi).angle();
  if (lifted) {
    mean = 0.0;
    for (const double p : phi) mean += p / static_cast<double>(phi.size());
  }
  Values out;
  for (const double p : phi) out.push_back(lifted ? p - mean : math::wrap_pi(p - mean));
  if (leader_too && t.led()) out.push_back(math::wrap_pi(c.phase_rad()[0] - mean));
  return out;
}

double tracking(const Trial& t, const Crowd& c) {
  const Values all = phases(t, c, true);
  double most = 0.0;
  for (const double p : all) most = std::max(most, std::abs(p - all.back()));
  return most;
}

double range_of(const Values& x) {
  const auto [least, most] = std::ranges::minmax(x);
  return most - least;
}

/// One rule's promise, and the error it is about over time.
struct Promise {
  const char* rule;
  RuleCertificate c;
  int levels = 1;  // of a hierarchy, down to this rule
  std::function<double()> error;
  std::function<bool()> inside;  // the region of the promise
  Values t{}, e{};
  double entered_s = -1.0;
};

struct Verdict {
  std::string rule;
  bool slower = false, judged = false;
  double per_guaranteed = 0.0;
};

constexpr double kStepped = 0.98;  // of a rate the engine's steps leave so much, as promised

/// Bound from the region on, where the rule stands alone: |e(t)| <= K |e(t0)| exp(-rate (t − t0)).
bool falls_short_at_once(const Promise& p) {
  if (p.c.in_the_end || p.levels > 1 || p.t.empty()) return false;
  for (std::size_t i = 1; i < p.t.size(); ++i) {
    const double bound =
        p.c.overshoot * p.e[0] * std::exp(-kStepped * p.c.guaranteed_1_s * (p.t[i] - p.t[0]));
    if (p.e[i] > 1.02 * bound + 1e-7) return true;
  }
  return false;
}

/// The slope of the tail. Two equal rates of a hierarchy make t exp(-rate t); modes that turn make
/// a factor.
Verdict verdict(const Trial& trial, const Promise& p) {
  Verdict v{p.rule, falls_short_at_once(p)};
  const double rate = kStepped * p.c.guaranteed_1_s;
  const HeadingRule& h = trial.rules.heading;  // a lane swings at sqrt(omega² m g/ahead)
  const double swing = trial.omega * std::sqrt(h.gain * trial.gait.least() / h.ahead_m);
  const double window = 2.0 * kPi * (2.5 / trial.omega + (v.rule == "lane" ? 1.0 / swing : 0.0));
  if (p.t.empty()) return v;
  Values top(p.e);  // largest of what is still to come within the window: turning modes
  for (std::size_t i = 0; i < top.size(); ++i) {
    for (std::size_t j = i; j < p.t.size() && p.t[j] < p.t[i] + window; ++j) {
      top[i] = std::max(top[i], p.e[j]);
    }
  }
  std::size_t first = p.t.size(), last = 0;
  for (std::size_t i = top.size(); i-- > 0 && top[i] < 3e-3;) first = i;
  for (std::size_t i = first; i < top.size() && top[i] > 3e-8; ++i) last = i;
  const bool ever = first < top.size();
  if (!ever) {  // nowhere near its goal, though it began there, or is certain to come
    v.slower = v.slower || ((!p.c.in_the_end || trial.near) && rate * (p.t.back() - p.t[0]) > 20.0);
    v.judged = v.slower;
    return v;
  }
  if (last <= first) return v;
  const double span = p.t[last] - p.t[first], fell = std::log(top[first] / top[last]);
  if (rate * span < 5.0 && fell < 5.0) return v;
  v.judged = true;
  v.per_guaranteed = fell / (rate * span);
  const double slack =
      std::log(p.c.in_the_end ? 2.0 : std::min(p.c.overshoot, 2.0)) +
      (p.levels - 1) * std::log(std::max(rate * p.t[last], 1.0) / std::max(rate * p.t[first], 1.0));
  v.slower = v.slower || fell < 0.99 * rate * span - slack;
  return v;
}

/// The twin begins elsewhere, with what must be equal.
Trial twin_of(const Trial& t, Dice& dice, bool phases_too) {
  Trial twin = t;
  double mean = 0.0;
  Values by;
  for (int i = 0; i < t.n; ++i) by.push_back((t.near ? 0.02 : 0.3) * dice.in(-1.0, 1.0));
  for (const double b : by) mean += b / t.n;
  for (std::size_t i = 0; i < by.size(); ++i) {
    if (!phases_too) {
      twin.ahead[i] += by[i];
    } else {  // z = G(phi) + c with the same c
      twin.phase[i] += by[i] - mean;
      if (t.rules.frequency.gain_rad_m_s != 0.0) {
        twin.ahead[i] += t.gait.integral(twin.phase[i]) - t.gait.integral(t.phase[i]);
      }
    }
  }
  return twin;
}

struct Judged {
  bool refused = false, in_force = false, certified = false;
  std::vector<Verdict> verdicts;
};

Judged judge(unsigned seed, bool talk) {
  Dice dice(seed);
  const Trial trial = dice.trial();
  const Rules& r = trial.rules;
  Judged out;
  const Certificate c = certify(r, trial.n, trial.range());
  const std::array<const RuleCertificate*, 5> all = {&c.frequency, &c.length, &c.phase, &c.tracking,
                                                     &c.heading};
  for (const RuleCertificate* rule : all) out.in_force |= rule->guarantee != Guarantee::off;
  out.certified = out.in_force && c.holds();
  const auto sure = [](const RuleCertificate& rule) {
    return rule.guarantee == Guarantee::contracting;
  };
  double slowest = 1e9;
  for (const RuleCertificate* rule : all) {
    if (sure(*rule)) slowest = std::min(slowest, rule->guaranteed_1_s);
  }
  if (slowest == 1e9) return out;
  const bool one = r.frequency.gain_rad_m_s != 0.0, two = r.length.gain_1_m != 0.0;
  const bool agree = sure(c.phase) && trial.spread == 0.0 && (!one || two);
  std::vector<Crowd> crowds;
  try {
    crowds.push_back(crowd_of(trial));                        // itself
    crowds.push_back(crowd_of(twin_of(trial, dice, true)));   // other phases
    crowds.push_back(crowd_of(twin_of(trial, dice, false)));  // other places
  } catch (const ConfigError&) {
    out.refused = true;
    return out;
  }
  const Crowd& self = crowds[0];
  // All-to-all each against its own mean: half a circle apart, twins go to agree on either side.
  const auto phases_from_twin = [&] {
    Values x = phases(trial, self, false);
    const Values y = phases(trial, crowds[1], false);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] -= y[i];
    return apart(x);
  };
  // A twin that had to wait has another mean phase, and so is late for ever.
  const auto in_time = [&] {
    double late = 0.0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(trial.n); ++i) {
      late += self.phase_rad()[i] - crowds[1].phase_rad()[i];
    }
    return std::abs(late) < 1e-9;
  };
  const auto phases_within = [&] {
    if (c.phase.within == 0.0 || c.phase.in_the_end) return true;
    return range_of(phases(trial, self, true)) < c.phase.within &&
           (agree || range_of(phases(trial, crowds[1], true)) < c.phase.within);
  };
  const auto sums_within = [&](const GraphSettings& graph, double within, std::size_t twin) {
    return within == 0.0 || (most_sum(trial, graph, self) < within &&
                             (agree || most_sum(trial, graph, crowds[twin]) < within));
  };
  const int above = (r.phase.gain_1_s != 0.0 ? 1 : 0) + (trial.led() ? 1 : 0);
  std::vector<Promise> promises;
  if (sure(c.phase)) {
    promises.push_back(
        {"phase", c.phase, one ? 2 : 1,
         [&] { return agree ? apart(phases(trial, self, false)) : phases_from_twin(); },
         phases_within});
  }
  if (sure(c.tracking) && trial.spread == 0.0) {
    promises.push_back({"tracking", c.tracking, 1, [&] { return tracking(trial, self); },
                        [&] {
                          return c.tracking.within == 0.0 ||
                                 range_of(phases(trial, self, true)) < c.tracking.within;
                        }});
  }
  const bool turns = r.heading.kind != HeadingKind::keep;
  // Farthest from its lane, as an angle; who is not near it walks less along the path.
  const auto off_lane = [&] {
    double most = 0.0;
    for (int i = 0; i < trial.n && r.heading.kind == HeadingKind::lane; ++i) {
      const Agent a = self.agent(i);
      const Eigen::Vector2d from = a.state.position_W_m - Eigen::Vector2d(1.0, 2.0);
      const double across = from.y() * std::cos(kPath_rad) - from.x() * std::sin(kPath_rad);
      most = std::max(most, std::hypot(math::wrap_pi(a.state.heading_rad - kPath_rad),
                                       (across - a.traits.lane_m) / r.heading.ahead_m));
    }
    return most;
  };
  if (sure(c.frequency)) {
    promises.push_back({two ? "joint I" : "frequency", c.frequency, two ? 2 : 1,
                        [&] { return two ? apart(spacing(self)) : phases_from_twin(); },
                        [&] {
                          if (!two && !in_time()) return false;
                          // Who is beside its lane loses way, and so ends in another motion.
                          if (!two && off_lane() > 1e-5) return false;
                          return c.frequency.in_the_end ||
                                 (sums_within(r.frequency.graph, c.frequency.within, 1) &&
                                  phases_within());
                        }});
  }
  if (sure(c.length)) {
    promises.push_back({one     ? "joint II"
                        : agree ? "length"
                                : "length alone",
                        c.length, 1 + above + (turns ? 1 : 0),
                        [&] {
                          Values x = spacing(self);
                          const Values y = spacing(crowds[2]);
                          for (std::size_t i = 0; !agree && i < x.size(); ++i) x[i] -= y[i];
                          return apart(x);
                        },
                        [&] {
                          return c.length.in_the_end
                                     ? off_lane() < 0.1
                                     : sums_within(r.length.graph, c.length.within, 2);
                        }});
  }
  if (sure(c.heading) &&
      c.heading.remains == 0.0) {  // else it ends swaying: printed_equations_test
    const auto error = [&] {
      if (r.heading.kind == HeadingKind::lane) return off_lane();
      double most = 0.0;
      Values off;
      for (int i = 0; i < trial.n; ++i) {
        const Agent a = self.agent(i);
        double e = math::wrap_pi(a.state.heading_rad - kPath_rad);
        if (r.heading.kind == HeadingKind::goal) {
          const Eigen::Vector2d way = a.traits.goal_W_m - a.state.position_W_m;
          e = 2.0 *
              std::tan(0.5 * math::wrap_pi(a.state.heading_rad - std::atan2(way.y(), way.x())));
        }
        off.push_back(e);
        most = std::max(most, std::abs(e));
      }
      if (r.heading.kind == HeadingKind::coupled || r.heading.kind == HeadingKind::consensus) {
        const double mean = circular_sum(self.heading_rad()).angle();
        for (int i = 0; i < trial.n; ++i) {
          off[static_cast<std::size_t>(i)] =
              math::wrap_pi(self.heading_rad()[static_cast<std::size_t>(i)] - mean);
        }
        return r.heading.kind == HeadingKind::coupled ? apart(off) : std::tan(0.5 * range_of(off));
      }
      return most;
    };
    const auto inside = [&] {
      const HeadingKind kind = r.heading.kind;
      if (kind == HeadingKind::lane && two && apart(spacing(self)) > 0.02) return false;
      if (c.heading.in_the_end && above > 0 && trial.spread == 0.0 &&
          apart(phases(trial, self, true)) > 0.02) {
        return false;
      }
      if (kind == HeadingKind::consensus || kind == HeadingKind::coupled) {
        Values off;
        const double mean = circular_sum(self.heading_rad()).angle();
        for (const double h : self.heading_rad()) off.push_back(math::wrap_pi(h - mean));
        return range_of(off) < c.heading.within;
      }
      for (int i = 0; i < trial.n; ++i) {
        const Agent a = self.agent(i);
        if (kind == HeadingKind::goal &&
            (a.traits.goal_W_m - a.state.position_W_m).norm() < c.heading.beyond_m) {
          return false;
        }
      }
      return true;
    };
    const HeadingKind kind = r.heading.kind;
    // A lane has two modes, which may be equal; sways wait for phases.
    const bool lane = kind == HeadingKind::lane;
    const int levels = lane ? (one || two || above > 0 ? 3 : 2) : trial.sway.none() ? 1 : 2;
    promises.push_back({kind == HeadingKind::lane        ? "lane"
                        : kind == HeadingKind::consensus ? "consensus"
                        : kind == HeadingKind::coupled   ? "coupled"
                                                         : "goal",
                        c.heading, levels, error, inside});
  }
  const double until = std::min(30.0 + 25.0 / slowest, 300.0);
  const int every = std::max(1, static_cast<int>(0.04 / trial.dt_s));
  for (int k = 0; self.time_s() < until; ++k) {
    for (Promise& p : promises) {
      if (k == 0 || k % every != 1 % every) break;  // the first step lifts phases
      const bool inside = p.inside();
      if (!inside) {  // it may leave: then it begins anew
        p.t.clear();
        p.e.clear();
        continue;
      }
      p.t.push_back(self.time_s());
      p.e.push_back(p.error());
    }
    for (Crowd& crowd : crowds) crowd.step();
  }
  for (const Promise& p : promises) {
    out.verdicts.push_back(verdict(trial, p));
    const Verdict& v = out.verdicts.back();
    if (!v.slower || !talk) continue;
    const auto say = [&](const GraphSettings& g) { return to_string(g.topology); };
    std::cout << "seed " << seed << " n " << trial.n << " dt " << trial.dt_s << ' ' << v.rule
              << " guaranteed " << p.c.guaranteed_1_s << " measured/guaranteed " << v.per_guaranteed
              << " at once " << falls_short_at_once(p) << " near " << trial.near << " spread "
              << trial.spread << " | I " << r.frequency.gain_rad_m_s << ' '
              << say(r.frequency.graph) << " sat " << r.frequency.saturation_m << " lp "
              << r.frequency.low_pass_rad_s << " | II " << r.length.gain_1_m << ' '
              << say(r.length.graph) << " | III " << r.phase.gain_1_s << ' ' << say(r.phase.graph)
              << " leader " << r.phase.leader_gain_1_s << " | IV "
              << static_cast<int>(r.heading.kind) << " gain " << r.heading.gain << " ahead "
              << r.heading.ahead_m << " tau " << r.heading.low_pass_s << " sway "
              << !trial.sway.none() << " omega " << trial.omega << " g " << trial.gait.least()
              << ' ' << trial.gait.mean() << ' ' << trial.gait.most() << '\n';
  }
  return out;
}

TEST(Judge, NothingIsSlowerThanItsCertificate) {
  const char* asked = std::getenv("MIMESIS_COMBINATIONS");
  const int combinations = asked != nullptr ? std::atoi(asked) : 50;
  const char* seed = std::getenv("MIMESIS_SEED");
  const unsigned from = seed != nullptr ? static_cast<unsigned>(std::atoi(seed)) : 7000U;
  int refused = 0, in_force = 0, certified = 0, judged = 0, slower = 0, promises = 0;
  std::map<std::string, Values> tight;
  std::map<std::string, int> slow;
  for (int k = 0; k < combinations; ++k) {
    const Judged j = judge(from + static_cast<unsigned>(k), true);
    refused += j.refused;
    in_force += j.in_force;
    certified += j.certified;
    bool any = false, seen = false;
    for (const Verdict& v : j.verdicts) {
      ++promises;
      any |= v.slower;
      seen |= v.judged;
      slow[v.rule] += v.slower;
      if (v.judged && v.per_guaranteed > 0.0) tight[v.rule].push_back(v.per_guaranteed);
    }
    slower += any;
    judged += seen;
  }
  std::cout << combinations << " combinations: " << in_force << " with rules, " << certified
            << " certified, " << refused << " refused by the engine, " << judged << " judged by "
            << promises << " promises, " << slower << " slower than guaranteed\n";
  Values whole;
  for (auto& [rule, values] : tight) {
    std::ranges::sort(values);
    whole.insert(whole.end(), values.begin(), values.end());
    std::cout << rule << ": " << values.size() << " judged, " << slow[rule]
              << " slower, measured/guaranteed " << values.front() << " ... "
              << values[values.size() / 2] << " ... " << values.back() << '\n';
  }
  EXPECT_EQ(slower, 0);
  EXPECT_GT(certified, combinations / 3);
  ASSERT_FALSE(whole.empty());
  std::ranges::sort(whole);
  std::cout << "all: median " << whole[whole.size() / 2] << '\n';
  EXPECT_LT(whole[whole.size() / 2], 1.5);
}

}  // namespace
}  // namespace mimesis::crowd
