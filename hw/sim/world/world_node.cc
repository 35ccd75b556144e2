#include "hw/sim/world/world_node.h"

#include <fmt/format.h>

#include "common/model/drawing.h"
#include "common/model/files.h"
#include "common/model/messages.h"
#include "hw/sim/world/world.h"

namespace mimesis::world {
namespace {

kin::Table table_for(const WorldParams& params, const kin::ArmModel& arm) {
  std::optional<double> bar_height;
  if (params.bar_height_m > 0.0) bar_height = params.bar_height_m;
  kin::Table table = model::load_table(params.table, bar_height);
  if (params.scene == "random")
    table = random_table(arm, table, static_cast<std::uint64_t>(params.seed));
  table.object.head<2>() += Eigen::Vector2d::Map(params.object_offset_m.data());
  for (const kin::GoalPlace& goal : table.goals) {
    if (goal.name != params.goal_blocked) continue;
    const Eigen::Vector3d half(0.04, 0.04, table.object_height / 2);
    table.boxes.push_back({goal.position, half, "block on goal " + goal.name});
  }
  return table;
}

}  // namespace

WorldNode::WorldNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      arm_model_(model::load_checked_arm(params.robot).arm),
      table_(table_for(params, arm_model_)),
      world_(arm_model_, table_),
      arm_(bus, "joint_states", {.author = runtime::Author::first}),
      hand_(bus, "hand", {.author = runtime::Author::first}),
      task_(bus, "task", false, runtime::Author::first),
      scene_(bus, "scene", {.latched = true}),
      state_(bus, "state"),
      contact_(bus, "contact"),
      transforms_(bus, "transforms", {.latched = true}),
      entities_(bus, "entities", {.latched = true}),
      outcome_(bus, "outcome", {.latched = true}) {}

void WorldNode::step(runtime::Time now) {
  const double dt = last_step_ ? runtime::to_seconds(now - *last_step_) : 1.0 / params_.rate_hz;
  if (dt <= 0.0) return;
  last_step_ = now;

  read_posture();
  const Hand hand = read_hand();
  const ObjectState before = world_.object().state();
  const bool upright_before = world_.object().upright();
  if (q_) {
    world_.step(dt, *q_, hand);
  } else {
    world_.step(dt);
  }
  const ObjectState after = world_.object().state();
  if (after == ObjectState::resting &&
      (before != ObjectState::resting || upright_before != world_.object().upright())) {
    scene_due_ = true;
    if (!world_.object().mishap().empty()) runtime::warn("object {}", world_.object().mishap());
  }

  follow_task(now);
  publish_state(now);
  publish_scene(now);
  const double wait_s = task_end_.done ? params_.settle_s : params_.retry_s;
  const bool settled = task_ended_ && runtime::to_seconds(now - *task_ended_) >= wait_s;
  if (settled && !outcome_sent_ && after != ObjectState::falling) publish_outcome(now);
}

/// Takes over the newest posture. Without news the arm is where it was.
void WorldNode::read_posture() {
  const v1::JointState* arm = arm_.get();
  if (arm == nullptr) return;
  const bool right_size = arm->position_rad_size() == arm_model_.dof();
  if (right_size) q_ = Eigen::VectorXd::Map(arm->position_rad().data(), arm_model_.dof());
  if (!right_size && !wrong_size_reported_) {
    runtime::error("input joint_states: {} positions, expected {} ({})", arm->position_rad_size(),
                   arm_model_.dof(), params_.robot);
  }
  wrong_size_reported_ = !right_size;
}

/// A silent hand stays as it was seen last.
Hand WorldNode::read_hand() {
  const v1::HandState* hand = hand_.get();
  if (hand == nullptr) return {};
  return {model::from_proto(hand->grip()), hand->closure()};
}

bool WorldNode::inputs_fresh(runtime::Time now) {
  const runtime::Time max_age = runtime::from_seconds(params_.stale_s);
  return arm_.fresh(now, max_age) != nullptr && hand_.fresh(now, max_age) != nullptr;
}

void WorldNode::follow_task(runtime::Time now) {
  while (const auto status = task_.pop()) {
    const bool done = status->state() == v1::TASK_STATE_DONE;
    const bool failed = status->state() == v1::TASK_STATE_FAILED;
    if (status->goal() != v1::GOAL_UNSPECIFIED) goal_ = status->goal();
    if (done || failed) {
      if (!task_ended_) task_ended_ = now;
      task_end_ = {
          done,
          goal_ == v1::GOAL_UNSPECIFIED ? "" : std::string(task::word(model::from_proto(goal_))),
          status->reason()};
    } else if (status->state() != v1::TASK_STATE_IDLE) {
      task_ended_.reset();  // the planner tries again
    }
  }
}

void WorldNode::publish_state(runtime::Time now) {
  const ObjectModel& object = world_.object();
  v1::WorldState state;
  model::to_proto(object.cylinder().X_WO.translation(),
                  *state.mutable_object_position_in_world_m());
  state.set_grasped(object.state() == ObjectState::held);
  state.set_moved(object.moved());
  state.set_dropped(!object.mishap().empty());
  state.set_collisions(static_cast<std::uint32_t>(world_.collisions().count()));
  state.set_last_collision(world_.collisions().last());
  if (collisions_said_ != world_.collisions().count())
    runtime::warn("collision: {}", world_.collisions().last());
  collisions_said_ = world_.collisions().count();
  state_.send(state, now);

  v1::HandContact contact;
  contact.set_reachable(inputs_fresh(now) && world_.contact().reachable);
  contact.set_contact_closure(world_.contact().closure);
  contact_.send(contact, now);

  auto transforms =
      model::to_transforms(arm_model_, world_.frames(), object.cylinder().X_WO, table_.goals, now);
  transforms_.send(transforms, now);
}

/// Over and over, so that whoever moves by it knows that it still holds; anew when the object has
/// moved.
void WorldNode::publish_scene(runtime::Time now) {
  constexpr auto kPeriod = std::chrono::milliseconds(20);
  if (!scene_due_ && now < scene_sent_ + kPeriod) return;
  scene_sent_ = now;
  if (!scene_due_) return scene_.send(scene_message_, now);
  scene_due_ = false;
  table_.object = world_.object().cylinder().X_WO.translation();
  scene_message_ = model::to_proto(table_);
  scene_.send(scene_message_, now);
  foxglove::SceneUpdate entities = model::to_entities(table_, arm_model_, now);
  entities_.send(entities, now);
}

void WorldNode::publish_outcome(runtime::Time now) {
  outcome_sent_ = true;
  const Verdict verdict = judge(task_end_, world_.object(), table_.goals);
  v1::TrialOutcome outcome;
  outcome.set_placed(verdict.placed);
  outcome.set_goal(goal_);
  outcome.set_placement_error_m(verdict.placement_error);
  outcome.set_collisions(static_cast<std::uint32_t>(world_.collisions().count()));
  outcome.set_dropped(!world_.object().mishap().empty());
  outcome.set_success(verdict.placed && outcome.collisions() == 0);
  outcome.set_reason(verdict.placed && !outcome.success()
                         ? fmt::format("collisions: {}, the last: {}", outcome.collisions(),
                                       world_.collisions().last())
                         : verdict.reason);
  outcome_.send(outcome, now);
  runtime::info("verdict: {}", outcome.success() ? "placed" : outcome.reason());
}

}  // namespace mimesis::world
