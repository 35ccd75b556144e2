#include "nodes/planner/tool_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/math/so3.h"

namespace mimesis::planner {
namespace {

using Eigen::Isometry3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kShortest_m = 1e-6, kLongestRadius_m = 100.0;
constexpr double kLongestStep_m = 0.05, kShortestStep_m = 2e-4;
constexpr double kJump_rad = 0.35;  // to another branch of solutions
constexpr double kUndecided_rad = 1e-7;
constexpr double kAtLimit_rad = 1e-4;
constexpr double kOfLines = 0.7;  // of the tolerance: the rest is for corners

}  // namespace

tl::expected<ToolPath, Status> ToolPath::make(const Isometry3d& X_WE,
                                              const std::vector<ToolPiece>& pieces) {
  ToolPath path;
  path.R_ = X_WE.linear();
  Vector3d from = X_WE.translation();
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const auto fail = [i](const char* why) {
      return tl::unexpected(Status{fmt::format("piece {} of the tool's way {}", i + 1, why)});
    };
    const ToolPiece& given = pieces[i];
    Piece piece{.begin_m = path.length_m(), .from = from};
    const Vector3d whole = given.to - from;
    if (!given.via) {
      if (whole.norm() < kShortest_m) return fail("has no length");
      piece.along = whole.normalized();
      piece.end_m = piece.begin_m + whole.norm();
    } else {
      // The centre is where the planes that halve two chords meet, in the plane of the points.
      const Vector3d a = *given.via - from, n = a.cross(whole);
      if (whole.norm() < kShortest_m) return fail("ends where it begins: a circle is two arcs");
      const Vector3d out =
          (a.squaredNorm() * whole - whole.squaredNorm() * a).cross(n) / (2.0 * n.squaredNorm());
      if (!(out.norm() < kLongestRadius_m)) return fail("has its three points on a line");
      piece.center = from + out;
      piece.radius_m = out.norm();
      piece.along = -out.normalized();
      piece.normal = n.normalized();
      const Vector3d r = given.to - piece.center;
      const double angle = std::atan2(piece.normal.cross(piece.along).dot(r), piece.along.dot(r));
      piece.end_m =
          piece.begin_m + piece.radius_m * (angle > 0.0 ? angle : angle + 2.0 * std::numbers::pi);
    }
    path.pieces_.push_back(piece);
    from = given.to;
  }
  return path;
}

Vector3d ToolPath::point(const Piece& piece, double s_m) {
  if (piece.radius_m == 0.0) return piece.from + (s_m - piece.begin_m) * piece.along;
  const double angle = (s_m - piece.begin_m) / piece.radius_m;
  return piece.center + piece.radius_m * (std::cos(angle) * piece.along +
                                          std::sin(angle) * piece.normal.cross(piece.along));
}

Vector3d ToolPath::at(double s_m) const {
  const auto last = pieces_.end() - 1;
  const auto piece =
      std::find_if(pieces_.begin(), last, [s_m](const Piece& p) { return s_m <= p.end_m; });
  return point(*piece, std::clamp(s_m, piece->begin_m, piece->end_m));
}

double ToolPath::distance(const Vector3d& p) const {
  double least = std::numeric_limits<double>::infinity();
  for (const Piece& piece : pieces_) {
    const double length = piece.end_m - piece.begin_m;
    double s = (p - piece.from).dot(piece.along);
    if (piece.radius_m > 0.0) {
      const Vector3d r = p - piece.center, beside = piece.normal.cross(piece.along);
      // Around the middle of the arc, where the angle must not jump.
      const double half = 0.5 * length / piece.radius_m;
      const Vector3d x = std::cos(half) * piece.along + std::sin(half) * beside;
      s = piece.radius_m * (half + std::atan2(piece.normal.cross(x).dot(r), x.dot(r)));
    }
    const Vector3d nearest = point(piece, piece.begin_m + std::clamp(s, 0.0, length));
    least = std::min(least, (p - nearest).norm());
  }
  return least;
}

double ToolPath::angle(const Eigen::Matrix3d& R_WE) const {
  return math::log_so3(Eigen::Matrix3d(R_.transpose() * R_WE)).norm();
}

bool keeps_to(const kin::ArmModel& arm, const ToolPath& path, const ToolTolerance& tolerance,
              const MatrixXd& control_points) {
  std::vector<Isometry3d> X;
  std::vector<MatrixXd> open{control_points};
  while (!open.empty()) {
    const MatrixXd part = std::move(open.back());
    open.pop_back();
    const VectorXd lo = part.rowwise().minCoeff(), hi = part.rowwise().maxCoeff();
    const VectorXd delta = 0.5 * (hi - lo);
    kin::forward(arm, 0.5 * (lo + hi), X);
    const Isometry3d X_WE = X.back() * arm.X_LE;
    const Vector3d p = X_WE.translation();
    const double off = path.distance(p), turned = path.angle(X_WE.linear());
    double moved = 0.0, turns = 0.0;
    for (std::size_t j = arm.links.size(); j-- > 0;) {
      const Isometry3d axis = X[j] * arm.links[j].before_joint();
      const double by = delta[static_cast<Eigen::Index>(j)];
      const double reach = (p - axis.translation()).cross(axis.linear().col(2)).norm();
      moved += arm.links[j].slides ? by : (reach + moved) * by;
      if (!arm.links[j].slides) turns += by;
    }
    if (off + moved <= tolerance.position_m && turned + turns <= tolerance.angle_rad) continue;
    const bool on_curve = part.cols() == 2;  // the middle of a line is on it
    const bool off_it = off > tolerance.position_m || turned > tolerance.angle_rad;
    if ((on_curve && off_it) || delta.maxCoeff() < kUndecided_rad) return false;
    // De Casteljau at 1/2.
    MatrixXd left(part.rows(), part.cols()), right = part;
    left.col(0) = right.col(0);
    for (Eigen::Index level = 1; level < part.cols(); ++level) {
      for (Eigen::Index i = 0; i < part.cols() - level; ++i)
        right.col(i) = 0.5 * (right.col(i) + right.col(i + 1));
      left.col(level) = right.col(0);
    }
    open.push_back(std::move(right));
    open.push_back(std::move(left));
  }
  return true;
}

tl::expected<std::vector<VectorXd>, Status> tool_way(const kin::ArmModel& arm, const ToolPath& path,
                                                     const ToolTolerance& tolerance,
                                                     const VectorXd& start,
                                                     CollisionChecker& checker) {
  const ToolTolerance of_lines{kOfLines * tolerance.position_m, kOfLines * tolerance.angle_rad};
  const Eigen::Matrix3d& R = path.orientation();
  std::vector<VectorXd> way{start};
  double at_m = 0.0, step_m = kLongestStep_m;
  const auto fail = [&](const std::string& why) {
    return tl::unexpected(Status{fmt::format("the tool's way fails after {:.0f} of {:.0f} mm: {}",
                                             std::floor(1e3 * at_m), 1e3 * path.length_m(), why)});
  };
  if (const auto contact = checker.contact(start); contact) return fail(*contact);
  while (at_m < path.length_m()) {
    if (checker.interrupt().told()) return tl::unexpected(checker.interrupt().reason());
    const double next_m = std::min(at_m + step_m, path.length_m());
    const kin::IkGoal goal{path.at(next_m),
                           {{Vector3d::UnitZ(), R.col(2)}, {Vector3d::UnitX(), R.col(0)}}};
    const VectorXd& last = way.back();
    const auto q = kin::solve_ik(arm, goal, last,
                                 {.limit_margin = kAtLimit_rad, .interrupt = checker.interrupt()});
    const bool reached = q && (*q - last).cwiseAbs().maxCoeff() < kJump_rad;
    bool keeps = false;
    if (reached) {
      MatrixXd line(arm.dof(), 2);
      line << last, *q;
      keeps = keeps_to(arm, path, of_lines, line);
    }
    if (keeps && checker.certify(last, *q)) {
      way.push_back(*q);
      at_m = next_m;
      step_m = std::min(1.5 * step_m, kLongestStep_m);
      continue;
    }
    step_m *= 0.5;
    if (step_m >= kShortestStep_m) continue;
    if (keeps) return fail(checker.nearest(*q));
    return fail(
        "no posture near the last one holds the tool so: a joint is at its limit, or the "
        "arm is singular");
  }
  return way;
}

}  // namespace mimesis::planner
