#include "nodes/planner/playback.h"

#include <algorithm>
#include <cmath>

namespace mimesis::planner {

void Playback::start(JointTrajectory trajectory) {
  trajectory_ = std::move(trajectory);
  at_ = 0.0;
  pace_ = 1.0;
  braking_ = false;
}

void Playback::advance() {
  if (at_rest()) return;
  const double period = trajectory_.period_s;
  if (braking_) pace_ = std::max(0.0, pace_ - period / brake_s_);
  at_ = std::min(at_ + pace_ * period, trajectory_.duration_s());
}

std::pair<Eigen::Index, double> Playback::sample() const {
  // Whole periods come out exactly: without braking every sample is played as planned.
  const double periods = at_ / trajectory_.period_s, whole = std::floor(periods + 1e-6);
  const auto k = std::min(static_cast<Eigen::Index>(whole), trajectory_.samples() - 1);
  return {k, std::max(0.0, periods - static_cast<double>(k))};
}

Eigen::VectorXd Playback::position() const {
  const auto [k, u] = sample();
  if (u < 1e-6 || k + 1 >= trajectory_.samples()) return trajectory_.position.col(k);
  // Cubic Hermite between the samples.
  const double h = trajectory_.period_s, v = 1.0 - u;
  return (1.0 + 2.0 * u) * v * v * trajectory_.position.col(k) +
         u * u * (3.0 - 2.0 * u) * trajectory_.position.col(k + 1) +
         h * u * v * v * trajectory_.velocity.col(k) -
         h * u * u * v * trajectory_.velocity.col(k + 1);
}

Eigen::VectorXd Playback::velocity() const {
  const auto [k, u] = sample();
  if (at_rest()) return Eigen::VectorXd::Zero(trajectory_.position.rows());
  if (u < 1e-6 || k + 1 >= trajectory_.samples()) return pace_ * trajectory_.velocity.col(k);
  return pace_ * ((1.0 - u) * trajectory_.velocity.col(k) + u * trajectory_.velocity.col(k + 1));
}

}  // namespace mimesis::planner
