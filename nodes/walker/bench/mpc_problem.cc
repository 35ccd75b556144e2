#include "nodes/walker/bench/mpc_problem.h"

#include <limits>

namespace mimesis::walker {
namespace {

constexpr int kN = 16, kFeet = 2, kAxis = kN + kFeet, kTicksAStep = 160, kTicksASample = 20;
constexpr double kSample_s = 0.1, kTick = 0.005, kHeightOverGravity = 0.807 / 9.81;
constexpr double kVelocityWeight = 1.0, kZmpWeight = 1e-3, kJerkWeight = 1e-5;
constexpr double kWish_m_s[2] = {0.2, 0.0};
constexpr double kHalf_m[2] = {0.06, 0.03};

}  // namespace

MpcProblem::MpcProblem()
    : state_(Eigen::Matrix<double, 2, 3>::Zero()),
      H_(kVariables, kVariables),
      g_(kVariables),
      lower_(Eigen::VectorXd::Constant(kRows, -std::numeric_limits<double>::infinity())),
      upper_(kRows),
      A_(kRows, kVariables) {}

/// Positions of the samples for jerks that are constant in between; the first interval is the rest
/// to the grid.
void MpcProblem::predict(double first_s) {
  for (int i = 0; i < kN; ++i) {
    const double t = first_s + i * kSample_s;
    velocity_of_state_.row(i) << 0.0, 1.0, t;
    zmp_of_state_.row(i) << 1.0, t, 0.5 * t * t - kHeightOverGravity;
    for (int j = 0; j < kN; ++j) {
      const double T = j == 0 ? first_s : kSample_s, after = j > i ? 0.0 : (i - j) * kSample_s;
      const double on = j > i ? 0.0 : 1.0;
      velocity_of_jerk_(i, j) = on * (0.5 * T * T + T * after);
      zmp_of_jerk_(i, j) = on * (T * T * T / 6.0 + 0.5 * T * T * after + 0.5 * T * after * after -
                                 kHeightOverGravity * T);
    }
  }
}

void MpcProblem::build() {
  const int into = tick_ % kTicksASample;
  predict(kSample_s - into * kTick);
  Eigen::Matrix<double, kN, kFeet> V = Eigen::Matrix<double, kN, kFeet>::Zero();
  Eigen::Matrix<double, kN, 1> current = Eigen::Matrix<double, kN, 1>::Zero();
  for (int i = 0; i < kN; ++i) {
    const int at = (tick_ - into + (i + 1) * kTicksASample - 1) / kTicksAStep - step_;
    if (at == 0) current[i] = 1.0;
    if (at > 0) V(i, std::min(at, kFeet) - 1) = 1.0;
  }
  H_.setZero();
  A_.setZero();
  for (int axis = 0; axis < 2; ++axis) {
    const int at = axis * kAxis, feet = at + kN;
    H_.block<kN, kN>(at, at).noalias() =
        kVelocityWeight * velocity_of_jerk_.transpose().lazyProduct(velocity_of_jerk_) +
        kZmpWeight * zmp_of_jerk_.transpose().lazyProduct(zmp_of_jerk_);
    H_.block<kN, kN>(at, at).diagonal().array() += kJerkWeight;
    H_.block<kN, kFeet>(at, feet).noalias() = -kZmpWeight * zmp_of_jerk_.transpose().lazyProduct(V);
    H_.block<kFeet, kN>(feet, at) = H_.block<kN, kFeet>(at, feet).transpose();
    H_.block<kFeet, kFeet>(feet, feet) = kZmpWeight * V.transpose().lazyProduct(V);
    H_.block<kFeet, kFeet>(feet, feet).diagonal().array() += 1e-6;
    const Eigen::Vector3d c = state_.row(axis);
    const Eigen::Matrix<double, kN, 1> v = (velocity_of_state_ * c).array() - kWish_m_s[axis];
    const Eigen::Matrix<double, kN, 1> z = zmp_of_state_ * c - current * foot_[axis];
    g_.segment<kN>(at).noalias() = kVelocityWeight * velocity_of_jerk_.transpose() * v +
                                   kZmpWeight * zmp_of_jerk_.transpose() * z;
    g_.segment<kFeet>(feet).noalias() = -kZmpWeight * V.transpose() * z;
    for (int i = 0; i < kN; ++i) {
      const bool first_step = step_ == 0 && current[i] > 0.0;  // both feet on the ground
      const double wide = first_step && axis == 1 ? 0.19 : 0.0;
      const int row = 4 * i + 2 * axis;
      A_.block<1, kN>(row, at) = zmp_of_jerk_.row(i);
      A_.block<1, kFeet>(row, feet) = -V.row(i);
      A_.row(row + 1) = -A_.row(row);
      upper_[row] = kHalf_m[axis] - z[i];
      upper_[row + 1] = kHalf_m[axis] + wide + z[i];
    }
  }
  // The next foot in a pentagon beside the one before.
  const double side = step_ % 2 == 0 ? -1.0 : 1.0;  // the first swing foot is the right one
  const double normal[5][2] = {{0.0, -1.0}, {0.7, 0.72}, {-0.7, 0.72}, {1.0, 0.0}, {-1.0, 0.0}};
  const double reach[5] = {-0.162, 0.36, 0.36, 0.28, 0.28};
  for (int f = 0; f < kFeet; ++f) {
    const double away = f == 0 ? side : -side;
    for (int e = 0; e < 5; ++e) {
      const int row = 4 * kN + 5 * f + e;
      const double nx = normal[e][0], ny = away * normal[e][1];
      A_(row, kN + f) = nx;
      A_(row, kAxis + kN + f) = ny;
      upper_[row] = reach[e];
      if (f == 0) {
        upper_[row] += nx * foot_.x() + ny * foot_.y();
      } else {
        A_(row, kN) = -nx;
        A_(row, kAxis + kN) = -ny;
      }
    }
  }
}

void MpcProblem::advance(const Eigen::Ref<const Eigen::VectorXd>& x) {
  for (int axis = 0; axis < 2; ++axis) {
    const double j = x[axis * kAxis], v = state_(axis, 1), a = state_(axis, 2);
    state_(axis, 0) += kTick * (v + kTick * (0.5 * a + kTick * j / 6.0));
    state_(axis, 1) += kTick * (a + 0.5 * kTick * j);
    state_(axis, 2) += kTick * j;
  }
  if (++tick_ % kTicksAStep != 0) return;
  ++step_;
  foot_ = {x[kN], x[kAxis + kN]};
}

}  // namespace mimesis::walker
