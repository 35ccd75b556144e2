// What coordinators publish.
#include <algorithm>
#include <cmath>

#include "nodes/crowd/crowd_node.h"
#include "nodes/crowd/scene_node.h"

namespace mimesis::crowd {
namespace {

using namespace std::chrono_literals;

v1::CrowdRule to_proto(Rule rule) {
  switch (rule) {
    case Rule::frequency:
      return v1::CROWD_RULE_FREQUENCY;
    case Rule::length:
      return v1::CROWD_RULE_LENGTH;
    case Rule::phase:
      return v1::CROWD_RULE_PHASE;
    case Rule::tracking:
      return v1::CROWD_RULE_TRACKING;
    case Rule::heading:
      return v1::CROWD_RULE_HEADING;
  }
  return v1::CROWD_RULE_UNSPECIFIED;
}

void to_proto(const RuleLine& line, int agents, v1::CrowdGuarantee& out) {
  const RuleCertificate& c = line.certificate;
  out.set_group(static_cast<std::uint32_t>(line.group));
  out.set_rule(to_proto(line.rule));
  out.set_guaranteed(c.guarantee == Guarantee::contracting);
  out.set_guaranteed_rate_1_s(c.guaranteed_1_s);
  out.set_expected_rate_1_s(c.expected_1_s);
  out.set_within(c.within);
  if (line.report.measured_1_s) out.set_measured_rate_1_s(*line.report.measured_1_s);
  out.set_disorder(line.disorder);
  out.set_agents(static_cast<std::uint32_t>(agents));
  if (c.largest_agents) out.set_largest_agents(static_cast<std::uint32_t>(*c.largest_agents));
  out.set_why(c.why);
  for (const std::string& change : c.change) out.add_change(change);
}

}  // namespace

void CrowdNode::publish_states(Time now) {
  states_message_.set_coordinator(static_cast<std::uint32_t>(params_.regions.own));
  states_message_.set_step(steps_);
  std::uint32_t hears = 1;
  for (int c = 0; c < coordinators(); ++c) {
    hears += c + 1 != params_.regions.own && far_.heard(c, now) ? 1 : 0;
  }
  states_message_.set_hears(hears);
  states_message_.set_time_s(runs_ ? run_.time_s() : 0.0);
  to_proto(run_, states_message_);
  states_message_.set_collisions(closeness_.collisions());
  if (std::isfinite(closeness_.least_gap_m())) {
    states_message_.set_least_gap_m(closeness_.least_gap_m());
    states_message_.set_least_distance_m(closeness_.least_distance_m());
  }
  states_.send(states_message_, now);
}

void CrowdNode::publish_scene(Time now) {
  // The picture is of the step before: in the first there is none.
  if (!first() || params_.scene_hz <= 0.0 || steps_ == 1 || now < scene_due_) return;
  if (scene_due_ == Time{}) scene_due_ = now;
  scene_due_ += runtime::from_seconds(1.0 / params_.scene_hz);
  foxglove::SceneUpdate update = paint(run_.scenario(), everybody_, now);
  scene_.send(update, now);
}

/// Once a second, and at once when one is void.
void CrowdNode::publish_certificate(Time now) {
  if (!first() || !runs_) return;
  const std::string voided = watch_.take_voided();
  if (voided.empty() && now < certificate_due_) return;
  if (!voided.empty()) runtime::info("certificate {}: {}", watch_.number(), voided);
  certificate_due_ = now + 1s;
  v1::CrowdCertificate message;
  message.set_coordinator(static_cast<std::uint32_t>(params_.regions.own));
  message.set_number(static_cast<std::uint32_t>(watch_.number()));
  message.set_voided(voided);
  for (const RuleLine& line : watch_.lines()) {
    to_proto(line, watch_.agents(line.group), *message.add_guarantees());
  }
  certificate_.send(message, now);
}

void CrowdNode::publish_status(Time now) {
  if (!status_changed_ && now < status_due_) return;
  status_changed_ = false;
  status_due_ = now + 1s;
  v1::CrowdStatus status;
  status.set_coordinator(static_cast<std::uint32_t>(params_.regions.own));
  status.set_runs(runs_);
  status.set_reason(runs_ ? trouble_ : reason_);
  status.set_own(static_cast<std::uint32_t>(states_message_.id_size()));
  status.set_seen(static_cast<std::uint32_t>(far_.taken_into_account()));
  status.set_given(given_);
  status.set_taken(taken_);
  status.set_in_order(first() && watch_.in_order());
  status.set_mean_step_s(took_.mean_s);
  status.set_worst_step_s(took_.worst_s);
  for (int e = 0; first() && e < externals_.size(); ++e) {
    v1::CrowdExternal& external = *status.add_externals();
    external.set_id(run_.roster().external_id(e));
    external.set_name(run_.scenario().externals[static_cast<std::size_t>(e)].name);
    external.set_trust(crowd::to_proto(externals_.trust(e)));
    external.set_reason(external_reasons_[static_cast<std::size_t>(e)]);
    if (externals_.trust(e) != Trust::absent) external.set_age_s(externals_.age_s(e, now));
  }
  status_.send(status, now);
}

void CrowdNode::publish_outcome(Time now) {
  if (!first()) return;
  v1::CrowdOutcome outcome;
  std::uint64_t collisions = closeness_.collisions();
  double gap_m = closeness_.least_gap_m(), distance_m = closeness_.least_distance_m();
  for (const Peer& peer : peers_) {
    collisions += peer.collisions;
    gap_m = std::min(gap_m, peer.least_gap_m);
    distance_m = std::min(distance_m, peer.least_distance_m);
  }
  outcome.set_agents(static_cast<std::uint32_t>(everybody_.size()));
  outcome.set_collisions(collisions);
  if (std::isfinite(gap_m)) outcome.set_least_gap_m(gap_m);
  if (std::isfinite(distance_m)) outcome.set_least_distance_m(distance_m);
  if (const auto weakest = watch_.weakest()) {
    outcome.set_rule(to_proto(weakest->rule));
    outcome.set_group(run_.scenario().groups[static_cast<std::size_t>(weakest->group)].name);
    if (weakest->certificate.guarantee == Guarantee::contracting) {
      outcome.set_guaranteed_rate_1_s(weakest->certificate.guaranteed_1_s);
      outcome.set_expected_rate_1_s(weakest->certificate.expected_1_s);
    }
    if (weakest->report.measured_1_s) outcome.set_measured_rate_1_s(*weakest->report.measured_1_s);
  }
  if (watch_.in_order()) outcome.set_formation_s(watch_.in_order_since_s());
  outcome.set_place_error_m(watch_.place_most_m());
  const Watch::Entrances& entrances = watch_.entrances();
  outcome.set_entrances(static_cast<std::uint32_t>(entrances.count));
  outcome.set_wrong_foot(static_cast<std::uint32_t>(entrances.wrong_foot));
  outcome.set_entrance_error_rad(entrances.most_rad);
  if (took_.sum_s > 0.0) outcome.set_agent_steps_1_s(took_.agent_steps / took_.sum_s);
  outcome.set_steps_1_s(took_.mean_s > 0.0 ? 1.0 / took_.mean_s : 0.0);
  std::string why;
  const auto blame = [&why](bool bad, const std::string& text) {
    if (bad) why += (why.empty() ? "" : "; ") + text;
  };
  blame(!watch_.in_order(), "not in order: " + watch_.disorder(run_));
  const bool avoid = std::ranges::any_of(
      run_.scenario().groups, [](const Group& group) { return group.rules.heading.avoid; });
  blame(avoid && collisions > 0, fmt::format("{} collisions", collisions));
  blame(watch_.broken(), "a rate was measured below the guaranteed one");
  blame(entrances.wrong_foot > 0,
        fmt::format("{} of {} came in on the wrong foot", entrances.wrong_foot, entrances.count));
  blame(!trouble_.empty(), trouble_);
  outcome.set_success(why.empty());
  outcome.set_reason(why);
  outcome_.send(outcome, now);
}

}  // namespace mimesis::crowd
