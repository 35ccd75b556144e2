#include "nodes/walker/filter/correction.h"

#include <algorithm>
#include <cmath>

#include "nodes/walker/pattern/preview_control.h"

namespace mimesis::walker {
namespace {

/// Of the cost; a tenth or a hundred times as much changes the errors left by less than a tenth.
constexpr double kJerkWeight = 1e-6;
/// How fast the wish fades past the window [1/tick]: what comes there is not known, and of changing
/// sign. Held instead, it made the second iteration worse than the first.
constexpr double kFade = 0.1;

using Eigen::Index, Eigen::MatrixXd;

/// Value at time u ∈ [0, 1] between samples 1 and 2 of four by the four (Catmull and Rom).
Eigen::RowVector4d cubic(double u) {
  return 0.5 * Eigen::RowVector4d(u * (-1.0 + u * (2.0 - u)), 2.0 + u * u * (-5.0 + 3.0 * u),
                                  u * (1.0 + u * (4.0 - 3.0 * u)), u * u * (u - 1.0));
}

/// Wish at every tick by the wish at the samples: `ticks` × `samples`.
MatrixXd interpolation(int ticks, int samples, int ticks_a_sample) {
  MatrixXd W = MatrixXd::Zero(ticks, samples);
  const int last = (samples - 1) * ticks_a_sample;
  for (int i = 0; i < ticks; ++i) {
    if (i >= last) {
      W(i, samples - 1) = std::exp(-kFade * (i - last));
      continue;
    }
    const int k = i / ticks_a_sample;
    const Eigen::RowVector4d weight =
        cubic(static_cast<double>(i - k * ticks_a_sample) / ticks_a_sample);
    for (int j = 0; j < 4; ++j) {
      W(i, std::clamp(k - 1 + j, 0, samples - 1)) += weight[j];
    }
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
  K_ = gains.K;
  const int last = (samples - 1) * ticks_a_sample;
  const MatrixXd W = interpolation(last + 1 + kPreviewTicks, samples, ticks_a_sample);
  const auto jerk_after = [&](int ticks) {
    return Eigen::RowVectorXd(gains.F.transpose() * W.middleRows(ticks, kPreviewTicks));
  };
  per_sample_ = jerk_after(0);
  by_state_.resize(3 * samples, 3);
  by_wish_.resize(3 * samples, samples);
  Eigen::Matrix3d state = Eigen::Matrix3d::Identity();
  MatrixXd wish = MatrixXd::Zero(3, samples);
  const Eigen::Matrix3d closed = A_ - b_ * K_;
  for (int i = 0; i <= last; ++i) {
    if (i % ticks_a_sample == 0) {
      by_state_.middleRows<3>(3 * (i / ticks_a_sample)) = state;
      by_wish_.middleRows<3>(3 * (i / ticks_a_sample)) = wish;
    }
    wish = (closed * wish + b_ * jerk_after(i)).eval();
    state = closed * state;
  }
}

Correction::State Correction::next(const State& now, const Errors& wished) const {
  const Eigen::RowVector2d jerk = per_sample_.lazyProduct(wished) - K_ * now;
  return A_ * now + b_ * jerk;
}

ComState Correction::at(int sample, const State& now, const Errors& wished) const {
  return to_com(by_state_.middleRows<3>(3 * sample).lazyProduct(now) +
                by_wish_.middleRows<3>(3 * sample).lazyProduct(wished));
}

ComState to_com(const Correction::State& state) {
  return {.p_W_m = state.row(0), .v_W = state.row(1), .a_W = state.row(2)};
}

}  // namespace mimesis::walker
