#include "nodes/crowd/crowd_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/error.h"
#include "common/runtime/bus.h"
#include "nodes/crowd/crowd_messages.h"

namespace mimesis::crowd {

namespace {

using runtime::Time;

using namespace std::chrono_literals;

constexpr double kCatchUp_s = 0.5;  // of run time in one step of the node

v1::CrowdRule to_proto(Rule rule) {
  constexpr std::array kRules = {v1::CROWD_RULE_FREQUENCY, v1::CROWD_RULE_LENGTH,
                                 v1::CROWD_RULE_PHASE, v1::CROWD_RULE_TRACKING,
                                 v1::CROWD_RULE_HEADING};
  return kRules.at(static_cast<std::size_t>(rule));
}

void to_proto(const RuleLine& line, int agents, v1::CrowdGuarantee& out) {
  const RuleCertificate& c = line.certificate;
  out.set_group(static_cast<std::uint32_t>(line.group));
  out.set_rule(to_proto(line.rule));
  out.set_guaranteed(c.guarantee == Guarantee::contracting);
  out.set_guaranteed_rate_1_s(c.guaranteed_1_s);
  out.set_expected_rate_1_s(c.expected_1_s);
  out.set_in_the_end(c.in_the_end);
  out.set_guests(static_cast<std::uint32_t>(line.guests));
  out.set_while_free(c.while_free);
  if (std::isfinite(c.remains)) out.set_remains(c.remains);
  if (line.report.measured_1_s) out.set_measured_rate_1_s(*line.report.measured_1_s);
  out.set_disorder(line.disorder);
  out.set_agents(static_cast<std::uint32_t>(agents));
  out.set_why(c.why);
  for (const std::string& change : c.change) out.add_change(change);
}

}  // namespace

CrowdNode::CrowdNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      bus_(bus),
      period_(runtime::from_seconds(1.0 / params.rate_hz)),
      run_(params.read_scenario()),
      guests_(params, bus, run_),
      watch_(run_),
      styles_in_(bus, "style", true),
      states_(bus, "states"),
      certificate_(bus, "certificate"),
      status_(bus, "status"),
      outcome_(bus, "outcome"),
      info_(bus, "info", {.latched = true}),
      scene_(bus, "scene") {
  if (params.threads > 1) team_.emplace(params.threads);
  const Scenario& scenario = run_.scenario();
  to_proto(run_, states_message_);
  runtime::info("scenario '{}': {} agents in {} groups, {} may come from outside; {} begin here",
                scenario.name, run_.roster().agents(), scenario.groups.size(),
                run_.roster().externals(), states_message_.id_size());
}

void CrowdNode::step(Time now) {
  if (!begin_) {
    begin_ = now - period_;
    v1::CrowdInfo info = to_info(run_);
    info_.send(info, now);
  }
  const auto before = std::chrono::steady_clock::now();
  guests_.take(now);
  take_styles();
  const int steps = steps_due(now);
  judge_guests(now, *begin_ + runtime::from_seconds(run_.time_s()));
  for (int k = 0; k < steps; ++k) {
    observe(now);
    if (!ended_ && run_.time_s() >= run_.scenario().until_s - 0.5 * run_.crowd().dt_s()) {
      ended_ = true;
      publish_outcome(now);
    }
    advance();
  }
  publish_states(now);
  guests_.publish_commands(now);
  guests_.publish_styles(now);
  publish_scene(now);
  publish_certificate(now);
  publish_status(now);
  const auto elapsed = [&] { return to_seconds(std::chrono::steady_clock::now() - before); };
  const double s = runtime::read_outside_value<double>(bus_, "step", elapsed);
  step_times_.steps += steps;
  step_times_.sum_s += s;
  step_times_.worst_s = std::max(step_times_.worst_s, s);
  step_times_.agent_steps += static_cast<double>(steps) * run_.crowd().size();
}

/// Steps that the run is behind the clock, as many as are made at once.
int CrowdNode::steps_due(Time now) {
  const double dt_s = run_.crowd().dt_s();
  const long due = std::max(0L, std::lround(to_seconds(now - *begin_) / dt_s) - walked_);
  const long steps = std::min(due, std::max(1L, std::lround(kCatchUp_s / dt_s)));
  walked_ += steps;
  std::string behind;
  if (due > steps) {
    behind = fmt::format("the run is {:.1f} s behind the clock",
                         static_cast<double>(due - steps) * dt_s);
  }
  if (behind.empty() != behind_.empty()) {
    status_changed_ = true;
    if (behind.empty()) {
      runtime::info("the run has caught up with the clock");
    } else {
      runtime::warn("{}: it was stopped, or its steps take too long", behind);
    }
  }
  behind_ = behind;
  return static_cast<int>(steps);
}

void CrowdNode::take_styles() {
  while (const auto wish = styles_in_.pop()) {
    std::string best;
    double most = 0.0;
    for (const v1::StyleShare& share : wish->shares()) {
      if (share.share() > most) best = share.style();
      most = std::max(most, share.share());
    }
    const std::vector<AgentId> ids(wish->characters().begin(), wish->characters().end());
    if (const std::string why = run_.wish_gait(ids, best); !why.empty() && bad_styles_.pass()) {
      runtime::warn("style: {}; ignored", why);
    }
  }
}

void CrowdNode::judge_guests(Time now, Time state_time) {
  for (const Guests::Change& change : guests_.judge(now, state_time)) {
    status_changed_ = true;
    if (change.trouble.empty()) {
      watch_.expect_change(change.group, change.what);
    } else {
      say(change.trouble);
    }
  }
}

/// Everybody at the time of the run's present state, by group and id.
void CrowdNode::observe(Time now) {
  everybody_.clear();
  discs_.clear();
  const Crowd& crowd = run_.crowd();
  for (int g = 0; g < crowd.groups(); ++g) {
    const Crowd::Rows rows = crowd.rows(g);
    for (int row = rows.first; row < rows.first + rows.count; ++row) {
      const auto r = static_cast<std::size_t>(row);
      const AgentId id = crowd.ids()[r];
      const AgentTraits& start = run_.roster().start(id).traits;
      Observed o{.id = id, .group = g};
      o.place_m = start.place_m;
      o.lane_m = start.lane_m;
      o.radius_m = start.radius_m;
      o.goal_W_m = start.goal_W_m;
      o.coupled = is_coupled(crowd.roles()[r]);
      const int external = run_.roster().external(id);
      o.external = external >= 0;
      if (o.external) o.age_s = guests_.age_s(external, now);
      o.p_W_m = {crowd.x_m()[r], crowd.y_m()[r]};
      o.heading_rad = crowd.heading_rad()[r];
      o.phase_rad = crowd.phase_rad()[r];
      o.avoid_rad_s = crowd.avoidance_rad_s(row);
      if (crowd.group(g).rules.heading.kind == HeadingKind::goal) {
        o.goal_W_m = run_.goal_W_m(id);
        o.next_W_m = crowd.agent(row).traits.goal_W_m;
      }
      everybody_.push_back(o);
      discs_.push_back({id, o.p_W_m.x(), o.p_W_m.y(), o.radius_m});
    }
  }
  watch_.observe(run_, run_.time_s(), everybody_);
  closeness_.observe(discs_);
}

void CrowdNode::advance() {
  try {
    run_.step(team_ ? &*team_ : nullptr);
  } catch (const ConfigError& e) {
    say(e.what());
  }
}

void CrowdNode::say(const std::string& trouble) {
  if (trouble == trouble_) return;
  runtime::warn("{}", trouble);
  trouble_ = trouble;
  status_changed_ = true;
}

void CrowdNode::publish_states(Time now) {
  states_message_.set_time_s(run_.time_s());
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
  if (params_.scene_hz <= 0.0 || walked_ <= 1 || now < scene_due_) return;
  if (scene_due_ == Time{}) scene_due_ = now;
  scene_due_ += runtime::from_seconds(1.0 / params_.scene_hz);
  foxglove::SceneUpdate update = paint(run_.scenario(), everybody_, now);
  scene_.send(update, now);
}

/// Once a second, and at once when one is void.
void CrowdNode::publish_certificate(Time now) {
  const std::string voided = watch_.take_voided();
  if (voided.empty() && now < certificate_due_) return;
  if (!voided.empty()) runtime::info("certificate {}: {}", watch_.number(), voided);
  certificate_due_ = now + 1s;
  v1::CrowdCertificate message;
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
  status.set_reason(behind_.empty() ? trouble_ : behind_);
  status.set_own(static_cast<std::uint32_t>(states_message_.id_size()));
  status.set_in_order(watch_.in_order());
  status.set_mean_step_s(step_times_.mean_s());
  status.set_worst_step_s(step_times_.worst_s);
  guests_.describe(status, now);
  status_.send(status, now);
}

void CrowdNode::publish_outcome(Time now) {
  v1::CrowdOutcome outcome;
  const std::uint64_t collisions = closeness_.collisions();
  const double gap_m = closeness_.least_gap_m();
  const double distance_m = closeness_.least_distance_m();
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
  if (step_times_.sum_s > 0.0)
    outcome.set_agent_steps_1_s(step_times_.agent_steps / step_times_.sum_s);
  outcome.set_steps_1_s(step_times_.sum_s > 0.0 ? 1.0 / step_times_.mean_s() : 0.0);
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
