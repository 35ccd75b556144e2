#include "common/motion/demix/test/known_mixture.h"

#include <cmath>
#include <random>

#include "common/math/circle.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double in(double low, double high) {  // equal on all platforms, unlike std's distributions
    return low + (high - low) * static_cast<double>(engine_()) / 4294967296.0;
  }

 private:
  std::mt19937 engine_;
};

Eigen::RowVectorXd source(Index k, Index samples, Random& random) {
  Eigen::RowVectorXd s = Eigen::RowVectorXd::Zero(samples);
  for (int f = 1; f <= 7; ++f) {
    const double strength = f == k + 1 ? 1.0 : random.in(0.05, 0.3) / f;
    const double phase = random.in(-3.0, 3.0);
    for (Index t = 0; t < samples; ++t) {
      s[t] += strength *
              std::cos(math::kTwoPi * f * static_cast<double>(t) / static_cast<double>(samples) +
                       phase);
    }
  }
  return s / std::sqrt(s.squaredNorm() / static_cast<double>(samples));
}

}  // namespace

Known known_mixture(const KnownShape& shape) {
  Random random(shape.seed);
  const Index count = shape.trials * shape.rows;
  Known out;
  out.mixture.sources.resize(shape.sources, shape.samples);
  for (Index k = 0; k < shape.sources; ++k) {
    out.mixture.sources.row(k) = source(k, shape.samples, random);
  }
  out.mixture.weights.resize(count, shape.sources);
  out.mixture.delay_rad.resize(count, shape.sources);
  out.mixture.means.resize(count);
  for (Index n = 0; n < count; ++n) {
    out.mixture.means[n] = random.in(-1.0, 1.0);
    for (Index k = 0; k < shape.sources; ++k) {
      const double sign = shape.nonnegative || random.in(0.0, 1.0) < 0.5 ? 1.0 : -1.0;
      out.mixture.weights(n, k) = sign * random.in(0.2, 1.2);
      const double phi = random.in(-3.1, 3.1);
      out.mixture.delay_rad(n, k) =
          shape.tied && n >= shape.rows ? out.mixture.delay_rad(n % shape.rows, k) : phi;
    }
  }
  for (int r = 0; r < shape.rows; ++r) out.set.rows.push_back("row" + std::to_string(r));
  for (int i = 0; i < shape.trials; ++i) {
    mocap::Trial trial;
    trial.clip = "made";
    trial.cycle = i;
    trial.duration_s = 1.0;
    out.set.trials.push_back(trial);
  }
  out.set.samples = out.mixture.reconstruct();
  return out;
}

}  // namespace mimesis::demix
