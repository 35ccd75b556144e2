#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "nodes/crowd/engine/crowd_impl.h"

/// The loops of `walk`, over blocks of rows. They are vectorised for the instruction set of the
/// function that calls them, so they have to become part of it. Where a pointer may be to what a
/// loop writes, the compiler asks before. The equations in them are functions of rules/.
namespace mimesis::crowd::rows {

constexpr int kBlock = 64;  // rows at a time: their values stay in the first-level cache
using Column = double[kBlock];

/// Increments of one step, and directions after it, for the rows at hand.
struct Step {
  Column phase, heading, way, way_x, way_y;
  Column cos_phase, sin_phase, cos_heading, sin_heading;
};

/// Adams and Bashforth's two-step method; Euler's while there is no rate of the step before.
MIMESIS_PART double increment(double dt, double now, double before) {
  return dt * (1.5 * now - 0.5 * (before == before ? before : now));
}

/// z − d of m rows.
MIMESIS_PART void spacing(const WalkField& f, const double* x, const double* y, const double* place,
                          int m, Column& out) {
  for (int l = 0; l < m; ++l) {
    out[l] = (x[l] - f.origin_x) * f.along_x + (y[l] - f.origin_y) * f.along_y - place[l];
  }
}

/// Rule I: changes φ̇ of m rows.
MIMESIS_PART void keep_by_frequency(const WalkField& f, AgentTable& t, int row, int m,
                                    const Column& ahead, Column& rate) {
  Column error;
  if (f.frequency_error != nullptr) {
    for (int l = 0; l < m; ++l) error[l] = f.frequency_error[row + l];
  } else {
    for (int l = 0; l < m; ++l) error[l] = mean_field_error(ahead[l], f.error_sum, f.count);
  }
  if (f.low_pass > 0.0) {
    double* smoothed = t.smoothed.data() + row;
    for (int l = 0; l < m; ++l) {
      const double now = smoothed[l];
      smoothed[l] = low_passed(now, error[l], f.low_pass);
      error[l] = now;
    }
  }
  if (const double limit = f.saturation; limit > 0.0) {
    for (int l = 0; l < m; ++l) error[l] = saturate(error[l], limit);
  }
  for (int l = 0; l < m; ++l) rate[l] += frequency_change(f.frequency_gain, error[l]);
}

/// Rule II: μ of m rows.
MIMESIS_PART void keep_by_length(const WalkField& f, int row, int m, const Column& ahead,
                                 Column& length) {
  if (f.length_error != nullptr) {
    for (int l = 0; l < m; ++l) {
      length[l] = step_length_change(f.length_gain, f.length_limit, f.length_error[row + l]);
    }
  } else {
    for (int l = 0; l < m; ++l) {
      const double error = mean_field_error(ahead[l], f.error_sum, f.count);
      length[l] = step_length_change(f.length_gain, f.length_limit, error);
    }
  }
}

/// φ̇ and μ of m rows: rules I-III.
MIMESIS_PART void rates(const WalkField& f, AgentTable& t, int row, int m, const Column& ahead,
                        Column& rate, Column& length) {
  const double* omega = t.omega.data() + row;
  const double* phase = t.phase.data() + row;
  for (int l = 0; l < m; ++l) rate[l] = omega[l];
  if (f.pull != nullptr) {
    for (int l = 0; l < m; ++l) rate[l] += f.pull[row + l];
  } else if (f.pull_to.gain_1_s != 0.0) {
    const int leader = f.leader_row - row;
    const double kept = leader >= 0 && leader < m ? rate[leader] : 0.0;
    for (int l = 0; l < m; ++l) rate[l] += f.pull_to.rate(phase[l]);
    if (leader >= 0 && leader < m) rate[leader] = kept;
  }
  if (f.frequency_gain != 0.0) keep_by_frequency(f, t, row, m, ahead, rate);
  // An agent that is far ahead waits: a gait does not go backwards, and rules II and IV need φ̇ >= 0
  // [M18 4.4.2].
  for (int l = 0; l < m; ++l) rate[l] = rate[l] < 0.0 ? 0.0 : rate[l];
  for (int l = 0; l < m; ++l) length[l] = 0.0;
  if (f.length_gain != 0.0) keep_by_length(f, row, m, ahead, length);
}

/// The gait at one phase.
struct Wave {
  CosSin phase;
  double way;  // ∫ (g − ⟨g⟩) dφ
};

MIMESIS_PART Wave wave(const WalkField& f, double phase) {
  double way = 0.0;
  const CosSin one =
      for_multiples<SpeedFunction::kHarmonics>(phase, [&](int k, CosSin of) MIMESIS_LAMBDA {
        const auto h = static_cast<std::size_t>(k - 1);
        way += (f.cosine[h] * of.sin - f.sine[h] * of.cos) * (1.0 / k);
      });
  return {one, way};
}

/// Phases, and the ways along the headings: ż = (1 + μ) φ̇ g(φ) [M18 4.4.1] as the integral of
/// (1 + μ) g dφ over the step, with μ in its middle.
MIMESIS_PART void advance_phase(const WalkField& f, const AgentTable& t, int row, int m,
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
    s.cos_phase[l] = to.phase.cos;
    s.sin_phase[l] = to.phase.sin;
  }
}

/// Rule IV to goals: ψ̇ of m rows, and shorter steps of agents that arrive at their goals.
/// @param share  of navigation that an agent follows
MIMESIS_PART void turn_to_goals(const WalkField& f, const AgentTable& t, int row, int m,
                                Column& turn, Column& share, Step& s) {
  const double* heading = t.heading.data() + row;
  const double* x = t.x.data() + row;
  const double* y = t.y.data() + row;
  const double* gx = t.goal_x.data() + row;
  const double* gy = t.goal_y.data() + row;
  for (int l = 0; l < m; ++l) {
    const double dx = gx[l] - x[l], dy = gy[l] - y[l];
    const double r = std::sqrt(dx * dx + dy * dy);
    const double per_r = 1.0 / (r > 1e-9 ? r : 1e-9);
    const Turn to = goal_turn(f.heading_gain, cos_sin_lane(heading[l]), dx, dy, per_r);
    turn[l] = to.rate_rad_s;
    // At full speed an agent could only circle round a goal that is beside it, v/gain away: there
    // it walks the slower the less it faces the goal.
    const double near = r / f.arrive;
    const double circle = 2.0 * s.way[l] / (f.dt * f.heading_gain + 1e-9) + 1e-9;
    const double free = r < circle ? r / circle : 1.0;
    const double ahead = to.facing > 0.0 ? to.facing : 0.0;
    s.way[l] *= (free + (1.0 - free) * ahead) * (near < 1.0 ? near * ahead : 1.0);
    // Agents beside the goal do not turn it away from there, nor who does not get nearer for long.
    const double held =
        f.per_patience * static_cast<double>(t.held[static_cast<std::size_t>(row + l)]);
    share[l] = (to.facing < 0.0 ? 1.0 + to.facing : 1.0) * (near < 1.0 ? near : 1.0) *
               (held < 1.0 ? 1.0 - held : 0.0);
  }
}

/// ψ̇ of m rows, from the rates of their phases: rule IV and navigation.
MIMESIS_PART void headings(const WalkField& f, const AgentTable& t, int row, int m,
                           const Column& rate, Column& turn, Step& s) {
  const double* heading = t.heading.data() + row;
  // Share of navigation. An agent that is turned away from its goal listens the less to others, or
  // it would walk round and round a crowd that stands at its goals.
  Column share;
  for (int l = 0; l < kBlock; ++l) share[l] = 1.0;
  for (int l = 0; l < m; ++l) turn[l] = 0.0;
  if (f.heading == HeadingKind::lane) {
    const double* x = t.x.data() + row;
    const double* y = t.y.data() + row;
    const double* lane = t.lane.data() + row;
    for (int l = 0; l < m; ++l) {
      const double across = (y[l] - f.origin_y) * f.along_x - (x[l] - f.origin_x) * f.along_y;
      const Turn to = lane_turn(f.heading_gain, rate[l], cos_sin_lane(heading[l] - f.path_rad),
                                lane[l] - across, f.ahead);
      turn[l] = to.rate_rad_s;
      share[l] = to.facing < 0.0 ? 1.0 + to.facing : 1.0;
    }
  } else if (f.heading == HeadingKind::consensus) {
    for (int l = 0; l < m; ++l) {
      turn[l] = consensus_turn(f.heading_gain, rate[l], cos_sin_lane(heading[l]), f.mean_heading);
    }
  } else if (f.heading == HeadingKind::coupled) {
    for (int l = 0; l < m; ++l) {
      turn[l] = coupled_turn(f.heading_gain, cos_sin_lane(heading[l]), f.mean_heading);
    }
  } else if (f.heading == HeadingKind::goal) {
    turn_to_goals(f, t, row, m, turn, share, s);
  }
  if (f.sways && (f.heading == HeadingKind::lane || f.heading == HeadingKind::consensus)) {
    const double* phase = t.phase.data() + row;
    for (int l = 0; l < m; ++l) turn[l] += rate[l] * f.sway(phase[l]);
  }
  if (f.turn != nullptr) {
    // Linearly implicit: terms of navigation vanish where an agent has turned by their width, so
    // Δψ = dt f (1 − |Δψ|/σ_φ). Explicit steps of 0.1 s and more turn beyond that, and back.
    for (int l = 0; l < m; ++l) {
      const double navigation = share[l] * f.turn[row + l];
      turn[l] += navigation / (1.0 + f.per_width * std::fabs(navigation));
    }
  }
}

MIMESIS_PART void go_straight(const AgentTable& t, int row, int m, Step& s) {
  const double* heading = t.heading.data() + row;
  for (int l = 0; l < m; ++l) {
    const CosSin h = cos_sin_lane(heading[l]);
    s.cos_heading[l] = h.cos;
    s.sin_heading[l] = h.sin;
    s.way_x[l] = s.way[l] * h.cos;
    s.way_y[l] = s.way[l] * h.sin;
  }
}

MIMESIS_PART void go_turning(const WalkField& f, AgentTable& t, int row, int m, const Column& turn,
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

// Sums over rows, added in an order that depends on nothing.

constexpr int kSumLanes = 8;

struct Lanes {
  double count[kSumLanes]{}, cos_phase[kSumLanes]{}, sin_phase[kSumLanes]{}, error[kSumLanes]{},
      cos_heading[kSumLanes]{}, sin_heading[kSumLanes]{};
};

/// Adds m values; those behind are set to zero.
MIMESIS_PART void add_to(double (&sum)[kSumLanes], Column& value, int m) {
  for (int l = m; l < kBlock; ++l) value[l] = 0.0;
  for (int k = 0; k < kBlock; k += kSumLanes) {
    for (int l = 0; l < kSumLanes; ++l) sum[l] += value[k + l];
  }
}

MIMESIS_PART double total(const double (&s)[kSumLanes]) {
  return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

MIMESIS_PART void add_sums(const WalkField& f, const AgentTable& t, int row, int m, Column& ahead,
                           Column& cp, Column& sp, Column& ch, Column& sh, Lanes& sums) {
  Column one;
  for (int l = 0; l < m; ++l) one[l] = 1.0;
  if (f.mixed) {
    for (int l = 0; l < m; ++l) {
      if (is_coupled(t.role[static_cast<std::size_t>(row + l)])) continue;
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

MIMESIS_PART GroupSums totals(const Lanes& sums) {
  return {total(sums.count), total(sums.cos_phase),   total(sums.sin_phase),
          total(sums.error), total(sums.cos_heading), total(sums.sin_heading)};
}

MIMESIS_PART GroupSums sum_rows(const WalkField& f, const AgentTable& t, int first, int last) {
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

/// Agents that others move go straight on until the next message about them.
MIMESIS_PART void keep_others(const WalkField& f, const AgentTable& t, int row, int m, Column& rate,
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

MIMESIS_PART void store(AgentTable& t, int row, int m, const Column& rate, const Column& length,
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

MIMESIS_PART GroupSums walk_rows(const WalkField& f, AgentTable& t, int first, int last) {
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
