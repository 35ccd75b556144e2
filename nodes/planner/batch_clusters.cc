// Part of BatchChecker: which balls are a cluster, and how far each joint moves it at most.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/error.h"
#include "nodes/planner/batch_checker.h"

namespace mimesis::planner {
namespace {

constexpr double kRounding = 1e-5;  // [m]
constexpr std::size_t kMostInCluster = 12;
constexpr std::size_t kMostInGroup = 5;

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

std::vector<std::vector<std::size_t>> near_each_other(const Eigen::Matrix3Xd& points,
                                                      std::size_t most) {
  struct Indexed {
    Eigen::Vector3d p;
    std::size_t index;
  };
  std::vector<Indexed> all;
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    all.push_back({points.col(i), static_cast<std::size_t>(i)});
  std::vector<std::vector<std::size_t>> parts;
  if (all.empty()) return parts;
  split(all, 0, all.size(), most, [&](std::size_t from, std::size_t to) {
    parts.emplace_back();
    for (std::size_t i = from; i < to; ++i) parts.back().push_back(all[i].index);
  });
  return parts;
}

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
void BatchChecker::bound_reach(const kin::ArmModel& arm, Cluster& cluster) {
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
    levers_[j] = std::max(levers_[j], static_cast<double>(cluster.reach[j]));
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
  for (const kin::Hull& hull : obstacles.hulls)
    for (const math::RoundBound& ball : hull.cover) all.push_back({ball.center, ball.radius});
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
