#pragma once
#include <functional>
#include <limits>
#include <string>

#include "common/motion/demix/mixture.h"
#include "common/motion/demix/sisa.h"
#include "common/motion/mocap/trials.h"

/// Quality on motion that nothing was learned from. Q and Q2 of mixture.h are in-sample: sources
/// are fitted to the very trials that they are compared with.
namespace mimesis::demix {

/// Describes `set` by the sources of a mixture over other trials with the same rows. The sources
/// stay; fitted by least squares is what the model gives each trial of its own: means and weights,
/// and with Delays::free the delays too (GridSearch from 0 and random ones). Delays::tied are those
/// of the mixture's first trial, row by row; Delays::none are 0.
Mixture fit_to(const mocap::Trials& set, const Mixture& learned, Delays delays,
               bool nonnegative = false);

struct HeldOut {
  double quality = std::numeric_limits<double>::quiet_NaN();  ///< Q, NaN if there is none
  double quality_squared = std::numeric_limits<double>::quiet_NaN();
  int groups = 0;           ///< number of groups, each left out once; 0: there is no Q
  bool by_clip = true;      ///< false: a set of one clip, its trials are left out one by one
  std::string reason = {};  ///< why there is no Q
};

/// Leave one clip out. For each clip c (all trials of one Trial::clip) sources, and delays if they
/// are tied, are learned from the other clips alone, X̂_c = fit_to(X_c, learn(the others)), and
///   Q = 1 − √(Σ_c ‖X_c − X̂_c‖² / Σ_c ‖X_c‖²),   means removed as in quality().
/// Weights, means and free delays are still fitted to the clip that is left out: Q says whether the
/// sources describe other motion of the kind, not how well a motion is predicted. With free delays
/// that are 2K + 1 numbers a row and trial, with tied ones K + 1, which is the stricter test.
/// Prediction from the task alone, nothing fitted: fig-3.20.
/// @param learn  a mixture over the set it is given. Its ConfigError, as for more sources than the
///   others support, becomes `reason`
/// @param progress  called with the share of the work done; may be empty
HeldOut held_out(const mocap::Trials& set, Delays delays, bool nonnegative,
                 const std::function<Mixture(const mocap::Trials&)>& learn,
                 const std::function<void(double)>& progress = {});

/// The held-out quality of sisa() with these options. Each of its runs starts from the sources of
/// `whole`, its result over all clips, so that it takes less time; as the sources of a run are
/// refined until it gains no more, what it owes to the clip that is left out is a choice among
/// local minima: on the recorded sets Q differs by less than 0.006 from runs that start anew.
HeldOut sisa_held_out(const mocap::Trials& set, SisaOptions options, const Mixture& whole);

/// The trials for which `keep` holds, in their order.
mocap::Trials subset(const mocap::Trials& set,
                     const std::function<bool(const mocap::Trial&)>& keep);

}  // namespace mimesis::demix
