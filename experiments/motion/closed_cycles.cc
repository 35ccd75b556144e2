#include "experiments/motion/closed_cycles.h"

#include <cmath>

#include "common/error.h"

namespace mimesis::synthesizer {

double close_cycles(mocap::Trials& trials) {
  const Eigen::Index length = trials.samples.cols();
  if (length < 4) {
    throw ConfigError("cycles of " + std::to_string(length) + " samples, expected at least 4");
  }
  const auto n = static_cast<double>(length);
  const auto column = [&](Eigen::Index t) { return trials.samples.col(t); };
  const Eigen::VectorXd jump =
      1.5 * column(length - 1) - 0.5 * column(length - 2) + 0.5 * column(1) - 1.5 * column(0);
  for (Eigen::Index t = 0; t < length; ++t) {
    trials.samples.col(t) -= (static_cast<double>(t) / n - 0.5) * jump;
  }
  return jump.size() == 0 ? 0.0 : std::sqrt(jump.squaredNorm() / static_cast<double>(jump.size()));
}

}  // namespace mimesis::synthesizer
