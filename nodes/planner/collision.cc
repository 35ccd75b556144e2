#include "nodes/planner/collision.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace mimesis::planner {
namespace {

/// Parts whose joints move less are not divided further: no ball moves by more than some tenths
/// of a millimetre there, and an undecided part counts as touching [rad].
constexpr double kUndecided = 1e-4;
/// The same for stops, as the motion of what is farthest from the joints [m], and the effort for
/// those between two points: slower ones need less.
constexpr double kUndecidedStops = 1e-4;
constexpr long kPosturesPerStops = 4000, kPosturesPerStopsAlone = 8000;
constexpr long kPosturesOfParts = 1000, kPosturesPerPiece = 24;  // what parts decide takes longer
constexpr long kUnlimited = std::numeric_limits<long>::max();

/// Straight from a to b. A part: its middle, 0 .. 1, and half its width. It has no halves if it is
/// too small to be divided; so have the others.
struct Line {
  static constexpr auto kJudge = &BatchChecker::judge_lines;
  static constexpr bool kOften = false;
  using Part = std::array<float, 2>;
  static bool holds_middle(const Part&) { return true; }
  const Eigen::Ref<const Eigen::VectorXd>&a, &b;
  float longest;

  void place(const Part& part, BatchChecker::Postures& to, int lane) const {
    for (Eigen::Index j = 0; j < a.size(); ++j) {
      const auto from = static_cast<float>(a[j]), way = static_cast<float>(b[j] - a[j]);
      to.q[static_cast<std::size_t>(j)][lane] = from + part[0] * way;
      to.deviation[static_cast<std::size_t>(j)][lane] = part[1] * way;
    }
  }
  std::optional<std::array<Part, 2>> halves(const Part& part) const {
    if (part[1] * longest < static_cast<float>(kUndecided)) return std::nullopt;
    const float quarter = 0.5f * part[1];
    return {{Part{part[0] - quarter, quarter}, Part{part[0] + quarter, quarter}}};
  }
};

/// A part: its control points. The curve stays in their hull.
struct Curve {
  static constexpr auto kJudge = &BatchChecker::judge_motions;
  static constexpr bool kOften = false;
  using Part = Eigen::MatrixXd;
  static bool holds_middle(const Part&) { return true; }

  /// De Casteljau at 1/2.
  static std::optional<std::array<Part, 2>> halves(const Part& part) {
    double widest = 0.0;
    for (Eigen::Index j = 0; j < part.rows(); ++j) widest = std::max(widest, width(part, j));
    if (widest < kUndecided) return std::nullopt;
    const Eigen::Index m = part.cols();
    Part left(part.rows(), m), right = part;
    left.col(0) = right.col(0);
    for (Eigen::Index level = 1; level < m; ++level) {
      for (Eigen::Index i = 0; i < m - level; ++i)
        right.col(i) = 0.5 * (right.col(i) + right.col(i + 1));
      left.col(level) = right.col(0);
    }
    return {{std::move(left), std::move(right)}};
  }
  static double width(const Part& part, Eigen::Index j) {
    return 0.5 * (part.row(j).maxCoeff() - part.row(j).minCoeff());
  }
  static void place(const Part& part, BatchChecker::Postures& to, int lane) {
    for (Eigen::Index j = 0; j < part.rows(); ++j) {
      const auto i = static_cast<std::size_t>(j);
      to.q[i][lane] = static_cast<float>(0.5 * (part.row(j).maxCoeff() + part.row(j).minCoeff()));
      to.deviation[i][lane] = static_cast<float>(width(part, j));
    }
  }
};

/// A part: ranges of where the stops begin on the line (0 .. 1), of the time u, of how far they
/// lead, of the delay, and of how far one joint that stops alone is back (0 .. 1).
///
/// Joints come to rest at different times, but mostly move alike: a stop (r²/k) ρ(u) is told by how
/// far it leads, λ = (r²/k) g(u), g the progress of the longest ramp, and by u. For g does what
/// ρ(u)/g(u) leaves nearly the same, most parts need no division in u.
struct Fan {
  static constexpr auto kJudge = &BatchChecker::judge_motions;
  static constexpr bool kOften = true;  // those of the next place on a path are much the same
  static constexpr std::size_t kRanges = 5;
  static constexpr Eigen::Index kNone = -1, kEvery = -2;
  struct Part {
    std::array<double, 2 * kRanges> range{};
    Eigen::Index alone = kNone;  // joint; kEvery: each at once is where it may be alone

    bool is_alone(Eigen::Index joint) const { return alone == joint || alone == kEvery; }
  };
  const Stops& s;
  const BatchChecker::Levers& lever;
  BatchChecker::Levers inverse_a{};
  double longest_s = 0.0;

  Fan(const Stops& stops, const BatchChecker::Levers& levers) : s(stops), lever(levers) {
    for (Eigen::Index j = 0; j < s.a.size(); ++j) {
      const double inverse = inverse_a[static_cast<std::size_t>(j)] = 1.0 / s.a[j];
      longest_s = std::max(longest_s, inverse * std::max(std::abs(s.v0[j]), std::abs(s.v1[j])));
    }
  }

  Part whole(Eigen::Index alone) const {
    const bool all = alone == kNone;
    return {{0.0, 1.0, 0.0, longest_s, 0.0, 1.0, 0.0, all ? s.delay_s : 0.0, 0.0, all ? 0.0 : 1.0},
            alone};
  }
  /// What is made of all joints at once may touch where none of the stops does.
  static bool holds_middle(const Part& part) { return part.alone != kEvery; }
  double speed(Eigen::Index j, double w) const { return s.v0[j] + w * (s.v1[j] - s.v0[j]); }
  double before(Eigen::Index j, double w) const {
    return s.before0[j] + w * (s.before1[j] - s.before0[j]);
  }
  /// g(u), 0 .. 1: of a ramp that rests after the longest time.
  double progress(double u) const {
    return longest_s > 0.0 ? u * (2.0 * longest_s - u) / (longest_s * longest_s) : 1.0;
  }
  /// The first u of progress λ.
  double soonest(double way) const {
    return longest_s * (1.0 - std::sqrt(std::max(0.0, 1.0 - way)));
  }
  /// Nearest and farthest that joints get in the ranges of a part: ρ(u)/g(u) falls with u.
  struct Reach {
    double u0, u1, nearest, farthest;
    Reach(const Fan& fan, const Part& part)
        : u0(part.range[2]),
          u1(part.range[3]),
          nearest(part.range[4] / std::max(fan.progress(u1), 1e-300)),
          farthest(u0 > 0.0 ? part.range[5] / fan.progress(u0)
                            : part.range[5] * 0.5 * fan.longest_s) {}
    /// @param v, a  of the joint, and 1/a
    std::pair<double, double> of(double v, double a, double inverse) const {
      const double rest = v * inverse, t0 = std::min(u0, rest), t1 = std::min(u1, rest);
      const double end = (v - 0.5 * a * t1) * t1;
      const double begin = u0 > 0.0 ? (v - 0.5 * a * t0) * t0 : v;
      return {nearest * end, std::min(end, farthest * begin)};
    }
  };
  void place(const Part& part, BatchChecker::Postures& to, int lane) const {
    const double w0 = part.range[0], w1 = part.range[1], delay0 = part.range[6],
                 delay1 = part.range[7], back0 = part.range[8], back1 = part.range[9];
    const Reach reach(*this, part);
    for (Eigen::Index j = 0; j < s.a.size(); ++j) {
      // Joints move one way: the ends of all ranges bound the postures between.
      double lo = std::numeric_limits<double>::infinity(), hi = -lo;
      const auto take = [&](double q) {
        lo = std::min(lo, q);
        hi = std::max(hi, q);
      };
      const auto i = static_cast<std::size_t>(j);
      const bool alone = part.is_alone(j);
      for (const double w : {w0, w1}) {
        const double q = s.q0[j] + w * (s.q1[j] - s.q0[j]), v = speed(j, w);
        const auto [least, most] = reach.of(std::abs(v), s.a[j], inverse_a[i]);
        const double near = q + (alone ? s.alone_s : delay0) * v + std::copysign(least, v);
        const double far = q + (alone ? s.alone_s : delay1) * v + std::copysign(most, v);
        if (!alone) {
          take(near);
          take(far);
          continue;
        }
        for (const double back : {back0, back1}) {
          take(near + back * (before(j, w) - near));
          take(far + back * (before(j, w) - far));
        }
      }
      to.q[i][lane] = static_cast<float>(0.5 * (lo + hi));
      to.deviation[i][lane] =
          static_cast<float>(0.5 * (hi - lo) + s.bow_rad + (alone ? s.before_bow_rad : 0.0));
    }
  }
  /// What each range adds to the motion of what is farthest from the joints [m].
  std::array<double, kRanges> widths(const Part& part) const {
    const auto& [w0, w1, u0, u1, way0, way1, delay0, delay1, back0, back1] = part.range;
    const Reach reach(*this, part);
    const double longer = way1 > 0.0 ? (way1 - way0) / way1 : 0.0;
    std::array<double, kRanges> width{};
    for (Eigen::Index j = 0; j < s.a.size(); ++j) {
      const auto i = static_cast<std::size_t>(j);
      const double v = std::abs(speed(j, w1)), arm = lever[i];
      const auto [near, far] = reach.of(v, s.a[j], inverse_a[i]);
      const double along = far * longer;
      width[0] += arm * (w1 - w0) * std::abs(s.q1[j] - s.q0[j]);
      width[1] += arm * (far - near - along);
      width[2] += arm * along;
      width[3] += arm * (delay1 - delay0) * v;
      if (part.is_alone(j)) {
        const double q = s.q0[j] + w1 * (s.q1[j] - s.q0[j]);
        width[4] += arm * (back1 - back0) * (std::abs(q - before(j, w1)) + s.alone_s * v + far);
      }
    }
    return width;
  }
  /// A stop does not lead farther than all do until then, nor as far before.
  std::optional<std::vector<Part>> halves(const Part& part) const {
    auto width = widths(part);
    if (part.alone == kEvery) {
      if (width[4] >= width[0] + width[1] + width[2]) return one_by_one(part);
      width[4] = 0.0;
    }
    const auto widest = std::max_element(width.begin(), width.end());
    if (*widest < kUndecidedStops) return std::nullopt;
    const auto i = static_cast<std::size_t>(2 * (widest - width.begin()));
    std::vector<Part> parts{part, part};
    parts[0].range[i + 1] = parts[1].range[i] = 0.5 * (part.range[i] + part.range[i + 1]);
    parts[0].range[5] = std::min(parts[0].range[5], progress(parts[0].range[3]));
    parts[1].range[2] = std::max(parts[1].range[2], soonest(parts[1].range[4]));
    return parts;
  }
  /// Instead of all joints at once: each alone, and none.
  std::vector<Part> one_by_one(Part part) const {
    std::vector<Part> parts;
    for (part.alone = 0; part.alone < s.a.size(); ++part.alone) parts.push_back(part);
    part.alone = kNone;
    part.range[7] = s.delay_s;
    part.range[9] = 0.0;
    parts.push_back(part);
    return parts;
  }
};

}  // namespace

std::string in_mm(const Eigen::Vector3d& p) {
  const auto mm = [](double v) { return std::to_string(std::lround(v * 1e3)); };
  return "(" + mm(p.x()) + ", " + mm(p.y()) + ", " + mm(p.z()) + ") mm";
}

std::string in_words(const kin::Box& box) {
  return box.name.empty() ? "the box at " + in_mm(box.center) : "the " + box.name;
}

CollisionChecker::CollisionChecker(const kin::ArmModel& arm, const Obstacles& obstacles,
                                   double margin_m, Interrupt interrupt)
    : arm_(arm),
      obstacles_(obstacles),
      margin_(margin_m),
      batch_(arm, obstacles, margin_m),
      interrupt_(std::move(interrupt)),
      q_(arm.dof()),
      deviation_(arm.dof()) {
  if (!arm.parts.empty() || !obstacles.hulls.empty()) parts_.emplace(arm, obstacles, margin_m);
  line_parts_.reserve(8 * kLanes);
}

void CollisionChecker::take_lane(int lane) {
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    q_[j] = static_cast<double>(lanes_.q[static_cast<std::size_t>(j)][lane]);
    deviation_[j] = static_cast<double>(lanes_.deviation[static_cast<std::size_t>(j)][lane]);
  }
}

bool CollisionChecker::parts_free(int lane) {
  if (!parts_) return false;
  take_lane(lane);
  deviation_.setZero();
  return parts_->judge(q_, deviation_) == PartChecker::Verdict::free;
}

bool CollisionChecker::free(const Eigen::Ref<const Eigen::VectorXd>& q) {
  if (interrupt_.now()) return false;
  for (Eigen::Index j = 0; j < q.size(); ++j)
    lanes_.q[static_cast<std::size_t>(j)] = static_cast<float>(q[j]) - Lanes{};
  ++postures_;
  return batch_.judge(lanes_).touches == 0 || parts_free(0);
}

std::vector<char> CollisionChecker::free_columns(
    const Eigen::Ref<const Eigen::MatrixXd>& postures) {
  std::vector<char> free(static_cast<std::size_t>(postures.cols()));
  for (Eigen::Index first = 0; first < postures.cols() && !interrupt_.now(); first += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const Eigen::Index column = std::min(first + lane, postures.cols() - 1);
      for (Eigen::Index j = 0; j < postures.rows(); ++j)
        lanes_.q[static_cast<std::size_t>(j)][lane] = static_cast<float>(postures(j, column));
    }
    const std::uint32_t touches = batch_.judge(lanes_).touches;
    for (int lane = 0; lane < kLanes && first + lane < postures.cols(); ++lane)
      free[static_cast<std::size_t>(first + lane)] =
          (touches >> lane & 1u) == 0 || parts_free(lane);
    postures_ += std::min<Eigen::Index>(kLanes, postures.cols() - first);
  }
  return free;
}

/// Judges the open parts, first in, first out, until all are proven free, or one touches or cannot
/// be decided.
template <class Motion>
bool CollisionChecker::certify_family(const Motion& motion,
                                      std::vector<typename Motion::Part>& open, long most) {
  near_.clear();
  near_of_.assign(open.size(), {0, 0});
  for (std::size_t next = 0; next < open.size();) {
    if (interrupt_.now()) return false;
    const std::size_t count = std::min<std::size_t>(kLanes, open.size() - next);
    for (int lane = 0; lane < kLanes; ++lane)
      motion.place(open[next + std::min(static_cast<std::size_t>(lane), count - 1)], lanes_, lane);
    postures_ += static_cast<long>(count);
    most -= static_cast<long>(count);
    const auto verdicts = (batch_.*Motion::kJudge)(lanes_);
    const bool touches = verdicts.touches != 0;  // then not all lanes were looked at
    if ((touches && !parts_) || ((touches || verdicts.near != 0) && most <= 0)) return false;
    // Each open part takes a posture at least: with parts, end as soon as that is too many.
    if (parts_ && std::ssize(open) - static_cast<std::ptrdiff_t>(next + count) > most) return false;
    for (std::size_t lane = 0; lane < count; ++lane, ++next) {
      if (!touches && (verdicts.near >> lane & 1u) == 0) continue;
      auto verdict = PartChecker::Verdict::near;
      // A half is a part of the whole: what was not near there is not asked again.
      std::array<std::size_t, 2> near = near_of_[next];
      const auto ask_parts = [&] {
        take_lane(static_cast<int>(lane));
        const std::vector<PartChecker::Near> only(near_.begin() + std::ptrdiff_t(near[0]),
                                                  near_.begin() + std::ptrdiff_t(near[1]));
        near[0] = near_.size();
        verdict = parts_->judge(q_, deviation_, only, &near_, Motion::kOften);
        near[1] = near_.size();
      };
      if (touches) ask_parts();
      auto halves = motion.halves(open[next]);
      if (!touches && !halves && parts_) ask_parts();
      if (verdict == PartChecker::Verdict::free) continue;
      const bool touched = verdict == PartChecker::Verdict::touches;
      if (!halves || (touched && motion.holds_middle(open[next]))) return false;
      if (touched) near = near_of_[next];
      open.insert(open.end(), halves->begin(), halves->end());
      near_of_.insert(near_of_.end(), halves->size(), near);
    }
  }
  return true;
}

bool CollisionChecker::certify(const Eigen::Ref<const Eigen::VectorXd>& a,
                               const Eigen::Ref<const Eigen::VectorXd>& b) {
  line_parts_.clear();
  for (int i = 0; i < kLanes; ++i)
    line_parts_.push_back({(static_cast<float>(i) + 0.5f) / kLanes, 0.5f / kLanes});
  const Line line{a, b, static_cast<float>((b - a).cwiseAbs().maxCoeff())};
  return certify_family(line, line_parts_, kUnlimited);
}

bool CollisionChecker::seems_free(const Eigen::Ref<const Eigen::VectorXd>& a,
                                  const Eigen::Ref<const Eigen::VectorXd>& b) {
  if (interrupt_.now()) return false;
  for (Eigen::Index j = 0; j < a.size(); ++j) {
    const auto from = static_cast<float>(a[j]), way = static_cast<float>(b[j] - a[j]);
    lanes_.q[static_cast<std::size_t>(j)] =
        from + way / kLanes * Lanes{1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f, 8.0f};
  }
  postures_ += kLanes;
  if (!parts_) return !batch_.any_touches(lanes_);
  // The last one is the one farthest from what is known to be free.
  const std::uint32_t touches = batch_.judge(lanes_).touches;
  for (int lane = kLanes; lane-- > 0;)
    if ((touches >> lane & 1u) != 0 && !parts_free(lane)) return false;
  return true;
}

bool CollisionChecker::certify_curve(const Eigen::MatrixXd& control_points) {
  std::vector<Eigen::MatrixXd> open{control_points};
  return certify_family(Curve{}, open, kUnlimited);
}

bool CollisionChecker::certify_stops(const Stops& given) {
  Stops stops = given;
  if (stops.bow_rad == 0.0) {  // on a line the delay only makes it longer
    stops.v0 = stops.v1 = given.v0.norm() > given.v1.norm() ? given.v0 : given.v1;
    stops.q1 += stops.delay_s * stops.v1;
    stops.delay_s = 0.0;
  }
  const Fan all{stops, batch_.levers()}, one{given, batch_.levers()};
  const bool fails_alone = given.before0.size() > 0;
  // On a line the places of all joints at once hold those that they reach with the delay.
  const bool holds_all = parts_ && fails_alone && given.bow_rad == 0.0 &&
                         given.before_bow_rad == 0.0 && given.delay_s <= given.alone_s;
  // The motion can become slower, but not much slower than this: then twice the effort is made.
  constexpr double kSlow_rad_s = 0.1;
  const bool slow = given.v0.cwiseAbs().cwiseMax(given.v1.cwiseAbs()).maxCoeff() < kSlow_rad_s;
  const long most = !parts_            ? kPosturesPerStopsAlone
                    : given.pieces > 1 ? kPosturesPerPiece * given.pieces
                                       : (slow ? 2 : 1) * kPosturesOfParts;
  std::vector<Fan::Part> open{all.whole(Fan::kNone)};
  if (!holds_all && !certify_family(all, open, parts_ ? most / 2 : kPosturesPerStops)) return false;
  if (!fails_alone) return true;
  open.clear();
  if (parts_) {
    open.push_back(one.whole(Fan::kEvery));
  } else {
    for (Eigen::Index j = 0; j < given.a.size(); ++j) open.push_back(one.whole(j));
  }
  return certify_family(one, open, most);
}

std::optional<std::string> CollisionChecker::contact(const Eigen::Ref<const Eigen::VectorXd>& q) {
  if (free(q)) return std::nullopt;
  return nearest(q);
}

std::string CollisionChecker::nearest(const Eigen::Ref<const Eigen::VectorXd>& q) {
  return parts_ ? parts_->nearest(q) : PartChecker(arm_, obstacles_, margin_).nearest(q);
}

}  // namespace mimesis::planner
