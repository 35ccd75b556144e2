#include "experiments/walk/drawer/drawer_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/error.h"
#include "common/math/so3.h"
#include "experiments/walk/trial/suites.h"
#include "hw/sim/body/head_camera.h"
#include "nodes/walker/walk_wish.h"
#include "tools/mimesis/table.h"

namespace mimesis::walk {
namespace {

using synthesizer::BipedDrawerSequence;
using synthesizer::RobotFeedback;
using synthesizer::RobotGait;
using walker::kTick_s;
using walker::Side;

constexpr double kHold_s = 1.0;  // holding the object for this time ends the trial

mocap::Side to_person(Side side) { return side == robot::kLeft ? mocap::kLeft : mocap::kRight; }

RobotGait to_gait(walker::Gait gait) {
  switch (gait) {
    case walker::Gait::standing:
      return RobotGait::standing;
    case walker::Gait::starting:
      return RobotGait::starting;
    case walker::Gait::walking:
      return RobotGait::walking;
    case walker::Gait::stopping:
      return RobotGait::stopping;
  }
  return RobotGait::safe;
}

/// Contents of v1.WalkFeedback.
RobotFeedback to_feedback(const walker::WalkerOutput& out) {
  const walker::PatternSample& plan = out.pattern;
  RobotFeedback f;
  f.gait = to_gait(plan.gait);
  f.pelvis_W_m = out.X_WB.translation();
  f.heading_rad = math::yaw_of(out.X_WB.linear());
  f.swing = to_person(plan.swing);
  f.to_landing_s = plan.to_landing_s;
  f.landing = {to_person(plan.landing.side), plan.landing.p_W_m, plan.landing.yaw_rad};
  for (Side s : robot::kSides) {
    const Eigen::Isometry3d& X = plan.foot[s].X_WS;
    f.feet[s] = {to_person(s), X.translation().head<2>(), math::yaw_of(X.linear())};
  }
  f.steps = plan.steps;
  f.hands_known = true;
  f.hand_W_m = out.hand_W_m;
  f.X_WH = out.X_WH;
  return f;
}

walker::MotionWish to_motion(const synthesizer::BipedSequenceState& state,
                             const std::vector<Eigen::Index>& joint) {
  walker::MotionWish wish;
  wish.velocity_m_s = state.velocity.head<2>();
  wish.yaw_rate_rad_s = state.velocity.z();
  wish.stands = state.stands;
  for (std::size_t i = 0; i < 2; ++i) {
    if (!state.landing[i]) continue;
    const synthesizer::SolePrint& p = *state.landing[i];
    wish.landing[i] = walker::Footprint{p.side == mocap::kLeft ? robot::kLeft : robot::kRight,
                                        p.p_W_m, p.yaw_rad};
  }
  wish.upper_body = state.q(joint);
  wish.upper_body_rate = state.dq(joint);
  for (Side s : robot::kSides) {
    if (state.hand[s]) wish.hand[s] = {state.hand[s]->p_W_m, state.hand[s]->share};
  }
  return wish;
}

/// Indices of the joints of Biped::upper_body among those of the sequence.
std::vector<Eigen::Index> joints_of(const robot::Biped& biped, const robot::RobotTree& upper) {
  std::vector<Eigen::Index> out;
  for (const int dof : biped.upper_body) {
    out.push_back(upper.require_joint(biped.tree.moved(dof).joint));
  }
  return out;
}

/// The synthesizer's and the drawer's part of a trial.
class Task {
 public:
  explicit Task(const DrawerTrialSpec& spec)
      : spec_(spec),
        joint_(joints_of(spec.robot->biped, spec.actions->upper)),
        wish_(spec.robot->biped, walker::gait_settings(spec.robot->biped), {}),
        drawer_(settings(spec)),
        camera_(camera_settings(spec)),
        tracker_(spec.actions->drawer.handle_lateral_m, kTick_s) {}

  walker::WalkerWish wish(double time_s) {
    if (!sequence_ && feedback_ && result.refused.empty() && time_s >= spec_.stand_s) begin();
    if (!sequence_) return wish_.step(nullptr, {}, kTick_s);
    const auto& state = sequence_->step(&*feedback_, seen_);
    if (!state.refused.empty()) result.refused = state.refused;
    const walker::MotionWish motion = to_motion(state, joint_);
    return wish_.step(&motion, {feedback_->pelvis_W_m.head<2>(), feedback_->heading_rad}, kTick_s);
  }

  void see(const TrialTick& tick) {
    move_drawer(tick);
    const hw::sim::DrawerNow& now = drawer_.now();
    feedback_ = to_feedback(tick.out);
    synthesizer::DrawerSenses senses{.sight = {}, .holds = {now.held, now.taken}};
    const hw::sim::BodyTruth& truth = tick.truth;
    camera_.look(tick.time_s, {truth.X_WH, now.handle_W_m, now.object_W_m, truth.hand_W_m});
    if (const hw::sim::HeadSight* sight = camera_.arrived(tick.time_s)) {
      senses.sight = {tick.time_s - sight->taken_s, sight->handle_H_m, sight->object_H_m};
    }
    seen_ = tracker_.step(&*feedback_,
                          sequence_ ? sequence_->heading_rad() : feedback_->heading_rad, senses);
    measure(tick);
    if (now.taken && !result.taken) {
      result.taken = true;
      result.done_s = tick.time_s;
    }
    if (result.taken && tick.time_s >= result.done_s + kHold_s) tick.ends = true;
    if (!result.refused.empty() && !sequence_) tick.ends = true;
  }

  const synthesizer::BipedSequenceState* state() const {
    return sequence_ ? &sequence_->state() : nullptr;
  }
  const hw::sim::Drawer& drawer() const { return drawer_; }

  DrawerResult result;

  static hw::sim::DrawerSettings settings(const DrawerTrialSpec& spec) {
    hw::sim::DrawerSettings out;
    out.front_x_m = spec.front_m;
    out.front_y_m = spec.left_m;
    const synthesizer::Drawer& drawer = spec.actions->drawer;
    const double ground_m =
        hw::sim::ground_height_m(spec.body.slope_rad, {spec.front_m, spec.left_m});
    out.handle_height_m = ground_m + drawer.handle_height_m;
    out.handle_left_m = drawer.handle_lateral_m;
    out.object_height_m = ground_m + drawer.object_height_m;
    out.object_depth_m = spec.object_depth_m;
    out.jumps = spec.jumps;
    return out;
  }

 private:
  /// The physics of drawer and hands: theirs are the true places.
  void move_drawer(const TrialTick& tick) {
    const auto* state = sequence_ ? &sequence_->state() : nullptr;
    std::array<bool, 2> grips{};
    for (Side s : robot::kSides) {
      grips[s] = state != nullptr && state->hand[s] && state->hand[s]->closes;
    }
    tick.world.move(drawer_, grips, kTick_s);
  }

  static hw::sim::HeadCameraSettings camera_settings(const DrawerTrialSpec& spec) {
    hw::sim::HeadCameraSettings out;
    out.seed = spec.body.seed;
    return out;
  }

  void begin() {
    auto sequence = BipedDrawerSequence::start(
        *spec_.actions, {{spec_.front_m, spec_.left_m}, spec_.object_depth_m}, *feedback_,
        spec_.sequence);
    if (!sequence) {
      result.refused = sequence.error().reason;
      return;
    }
    sequence_.emplace(std::move(*sequence));
    Eigen::VectorXd q(spec_.actions->upper.dof());
    for (std::size_t i = 0; i < joint_.size(); ++i) {
      q[joint_[i]] = spec_.robot->biped.half_sitting[spec_.robot->biped.upper_body[i]];
    }
    sequence_->set_posture(q);
  }

  /// Measures the travel of an action by the true feet when the next one begins.
  void measure(const TrialTick& tick) {
    if (!sequence_) return;
    const auto& history = sequence_->history();
    const double heading = sequence_->heading_rad();
    const Eigen::Vector2d way(std::cos(heading), std::sin(heading));
    const double middle = 0.5 * way.dot(tick.truth.X_WS[0].translation().head<2>() +
                                        tick.truth.X_WS[1].translation().head<2>());
    for (; begun_ < history.size(); ++begun_) {
      if (begun_ > 0 && history[begun_ - 1].length_m != 0.0) {
        const synthesizer::PlannedAction& over = history[begun_ - 1];
        result.lengths.push_back({over.action, over.length_m, middle - start_m_});
      }
      start_m_ = middle;
    }
  }

  const DrawerTrialSpec& spec_;
  std::vector<Eigen::Index> joint_;
  walker::WalkWish wish_;
  hw::sim::Drawer drawer_;
  std::optional<BipedDrawerSequence> sequence_;
  std::optional<RobotFeedback> feedback_;
  hw::sim::HeadCamera camera_;
  synthesizer::DrawerTracker tracker_;
  const synthesizer::DrawerSeen* seen_ = nullptr;
  std::size_t begun_ = 0;  ///< actions
  double start_m_ = 0.0;   ///< place of the feet when the last action began
};

}  // namespace

double DrawerResult::length_error_max_m() const {
  double worst = 0.0;
  for (const ActionLength& l : lengths) worst = std::max(worst, std::abs(l.walked_m - l.wished_m));
  return worst;
}

DrawerResult run_drawer_trial(const DrawerTrialSpec& spec,
                              const std::function<void(const DrawerTick&)>& watch) {
  MIMESIS_ASSERT(spec.robot != nullptr && spec.actions != nullptr);
  Task task(spec);
  TrialSpec trial;
  trial.name = spec.name;
  trial.robot = spec.robot;
  trial.body = spec.body;
  trial.body.drawer = Task::settings(spec);
  trial.walker = spec.walker;
  trial.pushes = spec.pushes;
  trial.duration_s = spec.time_limit_s;
  trial.delay_ticks = spec.delay_ticks;
  trial.wish = [&](double time_s) { return task.wish(time_s); };
  TrialResult walk = run_trial(trial, [&](const TrialTick& tick) {
    task.see(tick);
    if (watch) watch({tick, task.state(), task.drawer().now()});
  });
  DrawerResult result = std::move(task.result);
  result.walk = std::move(walk);
  result.reach_error_m = task.drawer().reach_error_m().value_or(0.0);
  result.handle_error_m = task.drawer().handle_error_m().value_or(0.0);
  return result;
}

namespace {

constexpr double kStep_s = 0.8;
constexpr double kTaskAnkle_n_m = 30.0;  // HRP-2's limit of pitch [M18 3.8.4]
enum class Jumps { stays, on_the_way, before_it };

/// Time until the robot stands before a front at this distance: from a stand, two steps per 0.45 m.
double arrives_s(double front_m) { return 1.0 + kStep_s + 2.0 * kStep_s * (front_m - 0.5) / 0.45; }

}  // namespace

std::vector<DrawerTrialSpec> drawers30(const Robot& robot, const synthesizer::BipedDrawer& actions,
                                       const SuiteOptions& options) {
  std::vector<DrawerTrialSpec> trials;
  Draw draw(options.seed);
  for (const Jumps jumps : {Jumps::stays, Jumps::on_the_way, Jumps::before_it}) {
    for (int i = 0; i < 10; ++i) {
      DrawerTrialSpec spec;
      spec.robot = &robot;
      spec.actions = &actions;
      set_up(options, trials.size(), spec.body, spec.walker);
      if (!(spec.body.ankle_pitch_n_m > 0.0)) spec.body.ankle_pitch_n_m = kTaskAnkle_n_m;
      spec.delay_ticks = options.delay_ticks;
      spec.front_m = draw.between(1.2, 2.8);
      spec.left_m = spec.front_m * std::tan(draw.between(-0.06, 0.06));
      spec.object_depth_m = draw.between(0.124, 0.273);
      const double by_m = draw.between(-0.10, 0.10), when = draw.between(0.0, 1.0);
      const double there_s = arrives_s(spec.front_m);
      spec.name = fmt::format("{:.2f} m, {:+.2f} left, {:.2f} deep", spec.front_m, spec.left_m,
                              spec.object_depth_m);
      if (jumps != Jumps::stays) {
        const double at_s = jumps == Jumps::on_the_way
                                ? std::lerp(1.0, there_s - 2.0 * kStep_s, when)
                                : std::lerp(there_s - 2.0 * kStep_s, there_s + 2.0, when);
        spec.jumps.push_back({.at_s = at_s, .by_m = by_m});
        spec.name += fmt::format(", {:+.0f} mm at {:.1f} s", 1e3 * by_m, at_s);
      }
      trials.push_back(std::move(spec));
    }
  }
  return trials;
}

DrawerEnd end_of(const DrawerResult& result) {
  if (result.walk.figures.fell) return DrawerEnd::fell;
  if (result.taken) return DrawerEnd::taken;
  return result.refused.empty() ? DrawerEnd::silent : DrawerEnd::refused;
}

void run_drawer_trials(std::span<const DrawerTrialSpec> trials, int jobs,
                       const std::function<void(const DrawerResult&)>& done) {
  in_order<DrawerResult>(
      trials.size(), jobs, [&](std::size_t i) { return run_drawer_trial(trials[i]); }, done);
}

namespace {

using nlohmann::ordered_json;

const char* name_of(DrawerEnd end) {
  switch (end) {
    case DrawerEnd::taken:
      return "taken";
    case DrawerEnd::refused:
      return "refused";
    case DrawerEnd::fell:
      return "fell";
    case DrawerEnd::silent:
      break;
  }
  return "silent";
}

std::string reason_of(const DrawerResult& r) {
  switch (end_of(r)) {
    case DrawerEnd::taken:
      return "";
    case DrawerEnd::fell:
      return fmt::format("{} at {:.1f} s", r.walk.figures.how, r.walk.fell_at_s);
    default:
      return r.refused;
  }
}

}  // namespace

ordered_json to_json(const DrawerResult& r) {
  ordered_json j = to_json(r.walk);
  j["end"] = name_of(end_of(r));
  j["reason"] = reason_of(r);
  j["done_s"] = r.done_s;
  j["object_error_m"] = r.reach_error_m;
  j["handle_error_m"] = r.handle_error_m;
  j["length_error_max_m"] = r.length_error_max_m();
  return j;
}

ordered_json summary_json(std::span<const DrawerResult> results) {
  ordered_json ends = ordered_json::array();
  std::vector<TrialResult> walks;
  double object = 0.0, handle = 0.0, length = 0.0;
  int taken = 0, silent = 0;
  for (const DrawerResult& r : results) {
    walks.push_back(r.walk);
    const DrawerEnd end = end_of(r);
    silent += end == DrawerEnd::silent;
    if (end == DrawerEnd::taken) {
      ++taken;
      object = std::max(object, r.reach_error_m);
      handle = std::max(handle, r.handle_error_m);
    } else {
      ends.push_back({{"name", r.walk.name}, {"end", name_of(end)}, {"reason", reason_of(r)}});
    }
    if (end != DrawerEnd::fell) length = std::max(length, r.length_error_max_m());
  }
  ordered_json j = summary_json(walks);
  j["taken"] = taken;
  j["silent"] = silent;
  j["not_taken"] = ends;
  j["object_error_max_m"] = object;
  j["handle_error_max_m"] = handle;
  j["length_error_max_m"] = length;
  return j;
}

void print_table(std::span<const DrawerResult> results, std::ostream& out, bool bold_heading) {
  tool::TextTable table({"task", "end", "s", "object mm", "handle mm", "step err mm",
                         "length err mm", "ankle Nm (20 ms)", "Fz N", "tick us p50/p99", "why"});
  for (const DrawerResult& r : results) {
    const hw::sim::WalkFigures& f = r.walk.figures;
    table.row({r.walk.name, name_of(end_of(r)), r.taken ? fmt::format("{:.1f}", r.done_s) : "",
               fmt::format("{:.1f}", 1e3 * r.reach_error_m),
               fmt::format("{:.1f}", 1e3 * r.handle_error_m),
               fmt::format("{:.1f}", 1e3 * f.step_error_max_m),
               fmt::format("{:.1f}", 1e3 * r.length_error_max_m()),
               fmt::format("{:.0f} ({:.0f})", f.ankle_pitch_peak_n_m, f.ankle_pitch_slow_peak_n_m),
               fmt::format("{:.0f}", f.normal_peak_n),
               fmt::format("{:.0f}/{:.0f}", 1e6 * r.walk.tick_p50_s, 1e6 * r.walk.tick_p99_s),
               reason_of(r)});
  }
  table.print(out, bold_heading);
}

}  // namespace mimesis::walk
