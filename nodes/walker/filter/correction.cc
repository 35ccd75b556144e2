#include "nodes/walker/filter/correction.h"

#include <algorithm>
#include <cmath>

#include "nodes/walker/pattern/preview_control.h"

namespace mimesis::walker {
namespace {

/// Of the cost; a hundredth of it takes a fifth off the errors that a single stage leaves.
constexpr double kJerkWeight = 1e-6;
/// How fast the wish fades past the window, and its integral goes back to 0 [1/tick]: 0.05 to 0.2
/// leave errors within a tenth of a millimetre of each other.
constexpr double kFade = 0.1;
constexpr double kForget_s = 3.0;  ///< of the integral; 1.5 to 10 s leave the same errors

using Eigen::Index, Eigen::MatrixXd, Eigen::RowVectorXd;

/// Value at time u ∈ [0, 1] between samples 1 and 2 of four by the four (Catmull and Rom).
Eigen::RowVector4d cubic(double u) {
  return 0.5 * Eigen::RowVector4d(u * (-1.0 + u * (2.0 - u)), 2.0 + u * u * (-5.0 + 3.0 * u),
                                  u * (1.0 + u * (4.0 - 3.0 * u)), u * u * (u - 1.0));
}

/// Wish at every tick by the wish at the samples and, last, its integral until now:
/// `ticks` × (`samples` + 1).
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
  // wₙ = w₀ qⁿ + c n qⁿ, c such that what follows takes the whole sum away
  const double q = std::exp(-kFade);
  sum[samples - 1] += 1.0 / (1.0 - q);
  for (int i = last; i < ticks; ++i) {
    const double n = i - last, fade = std::pow(q, n);
    W.row(i) = -n * fade * (1.0 - q) * (1.0 - q) / q * sum;
    W(i, samples - 1) += fade;
  }
  return W;
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

}  // namespace mimesis::walker
