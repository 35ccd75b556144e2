#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "nodes/crowd/rules/gait.h"
#include "nodes/crowd/rules/rules.h"
#include "nodes/crowd/ways/ways.h"

namespace mimesis::crowd {

/// A way to walk; its name is the style or emotion that the synthesizer knows it by.
struct Gait {
  std::string name = "neutral";
  double eigenfrequency_rad_s = 5.7;                 ///< ω₀ of the gait phase
  double mean_m_rad = 0.2;                           ///< ⟨g⟩ of the speed function
  std::vector<double> cosine_m_rad{}, sine_m_rad{};  ///< its harmonics
  /// coefficients of g^ψ, the sway of headings [1]
  std::vector<double> sway_cosine{}, sway_sine{};

  /// @throws ConfigError where g touches zero
  SpeedFunction speed() const { return {mean_m_rad, cosine_m_rad, sine_m_rad}; }
  /// @throws ConfigError for more than four harmonics
  HeadingSway sway() const { return HeadingSway::make(sway_cosine, sway_sine); }
};

/// Where agents stand at the start, in the path's frame P: z along the path, ξ to the left of it.
enum class Arrangement {
  line,    ///< one behind the other
  row,     ///< side by side
  grid,    ///< rows of `columns`, one behind the other
  circle,  ///< facing its centre
  box,     ///< at random places, one radius between two at least
  listed
};

enum class PhaseStart { equal, spread, random, listed };

struct Start {
  Arrangement arrangement = Arrangement::grid;
  double spacing_m = 1.2;  ///< along the path
  double across_m = 1.2;
  int columns = 0;         ///< columns of a grid; 0: ⌈√count⌉
  double radius_m = 5.0;   ///< radius of a circle
  double length_m = 10.0;  ///< length of a box along the path; its middle is the path's origin
  double width_m = 10.0;
  double jitter_m = 0.0;                  ///< every coordinate moved at random by up to ±this
  std::vector<double> position_m{};       ///< listed: z, ξ of one agent after the other
  PhaseStart phase = PhaseStart::random;  ///< spread: multiples of the golden section of a cycle
  std::vector<double> phase_rad{};        ///< listed
};

/// Where agents shall be relative to each other: place dᵢ along the path, lane ξᵢ across.
enum class Shape {
  none,       ///< the rules know no distances
  line,       ///< agent 0 ahead, `spacing_m` from one to the next
  row,        ///< dᵢ = 0, side by side
  grid,       ///< rows of `columns`, agent 0 ahead on the left
  wedge,      ///< agent 0 ahead, the others behind on both sides
  listed,     ///< dᵢ and ξᵢ one by one
  distances,  ///< dᵢⱼ of pairs; lanes as a row
};

/// dᵢⱼ, how far i shall be ahead of j.
struct Distance {
  int i = 0, j = 0;
  double ahead_m = 0.0;
};

struct Formation {
  Shape shape = Shape::none;
  double spacing_m = 1.2;
  double across_m = 1.2;
  int columns = 0;  ///< columns of a grid; 0: ⌈√count⌉
  std::vector<double> place_m{}, lane_m{};
  std::vector<Distance> distances{};
};

enum class Aim {
  none,
  opposite,  ///< own start seen through the path's origin: circle swap, head-on pairs
  places,    ///< one for each agent, or one for all
  route      ///< every agent from one to the next
};

struct Goals {
  Aim aim = Aim::none;
  std::vector<double> position_m{};  ///< x, y in W of one after the other
  bool loop = false;                 ///< a route starts again
  double reached_m = 0.5;            ///< distance within which a place is reached
};

/// Agents with the same rules and gait. z runs from `origin` along `heading`.
struct Group {
  std::string name = "crowd";
  int count = 0;
  std::string gait = "neutral";
  double spread_rad_s = 0.0;  ///< eigenfrequencies are drawn from ω₀ ± this
  double radius_m = 0.25;     ///< radius of an agent
  double origin_x_m = 0.0, origin_y_m = 0.0, heading_rad = 0.0;  ///< place and direction of P in W
  Start start{};
  Formation formation{};
  Goals goals{};
  Rules rules{};
  double beat_gain_1_s = 0.0;  ///< to Scenario::beat, as α to a leader [M18 eq. 4.26]; 0: deaf
};

/// An external rhythm, such as music: phase at time 0 and rate; rate 0: none.
struct Rhythm {
  double phase_rad = 0.0, rate_rad_s = 0.0;
  std::string agent{};  ///< external agent whose gait it is, such as a robot; continues without it
};

/// From `at_s` on the group has these rules, and this gait if it names one.
struct Change {
  double at_s = 0.0;
  std::string group;
  std::string gait;
  Rules rules{};
};

/// An agent of `from` ("": of any group) in the rectangle changes to group `to`; with gathering,
/// agents wait there until this number has come.
struct Zone {
  std::string name, from, to;
  double least_x_m = 0.0, least_y_m = 0.0, most_x_m = 0.0, most_y_m = 0.0;
  int gather = 1;
};

/// An agent of `group` that comes within the distance of one of `other` goes over to group `to`:
/// emotions that switch when people meet.
struct Encounter {
  std::string group, other, to;
  double within_m = 2.0;
};

/// An agent that another process or a robot may be. It takes part from its first message on.
struct External {
  std::string name, group;
  double place_m = 0.0, lane_m = 0.0;  ///< in the group's formation
  double radius_m = 0.25;
};

/// All that a run of the crowd needs; the content of launch/crowd/NAME.yaml.
struct Scenario {
  std::string name = "crowd", about;
  int seed = 1;
  double step_s = 0.02;    ///< step of the simulation
  double until_s = 60.0;   ///< length of the run
  double formed_m = 0.01;  ///< largest distance of an agent from its place in a formation in order
  double stale_s = 0.3;    ///< older states of external agents are not trusted
  Rhythm beat{};
  std::vector<Gait> gaits{};
  std::vector<Group> groups{};
  std::vector<Pillar> pillars{};
  std::vector<Wall> walls{};
  std::vector<Polygon> polygons{};
  std::vector<Change> schedule{};  ///< in the order of time
  std::vector<Zone> zones{};
  std::vector<Encounter> encounters{};
  std::vector<External> externals{};

  /// By name; null if there is none.
  const Gait* gait(std::string_view wanted) const;
  const Group* group(std::string_view wanted) const;
  /// Number in `gaits` or `groups`; -1 if there is none.
  int gait_number(std::string_view wanted) const;
  int group_number(std::string_view wanted) const;
  /// Agents may come to this group while it runs: through zones, encounters or from outside.
  bool grows(std::string_view wanted) const;
};

/// State of an agent at time 0.
struct AgentStart {
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;  ///< in W, (-π, π]
  double phase_rad = 0.0;    ///< [0, 2π)
  double eigenfrequency_rad_s = 0.0;
};

/// Place of an agent in its formation: dᵢ ahead of agents with d = 0, ξᵢ to the left of the path.
struct FormationPlace {
  double place_m = 0.0;
  double lane_m = 0.0;
};

/// How the group begins. Same seed, same bits; agents drawn one after the other, so that a larger
/// group begins like a smaller one unless its grid is wider.
/// @param eigenfrequency_rad_s  ω₀ of the group's gait
/// @throws ConfigError if a box is too small for its agents
std::vector<AgentStart> starts(const Group& group, double eigenfrequency_rad_s, std::uint64_t seed);

/// Places of the group's agents; zeros for Shape::none. Distances of pairs are summed along a tree
/// from agent 0, whose place is 0. @throws ConfigError for distances that are inconsistent or leave
/// an agent without a place
std::vector<FormationPlace> places(const Group& group);

/// First goal of each agent in W [m]; empty for Aim::none.
std::vector<Eigen::Vector2d> first_goals(const Group& group, const std::vector<AgentStart>& from);

/// Walkers with these rules plan ways: those who avoid and have goals, where there are walls.
bool plans_ways(const Scenario& scenario, const Rules& rules);
/// At some time.
bool plans_ways(const Scenario& scenario, const Group& group);
/// The ways of a group that plans some; O(walls³).
Ways ways_of(const Scenario& scenario, const Group& group);

/// Something a scenario must not be, where ("groups.0.rules.frequency.gain_rad_m_s") and why, in
/// the terms of the theory.
struct Fault {
  std::string path, what;
};

/// All faults, whatever the source of the scenario; none: it can run.
std::vector<Fault> faults(const Scenario& scenario);

/// The coupling graph that settings ask for among n agents. @throws ConfigError
CouplingGraph coupling(const GraphSettings& settings, int n);

}  // namespace mimesis::crowd
