#include "nodes/walker/walker.h"

#include <algorithm>
#include <cmath>

#include "common/math/minimum_jerk.h"
#include "nodes/walker/pattern/generators.h"
#include "nodes/walker/pattern/preview_control.h"

namespace mimesis::walker {
namespace {

constexpr double kSettle_s = 1.0;  ///< transition from half-sitting to the pattern's CoM
/// The upper body's future is unknown within the filter's window; it is assumed to come to rest in
/// this time.
constexpr double kUpperBodyComesToRest_s = 0.3;
constexpr std::size_t kLine = 256;  ///< room for a line of trouble

Eigen::Isometry3d on_ground(const Eigen::Vector2d& p_W_m, double yaw_rad) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation().head<2>() = p_W_m;
  X.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return X;
}

/// 1 to 0 over [0, 1], at rest at both ends up to the acceleration.
double settle(double u) { return 1.0 - math::minimum_jerk(std::clamp(u, 0.0, 1.0)); }

bool usable(const Wish& wish) {
  if (!wish.velocity_m_s.allFinite() || !std::isfinite(wish.yaw_rate_rad_s)) return false;
  return std::ranges::all_of(wish.landing, [](const auto& l) {
    return !l || (l->p_W_m.allFinite() && std::isfinite(l->yaw_rad));
  });
}

std::unique_ptr<PatternGenerator> make_generator(PatternKind kind, const GaitSettings& gait) {
  switch (kind) {
    case PatternKind::linear:
      return std::make_unique<LinearMpc>(gait);
    case PatternKind::preview:
      return std::make_unique<PreviewPattern>(gait);
    case PatternKind::nonlinear:
      break;
  }
  return std::make_unique<NonlinearMpc>(gait);
}

StackSettings stack_settings(const robot::Biped& robot, StackSettings wished) {
  if (wished.tasks.empty()) wished.tasks = walking_stack(robot).tasks;
  return wished;
}

bool usable(const TaskGoals::Hand& hand) {
  return hand.p_W_m.allFinite() && hand.share >= 0.0 && hand.share <= 1.0;
}

constexpr int kMostAhead = 64;
constexpr double kBraking = 0.9;  ///< used share of the acceleration, because time is discrete

/// Speed with which the distance `left` can be covered with at most the acceleration `most`: linear
/// near the goal, the braking parabola farther away; they meet where the linear law brakes with
/// `most`.
double approach(double left, double gain_1_s, double most) {
  const double far = std::abs(left), linear = most / (gain_1_s * gain_1_s);
  const double v = far < linear ? gain_1_s * far : std::sqrt(most * (2.0 * far - linear));
  return std::copysign(v, left);
}

}  // namespace

UpperBodyFollower::UpperBodyFollower(const robot::Biped& biped, const UpperBodySettings& settings)
    : settings_(settings),
      half_sitting_(biped.half_sitting(biped.upper_body)),
      lower_(biped.tree.lower()(biped.upper_body).array() + settings.margin_rad),
      upper_(biped.tree.upper()(biped.upper_body).array() - settings.margin_rad),
      speed_(settings.speed_share * biped.tree.max_speed()(biped.upper_body)) {
  reset();
  ahead_.assign(kMostAhead, now_);
}

void UpperBodyFollower::reset() {
  wish_ = half_sitting_;
  rate_ = Eigen::VectorXd::Zero(wish_.size());
  now_ = {half_sitting_, rate_, rate_};
  clipped_ = false;
}

bool UpperBodyFollower::wish(const Eigen::VectorXd& q, const Eigen::VectorXd& rate) {
  clipped_ = false;
  if (q.size() == 0) {
    wish_ = half_sitting_;
    rate_.setZero();
    return true;
  }
  const bool good = q.size() == wish_.size() && q.allFinite() &&
                    (rate.size() == 0 || (rate.size() == wish_.size() && rate.allFinite()));
  if (!good) {
    rate_.setZero();
    return false;
  }
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    // a joint whose limits leave no room stands in their middle
    const double low = std::min(lower_[i], 0.5 * (lower_[i] + upper_[i]));
    const double high = std::max(upper_[i], 0.5 * (lower_[i] + upper_[i]));
    wish_[i] = std::clamp(q[i], low, high);
    const bool cut = wish_[i] != q[i];
    const double wished_rate = rate.size() == 0 || cut ? 0.0 : rate[i];
    rate_[i] = std::clamp(wished_rate, -speed_[i], speed_[i]);
    clipped_ = clipped_ || cut || rate_[i] != wished_rate;
  }
  return true;
}

void UpperBodyFollower::step() {
  const double most = settings_.acceleration_rad_s2;
  for (Eigen::Index i = 0; i < wish_.size(); ++i) {
    const double left = wish_[i] - now_.q[i];
    const double catch_up = approach(left, settings_.gain_1_s, kBraking * most);
    const double v = std::clamp(rate_[i] + catch_up, -speed_[i], speed_[i]);
    now_.ddq[i] = std::clamp((v - now_.dq[i]) / kTick_s, -most, most);
    now_.dq[i] += kTick_s * now_.ddq[i];
    now_.q[i] += kTick_s * now_.dq[i];
  }
}

std::span<const UpperBody> UpperBodyFollower::ahead(int samples, double dt_s, double settle_s) {
  const auto n = std::min(std::size_t(std::max(samples, 1)), ahead_.size());
  for (std::size_t k = 0; k < n; ++k) {
    const double t = double(k) * dt_s, keep = std::exp(-t / settle_s);
    UpperBody& a = ahead_[k];
    a.dq = keep * now_.dq;
    a.q = now_.q + settle_s * (1.0 - keep) * now_.dq;
    a.q = a.q.cwiseMax(lower_).cwiseMin(upper_);
    a.ddq = -a.dq / settle_s;
  }
  ahead_[0] = now_;
  return std::span(ahead_).first(n);
}

struct Walker::Impl {
  Impl(const robot::Biped& robot, const WalkerSettings& s)
      : biped(robot),
        settings(s),
        gait(s.gait ? *s.gait : gait_settings(robot)),
        pattern(make_generator(s.pattern, gait)),
        filter(robot, gait, s.filter_settings),
        stabilizer(robot, gait, s.stabilizer),
        stack(robot, stack_settings(robot, s.stack)),
        upper_body(robot, s.upper_body),
        kinematics(robot.tree) {
    out.trouble.reserve(kLine);
    out.stabilizer.reason.reserve(kLine);
    reset(Eigen::Vector2d::Zero(), 0.0);
  }

  void reset(const Eigen::Vector2d& p_W_m, double yaw_rad);
  void plan(const WalkerWish& wish);
  void balance(const Sensors& sensors);
  void feel(const Sensors& sensors);
  void move(const WalkerWish& wish);
  Eigen::Matrix3d wished_trunk();
  void note(std::string_view reason);

  const robot::Biped& biped;
  WalkerSettings settings;
  GaitSettings gait;
  std::unique_ptr<PatternGenerator> pattern;
  DynamicFilter filter;
  Stabilizer stabilizer;
  Stack stack;
  UpperBodyFollower upper_body;
  robot::Kinematics kinematics;    ///< kinematics of the wished or of the measured body
  Eigen::VectorXd q_upper;         ///< dof [rad]; legs half-sitting
  Eigen::Vector3d start_offset_m;  ///< offset of half-sitting's CoM from the pattern's, in W
  double time_s = 0.0;
  bool stay = false;  ///< the walk ends because of trouble
  StabilizerPlan planned;
  TaskGoals goals;
  WalkerOutput out;
};

void Walker::Impl::reset(const Eigen::Vector2d& p_W_m, double yaw_rad) {
  const Eigen::Isometry3d X_WG = on_ground(p_W_m, yaw_rad);
  const Eigen::Isometry3d X_WB = X_WG * biped.X_WB_half_sitting;
  kinematics.update(X_WB, biped.half_sitting);
  std::array<Footprint, 2> feet;
  for (Side s : robot::kSides) {
    const Eigen::Isometry3d& X_WS = kinematics.X_WL(biped.leg[s].sole);
    feet[s] = {s, X_WS.translation().head<2>(), yaw_rad};
  }
  pattern->reset(feet);
  filter.reset();
  stabilizer.reset();
  out.stabilizer.ground = {};
  stack.reset(X_WB, biped.half_sitting);
  upper_body.reset();
  start_offset_m = kinematics.com();
  start_offset_m.head<2>() -= pattern->now().com.p_W_m;
  start_offset_m.z() -= gait.com_height_m;
  time_s = 0.0;
  stay = false;
  planned = {pattern->now(), pattern->now().com, X_WB};
  q_upper = biped.half_sitting;
  out.q = biped.half_sitting;
  out.dq = Eigen::VectorXd::Zero(biped.tree.dof());
  out.X_WB = X_WB;
}

void Walker::Impl::note(std::string_view reason) {
  if (out.trouble.empty()) out.trouble.assign(reason);
}

void Walker::Impl::plan(const WalkerWish& wish) {
  Wish walk = wish.walk;
  if (!usable(walk)) note("wish: a velocity or landing is not finite");
  if (stay || !usable(walk)) {
    walk = Wish{};
    walk.walk = false;
  }
  pattern->step(walk);
  if (!upper_body.wish(wish.upper_body, wish.upper_body_rate)) {
    note("wish: the upper body's posture has the wrong size or is not finite");
  }
  upper_body.step();

  planned.pattern = pattern->now();
  planned.com = planned.pattern.com;
  if (settings.filter) {
    const FilterSettings& f = settings.filter_settings;
    const ComState shift = filter.step(
        *pattern, upper_body.ahead(f.samples, f.window_s / f.samples, kUpperBodyComesToRest_s));
    if (filter.unreachable() > 0) note("filter: a leg ahead is too short, and taken to be rigid");
    planned.com = planned.com + shift;
  }
  // Half-sitting's CoM is not exactly above the middle of the feet: both come together slowly.
  const double left = settle(time_s / kSettle_s);
  planned.com.p_W_m += left * start_offset_m.head<2>();
  planned.pattern.zmp_W_m += left * start_offset_m.head<2>();
  for (FootState& foot : planned.pattern.foot) out.stabilizer.ground.carry(foot);
  time_s += kTick_s;
}

void Walker::Impl::balance(const Sensors& sensors) {
  planned.X_WB_last = out.X_WB;
  if (!settings.stabilize) {
    out.stabilizer.X_WS = {planned.pattern.foot[kLeft].X_WS, planned.pattern.foot[kRight].X_WS};
    out.stabilizer.X_WB = planned.X_WB_last;
    return;
  }
  out.stabilizer = stabilizer.step(planned, sensors);
  if (!out.stabilizer.pattern_shift_W_m.isZero()) {
    pattern->shift(out.stabilizer.pattern_shift_W_m);
  }
  note(out.stabilizer.reason);
  stay = out.stabilizer.falling || !out.stabilizer.reason.empty();
}

/// Hands and head where the encoders have them; in a tick without encoders, where they were sent.
void Walker::Impl::feel(const Sensors& sensors) {
  const bool felt = sensors.q.size() == biped.tree.dof() && sensors.q.allFinite();
  kinematics.update(out.stabilizer.X_WB, felt ? sensors.q : out.q);
  for (Side s : robot::kSides) {
    if (biped.hand[s] >= 0) out.hand_W_m[s] = kinematics.X_WL(biped.hand[s]).translation();
  }
  if (biped.head >= 0) out.X_WH = kinematics.X_WL(biped.head);
}

/// Orientation of the trunk that the wished waist gives above an upright pelvis with the plan's
/// heading. An upright trunk as goal would turn the pelvis against the waist and displace the
/// hands.
Eigen::Matrix3d Walker::Impl::wished_trunk() {
  const UpperBody& wished = upper_body.now();
  for (std::size_t i = 0; i < biped.upper_body.size(); ++i) {
    q_upper[biped.upper_body[i]] = wished.q[Eigen::Index(i)];
  }
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  X_WB.linear() = Eigen::AngleAxisd(planned.pattern.yaw_rad, Eigen::Vector3d::UnitZ()) *
                  biped.X_WB_half_sitting.linear();
  kinematics.update(X_WB, q_upper);
  return kinematics.X_WL(biped.trunk).linear();
}

void Walker::Impl::move(const WalkerWish& wish) {
  const StabilizerCommand& c = out.stabilizer;
  goals.com_W_m.head<2>() = planned.com.p_W_m + c.com_shift_W_m;
  goals.com_W_m.z() = gait.com_height_m + settle(time_s / kSettle_s) * start_offset_m.z() +
                      c.ground.height(goals.com_W_m.head<2>());
  goals.com_v_W.head<2>() = planned.com.v_W + c.com_shift_v_W;
  goals.com_v_W.z() = c.ground.slope.dot(goals.com_v_W.head<2>());
  for (Side s : robot::kSides) {
    goals.foot[s] = planned.pattern.foot[s];
    goals.foot[s].X_WS = c.X_WS[s];
    goals.hand[s] = usable(wish.hand[s]) ? wish.hand[s] : TaskGoals::Hand{};
  }
  goals.R_W_trunk = wished_trunk();
  goals.upper_body = upper_body.now().q;
  goals.upper_body_rate = upper_body.now().dq;
  const StackState& state = stack.step(goals, kTick_s);
  out.q = state.q;
  out.dq = state.dq;
  out.X_WB = state.X_WB;
  out.limited = state.limited;
  note(state.reason);
  out.failed = !state.reason.empty() || pattern->trouble().failed_solves > 0;
}

Walker::Walker(const robot::Biped& biped, const WalkerSettings& settings)
    : impl_(std::make_unique<Impl>(biped, settings)) {}
Walker::~Walker() = default;

void Walker::reset(const Eigen::Vector2d& p_W_m, double yaw_rad) {
  impl_->reset(p_W_m, yaw_rad);
  impl_->out.trouble.clear();
}

const Eigen::Quaterniond& Walker::watch(const Sensors& sensors) {
  return impl_->stabilizer.watch(sensors);
}

const WalkerOutput& Walker::step(const WalkerWish& wish, const Sensors& sensors) {
  WalkerOutput& out = impl_->out;
  out.trouble.clear();
  impl_->plan(wish);
  impl_->balance(sensors);
  impl_->feel(sensors);
  impl_->move(wish);
  const PatternTrouble& trouble = impl_->pattern->trouble();
  impl_->note(trouble.reason);
  out.clipped = trouble.clipped || impl_->upper_body.clipped();
  out.pattern = impl_->planned.pattern;
  out.com = impl_->planned.com;
  return out;
}

}  // namespace mimesis::walker
