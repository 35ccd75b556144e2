#pragma once
#include <algorithm>

#include "nodes/crowd/engine/block.h"
#include "nodes/crowd/engine/gait_rows.h"
#include "nodes/crowd/engine/walk.h"

/// Part of `walk`: sums over rows, added in an order that depends on nothing.
namespace mimesis::crowd::rows {

constexpr int kSumLanes = 8;

struct Lanes {
  double count[kSumLanes]{}, cos_phase[kSumLanes]{}, sin_phase[kSumLanes]{}, error[kSumLanes]{},
      cos_heading[kSumLanes]{}, sin_heading[kSumLanes]{};
};

/// Of m values; those behind are set to zero.
MIMESIS_PART void add_to(double (&sum)[kSumLanes], Column& value, int m) {
  for (int l = m; l < kBlock; ++l) value[l] = 0.0;
  for (int k = 0; k < kBlock; k += kSumLanes) {
    for (int l = 0; l < kSumLanes; ++l) sum[l] += value[k + l];
  }
}

MIMESIS_PART double total(const double (&s)[kSumLanes]) {
  return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

MIMESIS_PART void add_sums(const WalkField& f, const Table& t, int row, int m, Column& ahead,
                           Column& cp, Column& sp, Column& ch, Column& sh, Lanes& sums) {
  Column one;
  for (int l = 0; l < m; ++l) one[l] = 1.0;
  if (f.mixed) {
    for (int l = 0; l < m; ++l) {
      if (is_summed(t.role[static_cast<std::size_t>(row + l)])) continue;
      ahead[l] = cp[l] = sp[l] = ch[l] = sh[l] = one[l] = 0.0;
    }
  }
  add_to(sums.count, one, m);
  add_to(sums.cos_phase, cp, m);
  add_to(sums.sin_phase, sp, m);
  add_to(sums.error, ahead, m);
  add_to(sums.cos_heading, ch, m);
  add_to(sums.sin_heading, sh, m);
}

MIMESIS_PART WalkSums totals(const Lanes& sums) {
  return {total(sums.count), total(sums.cos_phase),   total(sums.sin_phase),
          total(sums.error), total(sums.cos_heading), total(sums.sin_heading)};
}

/// `walk_sums`.
MIMESIS_PART WalkSums sum_rows(const WalkField& f, const Table& t, int first, int last) {
  Lanes sums;
  for (int row = first; row < last; row += kBlock) {
    const int m = std::min(kBlock, last - row);
    Column ahead, cp, sp, ch, sh;
    spacing(f, t.x.data() + row, t.y.data() + row, t.place.data() + row, m, ahead);
    const double* phase = t.phase.data() + row;
    const double* heading = t.heading.data() + row;
    for (int l = 0; l < m; ++l) {
      const CosSin p = cos_sin_lane(phase[l]), h = cos_sin_lane(heading[l]);
      cp[l] = p.cos;
      sp[l] = p.sin;
      ch[l] = h.cos;
      sh[l] = h.sin;
    }
    add_sums(f, t, row, m, ahead, cp, sp, ch, sh, sums);
  }
  return totals(sums);
}

}  // namespace mimesis::crowd::rows
