#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "common/error.h"
#include "nodes/crowd/engine/crowd_impl.h"

namespace mimesis::crowd {
namespace {

void need(bool good, const std::string& what, double value, const std::string& expected) {
  if (!good) {
    throw ConfigError(what + ": " + std::to_string(value) + ", expected " + expected);
  }
}

void not_negative(double value, const std::string& what) {
  need(std::isfinite(value) && value >= 0.0, what, value, "a finite number, not negative");
}

void positive(double value, const std::string& what) {
  need(std::isfinite(value) && value > 0.0, what, value, "a finite number above 0");
}

/// Bound of the largest eigenvalue of the Laplacian [M18 A.2; Gershgorin].
double largest_eigenvalue(const GraphSettings& graph, double n) {
  switch (graph.topology) {
    case Topology::none:
      return 0.0;
    case Topology::chain:
    case Topology::ring:
      return 4.0;
    case Topology::weighted:
      break;
    default:
      return n;
  }
  int nodes = 0;
  for (const Edge& e : graph.edges) nodes = std::max({nodes, e.i + 1, e.j + 1});
  double most = 0.0;
  std::vector<double> degree(static_cast<std::size_t>(nodes), 0.0);
  for (const Edge& e : graph.edges) {
    most = std::max({most, degree[static_cast<std::size_t>(e.i)] += e.weight,
                     degree[static_cast<std::size_t>(e.j)] += e.weight});
  }
  return 2.0 * most;
}

}  // namespace

void check(const CrowdSettings& s) {
  positive(s.dt_s, "crowd: dt [s]");
  const AvoidSettings& a = s.avoid;
  const dmp::NavigationParams& n = a.navigation;
  not_negative(n.avoid_1_s, "crowd: gain of avoidance [1/s]");
  not_negative(n.predict_1_s, "crowd: gain of predicted collisions [1/s]");
  positive(n.sigma_angle_rad, "crowd: sigma of angles [rad]");
  positive(n.sigma_distance_m, "crowd: sigma of distances [m]");
  positive(n.horizon_s, "crowd: horizon of predictions [s]");
  need(std::isfinite(n.keep_right_rad), "crowd: keep right [rad]", n.keep_right_rad, "a number");
  positive(a.reach_m, "crowd: reach [m]");
  need(a.headway_s >= 2.0 * s.dt_s, "crowd: headway [s]", a.headway_s, "at least 2 dt");
  not_negative(a.separate_m_s, "crowd: speed of separation [m/s]");
  positive(a.arrive_m, "crowd: arrival [m]");
}

void check(const Rules& r, const std::string& what) {
  for (const GraphSettings* graph :
       {&r.frequency.graph, &r.length.graph, &r.phase.graph, &r.heading.graph}) {
    if (graph->topology != Topology::weighted) continue;
    int nodes = 0;
    for (const Edge& e : graph->edges) nodes = std::max({nodes, e.i + 1, e.j + 1});
    (void)CouplingGraph::weighted(nodes, graph->edges);  // refuses what is none
  }
  need(std::isfinite(r.frequency.gain_rad_m_s), what + "rule I, gain m_d", r.frequency.gain_rad_m_s,
       "a finite number");
  not_negative(r.frequency.saturation_m, what + "rule I, saturation [m]");
  not_negative(r.frequency.low_pass_rad_s, what + "rule I, low-pass [rad/s]");
  not_negative(r.length.gain_1_m, what + "rule II, gain m_z");
  need(r.length.limit > 0.0 && r.length.limit < 1.0, what + "rule II, limit of the step length",
       r.length.limit, "within (0, 1)");
  not_negative(r.phase.gain_1_s, what + "rule III, gain k");
  not_negative(r.phase.leader_gain_1_s, what + "rule III, gain alpha to the leader");
  not_negative(r.heading.gain, what + "rule IV, gain");
  positive(r.heading.ahead_m, what + "rule IV, distance of the sliding goal [m]");
  not_negative(r.heading.low_pass_s, what + "rule IV, low-pass [s]");
  not_negative(r.heading.spread_rad, what + "rule IV, spread [rad]");
}

void check_stiffness(const GroupSettings& s, double dt, double n, double omega,
                     const std::string& what) {
  const Rules& r = s.rules;
  const double phase =
      r.phase.gain_1_s * largest_eigenvalue(r.phase.graph, n) + r.phase.leader_gain_1_s +
      std::abs(r.frequency.gain_rad_m_s) * s.gait.most() * largest_eigenvalue(r.frequency.graph, n);
  const double length =
      r.length.gain_1_m * omega * s.gait.most() * largest_eigenvalue(r.length.graph, n);
  for (const auto& [rate, rule] : {std::pair(phase, "rules I and III"), {length, "rule II"}}) {
    if (rate * dt >= 1.0) {
      throw ConfigError(what + rule + ": with " + std::to_string(static_cast<long>(n)) +
                        " agents the fastest error decays at " + std::to_string(rate) +
                        " 1/s, which steps of " + std::to_string(dt) +
                        " s do not follow; expected below " + std::to_string(1.0 / dt) + " 1/s");
    }
  }
}

void check_edges(const GraphSettings& graph, int n, const std::string& what) {
  for (const Edge& e : graph.edges) {
    if (std::min(e.i, e.j) >= 0 && std::max(e.i, e.j) < n) continue;
    throw ConfigError(what + "edge " + std::to_string(e.i) + " - " + std::to_string(e.j) +
                      ": the graph has nodes 0 to " + std::to_string(n - 1));
  }
}

bool is_finite(const AgentState& s) {
  const auto may_miss = [](double x) { return !std::isinf(x); };
  return s.position_W_m.allFinite() && s.velocity_W_m_s.allFinite() &&
         std::isfinite(s.heading_rad) && std::isfinite(s.phase_rad) && std::isfinite(s.length) &&
         std::isfinite(s.smoothed_error_m) && may_miss(s.phase_rate_rad_s) &&
         may_miss(s.heading_rate_rad_s);
}

std::string flaw_of(const AgentTraits& t) {
  const auto above = [](double x) { return std::isfinite(x) && x > 0.0; };
  if (!std::isfinite(t.omega_rad_s) || t.omega_rad_s < 0.0) {
    return "eigenfrequency: expected a finite number, not negative";
  }
  if (!above(t.stride)) return "stride: expected a finite number above 0";
  if (!std::isfinite(t.radius_m) || t.radius_m < 0.0) return "radius: expected not negative";
  if (!std::isfinite(t.place_m) || !std::isfinite(t.lane_m) || !t.goal_W_m.allFinite()) {
    return "place, lane and goal: expected finite numbers";
  }
  return {};
}

}  // namespace mimesis::crowd
