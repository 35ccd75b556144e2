#include "nodes/walker/stabilizer/feet.h"

#include <algorithm>
#include <limits>

#include "common/error.h"
#include "common/math/so3.h"
#include "nodes/walker/stabilizer/settings.h"

// Equation numbers are those of docs/walking.md.
namespace mimesis::walker {
namespace {

/// > 0 if o → a → b turns left.
double turn(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

Eigen::Vector2d nearest_on_edge(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                const Eigen::Vector2d& p) {
  const Eigen::Vector2d along = b - a;
  const double length2 = along.squaredNorm();
  if (length2 == 0.0) return a;
  return a + std::clamp((p - a).dot(along) / length2, 0.0, 1.0) * along;
}

Eigen::Vector2d to_sole(const FootState& foot, const Eigen::Vector2d& v_W) {
  return Eigen::Rotation2Dd(-math::yaw_of(foot.X_WS.linear())) * v_W;
}

Eigen::Vector2d to_world(const FootState& foot, const Eigen::Vector2d& p_S) {
  return foot.X_WS.translation().head<2>() +
         Eigen::Rotation2Dd(math::yaw_of(foot.X_WS.linear())) * p_S;
}

constexpr double kLetGo_s = 0.1;     ///< decay of the tilt of a lifted foot
constexpr double kFeltShare = 0.05;  ///< share of the weight at which a foot counts as felt
/// A foot that lands early goes up no faster than this multiple of the reach's speed. The impact of
/// a stiff leg is over before the leg follows; a foot that followed all of it would be in the air
/// again.
constexpr double kGiveSpeed = 4.0;
constexpr double kShareStep = 0.05;  ///< change of a foot's share per tick; the plan's is no faster
constexpr double kShareFade_s = 0.3;  ///< decay of the height difference in single support

Eigen::Vector3d at_most(const Eigen::Vector3d& v, double length) {
  const double n = v.norm();
  return n > length ? Eigen::Vector3d(v * (length / n)) : v;
}

}  // namespace

Polygon::Polygon(std::span<const Eigen::Vector2d> points) {
  MIMESIS_ASSERT(!points.empty() && points.size() <= std::size_t(kMost));
  std::array<Eigen::Vector2d, kMost> sorted;
  const int n = static_cast<int>(points.size());
  std::copy(points.begin(), points.end(), sorted.begin());
  std::sort(sorted.begin(), sorted.begin() + n, [](const auto& a, const auto& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  const auto add = [this](const Eigen::Vector2d& p, int from) {
    while (size_ - from >= 2 &&
           turn(corner_[std::size_t(size_ - 2)], corner_[std::size_t(size_ - 1)], p) <= 0.0) {
      --size_;
    }
    corner_[std::size_t(size_++)] = p;
  };
  for (int i = 0; i < n; ++i) add(sorted[std::size_t(i)], 0);  // lower side
  const int lower = size_ - 1;
  for (int i = n - 2; i >= 0; --i) add(sorted[std::size_t(i)], lower);  // upper side
  if (size_ > 1) --size_;                                               // the first corner again
}

bool Polygon::contains(const Eigen::Vector2d& p) const {
  if (size_ < 3) return false;
  for (int i = 0; i < size_; ++i) {
    if (turn(corner_[std::size_t(i)], corner_[std::size_t((i + 1) % size_)], p) < 0.0) return false;
  }
  return true;
}

Eigen::Vector2d Polygon::nearest(const Eigen::Vector2d& p) const {
  if (contains(p)) return p;
  Eigen::Vector2d best = corner_[0];
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < size_; ++i) {
    const Eigen::Vector2d q =
        nearest_on_edge(corner_[std::size_t(i)], corner_[std::size_t((i + 1) % size_)], p);
    if ((q - p).squaredNorm() < least) {
      least = (q - p).squaredNorm();
      best = q;
    }
  }
  return best;
}

Eigen::Vector2d Ground::on_sole(Side side, const Eigen::Vector2d& p_S_m) const {
  const robot::Biped::Leg& leg = biped_->leg[side];
  const Eigen::Vector2d low = leg.min_S_m.array() + margin_, high = leg.max_S_m.array() - margin_;
  return p_S_m.cwiseMax(low).cwiseMin(high);
}

Eigen::Vector2d Ground::reachable(const PatternSample& plan, const Eigen::Vector2d& zmp_W_m) const {
  std::array<Eigen::Vector2d, Polygon::kMost> corner;
  std::size_t n = 0;
  for (Side s : robot::kSides) {
    if (!plan.contact[s]) continue;
    for (double x : {-1.0, 1.0}) {
      for (double y : {-1.0, 1.0}) {  // a point beyond every edge, then cut to the sole
        corner[n++] = to_world(plan.foot[s], on_sole(s, {x * 1e3, y * 1e3}));
      }
    }
  }
  if (n == 0) return zmp_W_m;
  return Polygon({corner.data(), n}).nearest(zmp_W_m);
}

Ground::Shares Ground::distribute(const PatternSample& plan, const Eigen::Vector2d& zmp_W_m) const {
  const Eigen::Vector2d left = plan.foot[kLeft].X_WS.translation().head<2>();
  const Eigen::Vector2d right = plan.foot[kRight].X_WS.translation().head<2>();
  Shares shares;
  shares.left = left_weight(plan);
  if (plan.contact[kLeft] && plan.contact[kRight]) {
    const Eigen::Vector2d across = left - right;
    const double length2 = std::max(across.squaredNorm(), 1e-6);
    shares.left = std::clamp((zmp_W_m - right).dot(across) / length2, 0.0, 1.0);
  }
  const Eigen::Vector2d rest = zmp_W_m - (shares.left * left + (1.0 - shares.left) * right);
  for (Side s : robot::kSides) shares.cop_S_m[s] = on_sole(s, to_sole(plan.foot[s], rest));
  return shares;
}

std::optional<Eigen::Vector2d> measured_zmp(const PatternSample& plan,
                                            const std::array<robot::Wrench, 2>& foot_S,
                                            double least_n) {
  double normal = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (Side s : robot::kSides) {
    const robot::Wrench& w = foot_S[s];
    if (w.force.z() <= 0.0) continue;
    normal += w.force.z();
    const Eigen::Vector2d cop(-w.moment.y() / w.force.z(), w.moment.x() / w.force.z());
    sum += w.force.z() * to_world(plan.foot[s], cop);
  }
  if (normal < least_n) return std::nullopt;
  return sum / normal;
}

Feet::Feet(const robot::Biped& biped, const StabilizerSettings& settings)
    : settings_(&settings),
      biped_(&biped),
      weight_n_(biped.tree.mass_kg() * robot::kGravity),
      swing_share_(low_pass_share(settings.swing_filter_s)) {
  reset();
}

void Feet::reset() {
  foot_.fill({});
  difference_m_ = 0.0;
  left_ = 0.5;
  behind_ = false;
  double_support_s_ = settings_->force_window_s;  // it starts on ground that is known
  X_WS_.fill(Eigen::Isometry3d::Identity());
}

void Feet::press(const PatternSample& plan, const Ground::Shares& wished,
                 const std::array<robot::Wrench, 2>& foot_S) {
  const StabilizerSettings& s = *settings_;
  std::array<Eigen::Vector2d, 2> rate;  // A (M_x − p_y F_z, M_y + p_x F_z)              [eq. 6.3]
  for (Side side : robot::kSides) {
    const robot::Wrench& w = foot_S[side];
    const Eigen::Vector2d& cop = wished.cop_S_m[side];
    rate[side] = s.cop_rad_s_n_m * Eigen::Vector2d(w.moment.x() - cop.y() * w.force.z(),
                                                   w.moment.y() + cop.x() * w.force.z());
  }
  const bool both = plan.contact[kLeft] && plan.contact[kRight];
  const Eigen::Vector2d mean = wished.left * rate[kLeft] + (1.0 - wished.left) * rate[kRight];
  for (Side side : robot::kSides) {
    if (!plan.contact[side]) continue;
    if (both) rate[side] = mean + s.cop_alone * (rate[side] - mean);
    for (int i = 0; i < 2; ++i) {
      double& tilt = foot_[side].tilt_rad[i];
      tilt = leaky(tilt, rate[side][i], s.cop_leak_s, s.cop_limit_rad);
    }
  }
}

void Feet::share_weight(const std::array<robot::Wrench, 2>& foot_S, double left) {
  const StabilizerSettings& s = *settings_;
  // (F_L − F_R) − (2λ − 1) mg                                                           [eq. 6.4]
  const double wrong =
      foot_S[kLeft].force.z() - foot_S[kRight].force.z() - (2.0 * left - 1.0) * weight_n_;
  double_support_s_ += kTick_s;
  if (double_support_s_ > s.force_window_s) return;
  difference_m_ = leaky(difference_m_, s.force_m_s_n * wrong, s.force_leak_s, s.force_limit_m);
}

void Feet::land(FootControl& foot, double planned_down_m_s, double normal_n) const {
  const StabilizerSettings& s = *settings_;
  const double least = kFeltShare * weight_n_;
  foot.touched = foot.touched || normal_n > least;
  if (!foot.touched) {
    foot.landing_m = decayed(foot.landing_m, s.landing_leak_s);
    return;
  }
  // l̇ = v_down + A (max(0, F_z) − F₀)                                                   [eq. 6.5]
  const double give = s.landing_m_s_n * (std::max(0.0, normal_n) - least);
  const double rate = planned_down_m_s + std::min(give, kGiveSpeed * s.reach_m_s);
  foot.landing_m = std::clamp(foot.landing_m + kTick_s * rate, 0.0, s.landing_limit_m);
}

void Feet::reach(FootControl& foot, bool found, double planned_down_m_s) const {
  const StabilizerSettings& s = *settings_;
  const double rate = found ? 0.0 : std::max(0.0, s.reach_m_s - planned_down_m_s);
  foot.reach_m = leaky(foot.reach_m, rate, s.force_leak_s, s.reach_limit_m);
}

void Feet::stand(FootControl& foot, double normal_n) const {
  foot.touched = false;
  foot.landing_m = decayed(foot.landing_m, settings_->landing_leak_s);
  foot.felt = foot.felt || normal_n > kFeltShare * weight_n_;
  reach(foot, foot.felt, 0.0);
  fade_swing(foot);
}

void Feet::swing(FootControl& foot, const PatternSample& plan, const FootState& planned,
                 const Measured& measured, double normal_n) const {
  for (double& tilt : foot.tilt_rad) tilt = decayed(tilt, kLetGo_s);
  foot.felt = false;
  if (!foot.touched) hold_swing(foot, planned.X_WS, measured);
  if (plan.to_landing_s > settings_->landing_window_s) {
    foot.touched = false;
    foot.landing_m = decayed(foot.landing_m, settings_->landing_leak_s);
    foot.reach_m = decayed(foot.reach_m, kShareFade_s);
    return;
  }
  const double down_m_s = std::max(0.0, -planned.v_W.z());
  land(foot, down_m_s, normal_n);
  reach(foot, foot.touched, down_m_s);
}

/// Leads the swing sole to its planned pose although the base is at X_WB instead of X_WB_planned.
void Feet::hold_swing(FootControl& foot, const Eigen::Isometry3d& X_WS,
                      const Measured& measured) const {
  const StabilizerSettings& s = *settings_;
  const Eigen::Isometry3d X = measured.X_WB_planned * measured.X_WB.inverse();
  const Eigen::Vector3d tilt = at_most(math::log_so3(X.linear()), s.swing_tilt_limit_rad);
  Eigen::Vector3d shift = s.swing_position * (X * X_WS.translation() - X_WS.translation());
  shift.z() = std::clamp(shift.z(), -s.swing_height_limit_m, s.swing_height_limit_m);
  shift.head<2>() = at_most({shift.x(), shift.y(), 0.0}, s.swing_position_limit_m).head<2>();
  foot.swing_tilt_W += swing_share_ * (tilt - foot.swing_tilt_W);
  foot.swing_shift_W += swing_share_ * (shift - foot.swing_shift_W);
}

void Feet::fade_swing(FootControl& foot) const {
  const double keep = decayed(1.0, settings_->swing_fade_s);
  foot.swing_tilt_W *= keep;
  foot.swing_shift_W *= keep;
}

const std::array<Eigen::Isometry3d, 2>& Feet::step(const PatternSample& plan,
                                                   const Ground::Shares& wished,
                                                   const Measured& measured) {
  give_m_n_ = measured.give_m_n;
  press(plan, wished, measured.foot_S);
  for (Side side : robot::kSides) {
    const double normal_n = measured.foot_S[side].force.z();
    if (plan.contact[side]) {
      stand(foot_[side], normal_n);
    } else {
      swing(foot_[side], plan, plan.foot[side], measured, normal_n);
    }
  }
  const bool both = plan.contact[kLeft] && plan.contact[kRight];
  // No leg changes its length for the weight of a foot that is not felt: that foot would only meet
  // the ground faster.
  const bool waits = both && !(foot_[kLeft].felt && foot_[kRight].felt);
  behind_ = waits || (behind_ && std::abs(wished.left - left_) > kShareStep);
  if (!behind_) left_ = wished.left;
  if (behind_ && !waits) left_ += std::clamp(wished.left - left_, -kShareStep, kShareStep);
  if (both) {
    if (!waits) share_weight(measured.foot_S, wished.left);
  } else {
    difference_m_ = decayed(difference_m_, kShareFade_s);
    double_support_s_ = 0.0;
  }
  compose(plan);
  return X_WS_;
}

const std::array<Eigen::Isometry3d, 2>& Feet::fade(const PatternSample& plan) {
  for (FootControl& foot : foot_) {
    for (double& tilt : foot.tilt_rad) tilt = decayed(tilt, settings_->cop_leak_s);
    foot.landing_m = decayed(foot.landing_m, settings_->landing_leak_s);
    foot.reach_m = decayed(foot.reach_m, settings_->force_leak_s);
    foot.felt = true;
    fade_swing(foot);
  }
  difference_m_ = decayed(difference_m_, settings_->force_leak_s);
  left_ = left_weight(plan);
  behind_ = false;
  compose(plan);
  return X_WS_;
}

void Feet::compose(const PatternSample& plan) {
  for (Side side : robot::kSides) {
    const FootControl& foot = foot_[side];
    const Eigen::Isometry3d& X_WS = plan.foot[side].X_WS;
    const double share = !plan.contact[side] ? 0.0 : side == kLeft ? left_ : 1.0 - left_;
    const Eigen::Vector3d pressed(foot.tilt_rad.x(), foot.tilt_rad.y(), 0.0);
    const Eigen::Matrix3d swung = math::exp_so3(foot.swing_tilt_W) * X_WS.linear();
    const Eigen::Matrix3d turn = math::exp_so3(pressed);
    const Eigen::Vector3d pivot_S = settings_->cop_pivot * biped_->leg[side].ankle_S_m;
    X_WS_[side].linear() = swung * turn;
    X_WS_[side].translation() =
        X_WS.translation() + foot.swing_shift_W + swung * (pivot_S - turn * pivot_S);
    X_WS_[side].translation().z() += foot.landing_m - foot.reach_m +
                                     0.5 * robot::sign(side) * difference_m_ +
                                     give_m_n_ * weight_n_ * (0.5 - share);
  }
}

}  // namespace mimesis::walker
