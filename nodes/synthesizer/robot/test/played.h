#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <string>
#include <vector>

#include "nodes/synthesizer/robot/biped_sequence.h"
#include "nodes/synthesizer/robot/test/learned_biped.h"

namespace mimesis::synthesizer::testing {

/// A robot that lands where it is wished but for errors, reports late, and stops as a walker does:
/// told to stop, it finishes the step under way and one more.
class FakeRobot {
 public:
  struct Trouble {
    double along_m = 0.0, across_m = 0.0;  ///< errors of every landing, mirrored for the left foot
    bool same_way = false;                 ///< both feet's the same way
    int late_ticks = 0;                    ///< delay of the feedback
    double pace = 1.0;                     ///< duration of a step, of 0.8 s
    Eigen::Vector3d hand_error_m = Eigen::Vector3d::Zero();
    bool left_first = false;
    bool knows_hands = false;
    double right_reach_m = 9.0;  ///< ahead of the middle of the feet
  };

  FakeRobot(const Trouble& trouble, double x_m = 0.0)
      : trouble_(trouble), robot_(standing_robot({x_m, 0.0}, 0.0, 0.19, 0.6487)) {
    robot_.swing = trouble.left_first ? mocap::kLeft : mocap::kRight;
    robot_.hands_known = trouble.knows_hands;
  }

  const RobotFeedback& now() const { return robot_; }
  /// Feedback as reported.
  const RobotFeedback* feedback() {
    sent_.push_back(robot_);
    const auto late = static_cast<std::size_t>(trouble_.late_ticks);
    const std::size_t at = sent_.size() > late ? sent_.size() - 1 - late : 0;
    return &sent_[at];
  }

  void step(const BipedSequenceState& wish) {
    constexpr double kDt = 0.005, kStep = 0.8, kFixed = 0.2;
    for (const std::size_t side : {0u, 1u}) {
      if (!wish.hand[side]) continue;
      robot_.hand_W_m[side] = wish.hand[side]->p_W_m + trouble_.hand_error_m;
    }
    robot_.hand_W_m[1].x() =
        std::min(robot_.hand_W_m[1].x(), robot_.pelvis_W_m.x() + trouble_.right_reach_m);
    const double step_s = kStep * trouble_.pace;
    if (!robot_.moves()) {
      if (wish.stands) return;
      robot_.gait = RobotGait::starting;
      robot_.to_landing_s = step_s + 0.8;
      more_ = 2;
    }
    if (robot_.to_landing_s < step_s) {
      if (robot_.gait == RobotGait::starting) robot_.gait = RobotGait::walking;
    }
    if (wish.stands) {
      if (robot_.gait == RobotGait::walking) robot_.gait = RobotGait::stopping;
    } else if (robot_.gait == RobotGait::stopping) {
      robot_.gait = RobotGait::walking;
      more_ = 2;
    }
    if (robot_.to_landing_s > kFixed) {
      robot_.landing = robot_.feet[robot_.swing];
      for (const auto& l : wish.landing) {
        if (l && l->side == robot_.swing) {
          robot_.landing = *l;
          break;
        }
      }
    }
    robot_.to_landing_s -= kDt;
    if (robot_.to_landing_s <= 1e-9) land(step_s);
    robot_.pelvis_W_m.head<2>() = 0.5 * (robot_.feet[0].p_W_m + robot_.feet[1].p_W_m);
  }
  std::vector<SolePrint> landed;

 private:
  void land(double step_s) {
    const double sign = robot_.swing == mocap::kLeft && !trouble_.same_way ? -1.0 : 1.0;
    SolePrint print = robot_.landing;
    print.p_W_m += sign * Eigen::Vector2d(trouble_.along_m, trouble_.across_m);
    robot_.feet[robot_.swing] = print;
    landed.push_back(print);
    ++robot_.steps;
    robot_.swing = robot_.swing == mocap::kLeft ? mocap::kRight : mocap::kLeft;
    robot_.to_landing_s = step_s;
    if (robot_.gait == RobotGait::stopping && --more_ == 0) {
      robot_.gait = RobotGait::standing;
      robot_.to_landing_s = 0.0;
    }
  }

  Trouble trouble_;
  RobotFeedback robot_;
  std::vector<RobotFeedback> sent_;
  int more_ = 2;  // steps until it stands, after the order to stop
};

/// A drawer that is held and emptied by hands that come near enough.
class FakeDrawer {
 public:
  FakeDrawer(double front_m, double depth_m) : front_(front_m), depth_(depth_m) { show(); }
  const DrawerSeen* seen() const { return &seen_; }
  void jump(double by_m) {
    front_ += by_m;
    seen_.held = false;
    seen_.opened_m = 0.0;
    show();
  }
  void step(const FakeRobot& walker, const BipedSequenceState& wish) {
    const auto at = [&](std::size_t side, const Eigen::Vector3d& p) {
      return wish.hand[side] && wish.hand[side]->share > 0.95 && wish.hand[side]->closes &&
             (walker.now().hand_W_m[side] - p).norm() < near_m;
    };
    if (at(0, seen_.handle_W_m)) seen_.held = true;
    if (!wish.hand[0]) seen_.held = false;
    if (seen_.held) {
      seen_.opened_m = std::clamp(front_ - walker.now().hand_W_m[0].x(), 0.0, 0.40);
    }
    show();
    if (!seen_.taken && seen_.opened_m > taken_from_m && at(1, seen_.object_W_m)) {
      seen_.taken = true;
      reach_error_m = (walker.now().hand_W_m[1] - seen_.object_W_m).norm();
    }
  }
  double near_m = 0.030, reach_error_m = 1.0;
  double taken_from_m = 0.15;  ///< opening at which the object can be taken

 private:
  void show() {
    seen_.front_W_m = {front_, 0.0};
    seen_.handle_W_m = {front_ - seen_.opened_m, 0.14, 0.92};
    seen_.object_W_m = {front_ - seen_.opened_m + depth_, 0.0, 0.90};
  }
  double front_, depth_;
  DrawerSeen seen_;
};

inline const BipedDrawer& drawer() { return biped_drawer(); }

struct Outcome {
  bool done = false;
  std::string refused;
  double time_s = 0.0, final_m = 0.0, reach_error_m = 0.0, most_speed = 0.0, most_rate_jump = 0.0,
         sum_of_q = 0.0, opened_m = 0.0;
  bool stands = false, hands = false;
  int actions = 0;
  std::vector<PlannedAction> history;
  std::vector<SolePrint> landed;
};

struct Scene {
  double front_m = 1.9, depth_m = 0.2;
  FakeRobot::Trouble trouble = {};
  double jump_at_s = -1.0, jump_m = 0.0;
  bool feedback = true, seen = true;
};

inline Outcome play(const Scene& scene) {
  Outcome out;
  FakeRobot walker(scene.trouble);
  FakeDrawer furniture(scene.front_m, scene.depth_m);
  auto sequence =
      BipedDrawerSequence::start(drawer(), {{scene.front_m, 0.0}, scene.depth_m}, walker.now());
  if (!sequence) {
    out.refused = sequence.error().reason;
    return out;
  }
  Eigen::VectorXd before;
  bool jumped = scene.jump_at_s < 0.0;
  const BipedSequenceState* state = &sequence->state();
  for (; out.time_s < 40.0 && !state->done; out.time_s += 0.005) {
    if (!jumped && out.time_s >= scene.jump_at_s) {
      furniture.jump(scene.jump_m);
      jumped = true;
      if (!scene.seen) {
        sequence->set_task({{scene.front_m + scene.jump_m, 0.0}, scene.depth_m});
      }
    }
    state = &sequence->step(scene.feedback ? walker.feedback() : nullptr,
                            scene.seen ? furniture.seen() : nullptr);
    walker.step(*state);
    furniture.step(walker, *state);
    if (before.size() > 0) {
      const Eigen::VectorXd share = state->dq.cwiseAbs().cwiseQuotient(drawer().upper.max_speed());
      out.most_speed = std::max(out.most_speed, share.maxCoeff());
      out.most_rate_jump = std::max(out.most_rate_jump, (state->dq - before).cwiseAbs().maxCoeff());
    }
    before = state->dq;
    out.sum_of_q += state->q.sum();
  }
  out.done = state->done;
  out.opened_m = state->opened_m;
  out.refused = state->refused;
  out.final_m = scene.front_m + (scene.jump_at_s < 0.0 ? 0.0 : scene.jump_m) -
                0.5 * (walker.now().feet[0].p_W_m.x() + walker.now().feet[1].p_W_m.x());
  out.reach_error_m = furniture.reach_error_m;
  out.actions = state->number + 1;
  out.history = sequence->history();
  out.landed = walker.landed;
  out.stands = state->stands && !walker.now().moves();
  out.hands = state->hand[0].has_value() || state->hand[1].has_value();
  return out;
}

}  // namespace mimesis::synthesizer::testing
