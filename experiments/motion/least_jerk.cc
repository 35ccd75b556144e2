#include "experiments/motion/least_jerk.h"

#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/character/parameters.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kPi = std::numbers::pi;

/// cos(rφ) or sin(rφ) and its first two derivatives by φ.
Eigen::RowVector3d wave(double r, double phase, bool sine) {
  const double c = std::cos(r * phase), s = std::sin(r * phase);
  return sine ? Eigen::RowVector3d(s, r * c, -r * r * s)
              : Eigen::RowVector3d(c, -r * s, -r * r * c);
}

/// Rows and their first two derivatives at φ in [0, 2π), R×3.
void evaluate(const MotionSeries& series, const std::vector<float>& factors, double phase,
              Eigen::MatrixXd& out) {
  out.setZero();
  const auto add = [&](int block, const Eigen::RowVector3d& basis) {
    const float* factor = factors.data() + static_cast<std::ptrdiff_t>(block) * series.row_stride();
    for (int r = 0; r < series.rows(); ++r) out.row(r) += static_cast<double>(factor[r]) * basis;
  };
  add(0, Eigen::RowVector3d(1.0, 0.0, 0.0));
  for (int h = 1; h <= series.harmonics(); ++h) {
    add(2 * h - 1, wave(h, phase, false));
    add(2 * h, wave(h, phase, true));
  }
  for (int f = 0; f < series.slow_functions(); ++f) {
    add(1 + 2 * series.harmonics() + f, wave(f < 2 ? 0.5 : 0.25, phase, f % 2 == 1));
  }
}

}  // namespace

LeastJerkTransition::LeastJerkTransition(const motion::MotionModel& model, double beta)
    : series_(model, static_cast<int>((model.sources.cols() - 1) / 2), 0.0),
      factors_(static_cast<std::size_t>(series_.size())),
      beta_(beta),
      coefficient_(series_.rows(), 6),
      begin_(series_.rows(), 3),
      end_(series_.rows(), 3) {
  if (!(beta > 0.0 && beta <= 1.0)) {
    throw ConfigError("transition: beta is " + std::to_string(beta) + ", expected one in (0, 1]");
  }
}

double LeastJerkTransition::time_s(double phase_rad) const {
  // ω = m + d sin u with u = φ/2β, by eq. 3.22 and 3.23: ∫dφ/ω in closed form, |d| < m
  const double m = 0.5 * (after_rad_s_ + before_rad_s_), d = 0.5 * (after_rad_s_ - before_rad_s_);
  const double root = std::sqrt(m * m - d * d);
  const auto integral = [&](double u) { return std::atan((m * std::tan(0.5 * u) + d) / root); };
  return 4.0 * beta_ / root * (integral(phase_rad / (2.0 * beta_)) - integral(-0.5 * kPi));
}

void LeastJerkTransition::prepare(const MotionParameters& previous, const MotionParameters& next) {
  MIMESIS_ASSERT(previous.frequency_rad_s > 0.0 && next.frequency_rad_s > 0.0);
  before_rad_s_ = previous.frequency_rad_s;
  after_rad_s_ = next.frequency_rad_s;
  duration_s_ = time_s(beta_ * kPi);
  const auto ends = [&](const MotionParameters& p, double phase, Eigen::MatrixXd& out) {
    series_.make(p.mean_rad, p.weight_rad, p.delay_rad, factors_.data());
    evaluate(series_, factors_, phase, out);
    // by the share of the duration: α' is 0 at both ends, the frequency stands still there
    const double rate = p.frequency_rad_s * duration_s_;
    out.col(1) *= rate;
    out.col(2) *= 0.5 * rate * rate;
  };
  ends(previous, math::kTwoPi - beta_ * kPi, begin_);
  ends(next, beta_ * kPi, end_);
  auto c = coefficient_.leftCols(3);
  c = begin_;
  // remaining angle, velocity and half the acceleration
  end_.col(0) -= begin_.col(0) + begin_.col(1) + begin_.col(2);
  end_.col(1) -= begin_.col(1) + 2.0 * begin_.col(2);
  end_.col(2) -= begin_.col(2);
  coefficient_.col(3) = 10.0 * end_.col(0) - 4.0 * end_.col(1) + end_.col(2);
  coefficient_.col(4) = -15.0 * end_.col(0) + 7.0 * end_.col(1) - 2.0 * end_.col(2);
  coefficient_.col(5) = 6.0 * end_.col(0) - 3.0 * end_.col(1) + end_.col(2);
}

void LeastJerkTransition::at(double phase_rad, MotionParameters& out) const {
  const double u = time_s(phase_rad) / duration_s_;
  out.mean_rad = coefficient_.col(5);
  for (int power = 4; power >= 0; --power)
    out.mean_rad = u * out.mean_rad + coefficient_.col(power);
  out.weight_rad.setZero(series_.rows(), series_.sources());
  out.delay_rad.setZero(series_.rows(), series_.sources());
  const double a = transition_weight(phase_rad, beta_);
  out.frequency_rad_s = (1.0 - a) * before_rad_s_ + a * after_rad_s_;
}

}  // namespace mimesis::synthesizer
