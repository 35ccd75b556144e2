#pragma once
#include "common/motion/demix/sisa.h"

namespace mimesis::demix {

/// Savitzky-Golay filter of periodic rows (R×T): each value becomes that of the polynomial of
/// `order` that is nearest to it and to the `half_window` samples on either side.
/// @throws ConfigError unless 0 <= order < 2·half_window + 1 <= T
Eigen::MatrixXd savitzky_golay(const Eigen::MatrixXd& rows, int half_window, int order);

struct SmoothOptions {
  int half_window = 3;  ///< samples
  int order = 3;
  bool nonnegative = false;  ///< weights, as in SisaOptions
};

/// Learned sources are continuous, but may have kinks. They are smoothed by savitzky_golay(), get
/// unit rms again, and the weights are estimated anew; delays and the fixed sources stay [M18
/// 3.3.3]. Q falls a little: it is what smoothness costs. The trace is empty.
/// @throws ConfigError for the window, as sisa() for the set, or if the mixture is not of the set
SisaResult smooth_sources(const mocap::Trials& set, const Mixture& mixture,
                          const SmoothOptions& options);

}  // namespace mimesis::demix
