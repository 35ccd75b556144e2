#include "nodes/crowd/scenario_file/scenario_file.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <string_view>

#include "common/error.h"
#include "common/runtime/param_source.h"

namespace mimesis::crowd {

namespace {

using runtime::ParamVisitor;

constexpr double kFar_m = 1e5, kLong_s = 1e5, kAngle_rad = 6.3;
// Gains may be negative here: theory refuses them, with its reason (faults).
constexpr double kGain = 1e4;

/// A visited word that stands for an enum, by the names of its values in their order.
template <class Enum, class... Name>
void word(ParamVisitor& v, std::string_view key, Enum& value, const Name&... names) {
  const std::array<std::string_view, sizeof...(names)> all{names...};
  std::string text(all.at(static_cast<std::size_t>(value)));
  v(key, text, {names...});
  const auto found = std::ranges::find(all, text);
  if (found != all.end()) value = static_cast<Enum>(found - all.begin());
}

/// A list of structs through a function for one.
template <class T, class Function>
void each(ParamVisitor& v, std::string_view key, std::vector<T>& items, const Function& one) {
  v.elements(
      key, items.size(), [&](std::size_t n) { items.resize(n); },
      [&](ParamVisitor& g, std::size_t i) { one(g, items[i]); });
}

void visit_graph(ParamVisitor& v, GraphSettings& graph) {
  Topology named = graph.topology == Topology::weighted ? Topology::none : graph.topology;
  word(v, "graph", named, "none", "chain", "ring", "star", "wheel", "all_to_all");
  each(v, "edges", graph.edges, [](ParamVisitor& g, Edge& edge) {
    g("i", edge.i, 0, 1'000'000);
    g("j", edge.j, 0, 1'000'000);
    g("weight", edge.weight, -kGain, kGain);
  });
  v("directed", graph.directed);
  const bool listed = named == Topology::none && !graph.edges.empty();
  graph.topology = listed ? Topology::weighted : named;
}

void visit_rules(ParamVisitor& v, Rules& rules) {
  v.group("frequency", [&](ParamVisitor& g) {
    visit_graph(g, rules.frequency.graph);
    g("gain_rad_m_s", rules.frequency.gain_rad_m_s, -kGain, kGain);
    g("saturation_m", rules.frequency.saturation_m, 0.0, kFar_m);
    g("low_pass_rad_s", rules.frequency.low_pass_rad_s, 0.0, kGain);
  });
  v.group("length", [&](ParamVisitor& g) {
    visit_graph(g, rules.length.graph);
    g("gain_1_m", rules.length.gain_1_m, -kGain, kGain);
    g("limit", rules.length.limit, 0.0, 1.0);
  });
  v.group("phase", [&](ParamVisitor& g) {
    visit_graph(g, rules.phase.graph);
    g("gain_1_s", rules.phase.gain_1_s, -kGain, kGain);
    g("leader_gain_1_s", rules.phase.leader_gain_1_s, -kGain, kGain);
  });
  v.group("heading", [&](ParamVisitor& g) {
    word(g, "kind", rules.heading.kind, "keep", "lane", "consensus", "coupled", "goal");
    visit_graph(g, rules.heading.graph);
    g("gain", rules.heading.gain, -kGain, kGain);
    g("ahead_m", rules.heading.ahead_m, 0.0, kFar_m);
    g("low_pass_s", rules.heading.low_pass_s, 0.0, kLong_s);
    g("spread_rad", rules.heading.spread_rad, 0.0, kAngle_rad);
    g("avoid", rules.heading.avoid);
  });
}

void visit_gait(ParamVisitor& v, Gait& gait) {
  v("name", gait.name);
  v("eigenfrequency_rad_s", gait.eigenfrequency_rad_s, 0.0, 30.0);
  v("mean_m_rad", gait.mean_m_rad, -2.0, 2.0);
  v("cosine_m_rad", gait.cosine_m_rad, -2.0, 2.0, 0);
  v("sine_m_rad", gait.sine_m_rad, -2.0, 2.0, 0);
  v("sway_cosine", gait.sway_cosine, -2.0, 2.0, 0);
  v("sway_sine", gait.sway_sine, -2.0, 2.0, 0);
}

void visit_start(ParamVisitor& v, Start& start) {
  word(v, "arrangement", start.arrangement, "line", "row", "grid", "circle", "box", "listed");
  v("spacing_m", start.spacing_m, 0.0, kFar_m);
  v("across_m", start.across_m, 0.0, kFar_m);
  v("columns", start.columns, 0, 1'000'000);
  v("radius_m", start.radius_m, 0.0, kFar_m);
  v("length_m", start.length_m, 0.0, kFar_m);
  v("width_m", start.width_m, 0.0, kFar_m);
  v("jitter_m", start.jitter_m, 0.0, kFar_m);
  v("position_m", start.position_m, -kFar_m, kFar_m, 0);
  word(v, "phase", start.phase, "equal", "spread", "random", "listed");
  v("phase_rad", start.phase_rad, -kAngle_rad, kAngle_rad, 0);
}

void visit_formation(ParamVisitor& v, Formation& formation) {
  word(v, "shape", formation.shape, "none", "line", "row", "grid", "wedge", "listed", "distances");
  v("spacing_m", formation.spacing_m, 0.0, kFar_m);
  v("across_m", formation.across_m, 0.0, kFar_m);
  v("columns", formation.columns, 0, 1'000'000);
  v("place_m", formation.place_m, -kFar_m, kFar_m, 0);
  v("lane_m", formation.lane_m, -kFar_m, kFar_m, 0);
  each(v, "distances", formation.distances, [](ParamVisitor& g, Distance& distance) {
    g("i", distance.i, 0, 1'000'000);
    g("j", distance.j, 0, 1'000'000);
    g("ahead_m", distance.ahead_m, -kFar_m, kFar_m);
  });
}

void visit_goals(ParamVisitor& v, Goals& goals) {
  word(v, "aim", goals.aim, "none", "opposite", "places", "route");
  v("position_m", goals.position_m, -kFar_m, kFar_m, 0);
  v("loop", goals.loop);
  v("reached_m", goals.reached_m, 0.01, 100.0);
}

void visit_group(ParamVisitor& v, Group& group) {
  v("name", group.name);
  v("count", group.count, 0, 1'000'000);
  v("gait", group.gait);
  v("spread_rad_s", group.spread_rad_s, 0.0, 30.0);
  v("radius_m", group.radius_m, 0.01, 10.0);
  v("origin_x_m", group.origin_x_m, -kFar_m, kFar_m);
  v("origin_y_m", group.origin_y_m, -kFar_m, kFar_m);
  v("heading_rad", group.heading_rad, -kAngle_rad, kAngle_rad);
  v.group("start", [&](ParamVisitor& g) { visit_start(g, group.start); });
  v.group("formation", [&](ParamVisitor& g) { visit_formation(g, group.formation); });
  v.group("goals", [&](ParamVisitor& g) { visit_goals(g, group.goals); });
  v.group("rules", [&](ParamVisitor& g) { visit_rules(g, group.rules); });
  v("beat_gain_1_s", group.beat_gain_1_s, -kGain, kGain);
}

void visit_obstacles(ParamVisitor& v, Scenario& s) {
  each(v, "pillars", s.pillars, [](ParamVisitor& g, Pillar& pillar) {
    g("x_m", pillar.position_W_m.x(), -kFar_m, kFar_m);
    g("y_m", pillar.position_W_m.y(), -kFar_m, kFar_m);
    g("radius_m", pillar.radius_m, 0.0, kFar_m);
  });
  each(v, "walls", s.walls, [](ParamVisitor& g, Wall& wall) {
    g("from_x_m", wall.from_W_m.x(), -kFar_m, kFar_m);
    g("from_y_m", wall.from_W_m.y(), -kFar_m, kFar_m);
    g("to_x_m", wall.to_W_m.x(), -kFar_m, kFar_m);
    g("to_y_m", wall.to_W_m.y(), -kFar_m, kFar_m);
  });
}

void visit_polygons(ParamVisitor& v, Scenario& s) {
  each(v, "polygons", s.polygons, [](ParamVisitor& g, Polygon& polygon) {
    g("corner_m", polygon.corner_m, -kFar_m, kFar_m, 0);
  });
}

void visit_switches(ParamVisitor& v, Scenario& s) {
  each(v, "schedule", s.schedule, [](ParamVisitor& g, Change& change) {
    g("at_s", change.at_s, 0.0, kLong_s);
    g("group", change.group);
    g("gait", change.gait);
    g.group("rules", [&](ParamVisitor& r) { visit_rules(r, change.rules); });
  });
  each(v, "zones", s.zones, [](ParamVisitor& g, Zone& zone) {
    g("name", zone.name);
    g("from", zone.from);
    g("to", zone.to);
    g("least_x_m", zone.least_x_m, -kFar_m, kFar_m);
    g("least_y_m", zone.least_y_m, -kFar_m, kFar_m);
    g("most_x_m", zone.most_x_m, -kFar_m, kFar_m);
    g("most_y_m", zone.most_y_m, -kFar_m, kFar_m);
    g("gather", zone.gather, 1, 1000);
  });
  each(v, "encounters", s.encounters, [](ParamVisitor& g, Encounter& encounter) {
    g("group", encounter.group);
    g("other", encounter.other);
    g("to", encounter.to);
    g("within_m", encounter.within_m, 0.0, kFar_m);
  });
}

std::string known(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

void visit(ParamVisitor& v, Scenario& s) {
  v("name", s.name);
  v("about", s.about);
  v("seed", s.seed, 0, std::numeric_limits<int>::max());
  v("step_s", s.step_s, 1e-4, 0.1);
  v("until_s", s.until_s, 0.1, kLong_s);
  v("formed_m", s.formed_m, 1e-6, 100.0);
  v("stale_s", s.stale_s, 0.01, 60.0);
  v.group("beat", [&](ParamVisitor& g) {
    g("phase_rad", s.beat.phase_rad, -kAngle_rad, kAngle_rad);
    g("rate_rad_s", s.beat.rate_rad_s, 0.0, 30.0);
    g("agent", s.beat.agent);
  });
  each(v, "gaits", s.gaits, visit_gait);
  each(v, "groups", s.groups, visit_group);
  visit_obstacles(v, s);
  visit_polygons(v, s);
  visit_switches(v, s);
  each(v, "externals", s.externals, [](ParamVisitor& g, External& external) {
    g("name", external.name);
    g("group", external.group);
    g("place_m", external.place_m, -kFar_m, kFar_m);
    g("lane_m", external.lane_m, -kFar_m, kFar_m);
    g("radius_m", external.radius_m, 0.01, 10.0);
  });
}

Scenario read_scenario(const std::string& file, const std::vector<std::string>& sets) {
  const runtime::ParamSource source(file, {}, sets);
  Scenario scenario;
  source.read("", [&](runtime::ParamVisitor& v) { visit(v, scenario); });
  std::string lines;
  for (const Fault& fault : faults(scenario)) {
    lines += (lines.empty() ? "" : "\n") + to_string(source.place_of(fault.path)) + ": " +
             fault.path + ": " + fault.what;
  }
  if (!lines.empty()) throw ConfigError(lines);
  return scenario;
}

std::string find_scenario(const std::string& name) {
  if (name.find_first_of("./") != std::string::npos) {
    return runtime::find_project_file("launch", name);
  }
  const std::filesystem::path folder =
      std::filesystem::path(runtime::find_project_file("launch", "crowd/README.md")).parent_path();
  const std::filesystem::path file = folder / (name + ".yaml");
  if (std::filesystem::exists(file)) return file.string();
  throw ConfigError("scenario: there is no '" + name + "', expected " + known(folder) +
                    ", or a file");
}

}  // namespace mimesis::crowd
