#pragma once
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "nodes/planner/verb/hulls_apart.h"
#include "nodes/planner/verb/motion_families.h"
#include "nodes/planner/verb/plan_file.h"

namespace mimesis::tool {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;
using families::Alone, families::Moves, families::Piece, families::Ramps, families::Range,
    families::Region;

constexpr double kUndecided_rad = 1e-7;
constexpr std::size_t kMostPostures = 200'000;  // to prove one part

/// A ball, or the hull of corners, rounded, with a ball around it.
struct Shape {
  Vector3d center;
  double radius = 0.0;
  int frame = 0, group = 0;
  bool held = false, against_obstacles = true;
  Eigen::Matrix3Xd corners{};     ///< a column each; none: a ball
  double rounding = 0.0;          ///< of the hull
  std::vector<double> lever_m{};  ///< Lᵢⱼ of the joints below its frame
};

/// The hulls of one link, shapes [begin, end), and all their corners.
struct Bundle {
  std::size_t begin = 0, end = 0;
  int frame = 0, group = 0;
  bool against_obstacles = true;
  Eigen::Matrix3Xd corners{}, now{};  ///< in the frame; in W
  double rounding = 0.0;
};

struct Cuboid {
  Vector3d center, half;
  bool support = false;

  Eigen::Matrix3Xd corners() const {
    Eigen::Matrix3Xd out(3, 8);
    for (int i = 0; i < 8; ++i)
      out.col(i) =
          center + half.cwiseProduct(Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
    return out;
  }
};

/// A convex obstacle, with a ball around it.
struct Solid {
  Eigen::Matrix3Xd corners;
  double rounding = 0.0;
  Vector3d center = Vector3d::Zero();
  double radius = 0.0;
};

/// Of two hulls, at least; no farther than `enough` is looked for.
inline double planes_apart(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b, double enough,
                           Vector3d& normal) {
  return hulls_apart(a, b, -std::numeric_limits<double>::infinity(), enough, normal).at_least;
}

/// The arm among the obstacles of one motion.
class Scene {
 public:
  Scene(const kin::ArmModel& arm, const PlanMotion& motion) : arm_(arm) {
    const auto against = [&arm](int group) {
      return std::count(arm.env_groups.begin(), arm.env_groups.end(), group) > 0;
    };
    for (const kin::SafetyBall& ball : arm.balls) {
      if (!ball.of_part)
        add({ball.center, ball.radius, ball.frame, ball.group, false, against(ball.group)});
    }
    for (const kin::SafetyPart& part : arm.parts) {
      const Eigen::Matrix3Xd corners = part.shape.points.transpose();
      const Vector3d middle = corners.rowwise().mean();
      add({middle, (corners.colwise() - middle).colwise().norm().maxCoeff() + part.shape.radius,
           part.frame, part.group, false, against(part.group), corners, part.shape.radius});
      const std::size_t last = shapes_.size() - 1;
      if (bundles_.empty() || bundles_.back().frame != part.frame ||
          bundles_.back().group != part.group)
        bundles_.push_back({last, last, part.frame, part.group, against(part.group)});
      Bundle& bundle = bundles_.back();
      bundle.end = shapes_.size();
      bundle.rounding = std::max(bundle.rounding, part.shape.radius);
      bundle.corners.conservativeResize(3, bundle.corners.cols() + corners.cols());
      bundle.corners.rightCols(corners.cols()) = corners;
    }
    const int hand = arm.balls.empty() ? 0 : arm.balls.back().group;
    for (std::size_t i = 0; i < motion.held_m.size(); i += 4) {
      const Vector3d in_E = Vector3d::Map(&motion.held_m[i]);
      add({arm.X_LE * in_E, motion.held_m[i + 3], arm.dof(), hand, true, true});
    }
    for (std::size_t i = 0; i < motion.balls_m.size(); i += 4)
      balls_.push_back({Vector3d::Map(&motion.balls_m[i]), motion.balls_m[i + 3]});
    for (const bool support : {false, true}) {
      const auto& rows = support ? motion.supports_m : motion.boxes_m;
      for (std::size_t i = 0; i < rows.size(); i += 6)
        boxes_.push_back({Vector3d::Map(&rows[i]), Vector3d::Map(&rows[i + 3]), support});
    }
    for (const PlanHull& hull : motion.hulls) {
      Solid solid{Eigen::Matrix3Xd::Map(hull.points_m.data(), 3,
                                        static_cast<Index>(hull.points_m.size()) / 3),
                  hull.radius_m};
      solid.center = solid.corners.rowwise().mean();
      solid.radius =
          (solid.corners.colwise() - solid.center).colwise().norm().maxCoeff() + solid.rounding;
      solids_.push_back(std::move(solid));
    }
    const auto meet = [&arm](int a, int b) {
      return std::count(arm.self_pairs.begin(), arm.self_pairs.end(), std::pair(a, b)) > 0;
    };
    for (std::size_t a = 0; a < shapes_.size(); ++a) {
      for (std::size_t b = 0; b < shapes_.size(); ++b) {
        if (meet(shapes_[a].group, shapes_[b].group) && (is_ball(a) || is_ball(b)))
          pairs_.push_back({a, b});
      }
    }
    for (std::size_t a = 0; a < bundles_.size(); ++a) {
      for (std::size_t b = 0; b < bundles_.size(); ++b) {
        if (!meet(bundles_[a].group, bundles_[b].group)) continue;
        bundle_pairs_.push_back({a, b});
        bundle_pairs_.back().begin = pairs_.size();
        for (std::size_t i = bundles_[a].begin; i < bundles_[a].end; ++i)
          for (std::size_t k = bundles_[b].begin; k < bundles_[b].end; ++k)
            pairs_.push_back({i, k});
        bundle_pairs_.back().end = pairs_.size();
      }
    }
    loose_pairs_ = bundle_pairs_.empty() ? pairs_.size() : bundle_pairs_.front().begin;
    obstacle_normals_.assign(shapes_.size() * (balls_.size() + boxes_.size() + solids_.size()),
                             Vector3d::Zero());
    at_.resize(shapes_.size());
    corners_.resize(shapes_.size());
    bound_.resize(shapes_.size());
  }

  /// Postures between lo and hi will be looked at: links with few joints between them, which may be
  /// near each other all the time, are proven `least` apart once for a box of these joints.
  void expect(const VectorXd& lo, const VectorXd& hi, double least) {
    constexpr Index kMostJoints = 3;
    constexpr double kWider_rad = 0.1;
    for (Pair& pair : bundle_pairs_) {
      const Index first = inner(pair).frame, n = outer(pair).frame - first;
      if (n < 1 || n > kMostJoints || within(pair, lo, hi)) continue;
      pair.lo = lo.segment(first, n).array() - kWider_rad;
      pair.hi = hi.segment(first, n).array() + kWider_rad;
      pair.settled = apart_in_box(pair, 0.5 * (lo + hi), least);
    }
  }

  Eigen::Isometry3d tool(const VectorXd& q) {
    place(q);
    return frames_.back() * arm_.X_LE;
  }

  /// All postures of the family are proven `least` metres apart from everything. If not, `why`.
  template <class Family>
  bool proves(const Family& family, double least, PlanVerdict& verdict, double& nearest,
              std::string& why, std::size_t most = kMostPostures) {
    std::vector<Region> open{family.whole()};
    for (std::size_t next = 0; next < open.size(); ++next) {  // the coarse ones first
      Region region = open[next];
      const Moves moves = family.moves(region);
      ++verdict.postures;
      const Look seen = look(family.at(region), moves.rowwise().sum(), least, nearest, next > 0);
      nearest = std::min(nearest, seen.gap);
      if (seen.proven >= least) continue;
      Index range = 0;
      const double widest = moves.colwise().maxCoeff().maxCoeff(&range);
      // At the limit itself a part stays undecided.
      if (seen.gap < least || next > most || widest < kUndecided_rad) {
        why = fmt::format("{} and {}: {:.3f} mm apart, expected {:.3f}", name(seen.ball),
                          seen.other, 1e3 * seen.gap, 1e3 * least);
        return false;
      }
      auto& split = region[static_cast<std::size_t>(range)];
      const Range all = split;
      split = {all.middle(), all.hi};
      open.push_back(region);
      split = {all.lo, all.middle()};
      open.push_back(region);
    }
    return true;
  }

 private:
  struct Look {
    double gap = std::numeric_limits<double>::infinity();  ///< least distance
    double proven = gap;                                   ///< at least, of the whole part
    std::size_t ball = 0;                                  ///< the nearest, and what it is near to
    std::string other;
  };

  void add(Shape shape) {
    // From the shape inwards: its distance from the origin of frame m, then that from axis m. That
    // from its own axis, and from the origin before it, is the same at all places of the joint.
    const Eigen::Matrix3Xd points =
        shape.corners.cols() == 0 ? Eigen::Matrix3Xd(shape.center) : shape.corners;
    double reach = points.colwise().norm().maxCoeff();
    shape.lever_m.resize(static_cast<std::size_t>(shape.frame));
    for (auto m = static_cast<std::size_t>(shape.frame); m-- > 0;) {
      const kin::DhLink& link = arm_.links[m];
      const bool own = m + 1 == shape.lever_m.size();
      if (own && !link.modified && !link.slides) {
        const Eigen::Isometry3d X = Eigen::Translation3d(link.a, 0.0, link.d) *
                                    Eigen::AngleAxisd(link.alpha, Vector3d::UnitX());
        const Eigen::Matrix3Xd there = (X.linear() * points).colwise() + X.translation();
        shape.lever_m[m] = there.topRows<2>().colwise().norm().maxCoeff();
        reach = there.colwise().norm().maxCoeff();
        continue;
      }
      shape.lever_m[m] = link.slides ? 1.0 : link.modified ? reach : reach + std::abs(link.a);
      const auto joint = static_cast<Index>(m);
      const double slide =
          link.slides ? std::max(std::abs(arm_.q_min[joint]), std::abs(arm_.q_max[joint])) : 0.0;
      reach += std::hypot(link.a, std::abs(link.d) + slide);
    }
    shapes_.push_back(std::move(shape));
  }

  /// Link after link, each by its four elementary motions.
  void place(const VectorXd& q) {
    Eigen::Isometry3d X = arm_.X_WB;
    std::size_t next = 0;
    std::vector<Eigen::Isometry3d>& frames = frames_;
    frames.assign(1, X);
    for (std::size_t m = 0; m < arm_.links.size(); ++m) {
      const kin::DhLink& link = arm_.links[m];
      const double turned = link.slides ? 0.0 : q[static_cast<Index>(m)],
                   moved = link.slides ? q[static_cast<Index>(m)] : 0.0;
      const Eigen::AngleAxisd turn(turned + link.offset, Vector3d::UnitZ());
      const Eigen::AngleAxisd tilt(link.alpha, Vector3d::UnitX());
      const Eigen::Translation3d along_x(link.a, 0.0, 0.0), along_z(0.0, 0.0, link.d + moved);
      if (link.modified) {
        X = X * tilt * along_x * turn * along_z;
      } else {
        X = X * turn * along_z * along_x * tilt;
      }
      frames.push_back(X);
    }
    for (const Shape& shape : shapes_)
      at_[next++] = frames[static_cast<std::size_t>(shape.frame)] * shape.center;
    for (Eigen::Matrix3Xd& corners : corners_) corners.resize(3, 0);
    for (Bundle& bundle : bundles_) {
      const Eigen::Isometry3d& X_WF = frames[static_cast<std::size_t>(bundle.frame)];
      bundle.now = (X_WF.linear() * bundle.corners).colwise() + X_WF.translation();
    }
  }

  /// In W; of a ball its centre.
  const Eigen::Matrix3Xd& corners(std::size_t i) {
    if (corners_[i].cols() > 0) return corners_[i];
    const Shape& shape = shapes_[i];
    if (shape.corners.cols() == 0) return corners_[i] = at_[i];
    const Eigen::Isometry3d& X = frames_[static_cast<std::size_t>(shape.frame)];
    return corners_[i] = (X.linear() * shape.corners).colwise() + X.translation();
  }
  double rounding(std::size_t i) const {
    return shapes_[i].corners.cols() == 0 ? shapes_[i].radius : shapes_[i].rounding;
  }

  static double moved(const Shape& shape, const VectorXd& delta, int from) {
    double sum = 0.0;
    for (int j = from; j < shape.frame; ++j)
      sum += shape.lever_m[static_cast<std::size_t>(j)] * delta[j];
    return sum;
  }

  struct Pair {
    std::size_t a = 0, b = 0;  // shapes, or bundles
    Vector3d normal = Vector3d::Zero();
    std::size_t begin = 0, end = 0;  // of bundles: the pairs of their shapes
    VectorXd lo{}, hi{};             // of bundles: a box of the joints between them,
    bool settled = false;            // in all of which they are proven apart
  };

  const Bundle& inner(const Pair& pair) const {
    const Bundle &a = bundles_[pair.a], &b = bundles_[pair.b];
    return a.frame > b.frame ? b : a;
  }
  const Bundle& outer(const Pair& pair) const {
    return &inner(pair) == &bundles_[pair.a] ? bundles_[pair.b] : bundles_[pair.a];
  }

  bool apart_in_box(Pair& pair, VectorXd q, double least) {
    constexpr std::size_t kMostBoxes = 1000;
    const Index first = inner(pair).frame, n = pair.lo.size();
    VectorXd delta = VectorXd::Zero(q.size());
    std::vector<std::array<VectorXd, 2>> open{{pair.lo, pair.hi}};
    for (std::size_t next = 0; next < open.size(); ++next) {
      const std::array<VectorXd, 2> box = open[next];
      q.segment(first, n) = 0.5 * (box[0] + box[1]);
      delta.segment(first, n) = 0.5 * (box[1] - box[0]);
      place(q);
      double gap = std::numeric_limits<double>::infinity();
      bool proven = true;
      for (std::size_t i = pair.begin; i < pair.end && gap >= least; ++i) {
        Pair& two = pairs_[i];
        const Shape& moves = shapes_[shapes_[two.a].frame > shapes_[two.b].frame ? two.a : two.b];
        const double bound = moved(moves, delta, static_cast<int>(first));
        double apart =
            (at_[two.a] - at_[two.b]).norm() - shapes_[two.a].radius - shapes_[two.b].radius;
        if (apart < least + bound) {
          const double radii = rounding(two.a) + rounding(two.b);
          apart = std::max(apart, planes_apart(corners(two.a), corners(two.b),
                                               least + bound + radii, two.normal) -
                                      radii);
        }
        gap = std::min(gap, apart);
        proven = proven && apart >= least + bound;
      }
      if (proven) continue;
      if (gap < least || open.size() + 2 > kMostBoxes) return false;
      Index widest = 0;
      VectorXd reach = delta.segment(first, n);
      for (Index j = 0; j < n; ++j) {
        double most = 0.0;
        for (std::size_t i = outer(pair).begin; i < outer(pair).end; ++i)
          most = std::max(most, shapes_[i].lever_m[static_cast<std::size_t>(first + j)]);
        reach[j] *= most;
      }
      reach.maxCoeff(&widest);
      std::array<VectorXd, 2> low = box, high = box;
      low[1][widest] = high[0][widest] = q[first + widest];
      open.push_back(low);
      open.push_back(high);
    }
    return true;
  }

  bool is_ball(std::size_t i) const { return shapes_[i].corners.cols() == 0; }

  bool within(const Pair& pair, const VectorXd& lo, const VectorXd& hi) const {
    const Index first = inner(pair).frame, n = pair.lo.size();
    return n > 0 && (lo.segment(first, n).array() >= pair.lo.array()).all() &&
           (hi.segment(first, n).array() <= pair.hi.array()).all();
  }

  /// @param known   of pairs that are farther apart than this the distance is not asked for
  /// @param within_whole  of a posture that was looked at: pairs that are settled are not again
  Look look(const VectorXd& q, const VectorXd& delta, double least, double known,
            bool within_whole) {
    place(q);
    for (std::size_t i = 0; i < shapes_.size(); ++i) bound_[i] = moved(shapes_[i], delta, 0);
    Look out;
    const char* kind = "";
    std::size_t nearest = 0;
    const auto far_enough = [&](double bound) {
      return std::max(least + bound, std::min(out.gap, known));
    };
    /// `gap`: of the balls around the two; `exact`: of the hulls, if one is none.
    const auto consider = [&](std::size_t ball, double gap, double bound, const char* what,
                              std::size_t index, const auto& exact) {
      if (gap < far_enough(bound)) gap = std::max(gap, exact(far_enough(bound)));
      out.proven = std::min(out.proven, gap - bound);
      if (gap >= out.gap) return;
      out.gap = gap;
      out.ball = ball;
      kind = what;
      nearest = index;
    };
    constexpr double kNone = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      const Shape& shape = shapes_[i];
      if (!shape.against_obstacles) continue;
      Vector3d* normal =
          obstacle_normals_.data() + i * (balls_.size() + boxes_.size() + solids_.size());
      for (std::size_t k = 0; k < balls_.size(); ++k, ++normal) {
        const Vector3d center = balls_[k].first;
        const double radius = balls_[k].second;
        const auto exact = [&](double enough) {
          const double radii = rounding(i) + radius;
          return is_ball(i) ? kNone
                            : planes_apart(corners(i), center, enough + radii, *normal) - radii;
        };
        consider(i, (at_[i] - center).norm() - shape.radius - radius, bound_[i], "obstacle ball", k,
                 exact);
      }
      for (std::size_t k = 0; k < boxes_.size(); ++k, ++normal) {
        if (boxes_[k].support && shape.held) continue;
        const Vector3d out_of = (at_[i] - boxes_[k].center).cwiseAbs() - boxes_[k].half;
        const double apart =
            out_of.maxCoeff() < 0.0 ? out_of.maxCoeff() : out_of.cwiseMax(0.0).norm();
        const auto exact = [&](double enough) {
          return is_ball(i) ? kNone
                            : planes_apart(corners(i), boxes_[k].corners(), enough + rounding(i),
                                           *normal) -
                                  rounding(i);
        };
        consider(i, apart - shape.radius, bound_[i], "box", k, exact);
      }
      for (std::size_t k = 0; k < solids_.size(); ++k, ++normal) {
        const Solid& solid = solids_[k];
        const auto exact = [&](double enough) {
          const double radii = rounding(i) + solid.rounding;
          return planes_apart(corners(i), solid.corners, enough + radii, *normal) - radii;
        };
        consider(i, (at_[i] - solid.center).norm() - shape.radius - solid.radius, bound_[i], "hull",
                 k, exact);
      }
    }
    // Relative to the inner one, only the joints between them move the outer one.
    const auto own_pairs = [&](std::size_t begin, std::size_t end) {
      for (Pair* pair = pairs_.data() + begin; pair != pairs_.data() + end; ++pair) {
        const std::size_t a = pair->a, b = pair->b;
        const bool a_outer = shapes_[a].frame > shapes_[b].frame;
        const Shape &outer = shapes_[a_outer ? a : b], &inner = shapes_[a_outer ? b : a];
        const auto exact = [&](double enough) {
          const double radii = rounding(a) + rounding(b);
          return is_ball(a) && is_ball(b)
                     ? kNone
                     : planes_apart(corners(a), corners(b), enough + radii, pair->normal) - radii;
        };
        consider(a, (at_[a] - at_[b]).norm() - outer.radius - inner.radius,
                 moved(outer, delta, inner.frame), "its part", b, exact);
      }
    };
    own_pairs(0, loose_pairs_);
    for (Pair& pair : bundle_pairs_) {
      const bool settled = pair.settled && within(pair, q - delta, q + delta);
      if (settled && within_whole) continue;
      const Bundle &one = bundles_[pair.a], &other = bundles_[pair.b];
      double bound = 0.0;
      for (std::size_t i = outer(pair).begin; i < outer(pair).end && !settled; ++i)
        bound = std::max(bound, moved(shapes_[i], delta, inner(pair).frame));
      const double enough = far_enough(bound), radii = one.rounding + other.rounding;
      const double apart =
          hulls_apart(one.now, other.now, enough + radii, enough + radii, pair.normal).at_least -
          radii;
      const double proven = out.proven;
      if (apart < enough) {
        own_pairs(pair.begin, pair.end);
      } else {
        out.proven = std::min(out.proven, apart - bound);
      }
      if (settled) out.proven = proven;
    }
    out.other = fmt::format("{} {}", kind, nearest);
    return out;
  }

  std::string name(std::size_t i) const {
    if (shapes_[i].held) return "the held object";
    return fmt::format("{} {} ({})", shapes_[i].corners.cols() == 0 ? "ball" : "part", i,
                       arm_.groups[static_cast<std::size_t>(shapes_[i].group)]);
  }

  const kin::ArmModel& arm_;
  std::vector<Shape> shapes_;
  std::vector<std::pair<Vector3d, double>> balls_;
  std::vector<Cuboid> boxes_;
  std::vector<Solid> solids_;
  std::vector<Bundle> bundles_;
  std::vector<Pair> pairs_;  // of shapes: those with balls, then those of bundles
  std::vector<Pair> bundle_pairs_;
  std::size_t loose_pairs_ = 0;
  std::vector<Vector3d> obstacle_normals_;  // [shape][obstacle]
  // Scratch
  std::vector<Eigen::Isometry3d> frames_;
  std::vector<Vector3d> at_;
  std::vector<Eigen::Matrix3Xd> corners_;  // of no column: not asked for yet
  std::vector<double> bound_;
};

}  // namespace mimesis::tool
