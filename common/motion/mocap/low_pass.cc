#include "common/motion/mocap/low_pass.h"

#include <algorithm>
#include <cmath>
#include <numbers>
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

}  // namespace mimesis::mocap
