#include "common/robot/leg_ik.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"
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

/// 0, 1 or 2, and the sense, of a direction along x, y or z.
std::pair<int, double> along(const Vector3d& direction, const std::string& where) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  const double sense = direction[axis] > 0.0 ? 1.0 : -1.0;
  if ((direction - sense * Vector3d::Unit(axis)).norm() > 1e-9) {
    throw ConfigError(where + "axis is askew in the zero posture, expected along x, y or z");
  }
  return {static_cast<int>(axis), sense};
}

}  // namespace

LegIk::LegIk(const Biped& biped, Side side) {
  const RobotTree& tree = biped.tree;
  const Biped::Leg& leg = biped.leg[side];
  const Kinematics zero(tree);
  std::array<Line, 6> lines;
  for (std::size_t i = 0; i < 6; ++i) {
    const Link& link = tree.moved(leg.dof[i]);
    const Isometry3d& X = zero.X_WL(tree.moved_link(leg.dof[i]));
    lines[i] = {.point = X.translation(), .direction = X.linear() * link.axis};
    const auto n = static_cast<Eigen::Index>(i);
    std::tie(axis_[i], sense_[n]) =
        along(lines[i].direction, tree.name() + ": joint '" + link.joint + "': ");
    lower_[n] = link.lower;
    upper_[n] = link.upper;
  }
  const auto refuse = [&](int joint, const std::string& what) {
    throw ConfigError(tree.name() + ": joint '" +
                      tree.moved(leg.dof[static_cast<std::size_t>(joint)]).joint + "': " + what);
  };
  const auto hip = meeting_point(std::span(lines).first(3));
  if (!hip || axis_[0] == axis_[1] || axis_[1] == axis_[2] || axis_[2] == axis_[0]) {
    refuse(0, "expected three axes along x, y and z that meet in the hip");
  }
  if (axis_[3] != kY) refuse(3, "expected a knee about y");
  if (axis_[4] + axis_[5] != kX + kY || axis_[4] == axis_[5]) {
    refuse(4, "expected an ankle about x and y");
  }
  const Isometry3d& X_BS = zero.X_WL(leg.sole);
  hip_B_ = *hip;
  thigh_B_ = lines[3].point - hip_B_;
  shank_B_ = X_BS * leg.ankle_S_m - lines[3].point;
  ankle_S_ = leg.ankle_S_m;
  R_SB_ = X_BS.linear().transpose();
  const Vector3d &t = thigh_B_, &s = shank_B_;
  straight_ = std::atan2(s.z() * t.x() - s.x() * t.z(), s.x() * t.x() + s.z() * t.z());
  const double thigh_2 = t.x() * t.x() + t.z() * t.z(), shank_2 = s.x() * s.x() + s.z() * s.z();
  if (!(std::min(thigh_2, shank_2) > 0.0)) refuse(3, "expected a knee between hip and ankle");
  lengths_2_ = thigh_2 + shank_2;
  product_ = std::sqrt(thigh_2 * shank_2);
  // Bent to the side that has more room
  const double a = sense_[3] * lower_[3] - straight_, b = sense_[3] * upper_[3] - straight_;
  bends_ = std::max(a, b) >= -std::min(a, b) ? 1.0 : -1.0;
  most_bend_ = std::min(kPi, bends_ > 0.0 ? std::max(a, b) : -std::min(a, b));
  if (!(most_bend_ > 0.0)) refuse(3, "expected a knee that bends");
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

LegIk::Result LegIk::solve(const Isometry3d& X_BS, double least_knee_bend_rad) const {
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

}  // namespace mimesis::robot
