#include "nodes/synthesizer/dynamics/root_cycle.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kTravelHarmonics = 3;  // of travel, turn and height
constexpr int kTerms = 1 + 2 * kTravelHarmonics;
constexpr double kLow = 0.015, kSlow = 0.5;  // m, m/s: a foot that stands
constexpr double kRests = 0.1;               // m/s: a foot that rests says the travel best
constexpr double kShortest = 0.05;           // s: shorter contacts, and breaks of one, are none
constexpr double kFarthestChange = 0.5;      // rad
constexpr double kUnreached = 30.0;          // weight of a leg that is too short for the height
constexpr double kRelease = 0.7;             // a foot leaves the slower, by phase
constexpr double kCalm = 0.002;              // weight of the height's acceleration, per rad
constexpr double kLegReserve = 0.002;        // m, of a leg
constexpr double kStill = 1e-6;              // m
constexpr int kTurns = 4;

Vector3d wide(Vec3 v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

Vector2d rotated(const Vector2d& v, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
}

/// A leg at a phase, in H.
struct Leg {
  Vector3d hip, ankle, heel, toe;
  double sole;  ///< height of its lower end [m]
  double heel_share;

  Vector2d resting() const { return (toe + heel_share * (heel - toe)).head<2>(); }
  Vector2d along() const { return (toe - heel).head<2>(); }
};

/// The legs of all phases, and what follows from them.
class Cycle {
 public:
  Cycle(const BodyLanes& body, std::span<const float> angle_rad, double duration_s)
      : count_(static_cast<int>(angle_rad.size()) / mocap::kBodyRows),
        step_rad_(math::kTwoPi / count_),
        rate_(count_ / duration_s) {
    for (auto& leg : leg_) leg.resize(static_cast<std::size_t>(count_));
    for (auto& stands : stands_) stands.assign(static_cast<std::size_t>(count_), false);
    for (auto& weight : weight_) weight.assign(static_cast<std::size_t>(count_), 1.0);
    for (int first = 0; first < count_; first += kLanes) read(body, angle_rad, first);
    for (int f = 0; f < 2; ++f) {
      const int knee = f == 0 ? mocap::kLeftKnee : mocap::kRightKnee;
      reach_[f] = wide(body.offset[knee]).norm() + wide(body.offset[knee + 1]).norm() - kLegReserve;
    }
  }

  bool still() const {
    for (const auto& leg : leg_) {
      for (const Leg& l : leg) {
        if ((l.heel - leg[0].heel).norm() + (l.toe - leg[0].toe).norm() > kStill) return false;
      }
    }
    return true;
  }

  void learn() {
    for (int turn = 0; turn < kTurns; ++turn) {
      find_contacts(turn == 0);
      fit_travel();
    }
    fit_height();
    for (int f = 0; f < 2; ++f) find_lead(f);
  }

  std::vector<float> rows() const {
    std::vector<float> out(static_cast<std::size_t>(count_ * kRootStride), 0.0F);
    for (int n = 0; n < count_; ++n) {
      float* row = out.data() + n * kRootStride;
      const double phase = n * step_rad_;
      row[kRootForward] = static_cast<float>(value(forward_, phase));
      row[kRootLeft] = static_cast<float>(value(left_, phase));
      row[kRootTurn] = static_cast<float>(value(turn_, phase));
      row[kRootHeight] = static_cast<float>(value(height_, phase));
      row[kRootLeftStands] = static_cast<float>(margin(0, n));
      row[kRootRightStands] = static_cast<float>(margin(1, n));
      row[kRootWalks] = 1.0F;
      for (int f = 0; f < 2; ++f) {
        for (int axis = 0; axis < 2; ++axis) {
          row[kRootLeftLead + 2 * f + axis] = static_cast<float>(lead_[f][axis]);
        }
      }
    }
    return out;
  }

  float standing_height() const {
    return static_cast<float>(-std::min(leg_[0][0].sole, leg_[1][0].sole));
  }

 private:
  using Series = Eigen::Matrix<double, kTerms, 1>;

  void read(const BodyLanes& body, std::span<const float> angle_rad, int first) {
    alignas(64) Lane angle[mocap::kBodyRows];
    for (int l = 0; l < kLanes; ++l) {
      const auto n = static_cast<std::size_t>(std::min(first + l, count_ - 1));
      for (std::size_t b = 0; b < mocap::kBodyRows; ++b) {
        angle[b][l] = angle_rad[n * mocap::kBodyRows + b];
      }
    }
    RotationLanes rotation;
    PointLanes point;
    posture(body, angle, rotation, point);
    for (int l = 0; l < std::min(kLanes, count_ - first); ++l) {
      for (int f = 0; f < 2; ++f) {
        const int hip = f == 0 ? mocap::kLeftHip : mocap::kRightHip;
        const Vec3 heel = load(point.foot[2 * f], l), toe = load(point.foot[2 * f + 1], l);
        leg_[f][static_cast<std::size_t>(first + l)] = {
            .hip = wide(load(point.joint[hip], l)),
            .ankle = wide(load(point.joint[hip + 2], l)),
            .heel = wide(heel),
            .toe = wide(toe),
            .sole = static_cast<double>(sole_lane(heel.z, toe.z)),
            .heel_share = static_cast<double>(heel_share_lane(heel.z, toe.z))};
      }
    }
  }

  const Leg& leg(int f, int n) const {
    return leg_[f][static_cast<std::size_t>((n + count_) % count_)];
  }
  static Series basis(double phase_rad) {
    Series b;
    b[0] = 1.0;
    for (int h = 1; h <= kTravelHarmonics; ++h) {
      b[2 * h - 1] = std::cos(h * phase_rad);
      b[2 * h] = std::sin(h * phase_rad);
    }
    return b;
  }
  static double value(const Series& series, double phase_rad) {
    return series.dot(basis(phase_rad));
  }
  /// Travel from phase n to the next one if foot f rests and the heading turns so far.
  Vector2d travel(int f, int n, double turn_rad) const {
    const double share = 0.5 * (leg(f, n).heel_share + leg(f, n + 1).heel_share);
    const auto point = [share](const Leg& l) -> Vector2d {
      return (l.toe + share * (l.heel - l.toe)).head<2>();
    };
    return rotated(point(leg(f, n)), -0.5 * turn_rad) -
           rotated(point(leg(f, n + 1)), 0.5 * turn_rad);
  }
  double turned(int f, int n) const {
    const Vector2d a = leg(f, n).along(), b = leg(f, n + 1).along();
    if (a.norm() * b.norm() < 1e-6) return 0.0;
    return std::atan2(b.x() * a.y() - b.y() * a.x(), a.dot(b));
  }

  void find_contacts(bool by_height) {
    for (int n = 0; n < count_; ++n) {
      const double mid = (n + 0.5) * step_rad_;
      const Vector2d v(value(forward_, mid), value(left_, mid));
      const double turn = value(turn_, mid) * step_rad_;
      std::array<double, 2> cost{};
      for (int f = 0; f < 2; ++f) {
        const double high = leg(f, n).sole - std::min(leg(0, n).sole, leg(1, n).sole);
        const double speed = by_height ? 0.0 : (v * step_rad_ - travel(f, n, turn)).norm() * rate_;
        cost[static_cast<std::size_t>(f)] = std::max(high / kLow, speed / kSlow);
        if (by_height) cost[static_cast<std::size_t>(f)] = high > 0.0 ? 2.0 : 0.0;
        const double slides = speed / kRests;
        weight_[static_cast<std::size_t>(f)][static_cast<std::size_t>(n)] =
            1.0 / (1.0 + slides * slides);
      }
      const double least = std::min(cost[0], cost[1]);
      for (std::size_t f = 0; f < 2; ++f) {
        stands_[f][static_cast<std::size_t>(n)] = cost[f] < 1.0 || cost[f] == least;
      }
    }
    if (by_height) return;
    const int shortest = static_cast<int>(std::ceil(kShortest * rate_));
    for (auto& stands : stands_) {
      drop_short(stands, false, shortest);
      drop_short(stands, true, shortest);
    }
  }
  /// Runs of `which` that are shorter become the other.
  void drop_short(std::vector<bool>& stands, bool which, int shortest) const {
    int start = 0;  // at a change
    while (start < count_ && stands[static_cast<std::size_t>(start)] ==
                                 stands[static_cast<std::size_t>((start + count_ - 1) % count_)]) {
      ++start;
    }
    for (int k = 0; start < count_ && k < count_;) {
      const auto at = [&](int i) { return static_cast<std::size_t>((start + i) % count_); };
      int end = k;
      while (end < count_ && stands[at(end)] == stands[at(k)]) ++end;
      if (stands[at(k)] == which && end - k < shortest) {
        for (int i = k; i < end; ++i) stands[at(i)] = !which;
      }
      k = end;
    }
  }

  void fit_travel() {
    Eigen::Matrix<double, kTerms, kTerms> a =
        1e-6 * Eigen::Matrix<double, kTerms, kTerms>::Identity();
    Series turn = Series::Zero();
    const auto each = [this](auto&& use) {
      for (int n = 0; n < count_; ++n) {
        for (int f = 0; f < 2; ++f) {
          if (!stands_[f][static_cast<std::size_t>(n)]) continue;
          use(f, n, weight_[f][static_cast<std::size_t>(n)] * basis((n + 0.5) * step_rad_));
        }
      }
    };
    each([&](int f, int n, const Series& weighted) {
      a += weighted * basis((n + 0.5) * step_rad_).transpose();
      turn += turned(f, n) / step_rad_ * weighted;
    });
    const auto solver = a.ldlt();
    turn_ = solver.solve(turn);
    Series x = Series::Zero(), y = Series::Zero();
    each([&](int f, int n, const Series& weighted) {
      const double turns = value(turn_, (n + 0.5) * step_rad_) * step_rad_;
      const Vector2d v = travel(f, n, turns) / step_rad_;
      x += v.x() * weighted;
      y += v.y() * weighted;
    });
    forward_ = solver.solve(x);
    left_ = solver.solve(y);
  }

  /// As high as the feet that stand say, but no leg too short.
  void fit_height() {
    for (int turn = 0; turn < 30; ++turn) {
      Eigen::Matrix<double, kTerms, kTerms> a = Eigen::Matrix<double, kTerms, kTerms>::Zero();
      for (int k = 0; k < kTerms; ++k) {  // of an acceleration
        const int h = (k + 1) / 2;
        a(k, k) = 1e-6 + kCalm * count_ * h * h * h * h;
      }
      Series sum = Series::Zero();
      for (int n = 0; n < count_; ++n) {
        const Series b = basis(n * step_rad_);
        for (int f = 0; f < 2; ++f) {
          if (!stands_[f][static_cast<std::size_t>(n)]) continue;
          const double most = highest(f, n);
          const bool over = turn > 0 && height_.dot(b) > most;
          const double weight = over ? kUnreached : 1.0;
          const double h = over ? most : -leg(f, n).sole;
          a += weight * b * b.transpose();
          sum += weight * h * b;
        }
      }
      height_ = a.ldlt().solve(sum);
    }
    double over = 0.0;
    for (int n = 0; n < count_; ++n) {
      for (int f = 0; f < 2; ++f) {
        if (!stands_[f][static_cast<std::size_t>(n)]) continue;
        over = std::max(over, value(height_, n * step_rad_) - highest(f, n));
      }
    }
    height_[0] -= std::min(over, 0.01);
  }
  /// Height of the pelvis at which foot f stands on the ground and its leg is as long as it may be.
  double highest(int f, int n) const {
    const Leg& l = leg(f, n);
    const double flat2 = (l.ankle - l.hip).head<2>().squaredNorm();
    const double rise = std::sqrt(std::max(0.0, reach_[f] * reach_[f] - flat2));
    return l.ankle.z() - l.sole - l.hip.z() + rise;
  }

  /// A foot that stands is displaced against its slide; the mean of that, over its contacts.
  void find_lead(int f) {
    const auto& stands = stands_[f];
    const auto at = [&](int i) { return stands[static_cast<std::size_t>((i + count_) % count_)]; };
    const int before = static_cast<int>(kRestsFrom / step_rad_);
    Vector2d sum = Vector2d::Zero();
    int frames = 0;
    for (int start = 0; start < count_; ++start) {
      if (!at(start) || at(start - 1)) continue;
      Vector2d d = Vector2d::Zero();
      for (int n = start - before; n < start + count_ && (n < start || at(n)); ++n) {
        const double mid = (n + 0.5) * step_rad_, turn = value(turn_, mid) * step_rad_;
        const Vector2d v(value(forward_, mid), value(left_, mid));
        const double held = 1.0 - std::max(0.0, (start - n - 0.5) * step_rad_ / kRestsFrom);
        d = rotated(d, -turn) - held * held * (3.0 - 2.0 * held) *
                                    (v * step_rad_ - travel(f, (n + count_) % count_, turn));
        if (n < start) continue;
        sum += d;
        ++frames;
      }
    }
    if (frames > 0) lead_[f] = -sum / frames;
  }

  /// Phase to the nearest change of contact.
  double margin(int f, int n) const {
    const auto& stands = stands_[f];
    const auto at = [&](int i) { return stands[static_cast<std::size_t>((i + count_) % count_)]; };
    const bool now = at(n);
    const int most = static_cast<int>(std::ceil(kFarthestChange / kRelease / step_rad_));
    int next = 0, last = 0;
    while (next < most && at(n + next) == now) ++next;
    while (last < most && at(n - last) == now) ++last;
    const double ahead = (next - 0.5) * step_rad_, ago = (last - 0.5) * step_rad_;
    const double far = std::min({ahead, now ? ago : kRelease * ago, kFarthestChange});
    return now ? far : -far;
  }

  int count_;
  double step_rad_, rate_;  // a sample's phase; samples a second
  std::array<std::vector<Leg>, 2> leg_;
  std::array<std::vector<bool>, 2> stands_;
  std::array<std::vector<double>, 2> weight_;  // of what a foot says of the travel
  double reach_[2] = {};
  std::array<Vector2d, 2> lead_{Vector2d::Zero(), Vector2d::Zero()};
  Series forward_ = Series::Zero(), left_ = Series::Zero(), turn_ = Series::Zero(),
         height_ = Series::Zero();
};

}  // namespace

std::vector<float> learn_root(const BodyLanes& body, std::span<const float> angle_rad,
                              double duration_s) {
  Cycle cycle(body, angle_rad, duration_s > 0.0 ? duration_s : 1.0);
  if (cycle.still()) {
    std::vector<float> rows(angle_rad.size() / mocap::kBodyRows * kRootStride, 0.0F);
    for (std::size_t n = 0; n < rows.size(); n += kRootStride) {
      rows[n + kRootHeight] = cycle.standing_height();
    }
    return rows;
  }
  cycle.learn();
  return cycle.rows();
}

}  // namespace mimesis::synthesizer
