#include "nodes/crowd/scenario/scenario.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>

#include "common/error.h"

namespace mimesis::crowd {

namespace {

std::string number(double v) {
  std::ostringstream out;
  out << v;
  return out.str();
}

class RuleFaults {
 public:
  RuleFaults(std::string path, const Group& group, bool grows, std::vector<Fault>& faults)
      : path_(std::move(path)), group_(group), grows_(grows), faults_(faults) {}

  void check(const FrequencyRule& r) {
    gain("frequency.gain_rad_m_s", "m_d", r.gain_rad_m_s,
         "step frequencies drive the agents apart (4.28)");
    not_negative("frequency.saturation_m", "saturation", r.saturation_m);
    not_negative("frequency.low_pass_rad_s", "alpha of the low-pass", r.low_pass_rad_s);
    if (r.gain_rad_m_s != 0.0) {
      graph("frequency", r.graph, group_.count);
      distances("frequency");
    }
  }

  void check(const LengthRule& r) {
    gain("length.gain_1_m", "m_z", r.gain_1_m, "step lengths drive the agents apart (4.30)");
    if (!(r.limit > 0.0 && r.limit < 1.0)) {
      add("length.limit", "|mu| <= " + number(r.limit) +
                              ": with |mu| in (0, 1) everybody walks forward, 1 + mu > 0");
    }
    if (r.gain_1_m != 0.0) {
      graph("length", r.graph, group_.count);
      distances("length");
    }
  }

  void check(const PhaseRule& r) {
    gain("phase.gain_1_s", "k", r.gain_1_s, "the coupling repels phases (4.31)");
    gain("phase.leader_gain_1_s", "alpha", r.leader_gain_1_s, "the leader repels (4.26)");
    if (r.leader_gain_1_s != 0.0) {
      if (group_.count == 1 && !grows_) add("phase.leader_gain_1_s", "a leader without followers");
      // Only followers are coupled; the leader holds all their parts together.
      if (r.graph.topology != Topology::none) made(r.graph, "phase", group_.count - 1);
    } else if (r.gain_1_s != 0.0) {
      graph("phase", r.graph, group_.count);
    }
  }

  void check(const HeadingRule& r) {
    gain("heading.gain", "the gain", r.gain, "headings are repelled (4.32, 4.41)");
    if (r.kind == HeadingKind::keep) return;
    if (r.gain == 0.0) add("heading.gain", "is 0: nothing turns; keep says that");
    not_negative("heading.low_pass_s", "the low-pass", r.low_pass_s);
    not_negative("heading.spread_rad", "sigma", r.spread_rad);
    if (r.kind == HeadingKind::lane && !(r.ahead_m > 0.0)) {
      add("heading.ahead_m",
          "the sliding goal is " + number(r.ahead_m) + " m ahead; it must be > 0");
    }
    if (r.kind == HeadingKind::coupled) graph("heading", r.graph, group_.count);
    if (r.kind == HeadingKind::goal && group_.goals.aim == Aim::none && group_.count > 0) {
      add("heading.kind", "goal, but the group has no goals");
    }
  }

 private:
  void add(const std::string& key, const std::string& what) {
    faults_.push_back({path_ + "." + key, what});
  }

  void not_negative(const std::string& key, const std::string& name, double value) {
    if (!std::isfinite(value) || value < 0.0) {
      add(key, name + " is " + number(value) + ", it must be finite and not negative");
    }
  }

  void gain(const std::string& key, const std::string& name, double value, const char* harm) {
    if (!std::isfinite(value)) {
      add(key, name + " is " + number(value) + ", not a number to couple with");
    } else if (value < 0.0) {
      add(key, name + " = " + number(value) + " < 0: " + harm +
                   "; the Jacobian is not negative definite, contraction needs " + name + " > 0");
    }
  }

  void distances(const std::string& rule) {
    if (group_.formation.shape == Shape::none) {
      add(rule, "controls distances d_ij, but the group has no formation");
    }
  }

  /// @returns whether it is connected; nothing if there is none
  std::optional<bool> made(const GraphSettings& settings, const std::string& rule, int n) {
    if (!settings.edges.empty() && settings.topology != Topology::weighted) {
      add(rule + ".edges", "the graph is " + std::string(to_string(settings.topology)) +
                               " already: expected one of graph and edges");
      return std::nullopt;
    }
    if (settings.directed && settings.topology != Topology::weighted) {
      add(rule + ".directed", "a named graph has no directions: list its edges");
      return std::nullopt;
    }
    if (grows_ && settings.topology == Topology::weighted) {
      add(rule + ".edges", "agents may join this group: its graph needs a name, edges fix N");
      return std::nullopt;
    }
    try {
      return coupling(settings, std::max(n, 0)).connected();
    } catch (const ConfigError& e) {
      if (!grows_) add(rule + (settings.edges.empty() ? ".graph" : ".edges"), e.what());
      return std::nullopt;  // a group that grows may have too few agents at the start
    }
  }

  void graph(const std::string& rule, const GraphSettings& settings, int n) {
    if (settings.topology == Topology::none) {
      add(rule, "has a gain, but graph none couples nobody: the rule would do nothing");
      return;
    }
    if (n == 1 && !grows_) {
      add(rule, "N = 1: the Laplacian of one agent is 0, there is nobody to agree with");
      return;
    }
    if (made(settings, rule, n).value_or(true)) return;
    add(rule + (settings.edges.empty() ? ".graph" : ".edges"),
        "the coupling graph of " + std::to_string(n) +
            " agents is not connected: its algebraic connectivity lambda_2 is 0, and parts that do "
            "not hear each other do not agree (A.1)");
  }

  std::string path_;
  const Group& group_;
  bool grows_;
  std::vector<Fault>& faults_;
};

void add_rule_faults(const std::string& path, const Rules& rules, const Group& group, bool grows,
                     std::vector<Fault>& faults) {
  RuleFaults check(path, group, grows, faults);
  check.check(rules.frequency);
  check.check(rules.length);
  check.check(rules.phase);
  check.check(rules.heading);
}

std::string at(const char* list, std::size_t i) {
  return std::string(list) + "." + std::to_string(i);
}

class Checker {
 public:
  explicit Checker(const Scenario& scenario) : s_(scenario) {}

  std::vector<Fault> run() {
    if (s_.gaits.empty()) add("gaits", "there is no gait");
    if (s_.groups.empty()) add("groups", "there is no group: N = 0");
    if (!(s_.step_s > 0.0)) add("step_s", "a step of " + number(s_.step_s) + " s");
    for (std::size_t i = 0; i < s_.gaits.size(); ++i) check_gait(at("gaits", i), i);
    for (std::size_t i = 0; i < s_.groups.size(); ++i) check_group(at("groups", i), i);
    for (std::size_t i = 0; i < s_.schedule.size(); ++i) check_change(at("schedule", i), i);
    for (std::size_t i = 0; i < s_.zones.size(); ++i) check_zone(at("zones", i), s_.zones[i]);
    for (std::size_t i = 0; i < s_.encounters.size(); ++i) {
      check_encounter(at("encounters", i), s_.encounters[i]);
    }
    check_externals();
    check_obstacles();
    check_polygons();
    return std::move(faults_);
  }

 private:
  void add(const std::string& path, const std::string& what) { faults_.push_back({path, what}); }

  void check_gait(const std::string& path, std::size_t i) {
    const Gait& gait = s_.gaits[i];
    if (s_.gait(gait.name) != &gait) add(path + ".name", "gait " + gait.name + " is there twice");
    if (!(gait.eigenfrequency_rad_s > 0.0)) {
      add(path + ".eigenfrequency_rad_s",
          "omega_0 = " + number(gait.eigenfrequency_rad_s) + ": a walker's phase must advance");
    }
    try {
      [[maybe_unused]] const SpeedFunction g = gait.speed();
    } catch (const ConfigError& e) {
      add(path + ".mean_m_rad", e.what());
    }
    try {
      [[maybe_unused]] const HeadingSway sway = gait.sway();
    } catch (const ConfigError& e) {
      add(path + ".sway_cosine", e.what());
    }
  }

  void check_group(const std::string& path, std::size_t i) {
    const Group& group = s_.groups[i];
    if (s_.group(group.name) != &group) {
      add(path + ".name", "group " + group.name + " is there twice");
    }
    known_gait(path + ".gait", group.gait);
    const bool grows = s_.grows(group.name);
    if (group.count < 0 || (group.count == 0 && !grows)) {
      add(path + ".count", "N = " + std::to_string(group.count) +
                               ": there is nobody, and nobody comes by zones, encounters or bus");
      return;
    }
    const Gait* gait = s_.gait(group.gait);
    if (gait != nullptr && group.spread_rad_s >= gait->eigenfrequency_rad_s) {
      add(path + ".spread_rad_s", "as large as the eigenfrequency: somebody would not walk");
    }
    if (group.beat_gain_1_s < 0.0) {
      add(path + ".beat_gain_1_s",
          "alpha = " + number(group.beat_gain_1_s) + " < 0: the beat would repel");
    }
    if (group.beat_gain_1_s > 0.0 && s_.beat.rate_rad_s == 0.0) {
      add(path + ".beat_gain_1_s", "there is no beat to follow");
    }
    if (group.beat_gain_1_s > 0.0 && group.rules.phase.leader_gain_1_s > 0.0) {
      add(path + ".beat_gain_1_s", "the group has a leader already");
    }
    check_start(path, group);
    check_formation(path, group);
    check_goals(path, group);
    add_rule_faults(path + ".rules", group.rules, group, grows, faults_);
  }

  void check_start(const std::string& path, const Group& group) {
    const Start& start = group.start;
    const auto n = static_cast<std::size_t>(group.count);
    if (start.arrangement == Arrangement::listed) {
      sized(path + ".start.position_m", "numbers z, xi", 2 * n, start.position_m.size());
    }
    if (start.phase == PhaseStart::listed) {
      sized(path + ".start.phase_rad", "phases", n, start.phase_rad.size());
    }
    if (start.arrangement != Arrangement::box) return;
    Group alone = group;
    alone.start.phase = PhaseStart::equal;
    attempt(path + ".start", [&] { (void)starts(alone, 1.0, static_cast<unsigned>(s_.seed)); });
  }

  void check_formation(const std::string& path, const Group& group) {
    const Formation& f = group.formation;
    const auto n = static_cast<std::size_t>(group.count);
    if (f.shape == Shape::listed) {
      sized(path + ".formation.place_m", "places", n, f.place_m.size());
      if (!f.lane_m.empty()) sized(path + ".formation.lane_m", "lanes", n, f.lane_m.size());
    }
    if (f.shape != Shape::distances) return;
    for (std::size_t i = 0; i < f.distances.size(); ++i) {
      const Distance& d = f.distances[i];
      if (std::min(d.i, d.j) >= 0 && std::max(d.i, d.j) < group.count && d.i != d.j) continue;
      add(path + ".formation.distances." + std::to_string(i),
          "between " + std::to_string(d.i) + " and " + std::to_string(d.j) +
              ": expected two of the agents 0 to " + std::to_string(group.count - 1));
      return;
    }
    attempt(path + ".formation.distances", [&] { (void)places(group); });
  }

  void check_goals(const std::string& path, const Group& group) {
    const std::size_t given = group.goals.position_m.size();
    const std::string where = path + ".goals.position_m";
    const bool listed = group.goals.aim == Aim::places || group.goals.aim == Aim::route;
    if (listed && (given == 0 || given % 2 != 0)) {
      add(where, "expected x, y of every goal, found " + std::to_string(given) + " numbers");
    } else if (group.goals.aim == Aim::places && given > 2) {
      sized(where, "numbers x, y (or two for all)", 2 * static_cast<std::size_t>(group.count),
            given);
    }
  }

  void check_change(const std::string& path, std::size_t i) {
    const Change& change = s_.schedule[i];
    if (i > 0 && change.at_s < s_.schedule[i - 1].at_s) {
      add(path + ".at_s", "before the change above it");
    }
    if (!change.gait.empty()) known_gait(path + ".gait", change.gait);
    known_group(path + ".group", change.group);
    if (const Group* group = s_.group(change.group)) {
      add_rule_faults(path + ".rules", change.rules, *group, s_.grows(group->name), faults_);
    }
  }

  void check_zone(const std::string& path, const Zone& zone) {
    if (!zone.from.empty()) known_group(path + ".from", zone.from);
    known_group(path + ".to", zone.to);
    if (zone.least_x_m >= zone.most_x_m) add(path + ".most_x_m", "not above least_x_m");
    if (zone.least_y_m >= zone.most_y_m) add(path + ".most_y_m", "not above least_y_m");
    if (zone.gather < 1) add(path + ".gather", "fewer than one never come together");
  }

  void check_encounter(const std::string& path, const Encounter& e) {
    known_group(path + ".group", e.group);
    known_group(path + ".other", e.other);
    known_group(path + ".to", e.to);
    if (e.group == e.to) add(path + ".to", "the group they are in");
    if (!(e.within_m > 0.0)) add(path + ".within_m", "nobody comes so near");
  }

  void check_externals() {
    const std::string& leader = s_.beat.agent;
    if (!leader.empty() &&
        std::ranges::find(s_.externals, leader, &External::name) == s_.externals.end()) {
      add("beat.agent", "'" + leader + "' is none of the external agents");
    }
    for (std::size_t i = 0; i < s_.externals.size(); ++i) {
      const External& e = s_.externals[i];
      known_group(at("externals", i) + ".group", e.group);
      if (std::ranges::find(s_.externals, e.name, &External::name) - s_.externals.begin() !=
          static_cast<std::ptrdiff_t>(i)) {
        add(at("externals", i) + ".name", "external agent " + e.name + " is there twice");
      }
    }
  }

  void check_obstacles() {
    for (std::size_t i = 0; i < s_.pillars.size(); ++i) {
      if (!(s_.pillars[i].radius_m > 0.0)) add(at("pillars", i) + ".radius_m", "not above 0");
    }
    for (std::size_t i = 0; i < s_.walls.size(); ++i) {
      if (s_.walls[i].from_W_m != s_.walls[i].to_W_m) continue;
      add(at("walls", i), "ends where it begins; a pillar is round");
    }
  }

  void check_polygons() {
    for (std::size_t k = 0; k < s_.polygons.size(); ++k) {
      const std::vector<double>& xy = s_.polygons[k].corner_m;
      const std::string where = at("polygons", k) + ".corner_m";
      if (xy.size() < 6 || xy.size() % 2 != 0) {
        add(where, "expected x, y of three corners or more, found " + std::to_string(xy.size()) +
                       " numbers");
      } else if (const std::string why = tangled(xy); !why.empty()) {
        add(where, why);
      }
    }
    if (!faults_.empty()) return;  // starts and goals may not exist
    for (std::size_t g = 0; g < s_.groups.size(); ++g) check_ways(at("groups", g), s_.groups[g]);
  }

  /// Why these are no corners of one inside; empty: they are.
  static std::string tangled(const std::vector<double>& xy) {
    const std::vector<Wall> sides = edges({}, std::array{Polygon{xy}});
    const auto name = [](std::size_t i) { return std::to_string(i); };
    for (std::size_t i = 0; i < sides.size(); ++i) {
      if (sides[i].from_W_m == sides[i].to_W_m) return "corner " + name(i) + " is there twice";
      for (std::size_t j = 0; j + 1 < i; ++j) {
        if (i == sides.size() - 1 && j == 0) continue;  // neighbours
        if (meet(sides[i], sides[j])) return "sides " + name(j) + " and " + name(i) + " cross";
      }
    }
    return {};
  }

  /// Nobody may stand, or want to go, where there is no way.
  void check_ways(const std::string& path, const Group& group) {
    if (s_.walls.empty() && s_.polygons.empty()) return;
    const double omega = s_.gait(group.gait)->eigenfrequency_rad_s;
    const std::vector<AgentStart> from = starts(group, omega, static_cast<std::uint64_t>(s_.seed));
    const std::vector<Eigen::Vector2d> goals = first_goals(group, from);
    const auto in_a_polygon = [&](const Eigen::Vector2d& p, const std::string& where,
                                  const std::string& who) {
      for (std::size_t k = 0; k < s_.polygons.size(); ++k) {
        if (!inside(s_.polygons[k], p)) continue;
        add(where, who + " at " + number(p.x()) + ", " + number(p.y()) + " is inside of polygon " +
                       std::to_string(k));
        return true;
      }
      return false;
    };
    for (std::size_t i = 0; i < from.size(); ++i) {
      const std::string agent = "agent " + std::to_string(i);
      if (in_a_polygon(from[i].p_W_m, path + ".start", agent)) return;
      if (!goals.empty() &&
          in_a_polygon(goals[i], path + ".goals.position_m", "the goal of " + agent))
        return;
    }
    if (!plans_ways(s_, group)) return;
    constexpr std::size_t kMostWalls = 500;
    if (const std::size_t n = edges(s_.walls, s_.polygons).size(); n > kMostWalls) {
      add("walls", std::to_string(n) + " walls and sides of polygons: ways are planned around " +
                       std::to_string(kMostWalls) + " at most");
      return;
    }
    if (goals.empty()) return;
    Ways ways = ways_of(s_, group);
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (ways.next(from[i].p_W_m, goals[i])) continue;
      add(path + ".goals", "there is no way for agent " + std::to_string(i) + " from " +
                               number(from[i].p_W_m.x()) + ", " + number(from[i].p_W_m.y()) +
                               " to " + number(goals[i].x()) + ", " + number(goals[i].y()) +
                               ": walls close it, or gaps are too narrow for its radius of " +
                               number(group.radius_m) + " m");
      return;
    }
  }

  void known_gait(const std::string& path, const std::string& name) {
    if (s_.gait(name) != nullptr) return;
    std::string known;
    for (const Gait& gait : s_.gaits) known += (known.empty() ? "" : ", ") + gait.name;
    add(path, "no gait '" + name + "'; there are: " + known);
  }

  void known_group(const std::string& path, const std::string& name) {
    if (s_.group(name) != nullptr) return;
    std::string known;
    for (const Group& group : s_.groups) known += (known.empty() ? "" : ", ") + group.name;
    add(path, "no group '" + name + "'; there are: " + known);
  }

  void sized(const std::string& path, const char* what, std::size_t wanted, std::size_t found) {
    if (wanted == found) return;
    add(path,
        "expected " + std::to_string(wanted) + " " + what + ", found " + std::to_string(found));
  }

  template <class Function>
  void attempt(const std::string& path, const Function& function) {
    try {
      function();
    } catch (const ConfigError& e) {
      add(path, e.what());
    }
  }

  const Scenario& s_;
  std::vector<Fault> faults_;
};

}  // namespace

std::vector<Fault> faults(const Scenario& scenario) { return Checker(scenario).run(); }

int Scenario::gait_number(std::string_view wanted) const {
  const auto it = std::ranges::find(gaits, wanted, &Gait::name);
  return it == gaits.end() ? -1 : static_cast<int>(it - gaits.begin());
}

int Scenario::group_number(std::string_view wanted) const {
  const auto it = std::ranges::find(groups, wanted, &Group::name);
  return it == groups.end() ? -1 : static_cast<int>(it - groups.begin());
}

const Gait* Scenario::gait(std::string_view wanted) const {
  const int i = gait_number(wanted);
  return i < 0 ? nullptr : &gaits[static_cast<std::size_t>(i)];
}

const Group* Scenario::group(std::string_view wanted) const {
  const int i = group_number(wanted);
  return i < 0 ? nullptr : &groups[static_cast<std::size_t>(i)];
}

bool Scenario::grows(std::string_view wanted) const {
  return std::ranges::find(zones, wanted, &Zone::to) != zones.end() ||
         std::ranges::find(encounters, wanted, &Encounter::to) != encounters.end() ||
         std::ranges::find(externals, wanted, &External::group) != externals.end();
}

bool plans_ways(const Scenario& scenario, const Rules& rules) {
  return (!scenario.walls.empty() || !scenario.polygons.empty()) && rules.heading.avoid &&
         rules.heading.kind == HeadingKind::goal;
}

bool plans_ways(const Scenario& scenario, const Group& group) {
  return plans_ways(scenario, group.rules) ||
         std::ranges::any_of(scenario.schedule, [&](const Change& change) {
           return change.group == group.name && plans_ways(scenario, change.rules);
         });
}

Ways ways_of(const Scenario& scenario, const Group& group) {
  constexpr double kBeside_m = 0.02;  // more than their radius from walls
  return {scenario.walls, scenario.polygons, group.radius_m + kBeside_m};
}

CouplingGraph coupling(const GraphSettings& settings, int n) {
  return settings.topology == Topology::weighted
             ? CouplingGraph::weighted(n, settings.edges, settings.directed)
             : CouplingGraph::make(settings.topology, n);
}

}  // namespace mimesis::crowd
