#include "nodes/synthesizer/dynamics/motion_series.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include "common/error.h"
#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

void check(const motion::MotionModel& model) {
  auto need = [&](bool condition, const std::string& what) {
    if (!condition) throw ConfigError("motion model \"" + model.name + "\": " + what);
  };
  const auto rows = static_cast<Eigen::Index>(model.rows.size());
  const Eigen::Index k = model.sources.rows(), length = model.sources.cols();
  need(rows > 0 && k > 0 && length >= 4, "needs rows, sources and at least 4 samples a period");
  need(!model.patterns.empty(), "has no pattern");
  need(model.fixed >= 0 && model.fixed <= k, "fixed is outside [0, sources]");
  need(model.sources.allFinite(), "a source is not finite");
  for (std::size_t p = 0; p < model.patterns.size(); ++p) {
    const motion::Pattern& q = model.patterns[p];
    const std::string at = "pattern " + std::to_string(p);
    need(q.mean_rad.size() == rows && q.weight_rad.rows() == rows && q.weight_rad.cols() == k &&
             q.delay_rad.rows() == rows && q.delay_rad.cols() == k,
         at + ": sizes differ from " + std::to_string(rows) + " rows x " + std::to_string(k) +
             " sources");
    need(q.mean_rad.allFinite() && q.weight_rad.allFinite() && q.delay_rad.allFinite(),
         at + ": a number is not finite");
    need(q.delay_rad.leftCols(model.fixed).isZero(0.0), at + ": a fixed source is delayed");
  }
}

/// Real Fourier factors of a periodic row: c, a₁, b₁, a₂, ... up to below the Nyquist frequency.
Eigen::RowVectorXd fourier(const Eigen::RowVectorXd& s, int harmonics) {
  const Eigen::Index length = s.size();
  Eigen::ArrayXd angle(length);
  for (Eigen::Index t = 0; t < length; ++t)
    angle[t] = math::kTwoPi * static_cast<double>(t) / static_cast<double>(length);
  const Eigen::ArrayXd cosine = angle.unaryExpr([](double x) { return std::cos(x); });
  const Eigen::ArrayXd sine = angle.unaryExpr([](double x) { return std::sin(x); });
  Eigen::RowVectorXd f(1 + 2 * harmonics);
  f[0] = s.mean();
  for (int h = 1; h <= harmonics; ++h) {
    double a = 0.0, b = 0.0;
    for (Eigen::Index t = 0; t < length; ++t) {  // h·t modulo T: exact angles
      a += s[t] * cosine[h * t % length];
      b += s[t] * sine[h * t % length];
    }
    f[2 * h - 1] = 2.0 * a / static_cast<double>(length);
    f[2 * h] = 2.0 * b / static_cast<double>(length);
  }
  return f;
}

/// Columns cos φ/2, sin φ/2, cos φ/4, sin φ/4 and 1 at φ = 2πt/T.
Eigen::MatrixXd slow_basis(Eigen::Index length) {
  Eigen::MatrixXd f(length, 5);
  for (Eigen::Index t = 0; t < length; ++t) {
    const double half = std::numbers::pi * static_cast<double>(t) / static_cast<double>(length);
    f.row(t) << std::cos(half), std::sin(half), std::cos(half / 2.0), std::sin(half / 2.0), 1.0;
  }
  return f;
}

}  // namespace

MotionSeries::MotionSeries(const motion::MotionModel& model, int harmonics, double tolerance_rad) {
  check(model);
  const Eigen::Index k = model.sources.rows(), length = model.sources.cols();
  const int most = static_cast<int>((length - 1) / 2);
  MIMESIS_ASSERT(harmonics >= 0 && harmonics <= most);
  rows_ = static_cast<int>(model.rows.size());
  fixed_ = model.fixed;
  source_ = Eigen::MatrixXd::Zero(k, 1 + 2 * most);
  Eigen::MatrixXd periodic = model.sources;
  if (fixed_ > 0) {
    const Eigen::MatrixXd basis = slow_basis(length).leftCols(4);
    const Eigen::MatrixXd target = model.sources.topRows(fixed_).transpose();
    // the mean may go to either side: 1 takes part in the fit, and stays with the periodic part
    slow_ = slow_basis(length).colPivHouseholderQr().solve(target).topRows(4).transpose();
    periodic.topRows(fixed_) -= slow_ * basis.transpose();
  }
  for (Eigen::Index i = 0; i < k; ++i) source_.row(i) = fourier(periodic.row(i), most);

  Eigen::ArrayXd omitted = Eigen::ArrayXd::Zero(most + 1);
  for (const motion::Pattern& p : model.patterns) omitted = omitted.max(truncations(p));
  harmonics_ = harmonics > 0 ? harmonics : 1;
  while (harmonics == 0 && omitted[harmonics_] > tolerance_rad && harmonics_ < most) ++harmonics_;
  truncation_rad_ = omitted[harmonics_];
  basis_ = (1 + 2 * harmonics_ + slow_functions() + 3) / 4 * 4;
  stride_ = (rows_ + 15) / 16 * 16;
}

Eigen::ArrayXd MotionSeries::truncations(const motion::Pattern& pattern) const {
  const Eigen::Index most = (source_.cols() - 1) / 2;
  Eigen::ArrayXd worst = Eigen::ArrayXd::Zero(most + 1);
  for (Eigen::Index r = 0; r < rows_; ++r) {
    Eigen::ArrayXcd term = Eigen::ArrayXcd::Zero(most + 1);  // Σₖ wₖ Cₖₕ e^{−ihφₖ}
    for (Eigen::Index k = 0; k < source_.rows(); ++k) {
      const auto turn = std::polar(1.0, pattern.delay_rad(r, k));
      std::complex<double> turned = pattern.weight_rad(r, k);
      for (Eigen::Index h = 1; h <= most; ++h) {
        turned *= turn;
        term[h] += turned * std::complex(source_(k, 2 * h - 1), source_(k, 2 * h));
      }
    }
    double sum = 0.0;
    for (Eigen::Index h = most; h >= 1; --h) {
      worst[h] = std::max(worst[h], sum);
      sum += std::abs(term[h]);
    }
    worst[0] = std::max(worst[0], sum);
  }
  return worst;
}

void MotionSeries::make(const Eigen::Ref<const Eigen::VectorXd>& mean_rad,
                        const Eigen::Ref<const Eigen::MatrixXd>& weight_rad,
                        const Eigen::Ref<const Eigen::MatrixXd>& delay_rad, float* series) const {
  MIMESIS_ASSERT(mean_rad.size() == rows_ && weight_rad.rows() == rows_ &&
                 weight_rad.cols() == source_.rows() && delay_rad.rows() == rows_ &&
                 delay_rad.cols() == source_.rows());
  std::fill(series, series + size(), 0.0F);
  auto at = [&](int block, Eigen::Index row) -> float& { return series[block * stride_ + row]; };
  constexpr int kMost = 512;  // harmonics at once on the stack
  MIMESIS_ASSERT(2 * harmonics_ < kMost);
  for (Eigen::Index r = 0; r < rows_; ++r) {
    double sum[kMost] = {};  // c, a₁, b₁, ...: added up in double
    sum[0] = mean_rad[r];
    for (Eigen::Index k = 0; k < source_.rows(); ++k) {
      const double w = weight_rad(r, k);
      const double c1 = std::cos(delay_rad(r, k)), s1 = std::sin(delay_rad(r, k));
      double c = 1.0, s = 0.0;  // cosine and sine of h·φᵣₖ
      sum[0] += w * source_(k, 0);
      for (int h = 1; h <= harmonics_; ++h) {
        const double next = c * c1 - s * s1;
        s = s * c1 + c * s1;
        c = next;
        const double a = source_(k, 2 * h - 1), b = source_(k, 2 * h);
        sum[2 * h - 1] += w * (a * c - b * s);
        sum[2 * h] += w * (a * s + b * c);
      }
    }
    for (int b = 0; b <= 2 * harmonics_; ++b) at(b, r) = static_cast<float>(sum[b]);
    for (int f = 0; f < slow_functions(); ++f) {
      double d = 0.0;
      for (int k = 0; k < fixed_; ++k) d += weight_rad(r, k) * slow_(k, f);
      at(1 + 2 * harmonics_ + f, r) = static_cast<float>(d);
    }
  }
}

void MotionSeries::tabulate(const float* series, int samples, float* table) const {
  for (int j = -1; j <= samples + 1; ++j, table += stride_) {
    std::fill(table, table + stride_, 0.0F);
    const double phase = math::kTwoPi * j / samples;
    auto add = [&](int block, double value) {
      const float* factor = series + block * stride_;
      for (int r = 0; r < rows_; ++r) table[r] += static_cast<float>(value) * factor[r];
    };
    add(0, 1.0);
    for (int h = 1; h <= harmonics_; ++h) {
      add(2 * h - 1, std::cos(h * phase));
      add(2 * h, std::sin(h * phase));
    }
    for (int f = 0; f < slow_functions(); ++f) {
      const double slow = f < 2 ? 0.5 * phase : 0.25 * phase;
      add(1 + 2 * harmonics_ + f, f % 2 == 0 ? std::cos(slow) : std::sin(slow));
    }
  }
}

}  // namespace mimesis::synthesizer
