#include "nodes/synthesizer/synthesizer_node.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/runtime/param_source.h"
#include "nodes/synthesizer/motion_messages_node.h"

namespace mimesis::synthesizer {
namespace {

using runtime::Time;

double seconds(Time t) { return std::chrono::duration<double>(t).count(); }

}  // namespace

SynthesizerNode::SynthesizerNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      walkers_(load_motion_model(runtime::find_model_file(params.model)),
               form(params.characters, params.formation()), params.walkers()),
      commanded_(static_cast<std::size_t>(params.characters), Time{}),
      told_(static_cast<std::size_t>(params.characters)),
      velocity_rad_s_(static_cast<std::size_t>(walkers_.rows()), 0.0),
      goal_in_(bus, "goal"),
      style_in_(bus, "style"),
      beat_in_(bus, "beat"),
      crowd_in_(bus, "crowd"),
      rows_(bus, "rows", {.latched = true}),
      motion_(bus, "motion"),
      batch_(bus, "characters"),
      status_(bus, "status") {
  const auto angles = walkers_.angles(0);
  last_angles_.assign(angles.begin(), angles.end());
  set_first_goal();
  const MotionModel& model = walkers_.repertoire().model();
  runtime::info("model '{}': {} rows, {} sources; styles {}", model.name, model.rows.size(),
                model.sources.rows(), walkers_.repertoire().known());
}

void SynthesizerNode::set_first_goal() {
  if (params_.goal.kind == "none") return;
  v1::MotionGoal goal;
  goal.set_kind(v1::MOTION_GOAL_KIND_WALK_TO);
  goal.mutable_position_in_world_m()->set_x_m(params_.goal.x_m);
  goal.mutable_position_in_world_m()->set_y_m(params_.goal.y_m);
  if (const std::string why = fault(goal, walkers_); !why.empty()) {
    throw ConfigError("synthesizer.goal: " + why);
  }
  for (int i = 0; i < walkers_.size(); ++i) {
    walkers_.walker(i).walk_to({params_.goal.x_m, params_.goal.y_m});
  }
}

void SynthesizerNode::step(Time now) {
  take_goals(now);
  take_styles(now);
  take_beat(now);
  take_crowd(now);
  walkers_.step();
  publish_motion(now);
  publish_status(now);
}

void SynthesizerNode::take_goals(Time now) {
  while (const auto goal = goal_in_.pop()) {
    if (const std::string why = fault(*goal, walkers_); !why.empty()) {
      if (bad_goal_.pass()) runtime::warn("goal: {}; refused", why);
      refuse(goal->character(), why, now);
      continue;
    }
    Walker& walker = walkers_.walker(static_cast<int>(goal->character()));
    if (goal->kind() == v1::MOTION_GOAL_KIND_STOP) {
      walker.stop();
    } else {
      walker.walk_to({goal->position_in_world_m().x_m(), goal->position_in_world_m().y_m()});
    }
  }
}

void SynthesizerNode::take_styles(Time now) {
  while (const auto wish = style_in_.pop()) {
    if (const std::string why = fault(*wish, walkers_); !why.empty()) {
      if (bad_style_.pass()) runtime::warn("style: {}; refused", why);
      refuse(wish->characters().empty() ? 0 : wish->characters(0), why, now);
      continue;
    }
    const std::vector<double> shares = to_shares(*wish, walkers_.repertoire());
    if (wish->characters().empty()) {
      for (int i = 0; i < walkers_.size(); ++i) {
        walkers_.walker(i).style().wish(shares, wish->duration_s());
      }
    }
    for (const std::uint32_t i : wish->characters()) {
      walkers_.walker(static_cast<int>(i)).style().wish(shares, wish->duration_s());
    }
  }
}

void SynthesizerNode::take_beat(Time now) {
  if (beat_heard_ && now - beat_stamp_ > runtime::from_seconds(params_.beat_stale_s)) {
    runtime::info("no beat for {} s: everyone walks on in their own rhythm", params_.beat_stale_s);
    walkers_.end_beat();
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
    walkers_.end_beat();
    return;
  }
  walkers_.set_beat(beat->phase_rad() + beat->phase_rate_rad_s() * seconds(now - beat_stamp_),
                    beat->phase_rate_rad_s());
}

void SynthesizerNode::take_crowd(Time now) {
  const v1::CrowdCommand* crowd = crowd_in_.take();
  const Time stamp = crowd_in_.stamp();
  const bool in_time =
      stamp >= crowd_stamp_ && now - stamp <= runtime::from_seconds(params_.gait_stale_s);
  if (crowd != nullptr && in_time) {
    crowd_stamp_ = stamp;
    for (const v1::GaitCommand& gait : crowd->gaits()) {
      if (const std::string why = fault(gait, walkers_); !why.empty()) {
        if (bad_crowd_.pass()) runtime::warn("crowd: {}; ignored", why);
        continue;
      }
      const int i = static_cast<int>(gait.character());
      const Walker& walker = walkers_.walker(i);
      std::optional<double> phase;
      if (gait.has_phase_rad()) {
        const double rate =
            gait.has_phase_rate_rad_s() ? gait.phase_rate_rad_s() : walker.frequency_rad_s();
        phase = gait.phase_rad() + rate * seconds(now - stamp);
      }
      walkers_.set_gait(i, to_gait(gait), phase);
      commanded_[gait.character()] = stamp;
    }
  }
  release_stale(now);
}

void SynthesizerNode::release_stale(Time now) {
  int released = 0, first = 0;
  for (int i = walkers_.size() - 1; i >= 0; --i) {
    Time& stamp = commanded_[static_cast<std::size_t>(i)];
    if (stamp == Time{} || now - stamp <= runtime::from_seconds(params_.gait_stale_s)) continue;
    stamp = Time{};
    walkers_.release(i);
    ++released;
    first = i;
  }
  if (released == 1) {
    runtime::info("no crowd command for {} s: character {} walks on its own", params_.gait_stale_s,
                  first);
  } else if (released > 1) {
    runtime::info("no crowd command for {} s: {} characters walk on their own, the first is {}",
                  params_.gait_stale_s, released, first);
  }
}

void SynthesizerNode::publish_motion(Time now) {
  if (!rows_sent_) {
    v1::MotionRows message;
    const MotionModel& model = walkers_.repertoire().model();
    message.set_model(model.name);
    for (const std::string& row : model.rows) message.add_rows(row);
    for (const StyleMotions& style : walkers_.repertoire().styles()) message.add_styles(style.name);
    message.set_characters(static_cast<std::uint32_t>(walkers_.size()));
    rows_.send(message, now);
    rows_sent_ = true;
  }
  if (walkers_.size() > 1) {
    to_proto(walkers_, batch_message_);
    batch_.send(batch_message_, now);
    return;
  }
  const auto angles = walkers_.angles(0);
  for (std::size_t r = 0; r < angles.size(); ++r) {
    velocity_rad_s_[r] = static_cast<double>(angles[r] - last_angles_[r]) * params_.rate_hz;
    last_angles_[r] = angles[r];
  }
  to_proto(walkers_, 0, velocity_rad_s_, motion_message_);
  motion_.send(motion_message_, now);
}

void SynthesizerNode::publish_status(Time now) {
  for (int i = 0; i < walkers_.size(); ++i) {
    const Walker& walker = walkers_.walker(i);
    Told& told = told_[static_cast<std::size_t>(i)];
    const Told is{to_proto(walker.task()), walker.reached(), walker.stuck(), told.due};
    const bool changed =
        is.kind != told.kind || is.reached != told.reached || is.stuck != told.stuck;
    if (!changed && (is.kind == v1::MOTION_GOAL_KIND_UNSPECIFIED || now < told.due)) continue;
    const std::string why =
        is.stuck ? fmt::format("no nearer for {:g} s", params_.walk.give_up_s) : std::string();
    if (is.stuck && !told.stuck) runtime::warn("character {}: {}; it goes on", i, why);
    told = is;
    tell(i, why, now);
  }
}

void SynthesizerNode::tell(int character, const std::string& reason, Time now) {
  const Walker& walker = walkers_.walker(character);
  v1::MotionStatus status;
  status.set_character(static_cast<std::uint32_t>(character));
  status.set_kind(to_proto(walker.task()));
  status.set_reached(walker.reached());
  status.set_reason(reason);
  status.set_goal_distance_m(walker.goal_distance_m());
  status_.send(status, now);
  told_[static_cast<std::size_t>(character)].due = now + std::chrono::seconds(1);
}

/// Who wished hears why not; of a character that is not there, too.
void SynthesizerNode::refuse(std::uint32_t character, const std::string& why, Time now) {
  if (character < static_cast<std::uint32_t>(walkers_.size())) {
    tell(static_cast<int>(character), why, now);
    return;
  }
  v1::MotionStatus status;
  status.set_character(character);
  status.set_reason(why);
  status_.send(status, now);
}

}  // namespace mimesis::synthesizer
