#pragma once
#include "common/motion/demix/mixture.h"
#include "common/motion/mocap/trials.h"

namespace mimesis::demix {

/// A set made from sources, weights and delays that are known.
struct Known {
  Mixture mixture;
  mocap::Trials set;
};

struct KnownShape {
  int trials = 4, rows = 6, sources = 2;
  Eigen::Index samples = 64;
  bool tied = false;         ///< one delay per row and source
  bool nonnegative = false;  ///< weights in [0.2, 1.2], else of both signs
  unsigned seed = 0;
};

/// Source k is mostly harmonic k+1, with weaker ones up to 7; delays are no whole samples.
Known known_mixture(const KnownShape& shape);

}  // namespace mimesis::demix
