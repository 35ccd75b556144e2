#include "common/kin/arm.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "common/error.h"

namespace mimesis::kin {
namespace {

/// Rz(θ) Tz(d) Tx(a) Rx(α), or Rx(α) Tx(a) Rz(θ) Tz(d), multiplied out.
Eigen::Isometry3d link_transform(const DhLink& link, double q) {
  const double theta = (link.slides ? 0.0 : q) + link.offset, d = link.d + (link.slides ? q : 0.0);
  const double ct = std::cos(theta), st = std::sin(theta);
  const double ca = std::cos(link.alpha), sa = std::sin(link.alpha);
  Eigen::Isometry3d T;
  if (link.modified) {
    T.matrix() << ct, -st, 0.0, link.a,  //
        st * ca, ct * ca, -sa, -sa * d,  //
        st * sa, ct * sa, ca, ca * d,    //
        0.0, 0.0, 0.0, 1.0;
    return T;
  }
  T.matrix() << ct, -st * ca, st * sa, link.a * ct,  //
      st, ct * ca, -ct * sa, link.a * st,            //
      0.0, sa, ca, d,                                //
      0.0, 0.0, 0.0, 1.0;
  return T;
}

Eigen::Isometry3d dh_part(const DhLink& link) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  const double ca = std::cos(link.alpha), sa = std::sin(link.alpha);
  T.linear() << 1.0, 0.0, 0.0, 0.0, ca, -sa, 0.0, sa, ca;
  T.translation() = Eigen::Vector3d(link.a, 0.0, link.d);
  if (link.modified) T.translation() = Eigen::Vector3d(link.a, -sa * link.d, ca * link.d);
  return T;
}

constexpr double kBaseDamping = 1e-6;  // w̄: keeps the system regular where e vanishes

/// Angle between two unit vectors, exact also near 0 and π.
double angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Rotation vector that turns `from` into `to` on the shortest way. Opposite vectors turn about any
/// normal.
Eigen::Vector3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d normal = from.cross(to);
  const double s = normal.norm();
  if (s > 1e-9) return normal / s * angle(from, to);
  return from.dot(to) > 0.0 ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                            : from.unitOrthogonal() * M_PI;
}

double uniform(
    std::mt19937_64& generator) {  // [0, 1); the standard's distributions differ by library
  return static_cast<double>(generator() >> 11) * 0x1p-53;
}

}  // namespace

Eigen::Isometry3d DhLink::before_joint() const {
  if (!modified) return Eigen::Isometry3d::Identity();
  return slides ? dh_part(*this) * Eigen::AngleAxisd(offset, Eigen::Vector3d::UnitZ())
                : dh_part(*this);
}

Eigen::Isometry3d DhLink::after_joint() const {
  if (modified) return Eigen::Isometry3d::Identity();
  return slides ? Eigen::AngleAxisd(offset, Eigen::Vector3d::UnitZ()) * dh_part(*this)
                : dh_part(*this);
}

void forward(const ArmModel& arm, const Eigen::Ref<const Eigen::VectorXd>& q,
             std::vector<Eigen::Isometry3d>& X) {
  MIMESIS_ASSERT(q.size() == arm.dof());
  const auto n = static_cast<std::size_t>(arm.dof());
  X.resize(n + 1);
  X[0] = arm.X_WB;
  for (std::size_t i = 0; i < n; ++i) {
    X[i + 1] = X[i] * link_transform(arm.links[i], q[static_cast<Eigen::Index>(i)]);
  }
}

Eigen::Isometry3d end_effector(const ArmModel& arm, const Eigen::Ref<const Eigen::VectorXd>& q) {
  MIMESIS_ASSERT(q.size() == arm.dof());
  Eigen::Isometry3d X = arm.X_WB;
  for (int i = 0; i < arm.dof(); ++i)
    X = X * link_transform(arm.links[static_cast<std::size_t>(i)], q[i]);
  return X * arm.X_LE;
}

std::vector<SafetyPart> deciding_parts(const ArmModel& arm) {
  std::vector<SafetyPart> parts = arm.parts;
  for (const SafetyBall& ball : arm.balls) {
    if (!ball.of_part)
      parts.push_back({ball.frame,
                       ball.group,
                       {ball.center.transpose(), ball.radius},
                       {{ball.center, ball.radius}}});
  }
  return parts;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(const ArmModel& arm,
                                                  const Eigen::Ref<const Eigen::VectorXd>& q) {
  std::vector<Eigen::Isometry3d> X;
  forward(arm, q, X);
  const Eigen::Vector3d p_WE = X.back() * arm.X_LE.translation();
  Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, arm.dof());
  for (int i = 0; i < arm.dof(); ++i) {
    // Joint i + 1 turns about the z axis before it: ṗ = z × (p_E − p_i), ω = z; or slides: ṗ = z.
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Isometry3d frame = X[at] * arm.links[at].before_joint();
    const Eigen::Vector3d z = frame.linear().col(2);
    if (arm.links[at].slides) {
      J.col(i) << z, Eigen::Vector3d::Zero();
      continue;
    }
    J.col(i).head<3>() = z.cross(p_WE - frame.translation());
    J.col(i).tail<3>() = z;
  }
  return J;
}

void ball_centers(const ArmModel& arm, const std::vector<Eigen::Isometry3d>& X,
                  Eigen::Matrix3Xd& centers) {
  centers.resize(3, static_cast<Eigen::Index>(arm.balls.size()));
  for (std::size_t i = 0; i < arm.balls.size(); ++i) {
    const SafetyBall& ball = arm.balls[i];
    centers.col(static_cast<Eigen::Index>(i)) =
        X[static_cast<std::size_t>(ball.frame)] * ball.center;
  }
}

namespace {

constexpr double kParallel = 1e-9;  // sine of the angle between axes

/// Angle that turns `from` to `to` about `axis`, to which both are normal.
double angle_about(const Eigen::Vector3d& axis, const Eigen::Vector3d& from,
                   const Eigen::Vector3d& to) {
  return std::atan2(axis.dot(from.cross(to)), from.dot(to));
}

Eigen::Isometry3d frame(const Eigen::Vector3d& origin, const Eigen::Vector3d& x,
                        const Eigen::Vector3d& z) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() << x, z.cross(x), z;
  X.translation() = origin;
  return X;
}

}  // namespace

DhRows dh_rows(std::span<const JointAxis> axes) {
  DhRows rows;
  Eigen::Vector3d origin = axes[0].point, z = axes[0].direction, x = z.unitOrthogonal();
  rows.frames.push_back(frame(origin, x, z));
  for (std::size_t i = 0; i < axes.size(); ++i) {
    // The last frame stays on its own axis.
    const JointAxis& next = axes[std::min(i + 1, axes.size() - 1)];
    const Eigen::Vector3d between = next.point - origin, cross = z.cross(next.direction);
    Eigen::Vector3d foot = origin, there = origin, normal = x;
    if (const double sine = cross.norm(); sine > kParallel) {
      normal = cross / sine;
      foot += z * between.cross(next.direction).dot(normal) / sine;
      there = next.point + next.direction * between.cross(z).dot(normal) / sine;
    } else if (const Eigen::Vector3d off = between - z * z.dot(between); off.norm() > kParallel) {
      normal = off.normalized();
      there += off;
    }
    rows.links.push_back({.a = (there - foot).dot(normal),
                          .alpha = angle_about(normal, z, next.direction),
                          .d = (foot - origin).dot(z),
                          .offset = angle_about(z, x, normal),
                          .slides = axes[i].slides});
    origin = there;
    z = next.direction;
    x = normal;
    rows.frames.push_back(frame(origin, x, z));
  }
  return rows;
}

std::optional<Eigen::VectorXd> solve_ik(const ArmModel& arm, const IkGoal& goal,
                                        const Eigen::Ref<const Eigen::VectorXd>& start,
                                        const IkOptions& options) {
  MIMESIS_ASSERT(start.size() == arm.dof());
  const Eigen::VectorXd lo = arm.q_min.array() + options.limit_margin;
  const Eigen::VectorXd hi = arm.q_max.array() - options.limit_margin;
  const auto rows = static_cast<Eigen::Index>(3 + 3 * goal.axes.size());
  Eigen::VectorXd q = start.cwiseMax(lo).cwiseMin(hi);
  Eigen::VectorXd e(rows);
  Eigen::MatrixXd J(rows, arm.dof());

  for (int iteration = 0; iteration <= options.max_iterations && !options.interrupt.now();
       ++iteration) {
    const Eigen::Isometry3d X_WE = end_effector(arm, q);
    const Eigen::Matrix<double, 6, Eigen::Dynamic> J_E = jacobian(arm, q);
    e.head<3>() = goal.position_in_W - X_WE.translation();
    J.topRows<3>() = J_E.topRows<3>();
    bool converged = e.head<3>().norm() < options.position_tolerance;
    for (std::size_t i = 0; i < goal.axes.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(3 + 3 * i);
      const Eigen::Vector3d axis = X_WE.linear() * goal.axes[i].axis_in_E;
      const Eigen::Vector3d turn = rotation_between(axis, goal.axes[i].direction_in_W);
      e.segment<3>(row) = turn;
      // A turn about the axis itself changes nothing that is asked for.
      J.middleRows<3>(row) =
          (Eigen::Matrix3d::Identity() - axis * axis.transpose()) * J_E.bottomRows<3>();
      converged = converged && turn.norm() < options.angle_tolerance;
    }
    if (converged) return q;

    Eigen::MatrixXd H = J.transpose() * J;
    H.diagonal().array() += 0.5 * e.squaredNorm() + kBaseDamping;
    q = (q + H.ldlt().solve(J.transpose() * e)).cwiseMax(lo).cwiseMin(hi);
  }
  return std::nullopt;
}

std::vector<Eigen::VectorXd> solve_ik_anywhere(const ArmModel& arm, const IkGoal& goal,
                                               int attempts, std::uint64_t seed,
                                               const IkOptions& options) {
  std::mt19937_64 generator(seed);
  std::vector<Eigen::VectorXd> solutions;
  Eigen::VectorXd start(arm.dof());
  for (int i = 0; i < attempts && !options.interrupt.told(); ++i) {
    for (Eigen::Index j = 0; j < start.size(); ++j) {
      start[j] = arm.q_min[j] + (arm.q_max[j] - arm.q_min[j]) * uniform(generator);
    }
    if (auto q = solve_ik(arm, goal, start, options)) solutions.push_back(std::move(*q));
  }
  return solutions;
}

}  // namespace mimesis::kin
