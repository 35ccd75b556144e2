#include "nodes/cognition/cognition_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/model/messages.h"
#include "nodes/cognition/network_file.h"
#include "nodes/cognition/trial.h"

namespace mimesis::cognition {
namespace {

using runtime::Time;

/// Why an observation cannot be used; empty if it can.
std::string fault(const v1::Observation& o) {
  if (!v1::Grip_IsValid(o.grip()) || !v1::Transport_IsValid(o.transport()) ||
      !v1::Goal_IsValid(o.goal()) || !v1::ObjectColor_IsValid(o.color())) {
    return "has a symbol that proto/task.proto does not know";
  }
  for (const double c :
       {o.grip_confidence(), o.transport_confidence(), o.goal_confidence(), o.color_confidence()}) {
    if (c < 0.0 || c > 1.0) return fmt::format("has confidence {}, outside [0, 1]", c);
  }
  return {};
}

Demonstration from_proto(const v1::Observation& o) {
  Demonstration d;
  d.grip = model::from_proto(o.grip());
  d.transport = model::from_proto(o.transport());
  d.goal = model::from_proto(o.goal());
  d.color = model::from_proto(o.color());
  d.grip_confidence = o.grip_confidence();
  d.transport_confidence = o.transport_confidence();
  d.goal_confidence = o.goal_confidence();
  d.color_confidence = o.color_confidence();
  return d;
}

void to_proto(const Decision& d, v1::Decision& out) {
  out.set_grip(model::to_proto(d.grip));
  out.set_transport(model::to_proto(d.transport));
  out.set_goal(model::to_proto(d.goal));
  out.set_color(model::to_proto(d.color));
  out.set_settled(d.settled);
}

/// "precision, above, high" for log lines.
template <class Symbols>
std::string text(const Symbols& s) {
  return fmt::format("{}, {}, {}", task::word(s.grip), task::word(s.transport), task::word(s.goal));
}

template <class Symbols>
bool matches(const v1::TaskStatus& status, const Symbols& s) {
  return model::from_proto(status.grip()) == s.grip &&
         model::from_proto(status.transport()) == s.transport &&
         model::from_proto(status.goal()) == s.goal;
}

long whole_steps(const CognitionParams& p, double dt_s) {
  const double steps = 1.0 / (p.rate_hz * dt_s);
  if (std::abs(steps - std::round(steps)) > 1e-6 || steps < 0.5) {
    throw ConfigError(fmt::format(
        "cognition.rate_hz: the period 1/{} s is no multiple of dt_s = {}", p.rate_hz, dt_s));
  }
  return std::lround(steps);
}

}  // namespace

CognitionNode::CognitionNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      observation_(bus, "observation", {.author = runtime::Author::first}),
      task_(bus, "task", {.author = runtime::Author::first}),
      decision_(bus, "decision"),
      fields_(bus, "fields"),
      test_plan_(bus, "test_plan", {.author = runtime::Author::first, .optional = true}),
      goals_(bus, "goals", {.author = runtime::Author::first, .optional = true}),
      proposal_(bus, "proposal"),
      outcome_(bus, "outcome", {.latched = true}),
      explanation_(bus, "explanation"),
      ports_end_(bus),
      imitator_(
          params.imitator, load_network(params.network),
          params.links.empty()
              ? std::function<void(FieldNetwork<float>&, Bundles&)>{}
              : [&](FieldNetwork<float>& l, Bundles& b) { load_links(params.links, l, &b); }),
      period_s_(static_cast<double>(whole_steps(params, dt_s())) * dt_s()),
      fields_every_(params.fields_hz > 0.0
                        ? std::max(1L, std::lround(params.rate_hz / params.fields_hz))
                        : 0),
      saving_(bus),
      replaying_(bus.outside().replaying()) {
  for (const std::string& sequence : imitator_.refused()) {
    runtime::warn(
        "practice '{}': the robot settles on something it learned before; nothing learned",
        sequence);
  }
  for (const LinkSpec& link : imitator_.network().spec().links) {
    learns_always_ = learns_always_ || link.learns == "always";
  }
  for (const FieldSpec& spec : imitator_.network().spec().fields) {
    v1::Field* field = activity_.add_fields();
    field->set_name(spec.name);
    field->mutable_u()->Resize(spec.params.neurons * spec.params.rows, 0.0F);
  }
}

void CognitionNode::step(Time now) {
  hear_goals();
  watch(now);
  imitator_.advance(period_s_, succeeded(now));
  tell_changes(now);
  ask_for_a_test_plan(now);
  report_indecision(now);
  save_what_was_learned();
  publish_decision(now);
  if (fields_every_ > 0 && tick_ % fields_every_ == 0) publish_fields(now);
  ++tick_;
}

void CognitionNode::hear_goals() {
  const v1::TaskGoals* message = goals_.take();
  if (message == nullptr) return;
  std::vector<ExpectedGoal> goals;
  for (const v1::TaskGoal& g : message->goals()) {
    goals.push_back({model::from_proto(g.goal())});
    if (g.has_probability()) goals.back().probability = g.probability();
  }
  try {
    imitator_.expect(expected_goals(goals));
  } catch (const ConfigError& e) {
    if (bad_goals_.pass()) runtime::warn("goals: {}; ignored", e.what());
  }
}

void CognitionNode::watch(Time now) {
  const v1::Observation* seen = observation_.fresh(now, runtime::from_seconds(params_.stale_s));
  if (seen == nullptr) return;
  if (const std::string why = fault(*seen); !why.empty()) {
    if (bad_input_.pass()) runtime::warn("observation {}; ignored", why);
    return;
  }
  imitator_.observe(from_proto(*seen), seen->complete(), period_s_);
  if (!imitator_.doubt().empty() && !doubted_) {
    runtime::warn("observation: {} is seen with both values in turn; not used", imitator_.doubt());
  }
  doubted_ = !imitator_.doubt().empty();
}

void CognitionNode::tell_changes(Time now) {
  if (imitator_.stage() == stage_) return;
  stage_ = imitator_.stage();
  saved_ = false;
  plan_seen_ = failure_told_ = false;
  decided_ = imitator_.decided() ? now : Time{};
  entered_ = now;
  reported_ = false;
  if (imitator_.decided() || stage_ == Imitator::Stage::undecided) explain(now);
  if (imitator_.decided()) {
    runtime::info("decided: {} (seen: {})", text(imitator_.decision()), text(imitator_.shown()));
  } else if (stage_ == Imitator::Stage::undecided) {
    runtime::warn("no decision: {} (seen: {})", imitator_.reason(), text(imitator_.shown()));
  }
}

/// The file is written beside the steps: a slow disk delays no decision.
void CognitionNode::save_what_was_learned() {
  // Links that learn always have done so when the demonstration is over.
  const bool learned =
      imitator_.learned() || (learns_always_ && stage_ == Imitator::Stage::waiting);
  if (learned && !saved_ && !params_.save_links.empty() && !saving_.running()) {
    saving_.start(
        [path = params_.save_links, text = links_text(imitator_.network(), imitator_.bundles()),
         replaying = replaying_] { return replaying ? std::string() : save_links(path, text); });
  }
  saved_ = learned;
  if (const auto fault = saving_.take(); fault && !fault->empty()) runtime::warn("{}", *fault);
}

/// Reinforcement [M18 eq. 2.3]: the planner has a plan for this decision, not for an earlier one.
bool CognitionNode::succeeded(Time now) {
  const v1::TaskStatus* task = task_.fresh(now, runtime::from_seconds(params_.task_stale_s));
  if (task == nullptr || !imitator_.decided() || task_.stamp() < decided_) return false;
  const Decision& d = imitator_.decision();
  if (!matches(*task, d) || task->ticket() != 0) return false;  // or of another's request
  if (task->state() == v1::TASK_STATE_FAILED && !failure_told_) {
    runtime::warn("planning failed for {} ({}); the links stay as they are", text(d),
                  task->reason());
    failure_told_ = true;
    // A failure on the way has other reasons than the decision; then nothing must move again.
    if (!plan_seen_) imitator_.refuse();
    return false;
  }
  const bool under_way =
      task->state() == v1::TASK_STATE_PLANNING || task->state() == v1::TASK_STATE_EXECUTING;
  if (task->plan_succeeded() && !plan_seen_) sort_in(*task);
  plan_seen_ = plan_seen_ || task->plan_succeeded();
  return under_way && task->plan_succeeded();
}

/// The planned way with the object goes to its bundle, which the reward links with the decision.
void CognitionNode::sort_in(const v1::TaskStatus& task) {
  if (task.carried().empty() || imitator_.bundles().most() == 0) return;
  const int joints = task.carried(0).position_rad_size();
  Eigen::MatrixXd motion(joints, task.carried_size());
  for (int i = 0; i < task.carried_size(); ++i) {
    const auto& q = task.carried(i).position_rad();
    if (q.size() != joints) return runtime::warn("task: postures of unlike size; not learned");
    motion.col(i) = Eigen::VectorXd::Map(q.data(), joints);
  }
  if (imitator_.planned(motion)) return;
  runtime::warn("task: the motion is like none of the {} bundles known, and no site is left for it",
                imitator_.bundles().all().size());
}

/// The rehearsal: the planner is asked for a test, without a motion, before the decision falls
/// [M18 fig. 2.22].
void CognitionNode::ask_for_a_test_plan(Time now) {
  const v1::TaskStatus* answer = test_plan_.fresh(now, runtime::from_seconds(params_.task_stale_s));
  if (proposed_ != nullptr && answer != nullptr && test_plan_.stamp() > asked_ &&
      matches(*answer, *proposed_) &&
      (answer->plan_succeeded() || answer->state() == v1::TASK_STATE_FAILED)) {
    runtime::info("test plan for {}: {}", text(*proposed_),
                  answer->plan_succeeded() ? "found" : answer->reason());
    imitator_.answer(answer->plan_succeeded());
  }
  const Demonstration* proposal = imitator_.proposal();
  if (proposal != proposed_) asked_ = now;
  proposed_ = proposal;
  if (proposal == nullptr) return;
  v1::Decision message;
  to_proto({.grip = proposal->grip,
            .transport = proposal->transport,
            .goal = proposal->goal,
            .color = Color::unknown,
            .settled = true},
           message);
  message.set_decided_ns(static_cast<std::uint64_t>(asked_.count()));
  proposal_.send(message, now);
}

/// A run that waits for a verdict shall end with the reason why none will come. The teacher may
/// still go on: that is given the same patience as before.
void CognitionNode::report_indecision(Time now) {
  if (stage_ != Imitator::Stage::undecided || reported_ ||
      now - entered_ < runtime::from_seconds(params_.imitator.patience_s)) {
    return;
  }
  reported_ = true;
  v1::TrialOutcome outcome;
  outcome.set_placement_error_m(-1.0);
  outcome.set_reason("no decision: " + imitator_.reason());
  outcome_.send(outcome, now);
}

v1::Decision CognitionNode::decision_message() const {
  v1::Decision message;
  to_proto(imitator_.decision(), message);
  message.set_decided_ns(static_cast<std::uint64_t>(decided_.count()));
  message.set_learning(imitator_.learning());
  message.set_learned(imitator_.learned());
  message.set_reason(imitator_.reason());
  if (const Eigen::MatrixXd* motion = imitator_.preselected()) {
    for (const auto& q : motion->colwise()) {
      message.add_preselected()->mutable_position_rad()->Add(q.begin(), q.end());
    }
  }
  return message;
}

void CognitionNode::publish_decision(Time now) {
  v1::Decision message = decision_message();
  message.set_sight_lost(params_.sight_s > 0.0 && observation_.get() != nullptr &&
                         observation_.fresh(now, runtime::from_seconds(params_.sight_s)) ==
                             nullptr);
  decision_.send(message, now);
}

void CognitionNode::explain(Time now) {
  const Reasons& reasons = imitator_.reasons();
  const auto& specs = imitator_.network().spec().fields;
  std::vector<std::size_t> order;
  for (std::size_t f = 0; f < specs.size(); ++f) {
    if (reasons.fields()[f].onset_s >= 0.0) order.push_back(f);
  }
  std::ranges::stable_sort(order, {}, [&](std::size_t f) { return reasons.fields()[f].onset_s; });
  v1::Explanation message;
  *message.mutable_decision() = decision_message();
  message.set_deciding_s(imitator_.deciding_s());
  message.set_confidence(reasons.confidence());
  for (const std::size_t f : order) {
    const Reason& reason = reasons.fields()[f];
    v1::FieldReason& field = *message.add_fields();
    field.set_field(specs[f].name);
    if (reason.site >= 0) field.set_site(specs[f].sites[static_cast<std::size_t>(reason.site)]);
    field.set_onset_s(reason.onset_s);
    field.set_lead(reason.lead);
    for (const Reason::Part& part : reason.parts) {
      v1::Influence& influence = *field.add_influences();
      influence.set_from(reasons.names()[part.from]);
      influence.set_input(part.input);
    }
  }
  explanation_.send(message, now);
}

void CognitionNode::publish_fields(Time now) {
  for (int i = 0; i < activity_.fields_size(); ++i) {
    const auto u = imitator_.network().field(static_cast<std::size_t>(i)).activity();
    std::ranges::copy(u, activity_.mutable_fields(i)->mutable_u()->begin());
  }
  fields_.send(activity_, now);
}

}  // namespace mimesis::cognition
