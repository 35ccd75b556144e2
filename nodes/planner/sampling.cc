#include "nodes/planner/sampling.h"

#include <array>
#include <cmath>
#include <random>

#include "common/error.h"

namespace mimesis::planner {
namespace {

constexpr std::array<int, 12> kPrimes{2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37};

/// Digits of `index` in base `base`, mirrored at the point.
double radical_inverse(int index, int base) {
  double value = 0.0, digit = 1.0 / base;
  for (; index > 0; index /= base, digit /= base) value += digit * (index % base);
  return value;
}

}  // namespace

Eigen::MatrixXd halton(int n, int count, std::uint64_t seed) {
  MIMESIS_ASSERT(n >= 1 && n <= static_cast<int>(kPrimes.size()));
  std::mt19937_64 random(seed);
  Eigen::MatrixXd points(n, count);
  for (int row = 0; row < n; ++row) {
    const double shift = std::ldexp(static_cast<double>(random() >> 11), -53);
    for (int i = 0; i < count; ++i) {
      const double sum = radical_inverse(i + 1, kPrimes[static_cast<std::size_t>(row)]) + shift;
      points(row, i) = sum < 1.0 ? sum : sum - 1.0;
    }
  }
  return points;
}

Eigen::MatrixXd sample_box(const Eigen::VectorXd& lo, const Eigen::VectorXd& hi, int count,
                           std::uint64_t seed) {
  const Eigen::MatrixXd unit = halton(static_cast<int>(lo.size()), count, seed);
  return ((hi - lo).asDiagonal() * unit).colwise() + lo;
}

}  // namespace mimesis::planner
