#include "nodes/synthesizer/synthesizer_node.h"

#include "common/error.h"
#include "common/model/files.h"
#include "common/motion/model/motion_model.h"
#include "common/runtime/param_source.h"
#include "common/time.h"
#include "nodes/synthesizer/synthesizer_messages.h"

namespace mimesis::synthesizer {
namespace {

using runtime::Time;

/// A robot takes objects from drawers, and has to see them.
bool grasps(const SynthesizerParams& params) {
  return params.drawer && !params.robot.description.empty();
}

std::unique_ptr<const ActionMaps> learn_drawer(const SynthesizerParams& params, runtime::Bus& bus) {
  if (!params.drawer) {
    if (params.goal.kind != "drawer") return nullptr;
    throw ConfigError("synthesizer.goal.kind: 'drawer' needs synthesizer.drawer: true");
  }
  if (!params.robot.description.empty() || bus.outside().describing()) return nullptr;
  const mocap::Body body = mocap::standard_body();
  GeneratorSettings settings;
  settings.seed = static_cast<std::uint64_t>(params.drawer_seed);
  return std::make_unique<const ActionMaps>(
      learn_drawer_model(generate_drawer_data(body, Drawer{}, settings)));
}

std::unique_ptr<const BipedDrawer> learn_robot_drawer(const SynthesizerParams& params,
                                                      runtime::Bus& bus) {
  if (!grasps(params) || bus.outside().describing()) return nullptr;
  const robot::Biped biped = model::load_biped(params.robot.description);
  RobotTrialSettings settings = robot_trial_settings(biped);
  settings.seed = static_cast<std::uint64_t>(params.drawer_seed);
  settings.cycle_s = 2.0 * params.robot.asked().step_s;
  return std::make_unique<const BipedDrawer>(make_biped_drawer(biped, settings));
}

std::unique_ptr<Director> make_director(const SynthesizerParams& params, const ActionMaps* drawer,
                                        const BipedDrawer* robot_drawer) {
  const motion::MotionModel model =
      motion::load_motion_model(runtime::find_model_file(params.model));
  const auto starts = form(params.characters, params.start);
  const CharactersSettings settings = params.character_settings();
  if (params.robot.description.empty()) {
    return make_figure_director(model, starts, settings, drawer);
  }
  if (params.characters != 1) {
    throw ConfigError("synthesizer.robot.description: one robot, but synthesizer.characters is " +
                      std::to_string(params.characters));
  }
  return make_robot_director(model, starts.front(), settings, params.robot.asked(), robot_drawer);
}

/// What a robot shall do comes from one node.
runtime::Author authors(const SynthesizerNode::Params& params) {
  return params.robot.description.empty() ? runtime::Author::any : runtime::Author::first;
}

}  // namespace

SynthesizerNode::SynthesizerNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      name_(bus.node()),
      period_s_(1.0 / params.rate_hz),
      goal_in_(bus, "goal", true, authors(params)),
      style_in_(bus, "style", true, authors(params)),
      beat_in_(bus, "beat", {.author = authors(params), .optional = true}),
      crowd_in_(bus, "crowd", true, runtime::Author::first),
      feedback_in_(
          bus, "feedback",
          {.author = runtime::Author::first, .optional = params.robot.description.empty()}),
      sight_in_(bus, "sight", {.author = runtime::Author::first, .optional = !grasps(params)}),
      touch_in_(bus, "touch", {.author = runtime::Author::first, .optional = !grasps(params)}),
      rows_(bus, "rows", {.latched = true}),
      motion_(bus, "motion"),
      batch_(bus, "characters"),
      status_(bus, "status"),
      reached_(bus, "reached"),
      figures_(bus, "figures", {.latched = true}),
      ports_end_(bus),
      drawer_(learn_drawer(params, bus)),
      robot_drawer_(learn_robot_drawer(params, bus)),
      director_(make_director(params, drawer_.get(), robot_drawer_.get())),
      drawing_(FigureDrawing::of(*director_)),
      commanded_(static_cast<std::size_t>(params.characters), Time{}),
      last_status_(static_cast<std::size_t>(params.characters)) {
  const auto angles = director_->angles(0);
  last_angles_.assign(angles.begin(), angles.end());
  motion::clamp_to_limits(director_->characters().repertoire().model(),
                          std::span<float>(last_angles_));
  velocity_rad_s_.assign(angles.size(), 0.0);
  // A check does not learn what drawers are, which takes seconds.
  if (!params.drawer || !bus.outside().describing()) set_first_goal();
  const Repertoire& repertoire = director_->characters().repertoire();
  runtime::info("model '{}': {} rows, {} sources; styles {}", repertoire.model().name,
                repertoire.model().rows.size(), repertoire.model().sources.rows(),
                repertoire.known());
}

void SynthesizerNode::set_first_goal() {
  if (params_.goal.kind == "none") return;
  v1::MotionGoal goal;
  goal.set_kind(params_.goal.kind == "drawer" ? v1::MOTION_GOAL_KIND_DRAWER
                                              : v1::MOTION_GOAL_KIND_WALK_TO);
  goal.mutable_position_in_world_m()->set_x_m(params_.goal.x_m);
  goal.mutable_position_in_world_m()->set_y_m(params_.goal.y_m);
  goal.set_object_depth_m(params_.goal.object_depth_m);
  for (int i = 0; i < director_->size(); ++i) {
    goal.set_character(static_cast<std::uint32_t>(i));
    if (const std::string why = set_goal(goal); !why.empty()) {
      throw ConfigError("synthesizer.goal: " + why);
    }
  }
}

void SynthesizerNode::step(Time now) {
  take_goals(now);
  take_styles(now);
  take_beat(now);
  if (director_->leads_robot()) {
    take_feedback(now);
    take_senses(now);
  }
  take_crowd(now);
  director_->step(feedback(now), senses_);
  publish_rows(now);
  publish_motion(now);
  publish_status(now);
  publish_figures(now);
}

/// Why not; empty if it is pursued from now on.
std::string SynthesizerNode::set_goal(const v1::MotionGoal& goal) {
  if (std::string why = fault(goal, director_->characters()); !why.empty()) return why;
  const int i = static_cast<int>(goal.character());
  const Eigen::Vector2d place(goal.position_in_world_m().x_m(), goal.position_in_world_m().y_m());
  switch (goal.kind()) {
    case v1::MOTION_GOAL_KIND_DRAWER:
      return director_->to_drawer(i, {place, goal.object_depth_m()});
    case v1::MOTION_GOAL_KIND_STOP:
      director_->stop(i);
      return {};
    default:
      director_->walk_to(i, place);
      return {};
  }
}

/// Feedback that cannot be used is as none.
void SynthesizerNode::take_feedback(Time now) {
  const v1::WalkFeedback* message = feedback_in_.take();
  const Time stamp = feedback_in_.stamp();
  if (message == nullptr || stamp < feedback_stamp_ || stamp > now) return;
  if (const std::string why = fault(*message); !why.empty()) {
    if (bad_feedback_.pass()) runtime::warn("feedback: {}; ignored", why);
    return;
  }
  if (!feedback_) runtime::info("the robot says where it is");
  feedback_ = to_feedback(*message);
  robot_ = feedback_in_.source();
  feedback_stamp_ = stamp;
}

const RobotFeedback* SynthesizerNode::feedback(Time now) {
  if (!feedback_) return nullptr;
  if (now - feedback_stamp_ <= runtime::from_seconds(params_.robot.stale_s)) return &*feedback_;
  runtime::warn("no feedback for {} s: the robot is believed to do as it is told",
                params_.robot.stale_s);
  feedback_.reset();
  return nullptr;
}

void SynthesizerNode::take_senses(Time now) {
  const v1::HandTouch* touch = touch_in_.fresh(now, runtime::from_seconds(params_.robot.stale_s));
  senses_.holds = {touch != nullptr && touch->left_holds(),
                   touch != nullptr && touch->right_holds()};
  senses_.sight.reset();
  const v1::HeadSight* message = sight_in_.take();
  const Time stamp = sight_in_.stamp();
  if (message == nullptr || stamp < sight_stamp_ || stamp > now) return;
  if (const std::string why = fault(*message); !why.empty()) {
    if (bad_sight_.pass()) runtime::warn("sight: {}; ignored", why);
    return;
  }
  senses_.sight = to_sight(*message, to_seconds(now - stamp));
  sight_stamp_ = stamp;
}

void SynthesizerNode::take_goals(Time now) {
  while (const auto goal = goal_in_.pop()) {
    const std::string why = set_goal(*goal);
    if (why.empty()) continue;
    if (bad_goal_.pass()) runtime::warn("goal refused: {}", why);
    refuse(goal->character(), why, now);
  }
}

void SynthesizerNode::take_styles(Time now) {
  while (const auto wish = style_in_.pop()) {
    if (!is_for_us(wish->node())) continue;
    if (const std::string why = fault(*wish, director_->characters()); !why.empty()) {
      if (bad_style_.pass()) runtime::warn("style wish refused: {}", why);
      refuse(wish->characters().empty() ? 0 : wish->characters(0), why, now);
      continue;
    }
    const std::vector<double> shares = to_shares(*wish, director_->characters().repertoire());
    const auto set = [&](int i) {
      director_->characters().walk(i).style().wish(shares, wish->duration_s());
    };
    for (const std::uint32_t i : wish->characters()) set(static_cast<int>(i));
    for (int i = 0; wish->characters().empty() && i < director_->size(); ++i) set(i);
  }
}

void SynthesizerNode::take_beat(Time now) {
  if (beat_heard_ && now - beat_stamp_ > runtime::from_seconds(params_.beat_stale_s)) {
    runtime::info("no beat for {} s: everyone walks on in their own rhythm", params_.beat_stale_s);
    director_->characters().end_beat();
    beat_heard_ = false;
  }
  const v1::Beat* beat = beat_in_.take();
  if (beat == nullptr || beat_in_.stamp() < beat_stamp_) return;
  if (now - beat_in_.stamp() > runtime::from_seconds(params_.beat_stale_s)) return;
  if (const std::string why = fault(*beat); !why.empty()) {
    if (bad_beat_.pass()) runtime::warn("beat: {}; ignored", why);
    return;
  }
  beat_stamp_ = beat_in_.stamp();
  beat_heard_ = beat->phase_rate_rad_s() > 0.0;
  if (!beat_heard_) {
    director_->characters().end_beat();
    return;
  }
  director_->characters().set_beat(
      beat->phase_rad() + beat->phase_rate_rad_s() * (to_seconds(now - beat_stamp_) - period_s_),
      beat->phase_rate_rad_s());
}

void SynthesizerNode::take_crowd(Time now) {
  while (const auto crowd = crowd_in_.pop()) {
    const Time stamp(crowd->header().stamp_ns());
    const Time stale = runtime::from_seconds(params_.gait_stale_s);
    if (now - stamp > stale || stamp - now > stale) continue;
    for (const v1::GaitCommand& gait : crowd->gaits()) {
      if (!is_for_us(gait.node())) continue;
      if (const std::string why = fault(gait, director_->characters()); !why.empty()) {
        if (bad_crowd_.pass()) runtime::warn("crowd: {}; ignored", why);
        continue;
      }
      Time& last = commanded_[gait.character()];
      if (stamp < last) continue;
      obey(gait, to_seconds(now - stamp) - period_s_);
      last = stamp;
    }
  }
  release_stale(now);
}

/// Commands and styles name the node that tells the crowd where the character is: this one, or the
/// robot's walker.
bool SynthesizerNode::is_for_us(const std::string& node) const {
  return node.empty() || node == name_ || node == robot_;
}

void SynthesizerNode::obey(const v1::GaitCommand& gait, double age_s) {
  const int i = static_cast<int>(gait.character());
  std::optional<double> phase;
  if (gait.has_phase_rad()) {
    const double rate = gait.has_phase_rate_rad_s()
                            ? gait.phase_rate_rad_s()
                            : director_->characters().walk(i).frequency_rad_s();
    phase = gait.phase_rad() + rate * age_s;
  }
  director_->follow(i, to_gait(gait), phase);
}

void SynthesizerNode::release_stale(Time now) {
  int released = 0, first = 0;
  for (int i = director_->size() - 1; i >= 0; --i) {
    Time& stamp = commanded_[static_cast<std::size_t>(i)];
    if (stamp == Time{} || now - stamp <= runtime::from_seconds(params_.gait_stale_s)) continue;
    stamp = Time{};
    director_->release(i);
    ++released;
    first = i;
  }
  if (released == 1) {
    runtime::info("no crowd command for {} s: character {} is on its own", params_.gait_stale_s,
                  first);
  } else if (released > 1) {
    runtime::info("no crowd command for {} s: {} characters are on their own, the first is {}",
                  params_.gait_stale_s, released, first);
  }
}

void SynthesizerNode::publish_rows(Time now) {
  if (rows_sent_) return;
  rows_sent_ = true;
  v1::MotionRows message;
  const Repertoire& repertoire = director_->characters().repertoire();
  message.set_model(repertoire.model().name);
  for (const std::string& row : repertoire.model().rows) message.add_rows(row);
  for (const StyleMotions& style : repertoire.styles()) message.add_styles(style.name);
  message.set_characters(static_cast<std::uint32_t>(director_->size()));
  rows_.send(message, now);
}

void SynthesizerNode::publish_motion(Time now) {
  if (director_->size() > 1) {
    to_proto(*director_, batch_message_);
    batch_.send(batch_message_, now);
    return;
  }
  const auto angles = director_->angles(0);
  angles_.assign(angles.begin(), angles.end());
  motion::clamp_to_limits(director_->characters().repertoire().model(), std::span<float>(angles_));
  for (std::size_t r = 0; r < angles_.size(); ++r) {
    velocity_rad_s_[r] =
        (static_cast<double>(angles_[r]) - static_cast<double>(last_angles_[r])) * params_.rate_hz;
  }
  last_angles_ = angles_;
  to_proto(*director_, 0, {angles_, velocity_rad_s_}, motion_message_);
  motion_.send(motion_message_, now);
}

/// At every change, and once a second of those that have a goal.
void SynthesizerNode::publish_status(Time now) {
  for (int i = 0; i < director_->size(); ++i) {
    Progress is = director_->progress(i);
    LastStatus& last = last_status_[static_cast<std::size_t>(i)];
    const bool changed =
        is.kind != last.kind || is.reached != last.reached || is.reason != last.reason;
    if (!changed && (is.kind == GoalKind::none || now < last.due)) continue;
    if (!is.reason.empty() && is.reason != last.reason) {
      runtime::warn("character {}: {}; it goes on", i, is.reason);
    }
    v1::MotionStatus status = to_proto(i, is);
    status_.send(status, now);
    if (is.reached && !last.reached) reached_.send(status, now);
    last = {is.kind, is.reached, std::move(is.reason), now + std::chrono::seconds(1)};
  }
}

void SynthesizerNode::publish_figures(Time now) {
  if (!drawing_ || params_.figures_hz <= 0.0 || now < drawing_due_) return;
  if (drawing_due_ == Time{}) drawing_due_ = now;
  drawing_due_ += runtime::from_seconds(1.0 / params_.figures_hz);
  foxglove::SceneUpdate update = drawing_->draw(*director_, now);
  figures_.send(update, now);
}

/// The sender gets the reason, even for a character that does not exist.
void SynthesizerNode::refuse(std::uint32_t character, const std::string& why, Time now) {
  v1::MotionStatus status;
  status.set_character(character);
  if (character < static_cast<std::uint32_t>(director_->size())) {
    const int i = static_cast<int>(character);
    status = to_proto(i, director_->progress(i));
  }
  status.set_reason(why);
  status_.send(status, now);
}

}  // namespace mimesis::synthesizer
