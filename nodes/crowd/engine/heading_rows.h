#pragma once
#include <cmath>
#include <cstddef>

#include "nodes/crowd/engine/block.h"
#include "nodes/crowd/engine/walk.h"

/// Part of `walk`: headings of a block of rows [rule IV], and the ways along them.
namespace mimesis::crowd::rows {

/// g^ψ(φ), multiples by the recurrence of Chebyshev.
MIMESIS_PART double sway(const WalkField& f, double phase) {
  const CosSin one = cos_sin_lane(phase);
  const double twice = 2.0 * one.cos;
  double c0 = 1.0, c1 = one.cos, s0 = 0.0, s1 = one.sin, sum = 0.0;
  for (int k = 0; k < HeadingSway::kHarmonics; ++k) {
    const auto h = static_cast<std::size_t>(k);
    sum += f.sway.cosine[h] * c1 + f.sway.sine[h] * s1;
    const double c2 = twice * c1 - c0, s2 = twice * s1 - s0;
    c0 = c1;
    c1 = c2;
    s0 = s1;
    s1 = s2;
  }
  return sum;
}

/// ψ̇ of m rows, from the rates of their phases. Who arrives at its goal takes shorter steps.
MIMESIS_PART void headings(const WalkField& f, const Table& t, int row, int m, const Column& rate,
                           Column& turn, Step& s) {
  const double* heading = t.heading.data() + row;
  const double* x = t.x.data() + row;
  const double* y = t.y.data() + row;
  // Of navigation. Who is turned away from its goal listens the less to others, or it would walk
  // round and round a crowd that stands at its goals.
  Column share;
  for (int l = 0; l < kBlock; ++l) share[l] = 1.0;
  for (int l = 0; l < m; ++l) turn[l] = 0.0;
  if (f.heading == HeadingKind::lane) {
    const double* lane = t.lane.data() + row;
    for (int l = 0; l < m; ++l) {
      const double across = (y[l] - f.origin_y) * f.along_x - (x[l] - f.origin_x) * f.along_y;
      const double off = lane[l] - across;
      const double r = std::sqrt(off * off + f.ahead * f.ahead);
      const CosSin h = cos_sin_lane(heading[l] - f.path_rad);
      const double facing = (h.cos * f.ahead + h.sin * off) / r;
      turn[l] = rate[l] * f.heading_gain * (h.cos * off - h.sin * f.ahead) / r;
      share[l] = facing < 0.0 ? 1.0 + facing : 1.0;
    }
  } else if (f.heading == HeadingKind::consensus) {
    for (int l = 0; l < m; ++l) {
      const CosSin h = cos_sin_lane(heading[l]);
      turn[l] =
          rate[l] * f.heading_gain * (f.mean_heading_sin * h.cos - f.mean_heading_cos * h.sin);
    }
  } else if (f.heading == HeadingKind::coupled) {
    for (int l = 0; l < m; ++l) {
      const CosSin h = cos_sin_lane(heading[l]);
      turn[l] = f.heading_gain * (f.mean_heading_sin * h.cos - f.mean_heading_cos * h.sin);
    }
  } else if (f.heading == HeadingKind::goal) {
    const double* gx = t.goal_x.data() + row;
    const double* gy = t.goal_y.data() + row;
    for (int l = 0; l < m; ++l) {
      const double dx = gx[l] - x[l], dy = gy[l] - y[l];
      const double r = std::sqrt(dx * dx + dy * dy);
      const double per = 1.0 / (r > 1e-9 ? r : 1e-9);
      const CosSin h = cos_sin_lane(heading[l]);
      turn[l] = f.heading_gain * (h.cos * dy - h.sin * dx) * per;
      // At full speed it could only circle round a goal that is beside it, v/gain away: there it
      // goes on the slower the less it faces the goal.
      const double near = r / f.arrive, facing = (h.cos * dx + h.sin * dy) * per;
      const double circle = 2.0 * s.way[l] / (f.dt * f.heading_gain + 1e-9) + 1e-9;
      const double free = r < circle ? r / circle : 1.0;
      const double ahead = facing > 0.0 ? facing : 0.0;
      s.way[l] *= (free + (1.0 - free) * ahead) * (near < 1.0 ? near * ahead : 1.0);
      // Those beside the goal do not turn it away from there.
      share[l] = (facing < 0.0 ? 1.0 + facing : 1.0) * (near < 1.0 ? near : 1.0);
    }
  }
  if (f.sways && (f.heading == HeadingKind::lane || f.heading == HeadingKind::consensus)) {
    const double* phase = t.phase.data() + row;
    for (int l = 0; l < m; ++l) turn[l] += rate[l] * sway(f, phase[l]);
  }
  if (f.turn != nullptr) {
    for (int l = 0; l < m; ++l) turn[l] += share[l] * f.turn[row + l];
  }
}

MIMESIS_PART void go_straight(const Table& t, int row, int m, Step& s) {
  const double* heading = t.heading.data() + row;
  for (int l = 0; l < m; ++l) {
    const CosSin h = cos_sin_lane(heading[l]);
    s.cos_heading[l] = h.cos;
    s.sin_heading[l] = h.sin;
    s.way_x[l] = s.way[l] * h.cos;
    s.way_y[l] = s.way[l] * h.sin;
  }
}

MIMESIS_PART void go_turning(const WalkField& f, Table& t, int row, int m, const Column& turn,
                             Step& s) {
  const double* heading = t.heading.data() + row;
  double* before = t.heading_rate.data() + row;
  for (int l = 0; l < m; ++l) {
    s.heading[l] = increment(f.dt, turn[l], before[l]);
    before[l] = turn[l];
  }
  for (int l = 0; l < m; ++l) {
    const double by = s.heading[l];
    const CosSin mid = cos_sin_lane(heading[l] + 0.5 * by), to = cos_sin_lane(heading[l] + by);
    s.cos_heading[l] = to.cos;
    s.sin_heading[l] = to.sin;
    s.way_x[l] = s.way[l] * mid.cos;
    s.way_y[l] = s.way[l] * mid.sin;
  }
}

}  // namespace mimesis::crowd::rows
