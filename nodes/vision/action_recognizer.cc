#include "nodes/vision/action_recognizer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace mimesis::vision {

using Eigen::Vector2d;

constexpr int kMovedPictures = 3;  // a single one may show something else in the object's colour

template <class T>
void ActionRecognizer::Ballot<T>::vote(T value, double weight) {
  if (symbol.value != T::unknown) return;
  if (value == T::unknown) {
    ++abstained;
    return;
  }
  (value == first ? votes_first : votes_second) += weight;
}

template <class T>
void ActionRecognizer::Ballot<T>::settle(double needed, double agreement) {
  if (symbol.value != T::unknown) return;
  const double most = std::max(votes_first, votes_second);
  if (most < needed) return;
  const double share = most / (votes_first + votes_second);
  if (share < agreement) return;
  symbol = {votes_first > votes_second ? first : second, share, {}};
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
    moved_ = 0;
    stage_ = Stage::carried;
    if (grip_.symbol.value == Grip::unknown) grip_.symbol = facing_.symbol;
    for (const GripVote& vote : last_votes_) hold(vote);
  }
  if (stage_ == Stage::carried) {
    judge_held(sight);
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
    color_.vote(color);
    color_.settle(limits_.grip_votes, limits_.agreement);
  }
}

std::optional<Grip> ActionRecognizer::grip_at(const std::optional<double>& angle_rad) const {
  if (!angle_rad) return std::nullopt;
  const double beyond = *angle_rad - std::numbers::pi / 4.0;
  if (std::abs(beyond) < limits_.undecided_rad) return Grip::unknown;
  return beyond > 0.0 ? Grip::full : Grip::precision;
}

ActionRecognizer::GripVote ActionRecognizer::vote_of(const Sight& sight) const {
  return {grip_at(angle_), grip_at(sight.facing_angle_rad)};
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
    last_votes_.clear();
    near_ = 0;
    left_after_grip_ = false;
  }
  const GripVote vote = vote_of(sight);
  last_votes_.push_back(vote);
  if (static_cast<int>(last_votes_.size()) > limits_.held_votes) last_votes_.pop_front();
  if (vote.palm) grip_.vote(*vote.palm);
  if (vote.facing) facing_.vote(*vote.facing);
  grip_.settle(limits_.grip_votes, limits_.agreement);
  facing_.settle(limits_.grip_votes, limits_.agreement);
  if (++near_ > 3 * limits_.grip_votes && grip_.symbol.value == Grip::unknown)
    grip_.symbol = facing_.symbol;
}

void ActionRecognizer::hold(const GripVote& vote) {
  if (vote.palm) held_.vote(*vote.palm);
  if (vote.facing) held_facing_.vote(*vote.facing);
}

/// From the last pictures before the object moves until it is beside the bar, which hides the hand.
void ActionRecognizer::judge_held(const Sight& sight) {
  if (held_over_) return;
  const bool before =
      !sight.bar || !sight.object || sight.object->x() < sight.bar->x() - limits_.bar_zone_m;
  if (!before) return end_held();
  if (!hand_away_ && sight.palm && sight.object) hold(vote_of(sight));
}

void ActionRecognizer::end_held() {
  if (std::exchange(held_over_, true)) return;
  Ballot<Grip> held = held_;
  held.settle(limits_.held_votes, limits_.agreement);
  Symbol<Grip>& told = grip_.symbol;
  if (told.value == Grip::unknown) told = held.symbol;
  if (told.value == Grip::unknown) {
    Ballot<Grip> facing = held_facing_;
    facing.settle(limits_.held_votes, limits_.agreement);
    told = facing.symbol;
  }
  const bool other = held.symbol.value != Grip::unknown && held.symbol.value != told.value;
  const double votes = held.votes_first + held.votes_second;
  if (other && held.symbol.confidence >= limits_.overrule && votes >= 2 * limits_.held_votes)
    told = held.symbol;  // the hand had hovered
  if (told.value != Grip::unknown) return;
  const int seen = static_cast<int>(std::lround(votes)) + held.abstained;
  if (seen < limits_.held_votes) {
    told.why_not = fmt::format("{} pictures show the palm at the object, expected {} or more", seen,
                               limits_.held_votes);
  } else if (held.abstained > votes) {
    told.why_not = fmt::format("in {} of {} pictures the palm is turned between both grips",
                               held.abstained, seen);
  } else {
    told.why_not = fmt::format("{:.0f} pictures show the palm from above, {:.0f} from the side",
                               held.votes_first, held.votes_second);
  }
}

/// Each picture counts by the way that the object went in the bar's zone since the last one.
void ActionRecognizer::judge_transport(const Sight& sight) {
  if (!sight.bar || !sight.object) return;
  const double zone = limits_.bar_zone_m, beyond = sight.object->x() - sight.bar->x();
  const auto within = [zone](double x) { return std::clamp(x, -zone, zone); };
  const double way = beyond_ ? std::abs(within(beyond) - within(*beyond_)) : 0.0;
  beyond_ = beyond;
  if (beyond < -zone && transport_.symbol.value == Transport::unknown) {  // or it went back
    transport_.clear();
    passed_m_ = beside_m2_ = beside_way_m_ = 0.0;
  }
  if (way > 0.0 && beyond > -zone) {
    passed_m_ += way;
    if (sight.beside_m) {
      beside_m2_ += way * *sight.beside_m;
      beside_way_m_ += way;
    }
    // Wrist and object are on the same side of the bar; the nearer of the two decides.
    const double object = sight.object->y() - sight.bar->y();
    const auto& hand = sight.wrist ? sight.wrist : sight.palm;
    const double wrist = hand ? hand->y() - sight.bar->y() : object;
    Transport transport = Transport::unknown;
    if (std::min(object, wrist) > limits_.bar_margin_m) transport = Transport::above;
    if (std::max(object, wrist) < -limits_.bar_margin_m) transport = Transport::below;
    transport_.vote(transport, way);
  }
  if (sight.bar_half_m) bar_half_m_ = sight.bar_half_m;
  if (beyond > zone) settle_transport();
}

void ActionRecognizer::settle_transport() {
  Symbol<Transport>& told = transport_.symbol;
  if (told.value != Transport::unknown || !told.why_not.empty()) return;
  const double beside = beside_way_m_ > 0.0 ? std::abs(beside_m2_ / beside_way_m_) : 0.0;
  const double past_end = bar_half_m_ ? beside - *bar_half_m_ : -1.0;
  if (passed_m_ < limits_.passage_m) {
    told.why_not = "the object was not seen to pass the bar";
  } else if (past_end > limits_.end_margin_m) {
    told.why_not = fmt::format(
        "the object was carried around the end of the bar, {:.0f} mm past it", 1e3 * past_end);
  } else if (past_end > -limits_.end_margin_m) {
    told.why_not = "the object passed the end of the bar too near to tell on which side";
  } else {
    transport_.settle(limits_.passage_m, limits_.agreement);
    if (told.value == Transport::unknown)
      told.why_not = fmt::format(
          "of {:.0f} mm beside the bar {:.0f} are above, {:.0f} below, the rest at its height",
          1e3 * passed_m_, 1e3 * transport_.votes_first, 1e3 * transport_.votes_second);
  }
}

void ActionRecognizer::judge_goal(const Sight& sight) {
  const auto distance = [&](const std::optional<Vector2d>& goal) {
    return goal ? (*sight.object - *goal).norm() : INFINITY;
  };
  const double high = distance(sight.goal_high), low = distance(sight.goal_low);
  const double near = std::min(high, low);
  if (near > limits_.goal_radius_m) {
    goal_.symbol.why_not =
        !hand_away_ ? ""
        : std::isfinite(near)
            ? fmt::format("the object rests {:.0f} mm from the nearest goal", 1e3 * near)
            : "no goal is seen";
    return;
  }
  goal_.symbol.why_not.clear();
  goal_.symbol.value = high < low ? Goal::high : Goal::low;
  const double other = std::max(high, low);
  goal_.symbol.confidence = std::isfinite(other) ? 1.0 - near / other : 0.5;
  stage_ = Stage::placed;
  placed_ = *sight.object;
  end_held();
  if (sight.bar) return settle_transport();
  if (transport_.symbol.value == Transport::unknown) transport_.symbol.why_not = "no bar is seen";
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
  for (Ballot<Grip>* each : {&grip_, &facing_, &held_, &held_facing_}) each->clear();
  last_votes_.clear();
  held_over_ = false;
  near_ = moved_ = 0;
  beyond_.reset();
  passed_m_ = beside_m2_ = beside_way_m_ = 0.0;
  transport_.clear();
  goal_.clear();
  color_.clear();
  complete_ = false;
  left_after_grip_ = false;
  away_frames_ = 0;
}

}  // namespace mimesis::vision
