#include "nodes/walker/pattern/steps.h"

#include <algorithm>
#include <cmath>

#include "nodes/walker/pattern/swing_height.h"

namespace mimesis::walker {
namespace {

constexpr int kEndless = 1 << 28;
constexpr int kStopLandings = 2;

int ticks(double seconds) { return static_cast<int>(std::lround(seconds / kTick_s)); }

Eigen::Vector3d pose(const Footprint& foot) {
  return {foot.p_W_m.x(), foot.p_W_m.y(), foot.yaw_rad};
}

FootState on_ground(const PlanarState& s) {
  FootState foot;
  foot.X_WS.linear() = Eigen::AngleAxisd(s.p.z(), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  foot.X_WS.translation() = Eigen::Vector3d(s.p.x(), s.p.y(), 0.0);
  foot.v_W = Eigen::Vector3d(s.v.x(), s.v.y(), 0.0);
  foot.a_W = Eigen::Vector3d(s.a.x(), s.a.y(), 0.0);
  foot.yaw_rate_rad_s = s.v.z();
  foot.yaw_acceleration = s.a.z();
  return foot;
}

}  // namespace

PlanarState quintic(const PlanarState& s, const Eigen::Vector3d& goal, double D, double t) {
  if (t >= D) return {goal, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  const double u = t / D;
  const Eigen::Vector3d d = goal - s.p, v = D * s.v, a = D * D * s.a;
  const Eigen::Vector3d c3 = 10.0 * d - 6.0 * v - 1.5 * a, c4 = -15.0 * d + 8.0 * v + 1.5 * a,
                        c5 = 6.0 * d - 3.0 * v - 0.5 * a;
  PlanarState r;
  r.p = s.p + u * (v + u * (0.5 * a + u * (c3 + u * (c4 + u * c5))));
  r.v = (v + u * (a + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / D;
  r.a = (a + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / (D * D);
  return r;
}

Steps::Steps(const GaitSettings& s, Change change)
    : step_(ticks(s.step_s)),
      double_(ticks(s.double_support_s)),
      first_double_(ticks(s.first_double_support_s)),
      sample_(kSampleTicks),
      height_m_(s.step_height_m),
      change_(change) {
  const int swing = step_ - double_;
  lift_ = double_ + swing / 20;
  touch_ = step_ - swing / 7;
  reset({Footprint{kLeft, {0.0, s.feet_distance_m / 2.0}, 0.0},
         Footprint{kRight, {0.0, -s.feet_distance_m / 2.0}, 0.0}});
}

void Steps::reset(const std::array<Footprint, 2>& feet) {
  ground_ = feet;
  for (const Side side : robot::kSides) ground_[side].side = side;
  swing_ = kLeft;
  landed_ = 0;
  next_ = {ground_[kLeft], ground_[kRight], ground_[kLeft]};
  enter(Phase::kStand, -1);
}

void Steps::enter(Phase phase, int landings_left) {
  phase_ = phase;
  tick_ = 0;
  landings_left_ = landings_left;
  air_ = {pose(ground_[swing_]), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
}

void Steps::decide(bool walk, Side first_swing, bool settled) {
  switch (phase_) {
    case Phase::kStand:
    case Phase::kSettle:
      if (walk) {
        swing_ = first_swing;
        next_ = {ground_[swing_], ground_[robot::other(swing_)], ground_[swing_]};
        landed_ = 0;
        enter(Phase::kStart, -1);
      } else if (phase_ == Phase::kSettle && settled) {
        enter(Phase::kStand, -1);
      }
      break;
    case Phase::kStart:
      if (!walk && change_ == Change::kAtOnce) enter(Phase::kSettle, 0);
      break;
    case Phase::kStep:
      if (walk && (landings_left_ != 1 || change_ == Change::kAtOnce))
        landings_left_ = -1;
      else if (!walk && landings_left_ < 0)
        landings_left_ = kStopLandings;
      break;
  }
}

void Steps::plan(int ahead, const Footprint& landing) {
  Footprint& next = next_[static_cast<std::size_t>(ahead)];
  next = landing;
  next.side = ahead % 2 ? robot::other(swing_) : swing_;
}

int Steps::length() const {
  switch (phase_) {
    case Phase::kStart:
      return first_double_;
    case Phase::kStep:
      return step_;
    default:
      return kEndless;
  }
}

PlanarState Steps::swing_after(int n) const {
  const int from = std::max(tick_, lift_), to = tick_ + n;
  if (phase_ != Phase::kStep || to <= from) return air_;
  return quintic(air_, pose(next_[0]), kTick_s * std::max(1, touch_ - from), kTick_s * (to - from));
}

void Steps::advance(int n) {
  while (n >= length() - tick_) {
    n -= length() - tick_;
    finish_phase();
  }
  air_ = swing_after(n);
  tick_ += n;
}

void Steps::finish_phase() {
  if (phase_ == Phase::kStart) {
    enter(Phase::kStep, landings_left_);
    return;
  }
  ground_[swing_] = next_[0];
  ++landed_;
  swing_ = robot::other(swing_);
  next_ = {next_[1], next_[2], next_[1]};
  if (landings_left_ > 0) --landings_left_;
  enter(landings_left_ == 0 ? Phase::kSettle : Phase::kStep, landings_left_);
}

int Steps::ticks_to_sample() const { return sample_ - tick_ % sample_; }

Support Steps::support_after(int n) const {
  int alone = 0;
  if (phase_ != Phase::kStep) {
    if (n <= length() - tick_) return {.both = true};
    alone = (n - (length() - tick_) - 1) / step_;
  } else if (n > length() - tick_) {
    alone = 1 + (n - (length() - tick_) - 1) / step_;
  }
  if (landings_left_ >= 0 && alone >= landings_left_)
    return {.i = landings_left_ - 1, .j = landings_left_};
  return {.i = std::min(alone, 3), .j = std::min(alone, 3)};
}

double Steps::until_next_landing_s(double ahead_s) const {
  const int to_step = length() - tick_, n = ticks(ahead_s);
  if (n <= to_step && phase_ == Phase::kStep) return kTick_s * (to_step - n);
  return kTick_s * (step_ - 1 - (n - to_step - 1) % step_);
}

double Steps::free_time_s() const {
  if (phase_ != Phase::kStep) return 1e3;
  return kTick_s * std::max(0, touch_ - std::max(tick_, lift_));
}

double Steps::yaw_rad() const { return (air_.p.z() + stance().yaw_rad) / 2.0; }

Eigen::Vector2d Steps::middle_W_m() const {
  return (ground_[kLeft].p_W_m + ground_[kRight].p_W_m) / 2.0;
}

void Steps::describe(PatternSample& s) const {
  const PlanarState still{pose(stance()), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  s.foot[swing_] = on_ground(air_);
  s.foot[robot::other(swing_)] = on_ground(still);
  s.contact = {true, true};
  if (phase_ == Phase::kStep && tick_ > double_) {
    const double rate = 1.0 / (kTick_s * (step_ - double_));
    const SwingHeight height = swing_height((tick_ - double_) * kTick_s * rate);
    FootState& foot = s.foot[swing_];
    foot.X_WS.translation().z() = height_m_ * height.z;
    foot.v_W.z() = height_m_ * height.dz * rate;
    foot.a_W.z() = height_m_ * height.ddz * rate * rate;
    s.contact[swing_] = false;
  }
  s.yaw_rad = yaw_rad();
  s.yaw_rate_rad_s = air_.v.z() / 2.0;
  s.swing = swing_;
  s.since_change_s = tick_ * kTick_s;
  s.steps = landed_;
  s.landing = next_[0];
  s.to_landing_s = 0.0;
  switch (phase_) {
    case Phase::kStand:
      s.gait = Gait::kStanding;
      s.landing = ground_[swing_];
      break;
    case Phase::kSettle:
      s.gait = Gait::kStopping;
      s.landing = ground_[swing_];
      break;
    case Phase::kStart:
      s.gait = Gait::kStarting;
      s.to_landing_s = (length() - tick_ + step_) * kTick_s;
      break;
    case Phase::kStep:
      s.gait = landings_left_ < 0 ? Gait::kWalking : Gait::kStopping;
      s.to_landing_s = (length() - tick_) * kTick_s;
      break;
  }
}

void Steps::shift(const Eigen::Vector2d& d) {
  for (Footprint& foot : ground_) foot.p_W_m += d;
  for (Footprint& foot : next_) foot.p_W_m += d;
  air_.p.head<2>() += d;
}

}  // namespace mimesis::walker
