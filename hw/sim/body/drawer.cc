#include "hw/sim/body/drawer.h"

#include <algorithm>
#include <cmath>

namespace mimesis::hw::sim {
namespace {

using Eigen::Vector3d;

/// Friction grows to its value over this speed: steeper, it would chatter at the ticks of a hand.
constexpr double kFrictionFrom_m_s = 0.05;
constexpr double kSpeedFilter_s = 0.02;
constexpr double kEndStop_n_m = 2000.0;
constexpr double kJump_m_s = 1.0;

}  // namespace

// The handle is a bow that stands off the panel as far as fingers reach behind it; the tray is open
// above, and its rim leaves the object's upper part free.
std::array<Board, 4> boards(const DrawerSettings& s) {
  constexpr double kStandOff_m = 0.07, kPanel_m = 0.015, kHalfWidth_m = 0.28, kLong_m = 0.45;
  constexpr double kRimBelowObject_m = 0.06, kTray_m = 0.09, kGap_m = 0.02;
  const double rim = s.object_height_m - kRimBelowObject_m, floor = rim - kTray_m;
  const double inside = kStandOff_m + kPanel_m, end = kStandOff_m + kLong_m;
  const Vector3d handle(0.0, s.handle_left_m, s.handle_height_m), bow(0.01, 0.05, 0.01);
  return {
      {{"cabinet",
        {kStandOff_m, -kHalfWidth_m, 0.0},
        {end + kGap_m, kHalfWidth_m, floor - kGap_m},
        false,
        false},
       {"panel", {kStandOff_m, -kHalfWidth_m, floor}, {inside, kHalfWidth_m, rim}, true, false},
       {"tray", {inside, -kHalfWidth_m, floor}, {end, kHalfWidth_m, floor + kPanel_m}, true, false},
       {"handle", handle - bow, handle + bow, true, true}}};
}

Drawer::Drawer(const DrawerSettings& settings)
    : settings_(settings),
      axis_W_(std::cos(settings.yaw_rad), std::sin(settings.yaw_rad), 0.0),
      left_W_(-axis_W_.y(), axis_W_.x(), 0.0) {
  std::stable_sort(settings_.jumps.begin(), settings_.jumps.end(),
                   [](const DrawerJump& a, const DrawerJump& b) { return a.at_s < b.at_s; });
  show({});
}

Vector3d Drawer::place(double depth_m, double left_m, double height_m) const {
  return Vector3d(settings_.front_x_m, settings_.front_y_m, height_m) +
         (depth_m - now_.opened_m) * axis_W_ + left_m * left_W_;
}

void Drawer::jump(double time_s, double dt_s) {
  while (jumped_ < settings_.jumps.size() && time_s >= settings_.jumps[jumped_].at_s) {
    to_go_m_ += settings_.jumps[jumped_].by_m;
    closes_ = true;
    ++jumped_;
  }
  if (to_go_m_ == 0.0 && !closes_) return;
  lose();
  const double most_m = kJump_m_s * dt_s, by_m = std::clamp(to_go_m_, -most_m, most_m);
  to_go_m_ -= by_m;
  settings_.front_x_m += by_m * axis_W_.x();
  settings_.front_y_m += by_m * axis_W_.y();
  now_.opened_m = std::max(0.0, now_.opened_m - most_m);
  closes_ = now_.opened_m > 0.0;
}

void Drawer::lose() {
  lost_ = lost_ || now_.held;
  now_.held = false;
  near_s_.fill(0.0);
}

void Drawer::grip(robot::Side side, double dt_s, const DrawerHands& hands) {
  const bool left = side == robot::kLeft;
  bool& has = left ? now_.held : now_.taken;
  if (!hands.grips[side]) {
    near_s_[side] = 0.0;
    if (left) has = lost_ = false;  // the object stays with the hand that took it
    return;
  }
  if (has || (left && lost_)) return;
  const Vector3d away = hands.p_W_m[side] - (left ? now_.handle_W_m : now_.object_W_m);
  const double distance = away.norm();
  near_s_[side] = distance <= settings_.near_m ? near_s_[side] + dt_s : 0.0;
  if (near_s_[side] <= 0.0 || near_s_[side] < settings_.dwell_s - 1e-9) return;
  has = true;
  error_m_[side] = distance;
  if (!left) return;
  handle_to_hand_W_m_ = away;
  hand_m_ = axis_W_.dot(hands.p_W_m[side]);
  speed_m_s_ = 0.0;
}

Vector3d Drawer::follow(double dt_s, const Vector3d& hand_W_m) {
  const double hand_m = axis_W_.dot(hand_W_m);
  const double share = 1.0 - std::exp(-dt_s / kSpeedFilter_s);
  speed_m_s_ += share * ((hand_m - hand_m_) / dt_s - speed_m_s_);
  hand_m_ = hand_m;
  // where the hand pulls it, and where the ends of the rail let it be
  const Vector3d pulled = hand_W_m - handle_to_hand_W_m_ - now_.handle_W_m;
  const double wanted = now_.opened_m - axis_W_.dot(pulled);
  now_.opened_m = std::clamp(wanted, 0.0, settings_.longest_m);
  const double stop = kEndStop_n_m * (wanted - now_.opened_m);
  if (std::abs(stop) > settings_.slips_n) {
    lose();
    return Vector3d::Zero();
  }
  const double rail = -settings_.friction_n * std::tanh(speed_m_s_ / kFrictionFrom_m_s) -
                      settings_.viscous_n_s_m * speed_m_s_;
  return std::clamp(rail + stop, -settings_.slips_n, settings_.slips_n) * axis_W_;
}

void Drawer::show(const DrawerHands& hands) {
  now_.front_W_m = {settings_.front_x_m, settings_.front_y_m, 0.0};
  now_.handle_W_m = place(0.0, settings_.handle_left_m, settings_.handle_height_m);
  now_.object_W_m = now_.taken ? hands.p_W_m[robot::kRight]
                               : place(settings_.object_depth_m, settings_.object_left_m,
                                       settings_.object_height_m);
}

Vector3d Drawer::step(double time_s, double dt_s, const DrawerHands& hands) {
  jump(time_s, dt_s);
  show(hands);
  Vector3d force = Vector3d::Zero();
  for (const robot::Side side : robot::kSides) {
    if (hands.p_W_m[side].allFinite()) grip(side, dt_s, hands);
  }
  if (now_.held && hands.p_W_m[robot::kLeft].allFinite() && dt_s > 0.0) {
    force = follow(dt_s, hands.p_W_m[robot::kLeft]);
  }
  show(hands);
  return force;
}

}  // namespace mimesis::hw::sim
