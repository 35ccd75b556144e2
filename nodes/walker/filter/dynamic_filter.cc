#include "nodes/walker/filter/dynamic_filter.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "nodes/walker/pattern/preview_control.h"

// Equation numbers are those of docs/walking.md.
namespace mimesis::walker {
namespace {

/// R of preview control. A hundredth of it reduces the errors that a single stage leaves by a
/// fifth.
constexpr double kJerkWeight = 1e-6;
/// λ: rate at which Δz fades past the window and its integral returns to 0 [1/tick]. Values from
/// 0.05 to 0.2 leave errors within a tenth of a millimetre of each other.
constexpr double kFade = 0.1;
constexpr double kForget_s =
    3.0;  ///< forgetting time of the integral; 1.5 to 10 s: the same errors

using Eigen::Index, Eigen::MatrixXd, Eigen::RowVectorXd;

/// Weights of four samples for the value at time u ∈ [0, 1] between the middle two (Catmull-Rom).
Eigen::RowVector4d cubic(double u) {
  return 0.5 * Eigen::RowVector4d(u * (-1.0 + u * (2.0 - u)), 2.0 + u * u * (-5.0 + 3.0 * u),
                                  u * (1.0 + u * (4.0 - 3.0 * u)), u * u * (u - 1.0));
}

/// Δz at every tick as a linear function of Δz at the samples and, in the last column, of its
/// integral until now: `ticks` × (`samples` + 1).
MatrixXd interpolation(int ticks, int samples, int ticks_a_sample) {
  MatrixXd W = MatrixXd::Zero(ticks, samples + 1);
  const int last = (samples - 1) * ticks_a_sample;
  RowVectorXd sum = RowVectorXd::Zero(samples + 1);  // ∫ wish / dt up to the tick
  sum[samples] = 1.0 / kTick_s;
  for (int i = 0; i < last; ++i) {
    const int k = i / ticks_a_sample;
    const Eigen::RowVector4d weight =
        cubic(static_cast<double>(i - k * ticks_a_sample) / ticks_a_sample);
    for (int j = 0; j < 4; ++j) {
      W(i, std::clamp(k - 1 + j, 0, samples - 1)) += weight[j];
    }
    sum += W.row(i);
  }
  // Past the last sample, n ticks later: Δzₙ = Δz₀ qⁿ + c n qⁿ, q = e^−λ, with c such that the sum
  // over all ticks is 0: Σ qⁿ = 1/(1 − q), Σ n qⁿ = q/(1 − q)²  ⇒  c = −sum (1 − q)²/q [eq. 5.4]
  const double q = std::exp(-kFade);
  sum[samples - 1] += 1.0 / (1.0 - q);
  for (int i = last; i < ticks; ++i) {
    const double n = i - last, fade = std::pow(q, n);
    W.row(i) = -n * fade * (1.0 - q) * (1.0 - q) / q * sum;
    W(i, samples - 1) += fade;
  }
  return W;
}

UpperBody at_rest(const robot::Biped& biped) {
  const auto n = static_cast<Eigen::Index>(biped.upper_body.size());
  return {.q = biped.half_sitting(biped.upper_body),
          .dq = Eigen::VectorXd::Zero(n),
          .ddq = Eigen::VectorXd::Zero(n)};
}

}  // namespace

Correction::Correction(double com_height_m, int samples, int ticks_a_sample) {
  const PreviewSettings settings{
      .height_m = com_height_m, .samples = kPreviewTicks, .jerk_weight = kJerkWeight};
  const PreviewGains gains = preview_gains(settings);
  const CartTableAxis axis(settings.dt_s, settings.height_m);
  A_ = axis.A;
  b_ = axis.b;
  const int last = (samples - 1) * ticks_a_sample;
  const MatrixXd W = interpolation(last + 2 + kPreviewTicks, samples, ticks_a_sample);
  const auto jerk_after = [&](int ticks) {
    return RowVectorXd(gains.F.transpose() * W.middleRows(ticks, kPreviewTicks));
  };
  const RowVectorXd jerk = jerk_after(0);
  per_sample_ = jerk.head(samples);
  by_state_ << -gains.K, jerk[samples];
  for (Forecast* f : {&forecast_, &forecast_in_next_tick_}) {
    f->by_state.resize(3 * samples, 4);
    f->by_wish.resize(3 * samples, samples);
  }
  Eigen::Matrix3d state = Eigen::Matrix3d::Identity();
  MatrixXd wish = MatrixXd::Zero(3, samples + 1);
  const auto put = [&](int tick, Forecast& f) {
    if (tick < 0 || tick % ticks_a_sample != 0) return;
    const Index row = 3 * (tick / ticks_a_sample);
    f.by_state.middleRows<3>(row) << state, wish.col(samples);
    f.by_wish.middleRows<3>(row) = wish.leftCols(samples);
  };
  const Eigen::Matrix3d closed = A_ - b_ * gains.K;
  for (int i = 0; i <= last + 1; ++i) {
    if (i <= last) put(i, forecast_);
    put(i - 1, forecast_in_next_tick_);
    wish = (closed * wish + b_ * jerk_after(i)).eval();
    state = closed * state;
  }
}

/// x⁺ = A x + b u, u = −K x + Σᵢ Fᵢ Δz(i);   ∫⁺ = ∫ + dt (Δz₀ − ∫/T) [eq. 5.3]
Correction::State Correction::next(const State& now, const Errors& wished) const {
  const Eigen::RowVector2d jerk = per_sample_.lazyProduct(wished) + by_state_ * now;
  State next;
  next.topRows<3>() = A_ * now.topRows<3>() + b_ * jerk;
  next.row(3) = now.row(3) + kTick_s * (wished.row(0) - now.row(3) / kForget_s);
  return next;
}

ComState Correction::Forecast::at(int sample, const State& now, const Errors& wished) const {
  const Eigen::Matrix<double, 3, 2> x = by_state.middleRows<3>(3 * sample).lazyProduct(now) +
                                        by_wish.middleRows<3>(3 * sample).lazyProduct(wished);
  return {.p_W_m = x.row(0), .v_W = x.row(1), .a_W = x.row(2)};
}

ComState Correction::at(int sample, const State& now, const Errors& wished) const {
  return forecast_.at(sample, now, wished);
}

ComState Correction::at_in_next_tick(int sample, const State& now, const Errors& wished) const {
  return forecast_in_next_tick_.at(sample, now, wished);
}

ComState to_com(const Correction::State& state) {
  return {.p_W_m = state.row(0), .v_W = state.row(1), .a_W = state.row(2)};
}

DynamicFilter::DynamicFilter(const robot::Biped& biped, const GaitSettings& gait,
                             const FilterSettings& settings)
    : settings_(settings),
      ticks_a_sample_(
          static_cast<int>(std::lround(settings.window_s / settings.samples / kTick_s))),
      com_height_(gait.com_height_m),
      body_(biped, gait.com_height_m),
      correction_(gait.com_height_m, settings.samples, ticks_a_sample_),
      rest_(at_rest(biped)),
      rest_moments_(body_.moments(rest_)),
      plan_(static_cast<std::size_t>(settings.samples)),
      shift_(plan_.size()),
      moments_(plan_.size()),
      lever_(plan_.size() * static_cast<std::size_t>(settings.iterations)) {
  for (Stage& stage : stage_) stage.wished.setZero(settings.samples, 2);
  reset();
}

void DynamicFilter::reset() {
  for (Stage& stage : stage_) stage.state.setZero();
  std::ranges::fill(shift_, ComState{});
  for (WholeBody::Lever& lever : lever_) lever.known = false;
  unreachable_ = 0;
}

const UpperBody& DynamicFilter::upper_at(std::size_t sample,
                                         std::span<const UpperBody> upper) const {
  return settings_.legs_only ? rest_ : upper[upper.size() == 1 ? 0 : sample];
}

void DynamicFilter::look_ahead(const PatternGenerator& pattern, std::span<const UpperBody> upper) {
  for (std::size_t k = 0; k < plan_.size(); ++k) {
    plan_[k] = pattern.ahead(static_cast<int>(k) * ticks_a_sample_);
    if (settings_.legs_only) {
      moments_[k] = rest_moments_;
    } else {
      moments_[k] = k > 0 && upper.size() == 1 ? moments_[0] : body_.moments(upper[k]);
    }
  }
}

ComState DynamicFilter::step(const PatternGenerator& pattern, std::span<const UpperBody> upper) {
  MIMESIS_ASSERT(upper.size() == 1 || upper.size() >= plan_.size());
  look_ahead(pattern, upper);
  unreachable_ = 0;
  auto lever = lever_.begin();
  for (int iteration = 0; iteration < settings_.iterations; ++iteration) {
    if (iteration > 0) forecast(&Correction::at);
    for (std::size_t k = 0; k < plan_.size(); ++k) {
      const PatternSample& plan = plan_[k];
      const Eigen::Vector2d z_MB =  // multi-body ZMP [eq. 5.1]
          body_.zmp(plan, plan.com + shift_[k], upper_at(k, upper), moments_[k], &*lever++);
      unreachable_ += body_.unreachable();
      // Δz = z_plan + z_Δc − z_MB, z_Δc = Δc − (h/g) Δc̈: the ZMP change by which the shift moves a
      // cart-table is intended and no error                                               [eq. 5.2]
      stage_[0].wished.row(static_cast<Eigen::Index>(k)) =
          (plan.zmp_W_m + zmp(shift_[k], com_height_) - z_MB).transpose();
    }
    share_wish();
  }
  ComState shift;
  for (const Stage& stage : stage_) shift = shift + to_com(stage.state);
  forecast(&Correction::at_in_next_tick);
  for (Stage& stage : stage_) stage.state = correction_.next(stage.state, stage.wished);
  return shift;
}

/// A stage gets the error that the stage before will leave: Δzᵢ = Δzᵢ₋₁ − z_Δcᵢ₋₁ [eq. 5.5]
void DynamicFilter::share_wish() {
  for (std::size_t i = 1; i < stage_.size(); ++i) {
    const Stage& last = stage_[i - 1];
    for (int k = 0; k < settings_.samples; ++k) {
      stage_[i].wished.row(k) =
          last.wished.row(k) -
          zmp(correction_.at(k, last.state, last.wished), com_height_).transpose();
    }
  }
}

void DynamicFilter::forecast(Look look) {
  for (std::size_t k = 0; k < shift_.size(); ++k) {
    shift_[k] = {};
    for (const Stage& stage : stage_) {
      shift_[k] = shift_[k] + (correction_.*look)(static_cast<int>(k), stage.state, stage.wished);
    }
  }
}

}  // namespace mimesis::walker
