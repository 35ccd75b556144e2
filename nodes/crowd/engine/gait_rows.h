#pragma once
#include <cmath>
#include <cstddef>

#include "nodes/crowd/engine/block.h"
#include "nodes/crowd/engine/walk.h"

/// Part of `walk`: gaits. Step frequency, step length and phase of a block of rows [rules I-III].
namespace mimesis::crowd::rows {

struct Wave {  // of the gait at one phase
  double cos_phase, sin_phase;
  double way;  // ∫ g without its linear part
};

/// cos and sin of the multiples by the recurrence of Chebyshev.
MIMESIS_PART Wave wave(const WalkField& f, double phase) {
  const CosSin one = cos_sin_lane(phase);
  const double twice = 2.0 * one.cos;
  double c0 = 1.0, c1 = one.cos, s0 = 0.0, s1 = one.sin, way = 0.0;
  for (int k = 0; k < SpeedFunction::kHarmonics; ++k) {
    const auto h = static_cast<std::size_t>(k);
    way += (f.cosine[h] * s1 - f.sine[h] * c1) * (1.0 / (k + 1));
    const double c2 = twice * c1 - c0, s2 = twice * s1 - s0;
    c0 = c1;
    c1 = c2;
    s0 = s1;
    s1 = s2;
  }
  return {one.cos, one.sin, way};
}

/// z − d of m rows.
MIMESIS_PART void spacing(const WalkField& f, const double* x, const double* y, const double* place,
                          int m, Column& out) {
  for (int l = 0; l < m; ++l) {
    out[l] = (x[l] - f.origin_x) * f.along_x + (y[l] - f.origin_y) * f.along_y - place[l];
  }
}

/// φ̇ and μ of m rows.
MIMESIS_PART void rates(const WalkField& f, Table& t, int row, int m, const Column& ahead,
                        Column& rate, Column& length) {
  const double* omega = t.omega.data() + row;
  const double* phase = t.phase.data() + row;
  for (int l = 0; l < m; ++l) rate[l] = omega[l];
  if (f.pull != nullptr) {
    for (int l = 0; l < m; ++l) rate[l] += f.pull[row + l];
  } else if (f.pull_gain != 0.0) {
    const int leader = f.leader_row - row;
    const double kept = leader >= 0 && leader < m ? rate[leader] : 0.0;
    for (int l = 0; l < m; ++l) rate[l] += f.pull_gain * wrap_lane(f.pull_target - phase[l]);
    if (leader >= 0 && leader < m) rate[leader] = kept;
  }
  if (f.frequency_gain != 0.0) {
    Column error;
    if (f.frequency_error != nullptr) {
      for (int l = 0; l < m; ++l) error[l] = f.frequency_error[row + l];
    } else {
      for (int l = 0; l < m; ++l) error[l] = f.count * ahead[l] - f.error_sum;
    }
    if (f.low_pass > 0.0) {
      double* smoothed = t.smoothed.data() + row;
      for (int l = 0; l < m; ++l) {
        const double now = smoothed[l];
        smoothed[l] = now + f.low_pass * (error[l] - now);
        error[l] = now;
      }
    }
    if (f.saturation > 0.0) {
      for (int l = 0; l < m; ++l) error[l] = saturate_lane(error[l], f.saturation);
    }
    for (int l = 0; l < m; ++l) rate[l] -= f.frequency_gain * error[l];
  }
  for (int l = 0; l < m; ++l) length[l] = 0.0;
  if (f.length_gain != 0.0) {
    if (f.length_error != nullptr) {
      for (int l = 0; l < m; ++l) {
        length[l] = clamp_lane(-f.length_gain * f.length_error[row + l], f.length_limit);
      }
    } else {
      for (int l = 0; l < m; ++l) {
        const double error = f.count * ahead[l] - f.error_sum;
        length[l] = clamp_lane(-f.length_gain * error, f.length_limit);
      }
    }
  }
}

/// Phases and the ways along the headings: the integral of (1 + μ) g dφ, μ of the middle.
MIMESIS_PART void advance_phase(const WalkField& f, const Table& t, int row, int m,
                                const Column& rate, const Column& length, Step& s) {
  const double* phase = t.phase.data() + row;
  const double* rate_before = t.phase_rate.data() + row;
  const float* length_before = t.length.data() + row;
  const float* stride = t.stride.data() + row;
  for (int l = 0; l < m; ++l) {
    const double by = increment(f.dt, rate[l], rate_before[l]);
    const double length_known =
        rate_before[l] == rate_before[l] ? static_cast<double>(length_before[l]) : length[l];
    const double mid = 1.5 * length[l] - 0.5 * length_known;
    const Wave from = wave(f, phase[l]), to = wave(f, phase[l] + by);
    s.phase[l] = by;
    s.way[l] = static_cast<double>(stride[l]) * (1.0 + clamp_lane(mid, f.length_limit)) *
               (f.mean_g * by + (to.way - from.way));
    s.cos_phase[l] = to.cos_phase;
    s.sin_phase[l] = to.sin_phase;
  }
}

}  // namespace mimesis::crowd::rows
