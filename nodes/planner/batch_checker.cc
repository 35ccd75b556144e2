#include "nodes/planner/batch_checker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "common/error.h"
#include "common/math/vector_clones.h"

namespace mimesis::planner {
namespace {

constexpr double kRounding = 1e-5;  // [m]
constexpr std::size_t kMostInCluster = 12;
constexpr std::size_t kMostInGroup = 5;

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

namespace {

struct ArmBall {
  std::size_t frame = 0;
  int group = 0;
  bool held = false, against_obstacles = true;
  Eigen::Vector3d p;  // in the frame of the joint's axis
  double r = 0.0;
};

/// Halves [begin, end) along its longest side until parts are small; calls `part(begin, end)`.
template <class T, class Part>
void split(std::vector<T>& all, std::size_t begin, std::size_t end, std::size_t most,
           const Part& part) {
  if (end - begin <= most) return part(begin, end);
  Eigen::Vector3d lo = all[begin].p, hi = lo;
  for (std::size_t i = begin; i < end; ++i) {
    lo = lo.cwiseMin(all[i].p);
    hi = hi.cwiseMax(all[i].p);
  }
  Eigen::Index axis = 0;
  (hi - lo).maxCoeff(&axis);
  const auto at = [&](std::size_t i) { return all.begin() + static_cast<std::ptrdiff_t>(i); };
  const std::size_t middle = (begin + end + 1) / 2;
  std::nth_element(at(begin), at(middle), at(end),
                   [axis](const T& a, const T& b) { return a.p[axis] < b.p[axis]; });
  split(all, begin, middle, most, part);
  split(all, middle, end, most, part);
}

/// Ball around the balls [begin, end), and the largest distance of their centres from its own.
template <class T>
std::pair<Eigen::Vector4d, double> around(const std::vector<T>& all, std::size_t begin,
                                          std::size_t end) {
  Eigen::Vector3d lo = all[begin].p, hi = lo;
  for (std::size_t i = begin; i < end; ++i) {
    lo = lo.cwiseMin(all[i].p);
    hi = hi.cwiseMax(all[i].p);
  }
  const Eigen::Vector3d center = 0.5 * (lo + hi);
  double radius = 0.0, spread = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    spread = std::max(spread, (all[i].p - center).norm());
    radius = std::max(radius, (all[i].p - center).norm() + all[i].r);
  }
  return {{center.x(), center.y(), center.z(), radius}, spread};
}

/// At least the value, which is not negative.
float rounded_up(double value) { return static_cast<float>(value) * (1.0f + 0x1.0p-22f); }

std::array<float, 3> floats(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

BatchChecker::BatchChecker(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m)
    : margin_(static_cast<float>(margin_m)) {
  MIMESIS_ASSERT(static_cast<std::size_t>(arm.dof()) <= kMostJoints);
  steps_.reserve(arm.links.size());
  Eigen::Isometry3d rest = Eigen::Isometry3d::Identity();
  const Eigen::Matrix3d by_90 = Eigen::AngleAxisd(M_PI_2, Eigen::Vector3d::UnitX()).matrix();
  for (const kin::DhLink& link : arm.links) {
    const Eigen::Isometry3d C = rest * link.before_joint();
    rest = link.after_joint();
    Step step;
    const Eigen::Matrix3d R = C.linear();
    for (Eigen::Index i = 0; i < 9; ++i)
      step.R[static_cast<std::size_t>(i)] = static_cast<float>(R(i / 3, i % 3));
    step.turn = R.isApprox(Eigen::Matrix3d::Identity(), 1e-12) ? Step::Turn::none
                : R.isApprox(by_90, 1e-12)                     ? Step::Turn::x_by_90
                : R.isApprox(by_90.transpose(), 1e-12)         ? Step::Turn::x_by_minus_90
                                                               : Step::Turn::any;
    step.t = floats(C.translation());
    step.offset = static_cast<float>(link.offset);
    step.slides = link.slides;
    steps_.push_back(step);
  }
  const auto broadcast = [](const Eigen::Vector3f& v) {
    return Place{v.x() - Lanes{}, v.y() - Lanes{}, v.z() - Lanes{}};
  };
  twists_.front() = Twist();
  const Eigen::Isometry3f base = arm.X_WB.cast<float>();
  frames_[0] = {broadcast(base.linear().col(0)), broadcast(base.linear().col(1)),
                broadcast(base.linear().col(2)), broadcast(base.translation())};
  add_arm(arm, obstacles, margin_m);
  add_obstacles(obstacles);
}

/// From its frame to the base: what the centres can reach when a joint turns is a solid of
/// revolution, of which a cylinder about the axis remains.
void BatchChecker::bound_reach(const kin::ArmModel& arm, Cluster& cluster) const {
  double rho = 0.0, lo = std::numeric_limits<double>::infinity(), hi = -lo;
  for (std::size_t i = cluster.begin; i < cluster.end; ++i) {
    const auto& p = balls_[i].p;
    rho = std::max(rho, std::hypot(static_cast<double>(p[0]), static_cast<double>(p[1])));
    lo = std::min(lo, static_cast<double>(p[2]));
    hi = std::max(hi, static_cast<double>(p[2]));
  }
  for (std::size_t j = cluster.frame; j-- > 0;) {
    const Step& step = steps_[j];
    cluster.reach[j] = step.slides ? 1.0f : rounded_up((1.0 + 1e-6) * rho + 1e-6);
    if (step.slides) {
      lo += arm.q_min[static_cast<Eigen::Index>(j)];
      hi += arm.q_max[static_cast<Eigen::Index>(j)];
    }
    const auto R = [&](std::size_t i) { return static_cast<double>(step.R[i]); };
    const auto away = [&](double z) {
      return std::hypot(step.t[0] + z * R(2), step.t[1] + z * R(5));
    };
    const double farther = std::max(away(lo), away(hi)) + rho;
    const double swing = rho * std::hypot(R(6), R(7));
    const double one = R(8) * lo, other = R(8) * hi;
    lo = step.t[2] + std::min(one, other) - swing;
    hi = step.t[2] + std::max(one, other) + swing;
    rho = farther;
  }
}

void BatchChecker::add_arm(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m) {
  std::vector<ArmBall> balls;
  balls.reserve(arm.balls.size() + obstacles.held.size());
  balls_.reserve(balls.capacity());
  clusters_.reserve(arm.links.size() + 2);
  const auto add = [&](int frame, int group, bool held, bool env, const Eigen::Vector3d& p,
                       double r) {
    const auto f = static_cast<std::size_t>(frame);
    balls.push_back({f, group, held, env, f == 0 ? p : arm.links[f - 1].after_joint() * p, r});
  };
  int hand = arm.balls.empty() ? 0 : arm.balls.back().group;
  for (const auto& ball : arm.balls) {
    add(ball.frame, ball.group, false,
        std::find(arm.env_groups.begin(), arm.env_groups.end(), ball.group) != arm.env_groups.end(),
        ball.center, ball.radius);
    if (ball.frame == arm.dof()) hand = ball.group;
  }
  for (const auto& ball : obstacles.held)
    add(arm.dof(), hand, true, true, arm.X_LE * ball.center, ball.radius);
  // The hand first: it is the likeliest to touch.
  const auto key = [](const ArmBall& b) {
    return std::tuple(!b.against_obstacles, -static_cast<int>(b.frame), b.group, b.held);
  };
  std::stable_sort(balls.begin(), balls.end(),
                   [&](const ArmBall& a, const ArmBall& b) { return key(a) < key(b); });
  std::vector<int> group;  // of clusters
  for (std::size_t begin = 0, end = 0; begin < balls.size(); begin = end) {
    while (end < balls.size() && key(balls[end]) == key(balls[begin])) ++end;
    split(balls, begin, end, kMostInCluster, [&](std::size_t from, std::size_t to) {
      const auto [ball, spread] = around(balls, from, to);
      const ArmBall& first = balls[from];
      for (std::size_t i = from; i < to; ++i)
        balls_.push_back({floats(balls[i].p), rounded_up(balls[i].r + margin_m + kRounding)});
      clusters_.push_back({first.frame,
                           from,
                           to,
                           {floats(ball.head<3>()), rounded_up(ball[3] + margin_m + kRounding)},
                           rounded_up(spread + 1e-6),
                           first.held,
                           first.against_obstacles});
      bound_reach(arm, clusters_.back());
      group.push_back(first.group);
    });
  }
  for (const auto& [group_a, group_b] : arm.self_pairs) {
    for (std::size_t a = 0; a < clusters_.size(); ++a) {
      for (std::size_t b = 0; b < clusters_.size(); ++b) {
        if (group[a] != group_a || group[b] != group_b) continue;
        const bool ordered = clusters_[a].frame <= clusters_[b].frame;
        pairs_.push_back(ordered ? Pair{a, b} : Pair{b, a});
      }
    }
  }
  centers_.resize(clusters_.size());
  bounds_.resize(clusters_.size());
  placed_.resize(clusters_.size());
  at_.resize(balls_.size());
}

void BatchChecker::add_obstacles(const Obstacles& obstacles) {
  struct Given {
    Eigen::Vector3d p;
    double r;
  };
  std::vector<Given> all;
  all.reserve(obstacles.balls.size());
  obstacles_.reserve(obstacles.balls.size());
  groups_.reserve(obstacles.balls.size() / 2 + 1);
  for (const auto& ball : obstacles.balls) all.push_back({ball.center, ball.radius});
  if (!all.empty()) {
    split(all, 0, all.size(), kMostInGroup, [&](std::size_t from, std::size_t to) {
      const Eigen::Vector4d ball = around(all, from, to).first;
      groups_.push_back({from, to, {floats(ball.head<3>()), rounded_up(ball[3])}});
    });
  }
  for (const Given& ball : all) obstacles_.push_back({floats(ball.p), rounded_up(ball.r)});
  for (const auto& box : obstacles.boxes)
    boxes_.push_back({floats(box.center), floats(box.half_extent)});
  for (const auto& box : obstacles.supports)
    supports_.push_back({floats(box.center), floats(box.half_extent)});
}

}  // namespace mimesis::planner
