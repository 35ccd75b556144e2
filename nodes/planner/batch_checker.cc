#include "nodes/planner/batch_checker.h"

#include "common/math/vector_clones.h"

namespace mimesis::planner {
namespace {

using Ints = std::int32_t __attribute__((vector_size(4 * kLanes), aligned(4 * kLanes)));

#define MIMESIS_INLINE __attribute__((always_inline)) inline

MIMESIS_INLINE bool any(const Ints& mask) {
  using Half = std::int64_t __attribute__((vector_size(2 * kLanes)));
  using HalfInts = std::int32_t __attribute__((vector_size(2 * kLanes)));
  const HalfInts both = __builtin_shufflevector(mask, mask, 0, 1, 2, 3) |
                        __builtin_shufflevector(mask, mask, 4, 5, 6, 7);
  const Half bits = __builtin_bit_cast(Half, both);
  return (bits[0] | bits[1]) != 0;
}

MIMESIS_INLINE std::uint32_t bits_of(const Ints& mask) {
  std::uint32_t bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= (static_cast<std::uint32_t>(mask[i]) & 1u) << i;
  return bits;
}

/// At least √v, at most 3e-5 of it more; by Newton's iteration, the same with any processor.
MIMESIS_INLINE Lanes root_at_least(const Lanes& v) {
  const Lanes x = v + 1e-20f;
  const Ints guess = 0x5f3759df - (__builtin_bit_cast(Ints, x) >> 1);
  Lanes y = __builtin_bit_cast(Lanes, guess);  // 1/√x
  y = y * (1.5f - 0.5f * x * y * y);
  y = y * (1.5f - 0.5f * x * y * y);
  return x * y * 1.00002f;
}

/// Sine and cosine to 1e-7, |angle| < 1000 rad: the quadrant, and polynomials (Cephes) within ±π/4.
MIMESIS_INLINE void turn(const Lanes& angle, Lanes& sine, Lanes& cosine) {
  constexpr float kRound = 12582912.0f;  // 1.5 · 2²³: adding it leaves whole numbers
  const Lanes shifted = angle * 0.636619772f + kRound;
  const Ints quadrant = __builtin_bit_cast(Ints, shifted);
  const Lanes n = shifted - kRound;
  const Lanes x =
      ((angle - n * 1.5703125f) - n * 4.837512969970703125e-4f) - n * 7.549789948768648e-8f;
  const Lanes xx = x * x;
  const Lanes s =
      x + x * xx * (-1.6666654611e-1f + xx * (8.3321608736e-3f - xx * 1.9515295891e-4f));
  const Lanes c =
      1.0f - 0.5f * xx +
      xx * xx *
          (4.166664568298827e-2f + xx * (-1.388731625493765e-3f + xx * 2.443315711809948e-5f));
  const Ints odd = (quadrant & 1) != 0;
  const Ints s_sign = (quadrant & 2) << 30, c_sign = ((quadrant + 1) & 2) << 30;
  const Ints s_bits = __builtin_bit_cast(Ints, s), c_bits = __builtin_bit_cast(Ints, c);
  const Ints sine_bits = ((odd & c_bits) | (~odd & s_bits)) ^ s_sign;
  const Ints cosine_bits = ((odd & s_bits) | (~odd & c_bits)) ^ c_sign;
  sine = __builtin_bit_cast(Lanes, sine_bits);
  cosine = __builtin_bit_cast(Lanes, cosine_bits);
}

}  // namespace

/// The inner loops. All is inlined into the one function that has a clone for each instruction set.
struct BatchKernel {
  using Frame = BatchChecker::Frame;
  using Place = BatchChecker::Place;
  using Point = BatchChecker::Point;
  using Step = BatchChecker::Step;
  using Cluster = BatchChecker::Cluster;

  static MIMESIS_INLINE void add(Place& p, float by, const Place& axis) {
    if (by == 0.0f) return;
    p.x += by * axis.x;
    p.y += by * axis.y;
    p.z += by * axis.z;
  }

  static MIMESIS_INLINE Place minus(const Place& p) { return {-p.x, -p.y, -p.z}; }

  static MIMESIS_INLINE Place combined(const Frame& f, float a, float b, float c) {
    Place p{a * f.x.x, a * f.x.y, a * f.x.z};
    add(p, b, f.y);
    add(p, c, f.z);
    return p;
  }

  static MIMESIS_INLINE Place placed(const Frame& f, const Point& point) {
    Place p = f.p;
    add(p, point.p[0], f.x);
    add(p, point.p[1], f.y);
    add(p, point.p[2], f.z);
    return p;
  }

  static MIMESIS_INLINE void move(const Frame& before, const Step& step, const Lanes& q,
                                  Frame& after) {
    Frame f = before;
    add(f.p, step.t[0], before.x);
    add(f.p, step.t[1], before.y);
    add(f.p, step.t[2], before.z);
    switch (step.turn) {
      case Step::Turn::none:
        break;
      case Step::Turn::x_by_90:
        f.y = before.z;
        f.z = minus(before.y);
        break;
      case Step::Turn::x_by_minus_90:
        f.y = minus(before.z);
        f.z = before.y;
        break;
      case Step::Turn::any:
        f.x = combined(before, step.R[0], step.R[3], step.R[6]);
        f.y = combined(before, step.R[1], step.R[4], step.R[7]);
        f.z = combined(before, step.R[2], step.R[5], step.R[8]);
    }
    if (step.slides) {
      after = f;
      after.p = {f.p.x + q * f.z.x, f.p.y + q * f.z.y, f.p.z + q * f.z.z};
      return;
    }
    Lanes s, c;
    turn(q + step.offset, s, c);
    after.x = {c * f.x.x + s * f.y.x, c * f.x.y + s * f.y.y, c * f.x.z + s * f.y.z};
    after.y = {c * f.y.x - s * f.x.x, c * f.y.y - s * f.x.y, c * f.y.z - s * f.x.z};
    after.z = f.z;
    after.p = f.p;
  }

  static MIMESIS_INLINE Lanes squared(const Place& a, const Place& b) {
    const Lanes dx = a.x - b.x, dy = a.y - b.y, dz = a.z - b.z;
    return dx * dx + dy * dy + dz * dz;
  }
  static MIMESIS_INLINE Lanes squared(const Place& a, const std::array<float, 3>& b) {
    const Lanes dx = a.x - b[0], dy = a.y - b[1], dz = a.z - b[2];
    return dx * dx + dy * dy + dz * dz;
  }
  static MIMESIS_INLINE Lanes outside(const Lanes& x, float c, float h) {
    const Lanes d = x - c, a = d < 0.0f ? -d : d, o = a - h;
    return o > 0.0f ? o : Lanes{};
  }
  static MIMESIS_INLINE Lanes squared(const Place& a, const BatchChecker::Cuboid& b) {
    const Lanes dx = outside(a.x, b.c[0], b.h[0]), dy = outside(a.y, b.c[1], b.h[1]),
                dz = outside(a.z, b.c[2], b.h[2]);
    return dx * dx + dy * dy + dz * dz;
  }

  struct Flags {
    Ints touches{}, near{};
  };

  static MIMESIS_INLINE void compare(const Lanes& distance_squared, float reach, const Lanes& bound,
                                     Flags& flags) {
    flags.touches |= distance_squared < reach * reach;
    const Lanes far = reach + bound;
    flags.near |= distance_squared < far * far;
  }

  /// D of a cluster for every frame below its own.
  static MIMESIS_INLINE void bound_motion(BatchChecker& c, std::size_t index,
                                          const BatchChecker::Postures& postures) {
    const Cluster& cluster = c.clusters_[index];
    auto& bounds = c.bounds_[index];
    const Place& p = c.centers_[index];
    Lanes D{};
    bounds[cluster.frame] = D;
    for (std::size_t j = cluster.frame; j-- > 0;) {
      if (c.steps_[j].slides) {
        bounds[j] = D = D + postures.deviation[j];
        continue;
      }
      const Frame& axis = c.frames_[j + 1];
      const Lanes dx = p.x - axis.p.x, dy = p.y - axis.p.y, dz = p.z - axis.p.z;
      const Lanes along = dx * axis.z.x + dy * axis.z.y + dz * axis.z.z;
      const Lanes squared = dx * dx + dy * dy + dz * dz - along * along;
      const Lanes rho = root_at_least(squared > 0.0f ? squared : Lanes{}) + cluster.spread;
      D = D + (rho + D) * postures.deviation[j];
      bounds[j] = D;
    }
  }

  static MIMESIS_INLINE void cross(const Place& a, const Place& b, Place& sum) {
    sum.x += a.y * b.z - a.z * b.y;
    sum.y += a.z * b.x - a.x * b.z;
    sum.z += a.x * b.y - a.y * b.x;
  }

  static MIMESIS_INLINE Lanes length(const Place& p) {
    return root_at_least(p.x * p.x + p.y * p.y + p.z * p.z);
  }

  /// Twists of the frames on a line, and what the bounds of its curvature have in common.
  static MIMESIS_INLINE void start_lines(BatchChecker& c, const BatchChecker::Postures& postures) {
    Lanes sum{};
    for (std::size_t j = 0; j < c.steps_.size(); ++j) {
      const Frame& axis = c.frames_[j + 1];
      const Lanes d = postures.deviation[j], size = d < 0.0f ? -d : d;
      const Place z{d * axis.z.x, d * axis.z.y, d * axis.z.z};
      BatchChecker::Twist twist = c.twists_[j];
      if (c.steps_[j].slides) {
        twist.move = {twist.move.x + z.x, twist.move.y + z.y, twist.move.z + z.z};
        c.squares_[j] = 2.0f * size * sum;
      } else {
        twist.turn = {twist.turn.x + z.x, twist.turn.y + z.y, twist.turn.z + z.z};
        cross(axis.p, z, twist.move);
        c.squares_[j] = size * (size + 2.0f * sum);
        sum += size;
      }
      twist.speed = length(twist.turn);
      c.twists_[j + 1] = twist;
    }
  }

  static MIMESIS_INLINE void bound_line(BatchChecker& c, std::size_t index,
                                        const BatchChecker::Postures& postures) {
    const Cluster& cluster = c.clusters_[index];
    auto& bounds = c.bounds_[index];
    Lanes D{}, R{};
    bounds[cluster.frame] = D;
    for (std::size_t j = cluster.frame; j-- > 0;) {
      const Lanes d = postures.deviation[j];
      D += cluster.reach[j] * (d < 0.0f ? -d : d);
      R += cluster.reach[j] * c.squares_[j];
      bounds[j] = D;
    }
    const BatchChecker::Twist& twist = c.twists_[cluster.frame];
    Place u = twist.move;
    cross(twist.turn, c.centers_[index], u);
    const Lanes line = length(u) + cluster.spread * twist.speed + 0.5f * R;
    bounds[0] = line < D ? line : D;
  }

  static MIMESIS_INLINE void place_balls(BatchChecker& c, std::size_t index) {
    if (c.placed_[index]) return;
    c.placed_[index] = 1;
    const Cluster& cluster = c.clusters_[index];
    for (std::size_t i = cluster.begin; i < cluster.end; ++i)
      c.at_[i] = placed(c.frames_[cluster.frame], c.balls_[i]);
  }

  template <class Obstacle>
  static MIMESIS_INLINE void against(BatchChecker& c, std::size_t index, const Obstacle& obstacle,
                                     float radius, const Lanes& bound, Flags& flags) {
    place_balls(c, index);
    const Cluster& cluster = c.clusters_[index];
    for (std::size_t i = cluster.begin; i < cluster.end; ++i)
      compare(squared(c.at_[i], obstacle), c.balls_[i].r + radius, bound, flags);
  }

  static MIMESIS_INLINE Ints overlap(const Lanes& distance_squared, float reach,
                                     const Lanes& bound) {
    const Lanes far = reach + bound;
    return distance_squared < far * far;
  }

  template <bool until_any>
  static MIMESIS_INLINE void against_obstacles(BatchChecker& c, std::size_t index,
                                               const Lanes& bound, Flags& flags) {
    const Cluster& cluster = c.clusters_[index];
    const Place& center = c.centers_[index];
    const float r = cluster.ball.r;
    for (const auto& box : c.boxes_) {
      if (any(overlap(squared(center, box), r, bound) & ~flags.touches))
        against(c, index, box, 0.0f, bound, flags);
    }
    if (!cluster.held) {
      for (const auto& box : c.supports_) {
        if (any(overlap(squared(center, box), r, bound)))
          against(c, index, box, 0.0f, bound, flags);
      }
    }
    for (const auto& group : c.groups_) {
      if (!any(overlap(squared(center, group.ball.p), r + group.ball.r, bound) & ~flags.touches))
        continue;
      for (std::size_t o = group.begin; o < group.end; ++o) {
        const Point& obstacle = c.obstacles_[o];
        if (any(overlap(squared(center, obstacle.p), r + obstacle.r, bound) & ~flags.touches))
          against(c, index, obstacle.p, obstacle.r, bound, flags);
      }
      if (until_any && any(flags.touches)) return;
    }
  }

  static MIMESIS_INLINE void against_itself(BatchChecker& c, const BatchChecker::Pair& pair,
                                            const Lanes& bound, Flags& flags) {
    const Cluster &a = c.clusters_[pair.a], &b = c.clusters_[pair.b];
    const Lanes apart = squared(c.centers_[pair.a], c.centers_[pair.b]);
    if (!any(overlap(apart, a.ball.r + b.ball.r, bound) & ~flags.touches)) return;
    place_balls(c, pair.a);
    place_balls(c, pair.b);
    for (std::size_t i = a.begin; i < a.end; ++i) {
      for (std::size_t k = b.begin; k < b.end; ++k) {
        compare(squared(c.at_[i], c.at_[k]), c.balls_[i].r + c.balls_[k].r - c.margin_, bound,
                flags);
      }
    }
  }

  template <BatchChecker::Mode mode>
  static MIMESIS_INLINE BatchChecker::Verdicts run(BatchChecker& c,
                                                   const BatchChecker::Postures& postures) {
    using Mode = BatchChecker::Mode;
    constexpr bool motions = mode == Mode::boxes || mode == Mode::lines;
    constexpr std::uint32_t all = (1u << kLanes) - 1u;
    for (std::size_t j = 0; j < c.steps_.size(); ++j)
      move(c.frames_[j], c.steps_[j], postures.q[j], c.frames_[j + 1]);
    if (mode == Mode::lines) start_lines(c, postures);
    Flags flags;
    for (std::size_t k = 0; k < c.clusters_.size(); ++k) {
      const Cluster& cluster = c.clusters_[k];
      c.centers_[k] = placed(c.frames_[cluster.frame], cluster.ball);
      c.placed_[k] = 0;
      if (mode == Mode::boxes) bound_motion(c, k, postures);
      if (mode == Mode::lines) bound_line(c, k, postures);
      if (!cluster.against_obstacles) continue;
      against_obstacles<mode != Mode::postures>(c, k, motions ? c.bounds_[k][0] : Lanes{}, flags);
      if (mode != Mode::postures && any(flags.touches)) return {all, 0u};
    }
    for (const auto& pair : c.pairs_) {
      const Lanes bound = motions ? c.bounds_[pair.b][c.clusters_[pair.a].frame] : Lanes{};
      against_itself(c, pair, bound, flags);
    }
    const std::uint32_t touches = bits_of(flags.touches);
    return {touches, motions ? bits_of(flags.near) & ~touches : 0u};
  }
};

MIMESIS_VECTOR_CLONES
BatchChecker::Verdicts BatchChecker::judge(const Postures& postures) {
  return BatchKernel::run<Mode::postures>(*this, postures);
}

MIMESIS_VECTOR_CLONES
bool BatchChecker::any_touches(const Postures& postures) {
  return BatchKernel::run<Mode::any_posture>(*this, postures).touches != 0;
}

MIMESIS_VECTOR_CLONES
BatchChecker::Verdicts BatchChecker::judge_motions(const Postures& postures) {
  return BatchKernel::run<Mode::boxes>(*this, postures);
}

MIMESIS_VECTOR_CLONES
BatchChecker::Verdicts BatchChecker::judge_lines(const Postures& postures) {
  return BatchKernel::run<Mode::lines>(*this, postures);
}

}  // namespace mimesis::planner
