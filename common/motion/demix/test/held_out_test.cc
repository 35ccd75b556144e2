#include "common/motion/demix/held_out.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/math/circle.h"
#include "common/motion/demix/sisa.h"
#include "common/motion/demix/test/known_mixture.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;

double q_of(const mocap::Trials& set, const Mixture& m) {
  return quality(set.samples, m.reconstruct());
}

/// Trials of the given clips, two rows each: sines of the clip's harmonic, of any size and phase.
mocap::Trials sines(const std::vector<std::pair<std::string, int>>& clips) {
  mocap::Trials set{.rows = {"a", "b"}, .task_names = {}, .trials = {}, .samples = {}};
  set.samples.resize(static_cast<Index>(2 * clips.size()), 32);
  for (std::size_t i = 0; i < clips.size(); ++i) {
    mocap::Trial trial;
    trial.clip = clips[i].first;
    trial.cycle = static_cast<int>(i);
    trial.duration_s = 1.0;
    set.trials.push_back(trial);
    for (Index r = 0; r < 2; ++r) {
      for (Index t = 0; t < 32; ++t) {
        const double angle = math::kTwoPi * clips[i].second * static_cast<double>(t) / 32.0;
        set.samples(2 * static_cast<Index>(i) + r, t) =
            0.3 + (1.0 + 0.2 * static_cast<double>(i)) * std::cos(angle - static_cast<double>(r));
      }
    }
  }
  return set;
}

TEST(FitTo, GivesTrialsWhatTheModelGivesThem) {
  const Known free = known_mixture({.trials = 6, .rows = 8, .sources = 2, .seed = 3});
  const Known tied = known_mixture({.trials = 6, .rows = 8, .sources = 2, .tied = true, .seed = 3});
  EXPECT_GT(q_of(free.set, fit_to(free.set, free.mixture, Delays::free)), 0.98);  // delays sought
  EXPECT_GT(q_of(tied.set, fit_to(tied.set, tied.mixture, Delays::tied)), 0.9999);
  EXPECT_LT(q_of(tied.set, fit_to(tied.set, tied.mixture, Delays::none)), 0.9);
  // the delays of other rows, or of the trial's own, are not those of a tied mixture
  EXPECT_LT(q_of(free.set, fit_to(free.set, free.mixture, Delays::tied)), 0.9);
  const Mixture pca = principal_components(free.set, 3);
  const Mixture again = fit_to(free.set, pca, Delays::none);
  EXPECT_LT((again.weights - pca.weights).norm(), 1e-9 * pca.weights.norm());
  EXPECT_LT((again.means - pca.means).norm(), 1e-12);
}

TEST(FitTo, KeepsFixedSourcesInPlace) {
  Known known = known_mixture({.trials = 4, .rows = 8, .sources = 2, .seed = 5});
  const Index samples = known.set.samples.cols();
  known.set.samples +=
      Eigen::VectorXd::LinSpaced(known.set.samples.rows(), -1.0, 1.0) * non_periodic(1, samples);
  const Mixture m =
      sisa(known.set, {.sources = 3, .fixed = non_periodic(1, samples), .turns = 100}).mixture;
  const Mixture fit = fit_to(known.set, m, Delays::free);
  EXPECT_GT(q_of(known.set, fit), q_of(known.set, m) - 2e-3);
  EXPECT_EQ(fit.delay_rad.col(0).norm(), 0.0);
  EXPECT_EQ(fit.sources, m.sources);
}

// Two clips of orthogonal motions: both components describe both, neither describes the other.
TEST(HeldOut, MotionThatNoOtherClipHasIsNotDescribed) {
  const mocap::Trials set = sines({{"one", 1}, {"one", 1}, {"two", 3}, {"two", 3}});
  const auto learn = [](const mocap::Trials& others) { return principal_components(others, 2); };
  EXPECT_GT(q_of(set, principal_components(set, 4)), 0.9999999);
  const HeldOut held = held_out(set, Delays::none, false, learn);
  EXPECT_EQ(held.groups, 2);
  EXPECT_TRUE(held.by_clip);
  EXPECT_NEAR(held.quality, 0.0, 1e-9);
  EXPECT_NEAR(held.quality_squared, 0.0, 1e-9);
  // with a third clip that has both, all of it is
  const mocap::Trials more = sines({{"one", 1}, {"two", 3}, {"both", 1}, {"both", 3}});
  const auto four = [](const mocap::Trials& others) { return principal_components(others, 4); };
  EXPECT_NEAR(held_out(more, Delays::none, false, four).quality, 1.0, 1e-6);
  const HeldOut none = held_out(set, Delays::none, false, four);
  EXPECT_EQ(none.groups, 0);
  EXPECT_TRUE(std::isnan(none.quality));
  EXPECT_NE(none.reason.find("4 is more than the set supports"), std::string::npos) << none.reason;
}

TEST(HeldOut, PoolsTheErrorsOfAllClips) {
  // of three clips the one alone in its harmonic is missed whole, the others not at all
  const mocap::Trials set = sines({{"a", 1}, {"b", 1}, {"c", 3}});
  const double energy = (set.samples.colwise() - set.samples.rowwise().mean()).squaredNorm();
  const double missed = (set.samples.bottomRows(2).array() - 0.3).matrix().squaredNorm();
  const HeldOut held = held_out(set, Delays::none, false, [](const mocap::Trials& others) {
    return principal_components(others, static_cast<int>(rank(others)));
  });
  EXPECT_NEAR(held.quality_squared, 1.0 - missed / energy, 1e-9);
  EXPECT_NEAR(held.quality, 1.0 - std::sqrt(missed / energy), 1e-9);
}

TEST(HeldOut, LeavesOutTheTrialsOfAClipThatIsAlone) {
  const Known known =
      known_mixture({.trials = 5, .rows = 8, .sources = 2, .tied = true, .seed = 2});
  mocap::Trials set = known.set;
  for (std::size_t i = 0; i < set.trials.size(); ++i) {
    set.trials[i].clip = "same";
    set.trials[i].cycle = static_cast<int>(i);
  }
  const SisaOptions options{.sources = 2, .tied = true, .turns = 100, .tolerance = 1e-8};
  const Mixture whole = sisa(set, options).mixture;
  double last = 0.0;
  SisaOptions watched = options;
  watched.progress = [&last](double share) { last = share; };
  const HeldOut held = sisa_held_out(set, watched, whole);
  EXPECT_EQ(held.groups, 5);
  EXPECT_FALSE(held.by_clip);
  EXPECT_EQ(last, 1.0);
  EXPECT_GT(held.quality, 0.999) << "one person's trials have the same sources";
  set.trials.resize(1);
  set.samples = set.samples.topRows(8).eval();
  EXPECT_EQ(sisa_held_out(set, options, whole).groups, 0) << "nothing is left to learn from";
}

}  // namespace
}  // namespace mimesis::demix
