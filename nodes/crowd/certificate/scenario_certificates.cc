#include "nodes/crowd/certificate/scenario_certificates.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "nodes/crowd/certificate/contraction.h"
#include "nodes/crowd/certificate/say.h"
#include "nodes/crowd/scenario/arrangement.h"

namespace mimesis::crowd {
namespace {

GaitRange range_of(const Scenario& scenario, const Stage& stage, const Group& group) {
  const Gait* gait = scenario.gait(stage.gait);
  return {gait->speed(), gait->eigenfrequency_rad_s, group.spread_rad_s, group.beat_gain_1_s,
          gait->sway()};
}

Certificate certified(const Scenario& scenario, const Stage& stage, const Group& group) {
  const GaitRange gait = range_of(scenario, stage, group);
  // Of a group that agents come to later a beat leads whoever it is.
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
