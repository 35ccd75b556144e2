#pragma once
#include <span>

#include "nodes/crowd/certificate/monitor.h"
#include "nodes/crowd/rules/rules.h"
#include "nodes/crowd/run/observer.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

/// How far an agent's heading is from what its rule wants, where headings are disturbed by
/// avoidance: in the coordinates in which that decays exponentially, 2 tan(e/2) of the angle e to a
/// goal, e itself to the direction of a lane. NaN where the rate is not to be measured: avoidance
/// turns it (by more than a twentieth of what the rule does, a tenth for lanes, or by an unknown
/// amount), the goal is nearer than the certificate holds for, or the rule has none.
/// @param omega_rad_s  of the group's gait
double turn_error(const Group& group, const HeadingRule& rule, const RuleCertificate& certificate,
                  double omega_rad_s, const Observed& agent);

/// Tells a monitor of all agents of a group in which each has turns of its own: some avoid, or
/// agents come and go.
void measure_turns(Monitor& monitor, const Group& group, const HeadingRule& rule,
                   double omega_rad_s, std::span<const Observed> agents, double t_s);

}  // namespace mimesis::crowd
