#pragma once
#include <string>
#include <utility>
#include <vector>

#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd::testing {

inline Gait gait(const std::string& name, double omega_rad_s) {
  Gait g;
  g.name = name;
  g.eigenfrequency_rad_s = omega_rad_s;
  g.mean_m_rad = 0.2;
  g.cosine_m_rad = {0.02};
  return g;
}

/// A group that walks in the direction of x, begins as a grid.
inline Group group(const std::string& name, int count) {
  Group g;
  g.name = name;
  g.count = count;
  g.start.phase = PhaseStart::spread;
  g.rules.heading.kind = HeadingKind::keep;
  return g;
}

/// Takes its places by the length of steps while phases become equal.
inline Group squad(const std::string& name, int count, Topology phases) {
  Group g = group(name, count);
  g.start.jitter_m = 0.3;
  g.formation.shape = Shape::grid;
  g.start.spacing_m = g.start.across_m = g.formation.spacing_m = g.formation.across_m = 1.5;
  g.rules.length.graph.topology = Topology::all_to_all;
  g.rules.length.gain_1_m = 0.5 / count;
  g.rules.phase.graph.topology = phases;
  g.rules.phase.gain_1_s = phases == Topology::all_to_all ? 1.0 / count : 1.5;
  g.rules.heading.kind = HeadingKind::lane;
  g.rules.heading.gain = 0.5;
  return g;
}

inline Scenario scenario(std::vector<Group> groups) {
  Scenario s;
  s.name = "small";
  s.gaits = {gait("neutral", 5.7), gait("happy", 6.6)};
  s.groups = std::move(groups);
  return s;
}

}  // namespace mimesis::crowd::testing
