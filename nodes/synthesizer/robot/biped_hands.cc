#include <algorithm>
#include <cmath>

#include "nodes/synthesizer/character/smooth.h"
#include "nodes/synthesizer/robot/biped_sequence.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Vector3d;
// Shares of an action at which events happen; as people did in the trials.
constexpr double kLeftReaches = 0.30;  // share of action 2 until its end
constexpr double kRightReaches = 0.20, kRightArrives = 0.95;
constexpr double kLeastReach_s = 0.8, kLetGo_s = 0.6;
// A hand leaves a drawer that came too near: so far before its front and above its handle.
constexpr double kLeave_s = 0.8, kLeave_m = 0.07, kLeaveUp_m = 0.04;
constexpr double kTurn_s = 0.4;  // braking time of a hand that turns back
// jump of a target, and rate at which a hand follows
constexpr double kJump_m = 0.02, kFollow_1_s = 10.0;
constexpr double kLead_1_s = 1.5, kMostLead_m = 0.04;
constexpr double kGrip_m = 0.005, kGrip_s = 0.1;  // distance and time after which a hand grips
constexpr double kThere = 0.95, kAtIt = 0.995;    // share of a reach
constexpr double kEdge_m = 0.10;                  // over the edge of the drawer, not through it
// A hand is so far above the object's height from this far before the drawer's front on until it is
// near the object, and comes down there.
constexpr double kOver_m = 0.08, kBefore_m = 0.10, kRise_m = 0.12, kDown_m = 0.07;
// A hand that has nothing after this time goes aside, by so much, at least for a while.
constexpr double kMissed_s = 0.8, kAside_m = 0.12, kAside_s = 0.5;
constexpr double kFreshSight_s = 0.12;
constexpr double kGripper_rad_s = 2.0;
constexpr double kSteady_s = 0.15;  // mean of the opening that is seen
// The right arm may be too short for the object in a drawer that is open as in the trials.
// rate of drawing the hand to its missing distance, and limit beyond the trials
constexpr double kDraw_1_s = 2.0, kMostDrawn_m = 0.08;

}  // namespace

void BipedDrawerSequence::start_hands() {
  const double share = state_.phase_rad / math::kTwoPi;
  if (halted_) return;
  const bool stands = state_.action == kStanding;
  // on its way back the robot is still too near for its arms
  const bool last = state_.action == kReachingStep && plan_.steps.size() <= 2 && !leads_back(0);
  const auto start = [&](mocap::Side side, double duration_s) {
    hand_[side].started = true;
    hand_[side].leaves = false;
    turn_hand(side, true, std::max(kLeastReach_s, duration_s));
  };
  if (!hand_[mocap::kLeft].started && (stands || (last && share >= kLeftReaches))) {
    start(mocap::kLeft, stands ? 0.0 : (1.0 - share) * 2.0 * options_.step_s);
  }
  if (!hand_[mocap::kRight].started && stands && share >= kRightReaches) {
    start(mocap::kRight, (kRightArrives - share) * drawer_->actions.ranges().standing_s);
  }
}

/// The reach of eq. 3.12 turns at once; the hand keeps its speed and brakes.
void BipedDrawerSequence::turn_hand(mocap::Side side, bool to_target, double duration_s) {
  Hand& hand = hand_[side];
  const auto rate = [&] {
    ArmReach soon = hand.reach;
    soon.step(options_.dt_s);
    const double left = faded(0.0, hand.turn_rate_1_s, hand.turned_s, kTurn_s),
                 left_soon = faded(0.0, hand.turn_rate_1_s, hand.turned_s + options_.dt_s, kTurn_s);
    return (soon.share() + left_soon - hand.reach.share() - left) / options_.dt_s;
  };
  const double before = rate();
  hand.reach.start(to_target, duration_s);
  hand.turn_rate_1_s = 0.0;
  hand.turn_rate_1_s = before - rate();
  hand.turned_s = 0.0;
}

double BipedDrawerSequence::share_of(mocap::Side side) const {
  const Hand& hand = hand_[side];
  const double turning = faded(0.0, hand.turn_rate_1_s, hand.turned_s, kTurn_s);
  return std::clamp(hand.reach.share() + turning, 0.0, 1.0);
}

/// Hands go back to where the arms have them; the drawer is let be. One that has come through its
/// handle or over its front (`too_near`) would be caught behind it: such hands leave it first.
void BipedDrawerSequence::release(bool too_near) {
  for (const mocap::Side side : {mocap::kLeft, mocap::kRight}) {
    Hand& hand = hand_[side];
    if (hand.started && too_near) {
      hand.leaves = true;
      hand.leaves_s = kLeave_s;
    } else if (hand.started) {
      turn_hand(side, false, kLetGo_s);
    }
    hand.started = hand.closes = false;
    hand.missed_s = 0.0;
    hand.aside_s = -1.0;
  }
  state_.opened_m = 0.0;
}

/// A closed hand that holds nothing hides where its target has gone: it opens beside it, and comes
/// back once the target has been seen.
void BipedDrawerSequence::look_again(const DrawerSeen* seen) {
  for (const mocap::Side side : {mocap::kLeft, mocap::kRight}) {
    Hand& hand = hand_[side];
    const bool has = seen == nullptr || (side == mocap::kLeft ? seen->held : seen->taken);
    hand.missed_s = hand.closes && !has ? hand.missed_s + options_.dt_s : 0.0;
    if (hand.missed_s > kMissed_s) {
      hand.missed_s = hand.aside_s = 0.0;
      hand.closes = false;
    }
    if (hand.aside_s < 0.0) continue;
    hand.aside_s += options_.dt_s;
    const bool sees = seen == nullptr || seen->age_s[side] < kFreshSight_s;
    if (hand.aside_s > kAside_s && sees) hand.aside_s = -1.0;
  }
}

void BipedDrawerSequence::move_hands(const DrawerSeen* seen) {
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  X_WB.linear() = Eigen::AngleAxisd(robot_.heading_rad, Vector3d::UnitZ()).toRotationMatrix();
  X_WB.translation() = robot_.pelvis_W_m;
  kinematics_.update(X_WB, state_.q);

  const Drawer& drawer = drawer_->drawer;
  const double share = state_.phase_rad / math::kTwoPi;
  const bool holds = seen != nullptr ? seen->held : share_of(mocap::kLeft) > kThere;
  if (state_.action == kStanding && hand_[mocap::kLeft].started && holds) {
    state_.opened_m =
        std::max(state_.opened_m, drawer.pull_m * minimum_jerk(share, kPullFrom, kPullTo));
  }
  const Vector3d way(std::cos(heading_), std::sin(heading_), 0.0);
  if (seen != nullptr) {
    const double share_of_dt = 1.0 - std::exp(-options_.dt_s / kSteady_s);
    opened_off_m_ += share_of_dt * (seen->opened_m - state_.opened_m - opened_off_m_);
    if (holds && !seen->taken) draw_on(steady_object(*seen, way), way);
  }
  const Vector3d left(-std::sin(heading_), std::cos(heading_), 0.0);
  Vector3d front;
  front << task_.front_W_m, 0.0;
  Vector3d handle = front + drawer.handle_lateral_m * left;
  handle.z() = drawer.handle_height_m;
  Vector3d object = front + (task_.object_depth_m - state_.opened_m) * way;
  object.z() = drawer.object_height_m;
  if (seen != nullptr) {
    handle = seen->handle_W_m + seen->opened_m * way;
    object = seen->taken ? hand_[mocap::kRight].last_target_m : steady_object(*seen, way);
  }
  const auto aside = [&](mocap::Side side) -> Vector3d {
    const double by_m = side == mocap::kLeft ? kAside_m : -kAside_m;
    return hand_[side].aside_s < 0.0 ? Vector3d::Zero() : Vector3d(by_m * left);
  };
  std::array<Vector3d, 2> target{handle - state_.opened_m * way + aside(mocap::kLeft),
                                 object + aside(mocap::kRight)};
  for (const mocap::Side side : {mocap::kLeft, mocap::kRight}) {
    Hand& hand = hand_[side];
    if (!hand.leaves) continue;
    target[side] -= (way.dot(target[side] - handle) + kLeave_m) * way;
    target[side].z() += kLeaveUp_m;
    hand.leaves_s -= options_.dt_s;
    if (hand.leaves_s <= 0.0 && hand.leaves_s > -options_.dt_s) turn_hand(side, false, kLetGo_s);
    hand.leaves = hand.leaves_s > -kLetGo_s;
  }
  move_hand(mocap::kLeft, target[mocap::kLeft], 0.0);
  move_hand(mocap::kRight, target[mocap::kRight], kEdge_m);
  if (state_.hand[mocap::kRight] && !(seen != nullptr && seen->taken)) {
    Vector3d& p = state_.hand[mocap::kRight]->p_W_m;
    const double open = seen != nullptr ? seen->opened_m : state_.opened_m;
    p.z() = over_front(on_way(p.head<2>()).x(), p.z(), handle - open * way, object);
  }
}

/// The object in a drawer that is open as wished, corrected by the mean difference over some time.
/// A left hand that shakes shakes the object too: a right hand that followed it at once would reach
/// with the trunk, and shake the left one through it.
Vector3d BipedDrawerSequence::steady_object(const DrawerSeen& seen, const Vector3d& way) const {
  return seen.object_W_m + (seen.opened_m - state_.opened_m - opened_off_m_) * way;
}

/// A right hand at its end that still lacks something to the object: the left one pulls on.
void BipedDrawerSequence::draw_on(const Vector3d& object_W_m, const Vector3d& way) {
  const bool over = state_.action == kStanding && state_.phase_rad >= math::kTwoPi * (1.0 - 1e-9);
  const Hand& right = hand_[mocap::kRight];
  if (!over || !robot_.hands_known || share_of(mocap::kRight) < kAtIt || right.closes) return;
  const double lacks = way.dot(object_W_m - robot_.hand_W_m[mocap::kRight]);
  const double most = drawer_->drawer.pull_m + kMostDrawn_m;
  state_.opened_m =
      std::clamp(state_.opened_m + options_.dt_s * kDraw_1_s * lacks, state_.opened_m, most);
}

/// p = p_joints + x (target − p_joints) [M18 eq. 3.12], in an arc; a target that jumps is followed
/// within tenths of a second.
void BipedDrawerSequence::move_hand(mocap::Side side, const Vector3d& target, double over_m) {
  Hand& hand = hand_[side];
  hand.reach.step(options_.dt_s);
  hand.turned_s += options_.dt_s;
  const double x = share_of(side);
  if (hand.has_target && (target - hand.last_target_m).norm() > kJump_m) {
    hand.gap_m += hand.last_target_m - target;
  }
  hand.last_target_m = target;
  hand.has_target = true;
  // ë + 2λė + λ²e = 0, exactly
  const double decay = std::exp(-kFollow_1_s * options_.dt_s);
  const Vector3d a = hand.gap_rate + kFollow_1_s * hand.gap_m;
  hand.gap_m = decay * (hand.gap_m + options_.dt_s * a);
  hand.gap_rate = decay * a - kFollow_1_s * hand.gap_m;
  if (x <= 0.0) {
    hand.near_s = 0.0;
    hand.gap_m.setZero();
    hand.gap_rate.setZero();
    hand.led_m.setZero();
    state_.hand[side].reset();
    return;
  }
  const Vector3d p_joints =
      kinematics_.X_WL(wrist_[side]) * drawer_->figure.hand_m[static_cast<std::size_t>(side)];
  const Vector3d goal = target + hand.gap_m;
  if (robot_.hands_known && x > kThere) {
    hand.led_m += options_.dt_s * kLead_1_s * (goal - robot_.hand_W_m[side]);
    if (hand.led_m.norm() > kMostLead_m) hand.led_m *= kMostLead_m / hand.led_m.norm();
  }
  const bool near = x > kAtIt && hand.gap_m.norm() < kGrip_m && hand.aside_s < 0.0 &&
                    (!robot_.hands_known || (goal - robot_.hand_W_m[side]).norm() < kGrip_m);
  hand.near_s = near ? hand.near_s + options_.dt_s : 0.0;
  if (hand.started && hand.near_s >= kGrip_s) hand.closes = true;
  Vector3d p = p_joints + x * (goal + hand.led_m - p_joints);
  p.z() += 4.0 * x * (1.0 - x) * over_m;
  state_.hand[side] = HandWish{p, std::clamp(10.0 * x, 0.0, 1.0), hand.closes};
}

/// Height of a hand that passes over a front to an object; `along_m`: of the hand, on the way.
double BipedDrawerSequence::over_front(double along_m, double z_m, const Vector3d& front,
                                       const Vector3d& object) const {
  const double edge = on_way(front.head<2>()).x(), at = on_way(object.head<2>()).x();
  const double risen = minimum_jerk(along_m, edge - kBefore_m - kRise_m, edge - kBefore_m),
               sunk = minimum_jerk(along_m, at - kDown_m, at - 0.2 * kDown_m);
  constexpr double kFree_m = 0.3, kSoft_m = 0.01;
  const double least = object.z() + kOver_m - kFree_m * (1.0 - risen) - (kOver_m + 0.1) * sunk;
  const double off = z_m - least;  // the larger one, without a kink
  return least + 0.5 * (off + std::sqrt(off * off + kSoft_m * kSoft_m));
}

void BipedDrawerSequence::move_grippers() {
  const double turn = kGripper_rad_s * options_.dt_s;
  for (Hand& hand : hand_) {
    if (hand.gripper < 0) continue;
    const double wished = !hand.started ? rows_[hand.gripper]
                          : hand.closes ? hand.closed_rad
                                        : hand.open_rad;
    if (state_.time_s <= options_.dt_s) hand.gripper_rad = rows_[hand.gripper];
    hand.gripper_rad += std::clamp(wished - hand.gripper_rad, -turn, turn);
    rows_[hand.gripper] = hand.gripper_rad;
  }
}

}  // namespace mimesis::synthesizer
