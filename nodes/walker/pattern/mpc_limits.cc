// The rows of the MPC's problem: where feet, ZMP and capture point may be.
#include <cmath>
#include <limits>

#include "nodes/walker/pattern/cart_table.h"
#include "nodes/walker/pattern/mpc_problem.h"

namespace mimesis::walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSample_s = kSampleTicks * kTick_s;
// A swing foot with D seconds left to fly may be led elsewhere by A D² in all, that is 2 A D a
// second: this bounds its acceleration. Once little time is left its landing stays.
constexpr double kSteer_m_s2 = 1.2, kSteer_rad_s2 = 2.0, kFrozen_s = 0.1;

// Share of the ZMP's rectangle that may be used up to catch the capture point on the next foot.
constexpr double kCaught = 0.4;
// Of a limit at the end of the horizon, so that it can be kept a sample later too.
constexpr double kKept = 0.98;

double steer_s2(const Steps& steps) {
  const double left = steps.free_time_s();
  return left <= kFrozen_s ? 0.0 : 2.0 * left * kTick_s;
}

}  // namespace

double MpcProblem::yaw_freedom_rad(const Steps& steps) const {
  return kSteer_rad_s2 * steer_s2(steps);
}

void MpcProblem::set_limits_of_landings(const Steps& steps) {
  const double steer = steer_s2(steps);
  const bool frozen = steer == 0.0;
  for (int axis = 0; axis < 2; ++axis) {
    x_lower_(axis * axis_ + N_) = feet_[1].p_W_m(axis) - steer * kSteer_m_s2;
    x_upper_(axis * axis_ + N_) = feet_[1].p_W_m(axis) + steer * kSteer_m_s2;
  }
  for (int i = frozen ? 1 : 0; i < 2; ++i) {
    const Side swing = i == 0 ? steps.swing() : robot::other(steps.swing());
    const Footprint& from = feet_[static_cast<std::size_t>(i)];
    const Eigen::Matrix2d R = rotation(from.yaw_rad);
    const Eigen::Vector2d step = feet_[static_cast<std::size_t>(i) + 1].p_W_m - from.p_W_m;
    for (const HalfPlane& side : footsteps_.limits(swing)) {
      const Eigen::Vector2d n = R * side.normal;
      auto row = A_.row(rows_);
      row.setZero();
      for (int axis = 0; axis < 2; ++axis) {
        row(axis * axis_ + N_ + i) = n(axis);
        if (i == 1) row(axis * axis_ + N_) = -n(axis);
      }
      lower_(rows_) = -kInfinity;
      upper_(rows_) = side.offset;  // the first is from the standing foot, the origin
      if (yaw_free_ && i == 1)      // d(Rn)/dθ of the first landing
        row(2 * axis_) = Eigen::Vector2d(-n.y(), n.x()).dot(step);
      ++rows_;
    }
  }
  if (!yaw_free_) return;
  x_lower_(2 * axis_) = -steer * kSteer_rad_s2;
  x_upper_(2 * axis_) = steer * kSteer_rad_s2;
  for (int i = frozen ? 1 : 0; i < 2; ++i) {
    auto row = A_.row(rows_);
    row.setZero();
    row(2 * axis_ + i) = 1.0;
    if (i == 1) row(2 * axis_) = -1.0;
    const double now =
        feet_[static_cast<std::size_t>(i) + 1].yaw_rad - feet_[static_cast<std::size_t>(i)].yaw_rad;
    lower_(rows_) = -settings_.most_foot_yaw_rad - now;
    upper_(rows_) = settings_.most_foot_yaw_rad - now;
    ++rows_;
  }
}

void MpcProblem::set_row(const Eigen::Ref<const Eigen::RowVectorXd>& of_jerk, const Support& s,
                         const Eigen::Vector2d& n) {
  auto row = A_.row(rows_);
  row.setZero();
  for (int axis = 0; axis < 2; ++axis) {
    row.segment(axis * axis_, of_jerk.size()) = n(axis) * of_jerk;
    if (s.both) continue;
    row(axis * axis_ + N_) = -n(axis) * part(s, 1);
    row(axis * axis_ + N_ + 1) = -n(axis) * part(s, 2);
  }
}

void MpcProblem::set_zmp_row(const Horizon& h, int k, const Eigen::Vector2d& n, double yaw_slope) {
  const Support& s = support_[static_cast<std::size_t>(k)];
  set_row(h.zmp.row(k).head(k + 1), s, n);
  if (yaw_free_ && !s.both && s.j > 0) A_(rows_, 2 * axis_ + s.j - 1) = yaw_slope;
}

/// The capture point at the end of the horizon if there is no further jerk, and the sample after
/// it.
MpcProblem::Capture MpcProblem::capture_at_end(const MpcInput& in, const Horizon& h) {
  Capture c;
  c.root_s = std::sqrt(settings_.com_height_m / kGravity_m_s2);
  c.end_s = h.first_s + (N_ - 1) * kSample_s;
  c.free = in.com.p_W_m - origin_ + c.end_s * (in.com.v_W + c.end_s / 2.0 * in.com.a_W) +
           c.root_s * (in.com.v_W + c.end_s * in.com.a_W);
  const Support& s = support_.back();
  if (!s.both) c.known_foot = part(s, 0) * feet_[0].p_W_m;
  c.growth = std::exp(kSample_s / c.root_s);
  c.next_zmp = (c.growth - 1.0) * c.root_s / kSample_s - 1.0;
  c.zmp = c.growth - 1.0 - c.next_zmp;
  coast_ = (c.growth * h.capture - c.zmp * h.zmp.row(N_ - 1)) / (c.growth - c.zmp);
  return c;
}

/// A sample on, with the ZMP then at the edge n·z = `edge` that pushes back, n·ξ' ≤ `most` must
/// hold: so the next tick's program has a solution too. Both as seen from the foot.
void MpcProblem::limit_next_capture(const Capture& c, const Eigen::Vector2d& n, double edge,
                                    double most) {
  const double g = c.growth, w = c.zmp;
  const Eigen::Vector2d last_zmp = free_zmp_.row(N_ - 1);
  set_row(coast_, support_.back(), n);
  lower_(rows_) = -kInfinity;
  upper_(rows_) = (most + c.next_zmp * edge) / (g - w) -
                  n.dot((g * c.free - w * last_zmp) / (g - w) - c.known_foot);
  ++rows_;
}

void MpcProblem::set_limits_of_capture(const MpcInput& in, const Horizon& h, const Steps& steps) {
  const Support& s = support_.back();
  const Capture c = capture_at_end(in, h);
  if (s.both) {
    for (const HalfPlane& side : hull_) {
      limit_next_capture(c, side.normal, side.offset, side.offset);
    }
    return;
  }
  if (s.i == s.j) return set_limits_of_next_step(h, c, steps);
  const Eigen::Matrix2d R = rotation(feet_[static_cast<std::size_t>(s.j)].yaw_rad);
  for (int axis = 0; axis < 2; ++axis) {
    const double half = settings_.zmp_half_m(axis);
    for (const double sign : {-1.0, 1.0}) {
      limit_next_capture(c, sign * R.col(axis), half, kKept * half);
    }
  }
}

/// One foot stands at the end: till the next landing the capture point goes away from it, and on
/// while the ZMP crosses to the next foot, `crossing` of the step is lost. What is left of the
/// ZMP's rectangle there then leads it to the step after.
void MpcProblem::set_limits_of_next_step(const Horizon& h, const Capture& c, const Steps& steps) {
  const Support& s = support_.back();
  const Eigen::Matrix2d R = rotation(feet_[static_cast<std::size_t>(s.j)].yaw_rad);
  const double left_s = steps.until_next_landing_s(c.end_s);
  const double crossing = (1.0 - 1.0 / c.growth) / 2.0;
  const Side swing = s.i % 2 == 0 ? steps.swing() : robot::other(steps.swing());
  for (const HalfPlane& side : footsteps_.limits(swing)) {
    const Eigen::Vector2d n = R * side.normal;
    const double edge = side.normal.cwiseAbs().dot(settings_.zmp_half_m);
    const double reach = (1.0 - crossing) * side.offset + kCaught * edge;
    if (left_s > kSample_s / 2.0) {
      limit_next_capture(c, n, edge, kKept * reach * std::exp((kSample_s - left_s) / c.root_s));
      continue;
    }
    set_row(h.capture, s, n);
    lower_(rows_) = -kInfinity;
    upper_(rows_) = reach * std::exp(-left_s / c.root_s) - n.dot(c.free - c.known_foot);
    ++rows_;
  }
}

void MpcProblem::set_limits_of_zmp(const MpcInput& in, const Horizon& h) {
  for (int k = 0; k < N_; ++k) {
    const Support& s = support_[static_cast<std::size_t>(k)];
    const Eigen::Vector2d free = free_zmp_.row(k);
    if (s.both) {
      for (const HalfPlane& side : hull_) {
        set_zmp_row(h, k, side.normal, 0.0);
        lower_(rows_) = -kInfinity;
        upper_(rows_) = side.offset - side.normal.dot(free);
        ++rows_;
      }
      continue;
    }
    const auto i = static_cast<std::size_t>(s.i), j = static_cast<std::size_t>(s.j);
    const double yaw = feet_[j].yaw_rad;
    const Eigen::Vector2d fixed = part(s, 0) * feet_[0].p_W_m;
    Eigen::Vector2d from_foot = Eigen::Vector2d::Zero();  // of the last plan's ZMP
    if (yaw_free_)
      from_foot = in.zmp_plan_W_m[static_cast<std::size_t>(k)] - origin_ -
                  0.5 * (feet_[i].p_W_m + feet_[j].p_W_m);
    for (int side = 0; side < 2; ++side) {
      const Eigen::Vector2d n = rotation(yaw).col(side), dn(-n.y(), n.x());
      set_zmp_row(h, k, n, dn.dot(from_foot));
      const double middle = n.dot(fixed - free), half = settings_.zmp_half_m(side);
      lower_(rows_) = middle - half;
      upper_(rows_) = middle + half;
      ++rows_;
    }
  }
}

}  // namespace mimesis::walker
