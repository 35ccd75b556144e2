#include "nodes/walker/pattern/mpc_problem.h"

#include <cmath>
#include <limits>

#include "nodes/walker/pattern/preview_control.h"

// Equation numbers are those of docs/walking.md.
namespace mimesis::walker {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSample_s = kSampleTicks * kTick_s;

// A swing foot with D seconds left may still be moved by A D² in all, that is by 2 A D per second:
// this bounds its acceleration. With less than kFrozen_s left its landing stays.
constexpr double kSteer_m_s2 = 1.2, kSteer_rad_s2 = 2.0, kFrozen_s = 0.1;

// κ: share of the ZMP's rectangle that may be used to catch the capture point on the next foot.
constexpr double kCaught = 0.4;
// Factor on a limit at the end of the horizon, so that it can be kept one sample later too.
constexpr double kKept = 0.98;

double steer_s2(const Steps& steps) {
  const double left = steps.free_time_s();
  return left <= kFrozen_s ? 0.0 : 2.0 * left * kTick_s;
}

}  // namespace

void support_polygon(const Footprint& a, const Footprint& b, const Eigen::Vector2d& half,
                     std::vector<HalfPlane>& sides) {
  std::array<Eigen::Vector2d, 8> corner;
  std::size_t n = 0;
  for (const Footprint* foot : {&a, &b})
    for (const Eigen::Vector2d& s : {Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, 1),
                                     Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1)})
      corner[n++] = foot->p_W_m + rotation(foot->yaw_rad) * s.cwiseProduct(half);
  std::size_t start = 0;
  for (std::size_t i = 1; i < n; ++i)
    if (corner[i].x() < corner[start].x()) start = i;
  // wraps the corners counter-clockwise: the next one has all others on its left
  sides.clear();
  std::size_t from = start;
  do {
    std::size_t to = (from + 1) % n;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector2d best = corner[to] - corner[from], other = corner[i] - corner[from];
      const double turn = cross(best, other);
      if (turn < -1e-12 || (turn <= 1e-12 && other.squaredNorm() > best.squaredNorm())) to = i;
    }
    const Eigen::Vector2d edge = corner[to] - corner[from];
    const Eigen::Vector2d normal = Eigen::Vector2d(edge.y(), -edge.x()).normalized();
    sides.push_back({normal, normal.dot(corner[from])});
    from = to;
  } while (from != start && sides.size() < 8);
}

MpcProblem::MpcProblem(const GaitSettings& settings, bool yaw_free, const MpcWeights& weights)
    : settings_(settings),
      weights_(weights),
      footsteps_(settings),
      yaw_free_(yaw_free),
      N_(2 * static_cast<int>(std::lround(settings.step_s / kSample_s))),
      axis_(N_ + 2) {
  const double h_g = settings.com_height_m / kGravity_m_s2, T = kSample_s;
  for (int r = 1; r <= kSampleTicks; ++r) {
    Horizon h{r * kTick_s,
              RowMatrix::Zero(N_, N_),
              RowMatrix::Zero(N_, N_),
              Eigen::RowVectorXd::Zero(N_),
              {}};
    for (int k = 0; k < N_; ++k) {
      for (int j = 0; j <= k; ++j) {
        // A unit jerk lasts d, then e passes until sample k:
        //   Pv(k, j) = d²/2 + d e,   Pz(k, j) = d³/6 + (d²/2) e + d e²/2 − (h/g) d      [eq. 2.2]
        const double d = j == 0 ? h.first_s : T, e = (k - j) * T;
        h.Pv(k, j) = d * d / 2.0 + d * e;
        h.Pz(k, j) = d * d * d / 6.0 + d * d / 2.0 * e + d * e * e / 2.0 - h_g * d;
      }
    }
    // Pξ = Pp + √(h/g) Pv with Pp = Pz + (h/g) Pa, Pa(j) = d                            [eq. 2.8]
    h.Pxi = h.Pz.row(N_ - 1) + std::sqrt(h_g) * h.Pv.row(N_ - 1);
    for (int j = 0; j < N_; ++j) h.Pxi(j) += h_g * (j == 0 ? h.first_s : T);
    // H_UU = α PvᵀPv + β PzᵀPz + γ I                                                    [eq. 2.5]
    h.hessian = weights.velocity * h.Pv.transpose() * h.Pv + weights.zmp * h.Pz.transpose() * h.Pz +
                weights.jerk * Eigen::MatrixXd::Identity(N_, N_);
    horizon_.push_back(std::move(h));
  }
  support_.resize(static_cast<std::size_t>(N_));
  hull_.reserve(8);
  free_zmp_.setZero(N_, 2);
  coast_.setZero(N_);
  H_.setZero(variables(), variables());
  g_.setZero(variables());
  A_.setZero(most_rows(), variables());
  lower_.setZero(most_rows());
  upper_.setZero(most_rows());
  x_lower_.setConstant(variables(), -kInfinity);
  x_upper_.setConstant(variables(), kInfinity);
}

qp::Problem MpcProblem::build(const MpcInput& in, const Steps& steps) {
  const int r = steps.ticks_to_sample();
  const Horizon& h = horizon_[static_cast<std::size_t>(r - 1)];
  origin_ = steps.stance().p_W_m;
  feet_ = {steps.stance(), in.foot[0].plan, in.foot[1].plan};
  for (Footprint& foot : feet_) foot.p_W_m -= origin_;
  middle_ = steps.middle_W_m() - origin_;
  for (int k = 0; k < N_; ++k)
    support_[static_cast<std::size_t>(k)] = steps.support_after(r + k * kSampleTicks);
  if (support_[0].both) {
    std::array<Footprint, 2> ground = steps.ground();
    for (Footprint& foot : ground) foot.p_W_m -= origin_;
    support_polygon(ground[0], ground[1], settings_.zmp_half_m, hull_);
  }
  set_cost(in, h);
  set_feet_cost(in);
  rows_ = 0;
  set_limits_of_landings(steps);
  set_limits_of_zmp(in, h);
  set_limits_of_capture(in, h, steps);
  return {H_, g_, A_.topRows(rows_), lower_.head(rows_), upper_.head(rows_), x_lower_, x_upper_};
}

/// Per axis: α/2 |v − v_ref|² + β/2 |z − c|² + γ/2 |U|²                                  [eq. 2.3]
/// with v = v⁰ + Pv U, z = z⁰ + Pz U and the middle c = c⁰ + s₁ F₁ + s₂ F₂ of the support, so that
///   H_UU = α PvᵀPv + β PzᵀPz + γ I,  H_FᵢU = −β sᵢᵀPz,  H_FᵢFⱼ = β sᵢᵀsⱼ [eq. 2.5] g_U = α Pvᵀ(v⁰
///   − v_ref) + β Pzᵀ(z⁰ − c⁰),  g_Fᵢ = −β sᵢᵀ(z⁰ − c⁰)                     [eq. 2.6]
void MpcProblem::set_cost(const MpcInput& in, const Horizon& h) {
  const double alpha = weights_.velocity, beta = weights_.zmp;
  const double h_g = settings_.com_height_m / kGravity_m_s2;
  const Eigen::Vector2d p = in.com.p_W_m - origin_, &v = in.com.v_W, &a = in.com.a_W;
  double s1_s1 = 0.0, s2_s2 = 0.0, s1_s2 = 0.0;  // sᵢᵀsⱼ
  for (int axis = 0; axis < 2; ++axis) g_.segment(axis * axis_, axis_).setZero();
  H_.leftCols(axis_).topRows(axis_).bottomRows(2).setZero();
  for (int k = 0; k < N_; ++k) {
    const Support& s = support_[static_cast<std::size_t>(k)];
    const double t = h.first_s + k * kSample_s;
    const Eigen::Vector2d v0 = v + t * a;
    const Eigen::Vector2d z0 = p + t * (v + t / 2.0 * a) - h_g * a;
    const bool walking = !s.both && s.i == s.j;
    const Eigen::Vector2d v_ref =
        walking ? Eigen::Vector2d(rotation(in.yaw_rad + t * in.wish.yaw_rate_rad_s) *
                                  in.wish.velocity_m_s)
                : Eigen::Vector2d::Zero();
    const double s1 = s.both ? 0.0 : part(s, 1), s2 = s.both ? 0.0 : part(s, 2);
    const Eigen::Vector2d c0 = s.both ? middle_ : Eigen::Vector2d(part(s, 0) * feet_[0].p_W_m);
    const auto Pv = h.Pv.row(k).head(k + 1), Pz = h.Pz.row(k).head(k + 1);
    const Eigen::Vector2d dz = z0 - c0, dv = v0 - v_ref;
    for (int axis = 0; axis < 2; ++axis) {
      auto g = g_.segment(axis * axis_, axis_);
      g.head(k + 1) += (alpha * dv(axis)) * Pv.transpose() + (beta * dz(axis)) * Pz.transpose();
      g(N_) -= beta * s1 * dz(axis);
      g(N_ + 1) -= beta * s2 * dz(axis);
    }
    if (s1 > 0.0) H_.row(N_).head(k + 1) -= beta * s1 * Pz;
    if (s2 > 0.0) H_.row(N_ + 1).head(k + 1) -= beta * s2 * Pz;
    s1_s1 += s1 * s1;
    s2_s2 += s2 * s2;
    s1_s2 += s1 * s2;
    free_zmp_.row(k) = z0;
  }
  H_.topLeftCorner(N_, N_) = h.hessian;
  H_(N_, N_) = beta * s1_s1;
  H_(N_ + 1, N_ + 1) = beta * s2_s2;
  H_(N_, N_ + 1) = H_(N_ + 1, N_) = beta * s1_s2;
  H_.block(0, N_, N_, 2) = H_.block(N_, 0, 2, N_).transpose();
}

/// Per axis: σ/2 (F₁ − d₁)² + σ/2 (F₂ − F₁ − d₂)² + δ/2 Σᵢ (Fᵢ − F̄ᵢ)², from the standing foot; a
/// wished landing Lᵢ replaces its σ-term by λ/2 (Fᵢ − Lᵢ)². Yaw: η/2 Σᵢ (θ̄ᵢ + Δθᵢ − θ_refᵢ)².
/// [eq. 2.4]
void MpcProblem::set_feet_cost(const MpcInput& in) {
  const double delta = weights_.foot, eta = weights_.yaw;
  for (int i = 0; i < 2; ++i) {
    const MpcInput::Landing& foot = in.foot[static_cast<std::size_t>(i)];
    const int at = N_ + i;
    const double weight = foot.p_W_m ? weights_.landing : weights_.spacing;
    const Eigen::Vector2d goal =
        foot.p_W_m ? Eigen::Vector2d(*foot.p_W_m - origin_) : foot.step_W_m;
    const Eigen::Vector2d& F_plan = feet_[static_cast<std::size_t>(i) + 1].p_W_m;
    H_(at, at) += weight + delta;
    for (int axis = 0; axis < 2; ++axis)
      g_(axis * axis_ + at) -= weight * goal(axis) + delta * F_plan(axis);
    if (i == 1 && !foot.p_W_m) {  // the term of F₂ − F₁
      H_(N_, N_) += weight;
      H_(N_, at) -= weight;
      H_(at, N_) -= weight;
      for (int axis = 0; axis < 2; ++axis) g_(axis * axis_ + N_) += weight * goal(axis);
    }
  }
  H_.block(axis_, axis_, axis_, axis_) = H_.topLeftCorner(axis_, axis_);
  if (!yaw_free_) return;
  for (int i = 0; i < 2; ++i) {
    const MpcInput::Landing& foot = in.foot[static_cast<std::size_t>(i)];
    H_(2 * axis_ + i, 2 * axis_ + i) = eta;
    g_(2 * axis_ + i) = eta * (foot.plan.yaw_rad - foot.wished_yaw_rad);
  }
}

double MpcProblem::yaw_freedom_rad(const Steps& steps) const {
  return kSteer_rad_s2 * steer_s2(steps);
}

/// nᵀR(θᵢ₋₁)ᵀ(Fᵢ − Fᵢ₋₁) ≤ b for the sides of the polygon, linearised in θ₁; |θᵢ − θᵢ₋₁| ≤ most.
/// [eq. 2.10]
void MpcProblem::set_limits_of_landings(const Steps& steps) {
  const double steer = steer_s2(steps);
  const bool frozen = steer == 0.0;
  for (int axis = 0; axis < 2; ++axis) {
    x_lower_(axis * axis_ + N_) = feet_[1].p_W_m(axis) - steer * kSteer_m_s2;
    x_upper_(axis * axis_ + N_) = feet_[1].p_W_m(axis) + steer * kSteer_m_s2;
  }
  for (int i = frozen ? 1 : 0; i < 2; ++i) {
    const Side swing = i == 0 ? steps.swing() : robot::other(steps.swing());
    const Footprint& from = feet_[static_cast<std::size_t>(i)];
    const Eigen::Matrix2d R = rotation(from.yaw_rad);
    const Eigen::Vector2d step = feet_[static_cast<std::size_t>(i) + 1].p_W_m - from.p_W_m;
    for (const HalfPlane& side : footsteps_.limits(swing)) {
      const Eigen::Vector2d n = R * side.normal;
      auto row = A_.row(rows_);
      row.setZero();
      for (int axis = 0; axis < 2; ++axis) {
        row(axis * axis_ + N_ + i) = n(axis);
        if (i == 1) row(axis * axis_ + N_) = -n(axis);
      }
      lower_(rows_) = -kInfinity;
      upper_(rows_) = side.offset;  // the first step is from the standing foot, the origin
      if (yaw_free_ && i == 1)      // d(Rn)/dθ of the first landing
        row(2 * axis_) = Eigen::Vector2d(-n.y(), n.x()).dot(step);
      ++rows_;
    }
  }
  if (!yaw_free_) return;
  x_lower_(2 * axis_) = -steer * kSteer_rad_s2;
  x_upper_(2 * axis_) = steer * kSteer_rad_s2;
  for (int i = frozen ? 1 : 0; i < 2; ++i) {
    auto row = A_.row(rows_);
    row.setZero();
    row(2 * axis_ + i) = 1.0;
    if (i == 1) row(2 * axis_) = -1.0;
    const double now =
        feet_[static_cast<std::size_t>(i) + 1].yaw_rad - feet_[static_cast<std::size_t>(i)].yaw_rad;
    lower_(rows_) = -settings_.most_foot_yaw_rad - now;
    upper_(rows_) = settings_.most_foot_yaw_rad - now;
    ++rows_;
  }
}

void MpcProblem::set_row(const Eigen::Ref<const Eigen::RowVectorXd>& of_jerk, const Support& s,
                         const Eigen::Vector2d& n) {
  auto row = A_.row(rows_);
  row.setZero();
  for (int axis = 0; axis < 2; ++axis) {
    row.segment(axis * axis_, of_jerk.size()) = n(axis) * of_jerk;
    if (s.both) continue;
    row(axis * axis_ + N_) = -n(axis) * part(s, 1);
    row(axis * axis_ + N_ + 1) = -n(axis) * part(s, 2);
  }
}

void MpcProblem::set_zmp_row(const Horizon& h, int k, const Eigen::Vector2d& n, double yaw_slope) {
  const Support& s = support_[static_cast<std::size_t>(k)];
  set_row(h.Pz.row(k).head(k + 1), s, n);
  if (yaw_free_ && !s.both && s.j > 0) A_(rows_, 2 * axis_ + s.j - 1) = yaw_slope;
}

/// ξ⁰ at the end of the horizon, and how it grows over the sample after it:
///   E = exp(T/r),   w' = (E − 1) r/T − 1,   w = E − 1 − w'                              [eq. 2.9]
MpcProblem::Capture MpcProblem::capture_at_end(const MpcInput& in, const Horizon& h) {
  Capture c;
  c.root_s = std::sqrt(settings_.com_height_m / kGravity_m_s2);
  c.end_s = h.first_s + (N_ - 1) * kSample_s;
  c.free = in.com.p_W_m - origin_ + c.end_s * (in.com.v_W + c.end_s / 2.0 * in.com.a_W) +
           c.root_s * (in.com.v_W + c.end_s * in.com.a_W);
  const Support& s = support_.back();
  if (!s.both) c.known_foot = part(s, 0) * feet_[0].p_W_m;
  c.growth = std::exp(kSample_s / c.root_s);
  c.next_zmp = (c.growth - 1.0) * c.root_s / kSample_s - 1.0;
  c.zmp = c.growth - 1.0 - c.next_zmp;
  coast_ = (c.growth * h.Pxi - c.zmp * h.Pz.row(N_ - 1)) / (c.growth - c.zmp);
  return c;
}

/// One sample later, with the ZMP at the edge n·z' = `edge` that pushes back, n·ξ' ≤ `most` must
/// hold, so that the next tick's program has a solution too:
///   n·(E ξ − w z) ≤ most + w' edge, both from the foot and divided by E − w             [eq. 2.11]
void MpcProblem::limit_next_capture(const Capture& c, const Eigen::Vector2d& n, double edge,
                                    double most) {
  const double E = c.growth, w = c.zmp;
  const Eigen::Vector2d last_zmp = free_zmp_.row(N_ - 1);
  set_row(coast_, support_.back(), n);
  lower_(rows_) = -kInfinity;
  upper_(rows_) = (most + c.next_zmp * edge) / (E - w) -
                  n.dot((E * c.free - w * last_zmp) / (E - w) - c.known_foot);
  ++rows_;
}

void MpcProblem::set_limits_of_capture(const MpcInput& in, const Horizon& h, const Steps& steps) {
  const Support& s = support_.back();
  const Capture c = capture_at_end(in, h);
  if (s.both) {
    for (const HalfPlane& side : hull_) {
      limit_next_capture(c, side.normal, side.offset, side.offset);
    }
    return;
  }
  if (s.i == s.j) return set_limits_of_next_step(h, c, steps);
  const Eigen::Matrix2d R = rotation(feet_[static_cast<std::size_t>(s.j)].yaw_rad);
  for (int axis = 0; axis < 2; ++axis) {
    const double half = settings_.zmp_half_m(axis);
    for (const double sign : {-1.0, 1.0}) {
      limit_next_capture(c, sign * R.col(axis), half, kKept * half);
    }
  }
}

/// One foot stands at the end of the horizon. Until the next landing, t away, the capture point
/// moves off from it as exp(t/r); while the ZMP then crosses to the next foot, the share χ of the
/// step is lost; the share κ of the ZMP's rectangle there must suffice to lead it on:
///   n·ξ ≤ ((1 − χ) b + κ edge) exp(−t/r),   χ = (1 − 1/E)/2                             [eq. 2.12]
void MpcProblem::set_limits_of_next_step(const Horizon& h, const Capture& c, const Steps& steps) {
  const Support& s = support_.back();
  const Eigen::Matrix2d R = rotation(feet_[static_cast<std::size_t>(s.j)].yaw_rad);
  const double left_s = steps.until_next_landing_s(c.end_s);
  const double crossing = (1.0 - 1.0 / c.growth) / 2.0;
  const Side swing = s.i % 2 == 0 ? steps.swing() : robot::other(steps.swing());
  for (const HalfPlane& side : footsteps_.limits(swing)) {
    const Eigen::Vector2d n = R * side.normal;
    const double edge = side.normal.cwiseAbs().dot(settings_.zmp_half_m);
    const double reach = (1.0 - crossing) * side.offset + kCaught * edge;
    if (left_s > kSample_s / 2.0) {
      limit_next_capture(c, n, edge, kKept * reach * std::exp((kSample_s - left_s) / c.root_s));
      continue;
    }
    set_row(h.Pxi, s, n);
    lower_(rows_) = -kInfinity;
    upper_(rows_) = reach * std::exp(-left_s / c.root_s) - n.dot(c.free - c.known_foot);
    ++rows_;
  }
}

/// |n·(z⁰ + Pz U − c)| ≤ half for both axes n of a foot, linearised in its yaw; the hull of both
/// feet while they stand. [eq. 2.7]
void MpcProblem::set_limits_of_zmp(const MpcInput& in, const Horizon& h) {
  for (int k = 0; k < N_; ++k) {
    const Support& s = support_[static_cast<std::size_t>(k)];
    const Eigen::Vector2d free = free_zmp_.row(k);
    if (s.both) {
      for (const HalfPlane& side : hull_) {
        set_zmp_row(h, k, side.normal, 0.0);
        lower_(rows_) = -kInfinity;
        upper_(rows_) = side.offset - side.normal.dot(free);
        ++rows_;
      }
      continue;
    }
    const auto i = static_cast<std::size_t>(s.i), j = static_cast<std::size_t>(s.j);
    const double yaw = feet_[j].yaw_rad;
    const Eigen::Vector2d fixed = part(s, 0) * feet_[0].p_W_m;
    Eigen::Vector2d from_foot = Eigen::Vector2d::Zero();  // distance of the last plan's ZMP
    if (yaw_free_)
      from_foot = in.zmp_plan_W_m[static_cast<std::size_t>(k)] - origin_ -
                  0.5 * (feet_[i].p_W_m + feet_[j].p_W_m);
    for (int side = 0; side < 2; ++side) {
      const Eigen::Vector2d n = rotation(yaw).col(side), dn(-n.y(), n.x());
      set_zmp_row(h, k, n, dn.dot(from_foot));
      const double middle = n.dot(fixed - free), half = settings_.zmp_half_m(side);
      lower_(rows_) = middle - half;
      upper_(rows_) = middle + half;
      ++rows_;
    }
  }
}

}  // namespace mimesis::walker
