#pragma once
#include <algorithm>
#include <cstddef>

#include "nodes/crowd/engine/gait_rows.h"
#include "nodes/crowd/engine/heading_rows.h"
#include "nodes/crowd/engine/sum_rows.h"

/// Parts of `walk`: loops over a block of rows that are vectorised for the instruction set of who
/// calls them, so they have to become part of it. Where a pointer may be to what a loop writes, the
/// compiler asks before.
namespace mimesis::crowd::rows {

/// Who is moved by others goes straight on until their next word.
MIMESIS_PART void keep_others(const WalkField& f, const Table& t, int row, int m, Column& rate,
                              Column& length, const Column& turn, Step& s) {
  for (int l = 0; l < m; ++l) {
    const auto i = static_cast<std::size_t>(row + l);
    f.wished_rate[i] = rate[l];
    f.wished_length[i] = length[l];
    f.wished_turn[i] = turn[l];
    if (t.role[i] == Role::own) continue;
    const double known = t.phase_rate[i];
    rate[l] = known == known ? known : t.omega[i];
    length[l] = static_cast<double>(t.length[i]);
    s.phase[l] = f.dt * rate[l];
    const CosSin p = cos_sin_lane(t.phase[i] + s.phase[l]), h = cos_sin_lane(t.heading[i]);
    s.cos_phase[l] = p.cos;
    s.sin_phase[l] = p.sin;
    s.heading[l] = 0.0;
    s.cos_heading[l] = h.cos;
    s.sin_heading[l] = h.sin;
    s.way_x[l] = f.dt * static_cast<double>(t.vx[i]);
    s.way_y[l] = f.dt * static_cast<double>(t.vy[i]);
  }
}

MIMESIS_PART void store(Table& t, int row, int m, const Column& rate, const Column& length,
                        const Step& s, bool turns) {
  double* phase = t.phase.data() + row;
  double* phase_rate = t.phase_rate.data() + row;
  float* before = t.length.data() + row;
  for (int l = 0; l < m; ++l) {
    phase[l] += s.phase[l];
    phase_rate[l] = rate[l];
    before[l] = static_cast<float>(length[l]);
  }
  if (!turns) return;
  double* heading = t.heading.data() + row;
  for (int l = 0; l < m; ++l) heading[l] += s.heading[l];
}

/// `walk`.
MIMESIS_PART WalkSums walk_rows(const WalkField& f, Table& t, int first, int last) {
  Lanes sums;
  const double per_step = 1.0 / f.dt;
  const bool turns = f.heading != HeadingKind::keep || f.turn != nullptr;
  for (int row = first; row < last; row += kBlock) {
    const int m = std::min(kBlock, last - row);
    double* x = t.x.data() + row;
    double* y = t.y.data() + row;
    Column ahead, rate, length, turn;
    Step s;
    spacing(f, x, y, t.place.data() + row, m, ahead);
    rates(f, t, row, m, ahead, rate, length);
    advance_phase(f, t, row, m, rate, length, s);
    if (turns) {
      headings(f, t, row, m, rate, turn, s);
      go_turning(f, t, row, m, turn, s);
    } else {
      std::fill_n(turn, m, 0.0);
      go_straight(t, row, m, s);
    }
    if (f.mixed) keep_others(f, t, row, m, rate, length, turn, s);
    store(t, row, m, rate, length, s, turns);
    if (f.wish_x != nullptr) {
      for (int l = 0; l < m; ++l) {
        f.wish_x[row + l] = s.way_x[l] * per_step;
        f.wish_y[row + l] = s.way_y[l] * per_step;
      }
      continue;
    }
    float* vx = t.vx.data() + row;
    float* vy = t.vy.data() + row;
    for (int l = 0; l < m; ++l) {
      x[l] += s.way_x[l];
      y[l] += s.way_y[l];
      vx[l] = static_cast<float>(s.way_x[l] * per_step);
      vy[l] = static_cast<float>(s.way_y[l] * per_step);
    }
    spacing(f, x, y, t.place.data() + row, m, ahead);
    add_sums(f, t, row, m, ahead, s.cos_phase, s.sin_phase, s.cos_heading, s.sin_heading, sums);
  }
  return totals(sums);
}

}  // namespace mimesis::crowd::rows
