#include "common/motion/mocap/resampling.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "common/error.h"

namespace mimesis::mocap {
namespace {

/// Second-order section, b scaled to gain 1 at frequency 0.
struct Section {
  double b0, b1, b2, a1, a2;
};

std::vector<Section> butterworth(double rate_hz, double cutoff_hz, int order) {
  const double k = std::tan(std::numbers::pi * cutoff_hz / rate_hz);
  std::vector<Section> sections;
  for (int i = 0; i < order / 2; ++i) {
    const double damping = 2.0 * std::cos(std::numbers::pi * (2 * i + 1) / (2.0 * order));
    const double scale = 1.0 / (1.0 + damping * k + k * k);
    const double b = k * k * scale;
    sections.push_back(
        {b, 2.0 * b, b, 2.0 * (k * k - 1.0) * scale, (1.0 - damping * k + k * k) * scale});
  }
  return sections;
}

/// In place; starts as if the first value had been there for ever.
void filter(const Section& s, Eigen::Ref<Eigen::MatrixXd> x) {
  for (Eigen::Index r = 0; r < x.rows(); ++r) {
    double z1 = (1.0 - s.b0) * x(r, 0), z2 = (s.b2 - s.a2) * x(r, 0);
    for (Eigen::Index t = 0; t < x.cols(); ++t) {
      const double in = x(r, t), out = s.b0 * in + z1;
      z1 = s.b1 * in - s.a1 * out + z2;
      z2 = s.b2 * in - s.a2 * out;
      x(r, t) = out;
    }
  }
}

}  // namespace

Eigen::MatrixXd low_pass(const Eigen::Ref<const Eigen::MatrixXd>& rows, double rate_hz,
                         double cutoff_hz, int order) {
  if (!(rate_hz > 0.0) || !(cutoff_hz > 0.0) || !(cutoff_hz < 0.5 * rate_hz)) {
    throw ConfigError("low-pass: a cutoff of " + std::to_string(cutoff_hz) +
                      " Hz is outside (0, rate/2) for " + std::to_string(rate_hz) + " Hz");
  }
  if (order < 2 || order % 2 != 0) {
    throw ConfigError("low-pass: order " + std::to_string(order) + ", expected 2, 4, ...");
  }
  if (!rows.allFinite()) throw ConfigError("low-pass: a value is not finite");
  const Eigen::Index frames = rows.cols();
  if (frames < 2) return rows;

  const auto reach = static_cast<Eigen::Index>(std::ceil(3.0 * rate_hz / cutoff_hz));
  const Eigen::Index pad = std::min(frames - 1, reach);
  Eigen::MatrixXd x(rows.rows(), frames + 2 * pad);
  x.middleCols(pad, frames) = rows;
  for (Eigen::Index i = 1; i <= pad; ++i) {
    x.col(pad - i) = 2.0 * rows.col(0) - rows.col(i);
    x.col(pad + frames - 1 + i) = 2.0 * rows.col(frames - 1) - rows.col(frames - 1 - i);
  }
  const std::vector<Section> sections = butterworth(rate_hz, cutoff_hz, order);
  for (int pass = 0; pass < 2; ++pass) {
    for (const Section& section : sections) filter(section, x);
    x = x.rowwise().reverse().eval();
  }
  return x.middleCols(pad, frames);
}

// The second derivatives solve a tridiagonal system, here by elimination from below to above
// (Thomas); natural ends: zero.
Spline::Spline(std::span<const double> knots, const Eigen::Ref<const Eigen::MatrixXd>& values)
    : knots_(
          Eigen::Map<const Eigen::VectorXd>(knots.data(), static_cast<Eigen::Index>(knots.size()))),
      values_(values),
      curvature_(Eigen::MatrixXd::Zero(values.rows(), values.cols())) {
  const Eigen::Index n = knots_.size();
  MIMESIS_ASSERT(n >= 2 && values.cols() == n);
  Eigen::VectorXd upper = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    const double before = knots_[i] - knots_[i - 1], after = knots_[i + 1] - knots_[i];
    const double pivot = 2.0 * (before + after) - before * upper[i - 1];
    upper[i] = after / pivot;
    const Eigen::VectorXd bend = (values_.col(i + 1) - values_.col(i)) / after -
                                 (values_.col(i) - values_.col(i - 1)) / before;
    curvature_.col(i) = (6.0 * bend - before * curvature_.col(i - 1)) / pivot;
  }
  for (Eigen::Index i = n - 2; i >= 1; --i) curvature_.col(i) -= upper[i] * curvature_.col(i + 1);
}

Eigen::VectorXd Spline::at(double x) const {
  const double* const begin = knots_.data();
  const auto above = std::upper_bound(begin, begin + knots_.size(), x) - begin;
  const Eigen::Index i = std::clamp<Eigen::Index>(above - 1, 0, knots_.size() - 2);
  const double h = knots_[i + 1] - knots_[i];
  const double a = (knots_[i + 1] - x) / h, b = 1.0 - a;
  return a * values_.col(i) + b * values_.col(i + 1) +
         (h * h / 6.0) *
             ((a * a * a - a) * curvature_.col(i) + (b * b * b - b) * curvature_.col(i + 1));
}

Eigen::MatrixXd resample(const Eigen::Ref<const Eigen::MatrixXd>& rows, double first, double last,
                         Eigen::Index count) {
  std::vector<double> knots(static_cast<std::size_t>(rows.cols()));
  std::iota(knots.begin(), knots.end(), 0.0);
  const Spline spline(knots, rows);
  Eigen::MatrixXd out(rows.rows(), count);
  for (Eigen::Index t = 0; t < count; ++t) {
    out.col(t) =
        spline.at(first + (last - first) * static_cast<double>(t) / static_cast<double>(count));
  }
  return out;
}

}  // namespace mimesis::mocap
