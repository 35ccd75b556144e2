#include "common/robot/leg_ik.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/math/so3.h"
#include "common/robot/kinematics.h"

namespace mimesis::robot {
namespace {

using Eigen::Isometry3d, Eigen::Matrix3d, Eigen::Vector3d;
using math::wrap_pi;
constexpr double kPi = std::numbers::pi;
enum Axis { kX, kY, kZ };

/// Rotation about an axis of coordinates.
Matrix3d turn(int axis, double angle) {
  const int j = (axis + 1) % 3, k = (axis + 2) % 3;
  const double c = std::cos(angle), s = std::sin(angle);
  Matrix3d R = Matrix3d::Identity();
  R(j, j) = c;
  R(j, k) = -s;
  R(k, j) = s;
  R(k, k) = c;
  return R;
}

/// Rotation about a unit vector: cos 1 + (1 − cos) a aᵀ + sin â.
Matrix3d turn_about(const Vector3d& a, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const Vector3d sa = s * a, ca = (1.0 - c) * a;
  Matrix3d R = ca * a.transpose();
  R.diagonal().array() += c;
  R(0, 1) -= sa.z();
  R(1, 0) += sa.z();
  R(0, 2) += sa.y();
  R(2, 0) -= sa.y();
  R(1, 2) -= sa.x();
  R(2, 1) += sa.x();
  return R;
}

/// Angles about x that bring a vector to a given y.
struct Rolls {
  double lesser, other;
  bool exist;  ///< false: both are the nearest
};

Rolls rolls_to(const Vector3d& v, double y) {
  const double rho = std::hypot(v.y(), v.z());
  const double at = std::atan2(v.z(), v.y());
  const double beta = rho > 0.0 ? std::acos(std::clamp(y / rho, -1.0, 1.0)) : 0.0;
  const double one = wrap_pi(beta - at), two = wrap_pi(-beta - at);
  const bool one_first = std::abs(one) < std::abs(two);
  return {.lesser = one_first ? one : two,
          .other = one_first ? two : one,
          .exist = rho > 0.0 && std::abs(y) <= rho * (1.0 + 1e-12)};
}

/// Angle about y from v to w.
double pitch_to(const Vector3d& v, const Vector3d& w) {
  return std::atan2(w.x() * v.z() - w.z() * v.x(), w.x() * v.x() + w.z() * v.z());
}

/// 0, 1 or 2, and the sense, of a direction along x, y or z; sense 0: along none.
std::pair<int, double> along(const Vector3d& direction) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  const double sense = direction[axis] > 0.0 ? 1.0 : -1.0;
  const bool askew = (direction - sense * Vector3d::Unit(axis)).norm() > 1e-9;
  return {static_cast<int>(axis), askew ? 0.0 : sense};
}

}  // namespace

LegIk::LegIk(const Biped& biped, Side side) {
  const RobotTree& tree = biped.tree;
  const Biped::Leg& leg = biped.leg[side];
  const Kinematics zero(tree);
  for (std::size_t i = 0; i < 6; ++i) {
    const Link& link = tree.moved(leg.dof[i]);
    const Isometry3d& X = zero.X_WL(tree.moved_link(leg.dof[i]));
    line_[i] = {.point = X.translation(), .direction = X.linear() * link.axis};
    const auto n = static_cast<Eigen::Index>(i);
    std::tie(axis_[i], sense_[n]) = along(line_[i].direction);
    lower_[n] = link.lower;
    upper_[n] = link.upper;
    half_sitting_[n] = biped.half_sitting[leg.dof[i]];
  }
  const Isometry3d& X_BS = zero.X_WL(leg.sole);
  ankle_S_ = leg.ankle_S_m;
  ankle_B_ = X_BS * ankle_S_;
  R_SB_ = X_BS.linear().transpose();
  closed_ = fits_closed_form();
  const std::string where = tree.name() + ": joint '" + tree.moved(leg.dof[kKnee]).joint + "': ";
  if (closed_) {
    hip_B_ = *meeting_point(std::span(line_).first(3));
    thigh_B_ = line_[3].point - hip_B_;
    shank_B_ = ankle_B_ - line_[3].point;
    const Vector3d &t = thigh_B_, &s = shank_B_;
    straight_ = std::atan2(s.z() * t.x() - s.x() * t.z(), s.x() * t.x() + s.z() * t.z());
    const double thigh_2 = t.x() * t.x() + t.z() * t.z(), shank_2 = s.x() * s.x() + s.z() * s.z();
    lengths_2_ = thigh_2 + shank_2;
    product_ = std::sqrt(thigh_2 * shank_2);
  } else {
    sense_[3] = 1.0;
    hip_B_ = zero.X_WL(tree.moved_link(leg.dof[kHipLast])) * leg.hip_T_m;
    // Squared distance of two points on either side of a hinge: m + c cos q + s sin q
    const Vector3d knee = line_[3].point, axis = line_[3].direction, t = knee - hip_B_,
                   s = ankle_B_ - knee, across = s - axis * axis.dot(s);
    const double c = t.dot(across), d = t.dot(axis.cross(s));
    straight_ = std::atan2(d, c);
    product_ = std::hypot(c, d);
    lengths_2_ = t.squaredNorm() + s.squaredNorm() + 2.0 * t.dot(axis) * axis.dot(s);
  }
  constexpr double kNoLever_m2 = 1e-6;
  if (!(product_ > kNoLever_m2)) throw ConfigError(where + "expected a knee between hip and ankle");
  // Bent to the side that has more room
  const double a = sense_[3] * lower_[3] - straight_, b = sense_[3] * upper_[3] - straight_;
  bends_ = std::max(a, b) >= -std::min(a, b) ? 1.0 : -1.0;
  most_bend_ = std::min(kPi, bends_ > 0.0 ? std::max(a, b) : -std::min(a, b));
  if (!(most_bend_ > 0.0)) throw ConfigError(where + "expected a knee that bends");
}

bool LegIk::fits_closed_form() const {
  if ((sense_.array() == 0.0).any()) return false;
  const bool hip = axis_[0] != axis_[1] && axis_[1] != axis_[2] && axis_[2] != axis_[0] &&
                   meeting_point(std::span(line_).first(3)).has_value();
  const bool ankle = axis_[4] != axis_[5] && axis_[4] + axis_[5] == kX + kY &&
                     meeting_point(std::span(line_).last(2)).has_value();
  return hip && ankle && axis_[3] == kY;
}

Vector3d LegIk::bend_knee(double distance_m, double least_bend_rad, Result& out) const {
  const Vector3d &t = thigh_B_, &s = shank_B_;
  const double aside = t.y() + s.y();
  const double cosine = (distance_m * distance_m - aside * aside - lengths_2_) / (2.0 * product_);
  const double wished = std::acos(std::clamp(cosine, -1.0, 1.0));
  const double bend = std::clamp(wished, std::min(least_bend_rad, most_bend_), most_bend_);
  out.stretched = !(std::abs(cosine) <= 1.0) || bend != wished;
  out.bend_rad = bend;
  const double angle = straight_ + bends_ * bend;
  out.q[3] = sense_[3] * angle;
  return -(s + turn(kY, -angle) * t);
}

void LegIk::turn_ankle(const Vector3d& hip_F, const Vector3d& hip_K, bool lesser,
                       Result& out) const {
  const bool pitch_first = axis_[4] == kY;  // hip_K = Ry Rx hip_F, else Rx⁻¹ hip_K = Ry hip_F
  const Rolls rolls = pitch_first ? rolls_to(hip_F, hip_K.y()) : rolls_to(hip_K, hip_F.y());
  if (!rolls.exist) out.stretched = true;
  const double roll = lesser ? rolls.lesser : rolls.other;
  if (pitch_first) {
    out.q.tail<2>() << pitch_to(turn(kX, roll) * hip_F, hip_K), roll;
  } else {
    out.q.tail<2>() << -roll, pitch_to(hip_F, turn(kX, roll) * hip_K);
  }
  out.q.tail<2>().array() *= sense_.tail<2>().array();
}

void LegIk::turn_hip(const Matrix3d& R_BT, Result& out) const {
  const int i = axis_[0], j = axis_[1], k = axis_[2];
  const double even = (i + 1) % 3 == j ? 1.0 : -1.0;  // sign of the permutation of x, y, z
  const double c = std::hypot(R_BT(i, i), R_BT(i, j));
  Vector3d angle;
  angle[1] = std::atan2(even * R_BT(i, k), c);
  if (c > 1e-9) {
    angle[0] = std::atan2(-even * R_BT(j, k), R_BT(k, k));
    angle[2] = std::atan2(-even * R_BT(i, j), R_BT(i, i));
  } else {  // first and last axis are parallel: all to the last
    angle[0] = 0.0;
    angle[2] = std::atan2(even * R_BT(j, i), R_BT(j, j));
  }
  const auto in_limits = [this](const Vector3d& q) {
    return (q.array() <= upper_.head<3>().array()).all() &&
           (q.array() >= lower_.head<3>().array()).all();
  };
  out.q.head<3>() = angle.cwiseProduct(sense_.head<3>());
  if (in_limits(out.q.head<3>())) return;
  // Equivalent rotation with the opposite sign
  const Vector3d other(wrap_pi(angle[0] + kPi), wrap_pi(kPi - angle[1]), wrap_pi(angle[2] + kPi));
  const Vector3d q_other = other.cwiseProduct(sense_.head<3>());
  if (in_limits(q_other)) out.q.head<3>() = q_other;
}

void LegIk::apply_limits(Result& out) const {
  constexpr double kRounding = 1e-9;
  out.limited =
      ((out.q - upper_).array() > kRounding).any() || ((lower_ - out.q).array() > kRounding).any();
  out.q = out.q.cwiseMax(lower_).cwiseMin(upper_);
}

LegIk::Result LegIk::solve_closed(const Isometry3d& X_BS, double least_knee_bend_rad) const {
  Result out;
  const Matrix3d R_BF = X_BS.linear() * R_SB_;
  Vector3d hip_F = R_BF.transpose() * (hip_B_ - X_BS * ankle_S_);
  const double distance = hip_F.norm();
  const Vector3d hip_K = bend_knee(distance, least_knee_bend_rad, out);
  if (out.stretched) {
    hip_F = distance > 1e-9 ? Vector3d(hip_F * (hip_K.norm() / distance))
                            : Vector3d(hip_K.norm() * Vector3d::UnitZ());
  }
  const auto finish = [&](bool lesser_roll) {
    Result finished = out;
    turn_ankle(hip_F, hip_K, lesser_roll, finished);
    const auto angle = [&](std::size_t i) {
      const auto n = static_cast<Eigen::Index>(i);
      return sense_[n] * finished.q[n];
    };
    const Matrix3d R_TF = turn(kY, angle(3)) * turn(axis_[4], angle(4)) * turn(axis_[5], angle(5));
    turn_hip(R_BF * R_TF.transpose(), finished);
    apply_limits(finished);
    return finished;
  };
  const Result first = finish(true);
  if (!first.limited) return first;
  const Result second = finish(false);
  return second.limited ? first : second;
}

LegIk::Result LegIk::search(const Isometry3d& X_BS, double least_bend_rad,
                            const Vector6d& from) const {
  constexpr int kMostSteps = 40;
  constexpr double kMostTurn_rad = 0.6;
  // Such a step leaves an error of its square, which is rounding.
  constexpr double kLastTurn_rad = 1e-7;
  const double least = std::min(least_bend_rad, most_bend_);
  const Matrix3d R_goal = X_BS.linear() * R_SB_;  // turn of the foot since the zero posture
  const Vector3d ankle_goal = X_BS * ankle_S_, way = ankle_goal - hip_B_;
  const double distance = way.norm();
  const Vector3d down = distance > 1e-9 ? Vector3d(way / distance) : Vector3d(-Vector3d::UnitZ());

  Result out{.q = from};
  const auto bend = [&] { return bends_ * (out.q[3] - straight_); };
  out.q[3] = straight_ + bends_ * std::clamp(bend(), least, most_bend_);
  Eigen::Matrix<double, 6, 6> J;
  Vector6d error;
  double missing_m = 0.0;            // the ankle is to be this much nearer to the hip than asked
  bool held = false, found = false;  // the knee, a posture
  int at_end = 0, releases = 0;
  for (int step = 0; step < kMostSteps; ++step) {
    Isometry3d X = Isometry3d::Identity();  // of what the joint moves, since the zero posture
    std::array<Line, 6> now;
    for (std::size_t i = 0; i < 6; ++i) {
      now[i] = {.point = X * line_[i].point, .direction = X.linear() * line_[i].direction};
      X.linear() *= turn_about(line_[i].direction, out.q[static_cast<Eigen::Index>(i)]);
      X.translation() = now[i].point - X.linear() * line_[i].point;
    }
    const Vector3d ankle = X * ankle_B_;
    error << ankle_goal - missing_m * down - ankle,
        math::log_so3(Matrix3d(R_goal * X.linear().transpose()));
    const double size_2 = error.squaredNorm();
    for (std::size_t i = 0; i < 6; ++i) {
      auto column = J.col(static_cast<Eigen::Index>(i));
      column << now[i].direction.cross(ankle - now[i].point), now[i].direction;
    }
    if (held) J.col(3) << down, Vector3d::Zero();
    // (JᵀJ + |e|² 1) dq = Jᵀ e
    Eigen::Matrix<double, 6, 6> H = J.transpose().lazyProduct(J);
    H.diagonal().array() += size_2 + 1e-15;
    Vector6d dq = H.llt().solve(J.transpose() * error);
    const double most = dq.cwiseAbs().maxCoeff();
    if (!(most < 1e6)) break;  // also NaN
    const bool last = most < kLastTurn_rad;
    if (most > kMostTurn_rad) dq *= kMostTurn_rad / most;
    if (held) {
      missing_m += dq[3];
      dq[3] = 0.0;
    }
    out.q += dq;
    if (held) {
      if (!last) continue;
      // Held at the end that is on the way to the goal: there is no better knee.
      const bool straightest = bend() < 0.5 * (least + most_bend_);
      found = straightest ? missing_m >= 0.0 : missing_m <= 0.0;
      if (found || ++releases > 2) break;
      // Near straight the knee's effect on the distance is lost: begin where the distance is right.
      const double cosine = (distance * distance - lengths_2_) / (2.0 * product_);
      out.q[3] = straight_ +
                 bends_ * std::clamp(std::acos(std::clamp(cosine, -1.0, 1.0)), least, most_bend_);
      held = false;
      at_end = 0;
      missing_m = 0.0;
    } else if (const double b = bend(); b < least || b > most_bend_) {
      out.q[3] = straight_ + bends_ * std::clamp(b, least, most_bend_);
      held = ++at_end > 1;
    } else if (last) {
      found = true;
      break;
    } else {
      at_end = 0;
    }
  }
  for (double& angle : out.q) angle = wrap_pi(angle);
  out.stretched = held || !found;
  out.bend_rad = std::max(0.0, bend());
  apply_limits(out);
  return out;
}

LegIk::Result LegIk::solve(const Isometry3d& X_BS, double least_knee_bend_rad,
                           const Vector6d* near) const {
  if (closed_) return solve_closed(X_BS, least_knee_bend_rad);
  const Result first = search(X_BS, least_knee_bend_rad, near != nullptr ? *near : half_sitting_);
  if (near == nullptr || (!first.stretched && !first.limited)) return first;
  const Result second = search(X_BS, least_knee_bend_rad, half_sitting_);
  const auto price = [](const Result& r) { return 2 * r.stretched + r.limited; };
  return price(second) < price(first) ? second : first;
}

}  // namespace mimesis::robot
