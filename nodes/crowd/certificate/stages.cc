// Certificates of the groups of a scenario, from one change of their rules to the next.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/circle.h"
#include "nodes/crowd/certificate/certificate.h"

namespace mimesis::crowd {
namespace {

/// Largest angle between headings that the group keeps and its path.
double off_path(const Scenario& scenario, const Group& group, const GroupNow& now) {
  if (now.turned || scenario.grows(group.name))
    return std::numbers::pi;  // who comes has any heading
  double off = 0.0;
  const double omega = scenario.gait(group.gait)->eigenfrequency_rad_s;
  for (const AgentStart& a : starts(group, omega, static_cast<std::uint64_t>(scenario.seed))) {
    off = std::max(off, std::abs(math::wrap_pi(a.heading_rad - group.heading_rad)));
  }
  return off;
}

/// Who comes from other groups differs from the gait as it did there.
double spread(const Scenario& scenario, const Group& group) {
  double most = group.spread_rad_s;
  for (const Group& other : scenario.groups) {
    if (scenario.grows(group.name)) most = std::max(most, other.spread_rad_s);
  }
  return most;
}

}  // namespace

Certificate certify(const Scenario& scenario, const GroupNow& now) {
  const Group& group = scenario.groups[static_cast<std::size_t>(now.group)];
  const Gait& gait = scenario.gaits[static_cast<std::size_t>(now.gait)];
  const bool beats = group.beat_gain_1_s > 0.0;
  Rules rules = now.rules;
  if (beats) rules.phase.leader_gain_1_s = 0.0;  // no agent leads
  // A beat leads any agent of a group, also those that come later.
  Certificate c = certify(rules, std::max(beats ? 1 : 0, now.agents),
                          {.gait = gait.speed(),
                           .eigenfrequency_rad_s = gait.eigenfrequency_rad_s,
                           .spread_rad_s = spread(scenario, group),
                           .beat_gain_1_s = group.beat_gain_1_s,
                           .beat_rate_rad_s = scenario.beat.rate_rad_s,
                           .sway = gait.sway(),
                           .off_path_rad = off_path(scenario, group, now),
                           .step_s = scenario.step_s,
                           .guests = now.guests,
                           .age_s = now.age_s});
  c.agents = now.agents;
  return c;
}

std::vector<Stage> certify(const Scenario& scenario) {
  std::vector<Stage> stages;
  for (std::size_t g = 0; g < scenario.groups.size(); ++g) {
    const Group& group = scenario.groups[g];
    const auto guests = std::ranges::count(scenario.externals, group.name, &External::group);
    GroupNow now{.group = static_cast<int>(g),
                 .rules = group.rules,
                 .gait = scenario.gait_number(group.gait),
                 .agents = group.count + static_cast<int>(guests),
                 .guests = static_cast<int>(guests),
                 .age_s = scenario.stale_s};
    const auto add = [&](double from_s, const std::string& gait) {
      stages.push_back({group.name, gait, from_s, now.rules, now.agents, certify(scenario, now)});
      if (guests == 0) return;
      stages.back().certificate.notes.push_back(
          "agents from outside follow by laws of their own: rates are those if " +
          std::to_string(guests) + " of " + std::to_string(now.agents) +
          " do what their commands say, with states as old as stale_s allows");
    };
    std::string gait = group.gait;
    add(0.0, gait);
    for (const Change& change : scenario.schedule) {
      if (change.group != group.name) continue;
      now.turned = now.turned || now.rules.heading.kind != HeadingKind::keep;
      now.rules = change.rules;
      if (!change.gait.empty()) gait = change.gait;
      now.gait = scenario.gait_number(gait);
      add(change.at_s, gait);
    }
  }
  return stages;
}

}  // namespace mimesis::crowd
