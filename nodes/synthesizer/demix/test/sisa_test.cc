#include "nodes/synthesizer/demix/sisa.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/demix/test/known_mixture.h"

namespace mimesis::demix {
namespace {

TEST(Sisa, FindsAMixtureOfFreeDelaysExactly) {
  const Known known = known_mixture({.trials = 6, .rows = 10, .sources = 1, .seed = 1});
  const SisaResult found = sisa(known.set, {.sources = 1, .turns = 200, .tolerance = 1e-9});
  EXPECT_GT(found.quality, 0.9999);
  EXPECT_NEAR(found.quality, quality(known.set.samples, found.mixture.reconstruct()), 1e-12);
}

TEST(Sisa, FindsAMixtureOfTiedDelaysExactly) {
  const Known known =
      known_mixture({.trials = 12, .rows = 8, .sources = 2, .tied = true, .seed = 2});
  const SisaResult found =
      sisa(known.set, {.sources = 2, .tied = true, .turns = 200, .tolerance = 1e-9});
  EXPECT_GT(found.quality, 0.999);
  const Eigen::Index rows = known.set.rows_per_trial();
  for (Eigen::Index n = rows; n < known.set.samples.rows(); ++n) {
    EXPECT_EQ(found.mixture.delay_rad.row(n), found.mixture.delay_rad.row(n % rows)) << n;
  }
}

}  // namespace
}  // namespace mimesis::demix
