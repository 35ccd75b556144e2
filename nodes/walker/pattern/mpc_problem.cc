#include "nodes/walker/pattern/mpc_problem.h"

#include <cmath>
#include <limits>

#include "nodes/walker/pattern/cart_table.h"
#include "nodes/walker/pattern/support_polygon.h"

namespace mimesis::walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSample_s = kSampleTicks * kTick_s;

}  // namespace

MpcProblem::MpcProblem(const GaitSettings& settings, bool yaw_free, const MpcWeights& weights)
    : settings_(settings),
      weights_(weights),
      footsteps_(settings),
      yaw_free_(yaw_free),
      N_(2 * static_cast<int>(std::lround(settings.step_s / kSample_s))),
      axis_(N_ + 2) {
  const double h_g = settings.com_height_m / kGravity_m_s2, T = kSample_s;
  for (int r = 1; r <= kSampleTicks; ++r) {
    Horizon h{r * kTick_s,
              RowMatrix::Zero(N_, N_),
              RowMatrix::Zero(N_, N_),
              Eigen::RowVectorXd::Zero(N_),
              {}};
    for (int k = 0; k < N_; ++k) {
      for (int j = 0; j <= k; ++j) {
        // jerk over `d` seconds, `e` seconds of coasting after it
        const double d = j == 0 ? h.first_s : T, e = (k - j) * T;
        h.velocity(k, j) = d * d / 2.0 + d * e;
        h.zmp(k, j) = d * d * d / 6.0 + d * d / 2.0 * e + d * e * e / 2.0 - h_g * d;
      }
    }
    h.capture = h.zmp.row(N_ - 1) + std::sqrt(h_g) * h.velocity.row(N_ - 1);
    for (int j = 0; j < N_; ++j) h.capture(j) += h_g * (j == 0 ? h.first_s : T);
    h.hessian = weights.velocity * h.velocity.transpose() * h.velocity +
                weights.zmp * h.zmp.transpose() * h.zmp +
                weights.jerk * Eigen::MatrixXd::Identity(N_, N_);
    horizon_.push_back(std::move(h));
  }
  support_.resize(static_cast<std::size_t>(N_));
  hull_.reserve(8);
  free_zmp_.setZero(N_, 2);
  coast_.setZero(N_);
  H_.setZero(variables(), variables());
  g_.setZero(variables());
  A_.setZero(most_rows(), variables());
  lower_.setZero(most_rows());
  upper_.setZero(most_rows());
  x_lower_.setConstant(variables(), -kInfinity);
  x_upper_.setConstant(variables(), kInfinity);
}

qp::Problem MpcProblem::build(const MpcInput& in, const Steps& steps) {
  const int r = steps.ticks_to_sample();
  const Horizon& h = horizon_[static_cast<std::size_t>(r - 1)];
  origin_ = steps.stance().p_W_m;
  feet_ = {steps.stance(), in.foot[0].plan, in.foot[1].plan};
  for (Footprint& foot : feet_) foot.p_W_m -= origin_;
  middle_ = steps.middle_W_m() - origin_;
  for (int k = 0; k < N_; ++k)
    support_[static_cast<std::size_t>(k)] = steps.support_after(r + k * kSampleTicks);
  if (support_[0].both) {
    std::array<Footprint, 2> ground = steps.ground();
    for (Footprint& foot : ground) foot.p_W_m -= origin_;
    support_polygon(ground[0], ground[1], settings_.zmp_half_m, hull_);
  }
  set_cost(in, h);
  set_feet_cost(in);
  rows_ = 0;
  set_limits_of_landings(steps);
  set_limits_of_zmp(in, h);
  set_limits_of_capture(in, h, steps);
  return {H_, g_, A_.topRows(rows_), lower_.head(rows_), upper_.head(rows_), x_lower_, x_upper_};
}

void MpcProblem::set_cost(const MpcInput& in, const Horizon& h) {
  const double h_g = settings_.com_height_m / kGravity_m_s2;
  const Eigen::Vector2d p = in.com.p_W_m - origin_;
  double count[2] = {0.0, 0.0}, both = 0.0;  // of samples on the landings
  for (int axis = 0; axis < 2; ++axis) g_.segment(axis * axis_, axis_).setZero();
  H_.leftCols(axis_).topRows(axis_).bottomRows(2).setZero();
  for (int k = 0; k < N_; ++k) {
    const Support& s = support_[static_cast<std::size_t>(k)];
    const double t = h.first_s + k * kSample_s;
    const Eigen::Vector2d velocity = in.com.v_W + t * in.com.a_W;
    const Eigen::Vector2d zmp = p + t * (in.com.v_W + t / 2.0 * in.com.a_W) - h_g * in.com.a_W;
    const bool walking = !s.both && s.i == s.j;
    const Eigen::Vector2d wished =
        walking ? Eigen::Vector2d(rotation(in.yaw_rad + t * in.wish.yaw_rate_rad_s) *
                                  in.wish.velocity_m_s)
                : Eigen::Vector2d::Zero();
    const double part1 = s.both ? 0.0 : part(s, 1), part2 = s.both ? 0.0 : part(s, 2);
    const Eigen::Vector2d centre = s.both ? middle_ : Eigen::Vector2d(part(s, 0) * feet_[0].p_W_m);
    free_zmp_.row(k) = zmp;
    const Eigen::Vector2d zmp_error = zmp - centre, velocity_error = velocity - wished;
    for (int axis = 0; axis < 2; ++axis) {
      auto g = g_.segment(axis * axis_, axis_);
      g.head(k + 1) +=
          (weights_.velocity * velocity_error(axis)) * h.velocity.row(k).head(k + 1).transpose() +
          (weights_.zmp * zmp_error(axis)) * h.zmp.row(k).head(k + 1).transpose();
      g(N_) -= weights_.zmp * part1 * zmp_error(axis);
      g(N_ + 1) -= weights_.zmp * part2 * zmp_error(axis);
    }
    if (part1 > 0.0) H_.row(N_).head(k + 1) -= weights_.zmp * part1 * h.zmp.row(k).head(k + 1);
    if (part2 > 0.0) H_.row(N_ + 1).head(k + 1) -= weights_.zmp * part2 * h.zmp.row(k).head(k + 1);
    count[0] += part1 * part1;
    count[1] += part2 * part2;
    both += part1 * part2;
  }
  H_.topLeftCorner(N_, N_) = h.hessian;
  H_(N_, N_) = weights_.zmp * count[0];
  H_(N_ + 1, N_ + 1) = weights_.zmp * count[1];
  H_(N_, N_ + 1) = H_(N_ + 1, N_) = weights_.zmp * both;
  H_.block(0, N_, N_, 2) = H_.block(N_, 0, 2, N_).transpose();
}

void MpcProblem::set_feet_cost(const MpcInput& in) {
  for (int i = 0; i < 2; ++i) {
    const MpcInput::Foot& foot = in.foot[static_cast<std::size_t>(i)];
    const int at = N_ + i;
    const double weight = foot.p_W_m ? weights_.landing : weights_.spacing;
    const Eigen::Vector2d goal =
        foot.p_W_m ? Eigen::Vector2d(*foot.p_W_m - origin_) : foot.step_W_m;
    H_(at, at) += weight + weights_.foot;
    for (int axis = 0; axis < 2; ++axis)
      g_(axis * axis_ + at) -=
          weight * goal(axis) + weights_.foot * feet_[static_cast<std::size_t>(i) + 1].p_W_m(axis);
    if (i == 1 && !foot.p_W_m) {  // relative to the first landing
      H_(N_, N_) += weight;
      H_(N_, at) -= weight;
      H_(at, N_) -= weight;
      for (int axis = 0; axis < 2; ++axis) g_(axis * axis_ + N_) += weight * goal(axis);
    }
  }
  H_.block(axis_, axis_, axis_, axis_) = H_.topLeftCorner(axis_, axis_);
  if (!yaw_free_) return;
  for (int i = 0; i < 2; ++i) {
    const MpcInput::Foot& foot = in.foot[static_cast<std::size_t>(i)];
    H_(2 * axis_ + i, 2 * axis_ + i) = weights_.yaw;
    g_(2 * axis_ + i) = weights_.yaw * (foot.plan.yaw_rad - foot.wished_yaw_rad);
  }
}

}  // namespace mimesis::walker
