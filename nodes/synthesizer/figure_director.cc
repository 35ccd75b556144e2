#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/math/circle.h"
#include "common/math/so3.h"
#include "nodes/synthesizer/character/smooth.h"
#include "nodes/synthesizer/director.h"
#include "nodes/synthesizer/sequence/drawer_sequence.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kFade_s = 0.5;
constexpr double kFacing = 0.15;  // rad: a drawer less aside is faced
// distance of the place to walk to if the sequence cannot begin on the way
constexpr double kBeforeFront_m = 0.6;
constexpr double kHold_s = 0.1;                 // within which feet begin and cease to be held
constexpr std::size_t kHeading = 3, kRows = 4;  // in Values

/// Height of the pelvis over the soles, legs straight; the mean of both.
double standing_height_m(const mocap::Body& body) {
  double sum = 0.0;
  for (const auto side : {mocap::kLeft, mocap::kRight}) {
    const auto hip =
        static_cast<std::size_t>(side == mocap::kLeft ? mocap::kLeftHip : mocap::kRightHip);
    sum -= body.offset_m[hip].z() - body.offset_m[hip + 1].norm() - body.offset_m[hip + 2].norm() +
           std::min(body.heel_m[side].z(), body.toe_m[side].z());
  }
  return 0.5 * sum;
}

/// Directs the characters: they walk (Characters), and may go to a drawer and take the object in it
/// (PlacedSequence). One motion follows the other without a jump: at the change the difference of
/// root and rows fades within kFade_s (smooth.h); feet that stand meanwhile are held (FootHold).
///
/// To a drawer a character walks as to any goal until it faces it; then, standing or at a left heel
/// strike, the drawer's sequence takes over, if one leads there from that distance. A drawer that
/// moves along the way is followed within the sequence (DrawerSequence); one that moves across it,
/// and any other goal, takes the character out of it again.
class FigureDirector : public Director {
 public:
  /// @param drawer  actions for goals of that kind; null: they are refused. Must outlive this.
  FigureDirector(const motion::MotionModel& model, std::span<const CharacterStart> starts,
                 const CharactersSettings& settings, const ActionMaps* drawer)
      : Director(model, starts, settings),
        drawer_(drawer),
        dt_s_(settings.walk.dt_s),
        pelvis_(settings.walk.dt_s),
        acts_(starts.size()) {
    if (drawer != nullptr) {
      pelvis_scale_ = standing_height_m(model.body) / standing_height_m(drawer->model().body);
    }
    for (const std::string& row : model.rows) {
      int b = 0;
      while (b < mocap::kBodyRows && mocap::body_row_name(b) != row) ++b;
      body_rows_ = body_rows_ && b < mocap::kBodyRows;
      body_row_.push_back(b);
    }
  }

  bool leads_robot() const override { return false; }
  void walk_to(int i, const Eigen::Vector2d& goal_W_m) override {
    characters_.walk(i).walk_to(goal_W_m);
    if (acts_[static_cast<std::size_t>(i)]) leave(i, act(i));
  }
  void stop(int i) override {
    characters_.walk(i).stop();
    if (acts_[static_cast<std::size_t>(i)]) leave(i, act(i));
  }
  std::string to_drawer(int i, const DrawerPlace& place) override {
    if (drawer_ == nullptr) return "no actions for drawers are loaded (parameter drawer)";
    if (!body_rows_) return "the model's rows are not those of a body";
    Act& a = act(i);
    if (a.run && a.run->move(place).empty()) return {};
    leave(i, a);
    const Eigen::Vector2d way = place.front_W_m - Eigen::Vector2d(a.shown[0], a.shown[1]);
    const double far = way.norm(),
                 share = std::max(0.0, 1.0 - kBeforeFront_m / std::max(far, 1e-9));
    characters_.walk(i).walk_to(Eigen::Vector2d(a.shown[0], a.shown[1]) + share * way);
    a.wished = place;
    return {};
  }
  void follow(int i, const GaitWish& wish, std::optional<double> phase_rad) override {
    characters_.set_gait(i, wish, phase_rad);
  }
  void release(int i) override { characters_.release(i); }
  /// Allocates only for characters in a drawer's sequence.
  void step(const RobotFeedback*, const DrawerSenses&) override {
    for (int i = 0; i < size(); ++i) {
      Act* act = acts_[static_cast<std::size_t>(i)].get();
      if (act == nullptr || !act->active) continue;
      if (act->wished) begin(i, *act);
      act->phase_rad = characters_.state(i).phase_rad;
      if (act->run) act->run->step();
    }
    characters_.step();
    for (int i = 0; i < size(); ++i) {
      Act* act = acts_[static_cast<std::size_t>(i)].get();
      if (act != nullptr && act->active) compose(i, *act);
    }
    if (size() == 1) pelvis_.step(state(0).root);
  }

  const CharacterState& state(int i) const override {
    const Act* act = acts_[static_cast<std::size_t>(i)].get();
    return act != nullptr && act->active ? act->state : characters_.state(i);
  }
  std::span<const float> angles(int i) const override {
    const Act* act = acts_[static_cast<std::size_t>(i)].get();
    return act != nullptr && act->active ? std::span<const float>(act->angles)
                                         : characters_.angles(i);
  }
  DirectedMotion motion(int i) const override {
    const CharacterState& is = state(i);
    const RootPose& root = is.root;
    DirectedMotion motion;
    motion.phase_rad = is.phase_rad;
    motion.phase_rate_rad_s = is.phase_rate_rad_s;
    motion.velocity << root.velocity_H_m_s, root.yaw_rate_rad_s;
    motion.smooth_velocity = pelvis_.value();
    motion.pelvis_W_m << root.position_W_m, root.height_m;
    motion.heading_rad = root.heading_rad;
    motion.support = root.support == mocap::kLeft ? mocap::kLeft : mocap::kRight;
    motion.action = action(i);
    return motion;
  }  ///< smooth only if there is one character
  const char* action(int i) const {
    const Act* act = acts_[static_cast<std::size_t>(i)].get();
    if (act != nullptr && act->run) return act->run->action();
    switch (characters_.walk(i).stage()) {
      case StepCourse::Stage::standing:
        return "stand";
      case StepCourse::Stage::opening:
        return "start";
      case StepCourse::Stage::closing:
        return "stop";
      case StepCourse::Stage::walking:
        break;
    }
    return "walk";
  }  ///< stand, start, walk, stop; step, reach, take at a drawer
  Progress progress(int i) const override {
    const Act* act = acts_[static_cast<std::size_t>(i)].get();
    const WalkControl& walk = characters_.walk(i);
    Progress p;
    if (act != nullptr && act->active && (act->run || act->wished)) {
      p.kind = GoalKind::drawer;
      p.distance_m = walk.goal_distance_m() + kBeforeFront_m;
      p.reason = act->refused;
      if (act->run) {
        p.distance_m = act->run->distance_m();
        p.reason = act->run->sequence().refused;
        p.reached = act->run->sequence().done && p.reason.empty();
      }
      return p;
    }
    p.kind = walk.task() == WalkTask::walk_to ? GoalKind::walk_to
             : walk.task() == WalkTask::stop  ? GoalKind::stop
                                              : GoalKind::none;
    p.reached = walk.task() == WalkTask::stop ? walk.stage() == StepCourse::Stage::standing
                                              : walk.reached();
    p.distance_m = walk.goal_distance_m();
    if (walk.stuck()) p.reason = "no nearer for a long time";
    return p;
  }
  const std::vector<PlannedAction>* plan(int i) const override {
    const Act* act = acts_[static_cast<std::size_t>(i)].get();
    return act != nullptr && act->run ? &act->run->plan() : nullptr;
  }

 private:
  /// Values of a motion: x, y, z of the pelvis in W, heading, rows.
  using Values = std::vector<double>;
  /// A character that is on its way to a drawer, in its sequence, or leaves it.
  struct Act {
    bool active = false;
    std::optional<DrawerPlace> wished;  // until its sequence begins
    std::string refused;                // why it did not
    std::optional<PlacedSequence> run;
    double phase_rad = 0.0;  // phase of the walk at the last step
    CharacterState state;    // state at this instant, with the fade
    std::vector<float> angles;
    Values shown, shown_before;  // values of this and the last instant
    double fade_s = kFade_s;     // since the change
    bool from_now = true;        // `motion` is of the instant of the change; else of the next one
    Values offset, offset_rate;  // offset from the new motion to the old one, at the change
    Values motion;               // the new one, without fade
    FootHold feet;               // of what is shown
    double held = 0.0;           // share of that: a walk's own feet stand
    Eigen::VectorXd body_rad = Eigen::VectorXd::Zero(mocap::kBodyRows);  // buffer
  };
  Act& act(int i) {
    auto& act = acts_[static_cast<std::size_t>(i)];
    if (!act) {
      act = std::make_unique<Act>();
      const std::size_t n = kRows + body_row_.size();
      for (Values* v :
           {&act->shown, &act->shown_before, &act->offset, &act->offset_rate, &act->motion}) {
        v->assign(n, 0.0);
      }
      act->angles.assign(body_row_.size(), 0.0F);
    }
    if (!act->active) {
      act->active = true;
      act->fade_s = kFade_s;
      act->phase_rad = characters_.state(i).phase_rad;
      read(i, *act, act->shown);
      act->shown_before = act->shown;
      act->feet = {};
      act->held = 0.0;
      show(i, *act);
    }
    return *act;
  }
  void advance(int i, Act& act);
  void begin(int i, Act& act) {
    const CharacterState& state = characters_.state(i);
    const StepCourse::Stage stage = characters_.walk(i).stage();
    const bool lands = strike_between(act.phase_rad, state.phase_rad) == Strike::left;
    if (stage != StepCourse::Stage::standing && !(stage == StepCourse::Stage::walking && lands)) {
      return;
    }
    const Eigen::Vector2d way = act.wished->front_W_m - state.root.position_W_m;
    const double aside = math::wrap_pi(std::atan2(way.y(), way.x()) - state.root.heading_rad);
    const bool there = characters_.walk(i).reached();
    if (std::abs(aside) > kFacing && !there) return;
    auto run = PlacedSequence::start(*drawer_, *act.wished, state.root.position_W_m, dt_s_);
    if (!run) {
      if (there) act.refused = run.error().reason;
      return;
    }
    act.run.emplace(std::move(*run));
    act.wished.reset();
    act.refused.clear();
    characters_.walk(i).stop();
    read(i, act, act.motion);
    begin_fade(act, true);
  }
  /// Out of the sequence: back to a walk that is where it was, or to standing.
  void leave(int i, Act& act) {
    act.wished.reset();
    act.refused.clear();
    if (!act.run) return;
    const SequenceState& was = act.run->sequence();
    const bool walks = was.action == kNormalStep;
    characters_.place(i,
                      {.position_W_m = {act.shown[0], act.shown[1]},
                       .heading_rad = act.shown[kHeading],
                       .phase_rad = walks ? was.phase_rad : 0.0},
                      walks);
    act.run.reset();
    begin_fade(act, false);
  }
  void begin_fade(Act& act, bool from_now) {
    act.fade_s = 0.0;
    act.from_now = from_now;
    for (std::size_t k = 0; k < act.offset.size(); ++k) {
      act.offset[k] = act.shown[k];
      act.offset_rate[k] = (act.shown[k] - act.shown_before[k]) / dt_s_;
    }
  }
  void read(int i, const Act& act, Values& values) const {
    if (act.run) {
      const SequenceState& s = act.run->sequence();
      const Eigen::Vector2d p = act.run->position_W_m();
      values[0] = p.x();
      values[1] = p.y();
      values[2] = pelvis_scale_ * s.pelvis_W_m.z();
      values[kHeading] = act.run->heading_rad();
      for (std::size_t r = 0; r < body_row_.size(); ++r) {
        values[kRows + r] = s.angle_rad[body_row_[r]];
      }
      return;
    }
    const RootPose& root = characters_.state(i).root;
    values[0] = root.position_W_m.x();
    values[1] = root.position_W_m.y();
    values[2] = root.height_m;
    values[kHeading] = root.heading_rad;
    const auto angles = characters_.angles(i);
    std::copy(angles.begin(), angles.end(), values.begin() + kRows);
  }
  /// Composes the shown motion: the motion and the rest of the difference to the one before it.
  void compose(int i, Act& act) {
    std::swap(act.shown, act.shown_before);
    const bool begins = act.fade_s == 0.0;
    if (begins && act.from_now) read(i, act, act.shown);
    if (!begins || !act.from_now) read(i, act, act.motion);
    if (begins) {
      for (std::size_t k = 0; k < act.shown.size(); ++k) {
        act.offset[k] -= act.motion[k];
        if (act.from_now) act.offset_rate[k] -= (act.shown[k] - act.motion[k]) / dt_s_;
      }
      act.offset[kHeading] = math::wrap_pi(act.offset[kHeading]);
      if (act.from_now) act.motion = act.shown;
    }
    act.fade_s = std::min(act.fade_s + dt_s_, kFade_s);
    for (std::size_t k = 0; k < act.shown.size(); ++k) {
      act.shown[k] = act.motion[k] + faded(act.offset[k], act.offset_rate[k], act.fade_s, kFade_s);
    }
    const bool holds = act.run || act.fade_s < kFade_s - kHold_s;
    act.held = std::clamp(act.held + (holds ? dt_s_ : -dt_s_) / kHold_s, 0.0, 1.0);
    if (act.held > 0.0) hold_feet(act);
    show(i, act);
    act.active =
        act.run || act.wished || act.fade_s < kFade_s || !act.refused.empty() || act.held > 0.0;
  }
  /// Feet that stand stay, on the ground, whatever is faded in.
  void hold_feet(Act& act) {
    const double share = minimum_jerk(act.held, 0.0, 1.0);
    const Eigen::Matrix3d R_WH = math::exp_so3({0.0, 0.0, act.shown[kHeading]});
    act.body_rad.setZero();
    for (std::size_t r = 0; r < body_row_.size(); ++r) {
      act.body_rad[body_row_[r]] = act.shown[kRows + r];
    }
    act.body_rad.head<3>() = math::log_so3(R_WH * math::exp_so3(act.body_rad.head<3>()));
    act.feet.apply(characters_.repertoire().model().body,
                   {act.shown[0], act.shown[1], act.shown[2]}, dt_s_, act.body_rad);
    for (std::size_t r = 0; r < body_row_.size(); ++r) {
      double& shown = act.shown[kRows + r];
      if (body_row_[r] >= 3) shown += share * (act.body_rad[body_row_[r]] - shown);
    }
  }
  void show(int i, Act& act) {
    const double rate = 1.0 / dt_s_;
    const double cosine = std::cos(act.shown[kHeading]), sine = std::sin(act.shown[kHeading]);
    const double vx = (act.shown[0] - act.shown_before[0]) * rate;
    const double vy = (act.shown[1] - act.shown_before[1]) * rate;
    const double phase_before = act.state.phase_rad;
    act.state = characters_.state(i);
    RootPose& root = act.state.root;
    root.position_W_m = {act.shown[0], act.shown[1]};
    root.height_m = act.shown[2];
    root.heading_rad = act.shown[kHeading];
    root.velocity_H_m_s = {cosine * vx + sine * vy, cosine * vy - sine * vx};
    root.yaw_rate_rad_s = math::wrap_pi(act.shown[kHeading] - act.shown_before[kHeading]) * rate;
    if (act.run) {
      const SequenceState& s = act.run->sequence();
      act.state.phase_rad = s.phase_rad;
      act.state.phase_rate_rad_s = math::wrap_pi(s.phase_rad - phase_before) * rate;
      root.support = s.stands[mocap::kLeft] ? mocap::kLeft : mocap::kRight;
    }
    for (std::size_t r = 0; r < act.angles.size(); ++r) {
      act.angles[r] = static_cast<float>(act.shown[kRows + r]);
    }
  }

  const ActionMaps* drawer_;
  double dt_s_;
  double pelvis_scale_ = 1.0;  // heights of a sequence are those of the body of its trials
  PelvisVelocity pelvis_;      // velocity of a single character
  bool body_rows_ = true;      // all rows of the model are rows of a body
  std::vector<int> body_row_;  // row of the body, for each row of the model
  std::vector<std::unique_ptr<Act>> acts_;
};

}  // namespace

std::unique_ptr<Director> make_figure_director(const motion::MotionModel& model,
                                               std::span<const CharacterStart> starts,
                                               const CharactersSettings& settings,
                                               const ActionMaps* drawer) {
  return std::make_unique<FigureDirector>(model, starts, settings, drawer);
}

}  // namespace mimesis::synthesizer
