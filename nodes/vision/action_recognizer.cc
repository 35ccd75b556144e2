#include "nodes/vision/action_recognizer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mimesis::vision {

using Eigen::Vector2d;

constexpr int kMovedPictures = 3;  // a single one may show something else in the object's colour

template <class T>
void ActionRecognizer::Ballot<T>::vote(T value, int needed, double agreement) {
  if (symbol.value != T::unknown) return;
  if (value == T::unknown) {
    ++abstained;
    return;
  }
  ++(value == first ? votes_first : votes_second);
  settle(needed, agreement);
}

template <class T>
void ActionRecognizer::Ballot<T>::settle(int needed, double agreement) {
  if (symbol.value != T::unknown) return;
  const int most = std::max(votes_first, votes_second);
  if (most < needed) return;
  const double share = static_cast<double>(most) / (votes_first + votes_second);
  if (share < agreement) return;
  symbol = {votes_first > votes_second ? first : second, share};
}

void ActionRecognizer::update(const Sight& sight) {
  angle_.reset();
  const bool both = sight.object && sight.palm;
  const double distance = both ? (*sight.palm - *sight.object).norm() : INFINITY;
  if (distance < limits_.reach_m) angle_ = sight.palm_angle_rad;
  // Away: clearly farther than where a grasp begins, or out of view while the object is seen.
  hand_away_ = sight.object && distance > limits_.reach_m;
  away_frames_ = hand_away_ ? away_frames_ + 1 : 0;

  if (stage_ == Stage::waiting && grip_.symbol.value != Grip::unknown &&
      away_frames_ >= limits_.rest_frames) {
    left_after_grip_ = true;
  }

  const bool still = object_still(sight);
  if (still && hand_away_) remember_start(sight);
  if (stage_ == Stage::waiting) judge_grip(sight);
  const bool moved = stage_ == Stage::waiting && start_ && sight.object && !hand_away_ &&
                     (*sight.object - *start_).norm() > limits_.moved_m;
  moved_ = moved ? moved_ + 1 : 0;
  if (moved_ >= kMovedPictures) {
    stage_ = Stage::carried;
    if (grip_.symbol.value == Grip::unknown) grip_.symbol = facing_.symbol;
  }
  if (stage_ == Stage::carried) {
    judge_transport(sight);
    if (still) judge_goal(sight);
  }
  if (stage_ == Stage::placed && away_frames_ >= limits_.rest_frames) complete_ = true;
}

/// Where the object waits for a demonstration; also ends the one before.
void ActionRecognizer::remember_start(const Sight& sight) {
  const Vector2d& object = *sight.object;
  const bool before_bar = !sight.bar || object.x() < sight.bar->x() - limits_.moved_m;
  if (!before_bar || near_goal(object, sight)) return;
  // Without a bar, and with a stand that is out of sight, it may still be where it was put.
  if (stage_ == Stage::placed && (object - placed_).norm() < limits_.moved_m) return;
  if (stage_ != Stage::waiting) restart();
  start_ = object;
  if (sight.object_luma) {
    const double lighter = *sight.object_luma - limits_.light_luma;
    Color color = lighter > 0.0 ? Color::light : Color::dark;
    if (std::abs(lighter) < limits_.undecided_luma) color = Color::unknown;
    color_.vote(color, limits_.grip_votes, limits_.agreement);
  }
}

Grip ActionRecognizer::grip_at(double angle_rad) const {
  const double beyond = angle_rad - std::numbers::pi / 4.0;
  if (std::abs(beyond) < limits_.undecided_rad) return Grip::unknown;
  return beyond > 0.0 ? Grip::full : Grip::precision;
}

/// The palm's own orientation decides; after three times as many pictures as it needs, or once the
/// object moves, where the hand is.
void ActionRecognizer::judge_grip(const Sight& sight) {
  if (hand_away_ || !sight.palm || !sight.object || !start_ ||
      (*sight.object - *start_).norm() > limits_.moved_m)
    return;
  if (left_after_grip_) {  // only a grasp had been shown; this is the next demonstration
    grip_.clear();
    facing_.clear();
    near_ = 0;
    left_after_grip_ = false;
  }
  const auto& facing = sight.facing_angle_rad;
  if (angle_) grip_.vote(grip_at(*angle_), limits_.grip_votes, limits_.agreement);
  if (facing) facing_.vote(grip_at(*facing), limits_.grip_votes, limits_.agreement);
  if (++near_ > 3 * limits_.grip_votes && grip_.symbol.value == Grip::unknown)
    grip_.symbol = facing_.symbol;
}

void ActionRecognizer::judge_transport(const Sight& sight) {
  constexpr int kPassing = 2;  // pictures beside the bar that are enough once it is passed
  if (!sight.bar || !sight.object) return;
  const double beyond = sight.object->x() - sight.bar->x();
  if (beyond > limits_.bar_zone_m) transport_.settle(kPassing, limits_.agreement);
  if (std::abs(beyond) > limits_.bar_zone_m) return;
  // Wrist and object are on the same side of the bar; the nearer of the two decides.
  const double object = sight.object->y() - sight.bar->y();
  const auto& hand = sight.wrist ? sight.wrist : sight.palm;
  const double wrist = hand ? hand->y() - sight.bar->y() : object;
  Transport transport = Transport::unknown;
  if (std::min(object, wrist) > limits_.bar_margin_m) transport = Transport::above;
  if (std::max(object, wrist) < -limits_.bar_margin_m) transport = Transport::below;
  transport_.vote(transport, limits_.transport_votes, limits_.agreement);
}

void ActionRecognizer::judge_goal(const Sight& sight) {
  const auto distance = [&](const std::optional<Vector2d>& goal) {
    return goal ? (*sight.object - *goal).norm() : INFINITY;
  };
  const double high = distance(sight.goal_high), low = distance(sight.goal_low);
  const double near = std::min(high, low);
  if (near > limits_.goal_radius_m) return;
  goal_.symbol.value = high < low ? Goal::high : Goal::low;
  const double other = std::max(high, low);
  goal_.symbol.confidence = std::isfinite(other) ? 1.0 - near / other : 0.5;
  stage_ = Stage::placed;
  placed_ = *sight.object;
}

bool ActionRecognizer::object_still(const Sight& sight) {
  if (!sight.object) {
    trail_.clear();
    return false;
  }
  trail_.push_back(*sight.object);
  if (static_cast<int>(trail_.size()) <= limits_.rest_frames) return false;
  trail_.pop_front();
  return std::all_of(trail_.begin(), trail_.end(), [&](const Vector2d& p) {
    return (p - trail_.back()).norm() < limits_.still_m;
  });
}

bool ActionRecognizer::near_goal(const Vector2d& object, const Sight& sight) const {
  const auto near = [&](const std::optional<Vector2d>& goal) {
    return goal && (object - *goal).norm() < limits_.goal_radius_m;
  };
  return near(sight.goal_high) || near(sight.goal_low);
}

void ActionRecognizer::restart() {
  stage_ = Stage::waiting;
  grip_.clear();
  facing_.clear();
  near_ = 0;
  transport_.clear();
  goal_.clear();
  color_.clear();
  complete_ = false;
  left_after_grip_ = false;
  away_frames_ = 0;
}

}  // namespace mimesis::vision
