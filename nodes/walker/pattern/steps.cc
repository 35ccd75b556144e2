#include "nodes/walker/pattern/steps.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"

namespace mimesis::walker {
namespace {

constexpr double kRise = 0.42, kGlide = 0.2;  ///< shares of the swing's time; the fall is between
constexpr double kGlideHeight = 0.12;         ///< at the beginning of the glide
constexpr SwingHeight kTop{1.0, 0.0, -24.0};

/// State at time `t` on the polynomial of fifth degree that leads from one state to another in `D`
/// > 0.
SwingHeight between(const SwingHeight& from, const SwingHeight& to, double D, double t) {
  const double u = t / D, v = D * from.dz, a = D * D * from.ddz;
  const double p = to.z - from.z - v - 0.5 * a, q = D * to.dz - v - a, r = D * D * to.ddz - a;
  const double c3 = 10.0 * p - 4.0 * q + 0.5 * r, c4 = -15.0 * p + 7.0 * q - r,
               c5 = 6.0 * p - 3.0 * q + 0.5 * r;
  return {from.z + u * (v + u * (0.5 * a + u * (c3 + u * (c4 + u * c5)))),
          (v + u * (a + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / D,
          (a + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / (D * D)};
}

/// `left`: remaining share of the glide.
SwingHeight glide(double left) {
  return {kGlideHeight * left * left, -2.0 * kGlideHeight / kGlide * left,
          2.0 * kGlideHeight / (kGlide * kGlide)};
}

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

constexpr double kInside_m = 0.004;  // margin to the narrowest step and the limits

double clamp_to(double value, double most, bool& clipped) {
  clipped = clipped || std::abs(value) > most * (1.0 + 1e-12);
  return std::clamp(value, -most, most);
}

bool finite(const Footprint& foot) { return foot.p_W_m.allFinite() && std::isfinite(foot.yaw_rad); }

}  // namespace

SwingHeight swing_height(double u) {
  if (u < kRise) return between({}, kTop, kRise, std::max(0.0, u));
  if (u < 1.0 - kGlide) return between(kTop, glide(1.0), 1.0 - kGlide - kRise, u - kRise);
  if (u < 1.0) return glide((1.0 - u) / kGlide);
  return {};
}

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
  enter(Phase::stand, -1);
}

void Steps::enter(Phase phase, int landings_left) {
  phase_ = phase;
  tick_ = 0;
  landings_left_ = landings_left;
  air_ = {pose(ground_[swing_]), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
}

void Steps::decide(bool walk, Side first_swing, bool settled) {
  switch (phase_) {
    case Phase::stand:
    case Phase::settle:
      if (walk) {
        swing_ = first_swing;
        next_ = {ground_[swing_], ground_[robot::other(swing_)], ground_[swing_]};
        landed_ = 0;
        enter(Phase::start, -1);
      } else if (phase_ == Phase::settle && settled) {
        enter(Phase::stand, -1);
      }
      break;
    case Phase::start:
      if (!walk && change_ == Change::at_once) enter(Phase::settle, 0);
      break;
    case Phase::step:
      if (walk && (landings_left_ != 1 || change_ == Change::at_once))
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
    case Phase::start:
      return first_double_;
    case Phase::step:
      return step_;
    default:
      return kEndless;
  }
}

PlanarState Steps::swing_after(int n) const {
  const int from = std::max(tick_, lift_), to = tick_ + n;
  if (phase_ != Phase::step || to <= from) return air_;
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
  if (phase_ == Phase::start) {
    enter(Phase::step, landings_left_);
    return;
  }
  ground_[swing_] = next_[0];
  ++landed_;
  swing_ = robot::other(swing_);
  next_ = {next_[1], next_[2], next_[1]};
  if (landings_left_ > 0) --landings_left_;
  enter(landings_left_ == 0 ? Phase::settle : Phase::step, landings_left_);
}

int Steps::ticks_to_sample() const { return sample_ - tick_ % sample_; }

Support Steps::support_after(int n) const {
  int alone = 0;
  if (phase_ != Phase::step) {
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
  if (n <= to_step && phase_ == Phase::step) return kTick_s * (to_step - n);
  return kTick_s * (step_ - 1 - (n - to_step - 1) % step_);
}

double Steps::free_time_s() const {
  if (phase_ != Phase::step) return 1e3;
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
  if (phase_ == Phase::step && tick_ > double_) {
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
    case Phase::stand:
      s.gait = Gait::standing;
      s.landing = ground_[swing_];
      break;
    case Phase::settle:
      s.gait = Gait::stopping;
      s.landing = ground_[swing_];
      break;
    case Phase::start:
      s.gait = Gait::starting;
      s.to_landing_s = (length() - tick_ + step_) * kTick_s;
      break;
    case Phase::step:
      s.gait = landings_left_ < 0 ? Gait::walking : Gait::stopping;
      s.to_landing_s = (length() - tick_) * kTick_s;
      break;
  }
}

void Steps::shift(const Eigen::Vector2d& d) {
  for (Footprint& foot : ground_) foot.p_W_m += d;
  for (Footprint& foot : next_) foot.p_W_m += d;
  air_.p.head<2>() += d;
}

Side first_swing(const FeasibleWish& wish) {
  if (wish.landing[0]) return wish.landing[0]->side;
  const double sideways = wish.velocity_m_s.y();
  return (sideways != 0.0 ? sideways : wish.yaw_rate_rad_s) < 0.0 ? kRight : kLeft;
}

Footsteps::Footsteps(const GaitSettings& s) : settings_(s) {
  const std::array<Eigen::Vector2d, kStepSides> corner{
      {{-s.longest_step_m, s.narrowest_step_m},
       {s.longest_step_m, s.narrowest_step_m},
       {5.0 / 7.0 * s.longest_step_m, s.widest_step_m},
       {0.0, 4.0 / 3.0 * s.widest_step_m},
       {-5.0 / 7.0 * s.longest_step_m, s.widest_step_m}}};
  for (std::size_t i = 0; i < kStepSides; ++i) {
    const Eigen::Vector2d edge = corner[(i + 1) % kStepSides] - corner[i];
    const Eigen::Vector2d normal = Eigen::Vector2d(edge.y(), -edge.x()).normalized();
    limits_[kLeft][i] = {normal, normal.dot(corner[i])};
    limits_[kRight][i] = {{normal.x(), -normal.y()}, normal.dot(corner[i])};
  }
}

double Footsteps::beyond(Side swing, const Eigen::Vector2d& step_S_m) const {
  double worst = -1e9;
  for (const HalfPlane& side : limits_[swing])
    worst = std::max(worst, side.normal.dot(step_S_m) - side.offset);
  return worst;
}

Eigen::Vector2d Footsteps::step_W_m(Side swing, double from_rad, double to_rad,
                                    const Eigen::Vector2d& v) const {
  const double T = settings_.step_s, distance = settings_.feet_distance_m;
  const double sideways = std::abs(v.y()) * T;
  const double spare = std::max(0.0, distance - settings_.narrowest_step_m - kInside_m);
  const double width = distance + sideways - std::min(spare, sideways);
  const Eigen::Vector2d out(0.0, robot::sign(swing) * width / 2.0);
  return rotation((from_rad + to_rad) / 2.0) * v * T + rotation(from_rad) * out +
         rotation(to_rad) * out;
}

double Footsteps::reachable_yaw(double from_rad, double wished_rad) const {
  const double most = settings_.most_foot_yaw_rad;
  return from_rad + std::clamp(math::wrap_pi(wished_rad - from_rad), -most, most);
}

Footprint Footsteps::next(const Footprint& stance, const FeasibleWish& wish) const {
  const Side swing = robot::other(stance.side);
  const double yaw =
      reachable_yaw(stance.yaw_rad, stance.yaw_rad + wish.yaw_rate_rad_s * settings_.step_s);
  return {swing, stance.p_W_m + step_W_m(swing, stance.yaw_rad, yaw, wish.velocity_m_s), yaw};
}

Footprint Footsteps::reachable(const Footprint& stance, const Footprint& landing) const {
  Footprint result = landing;
  result.yaw_rad = reachable_yaw(stance.yaw_rad, landing.yaw_rad);
  const Side swing = robot::other(stance.side);
  const Eigen::Matrix2d to_S = rotation(-stance.yaw_rad);
  const Eigen::Vector2d still = beside(stance).p_W_m, way = landing.p_W_m - still;
  double share = 1.0;
  for (const HalfPlane& side : limits_[swing]) {
    const double room = side.offset - side.normal.dot(to_S * (still - stance.p_W_m));
    const double used = side.normal.dot(to_S * way);
    if (used * share > room) share = room / used;
  }
  result.p_W_m = still + share * way;
  return result;
}

Footprint Footsteps::beside(const Footprint& stance) const { return next(stance, FeasibleWish{}); }

double Footsteps::fastest_share(const Eigen::Vector2d& v, double yaw_rate) const {
  double share = 1.0;
  for (const Side swing : robot::kSides) {
    const double to = reachable_yaw(0.0, yaw_rate * settings_.step_s);
    const Eigen::Vector2d still = step_W_m(swing, 0.0, to, Eigen::Vector2d::Zero());
    for (const HalfPlane& side : limits_[swing]) {
      const double room = side.offset - side.normal.dot(still);
      // step_W_m is piecewise linear in the speed: a few secants find the limit
      for (int i = 0; i < 3; ++i) {
        const double used = side.normal.dot(step_W_m(swing, 0.0, to, share * v) - still);
        if (used > room) share *= std::max(0.0, room) / used;
      }
    }
  }
  return share;
}

FeasibleWish Footsteps::feasible(const Wish& wish, PatternTrouble& trouble) const {
  FeasibleWish result;
  result.walk = false;
  if (!wish.velocity_m_s.allFinite() || !std::isfinite(wish.yaw_rate_rad_s)) {
    trouble.reason = "wished velocity is not a number: stopping";
    return result;
  }
  result.walk = wish.walk;
  for (std::size_t i = 0; i < 2; ++i) {
    if (!wish.landing[i]) continue;
    if (finite(*wish.landing[i]))
      result.landing[i] = wish.landing[i];
    else
      trouble.reason = "wished landing is not a number: left out";
  }
  if (!wish.walk) return result;
  result.velocity_m_s = {
      clamp_to(wish.velocity_m_s.x(), settings_.most_forward_m_s, trouble.clipped),
      clamp_to(wish.velocity_m_s.y(), settings_.most_sideways_m_s, trouble.clipped)};
  result.yaw_rate_rad_s = clamp_to(wish.yaw_rate_rad_s, settings_.most_turn_rad_s, trouble.clipped);
  const double share = fastest_share(result.velocity_m_s, result.yaw_rate_rad_s);
  trouble.clipped = trouble.clipped || share < 1.0;
  result.velocity_m_s *= share;
  return result;
}

}  // namespace mimesis::walker
