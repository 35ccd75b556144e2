#pragma once
#include <cstdint>
#include <vector>

#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

/// Names that make_suite() knows.
const std::vector<std::string>& suite_names();

struct SuiteOptions {
  hw::sim::Plant plant = hw::sim::Plant::kSprings;
  std::uint64_t seed = 1;  ///< of everything that is drawn
  int delay_ticks = 1;     ///< 5 ms each
  walker::WalkerSettings walker;
};

/// Trials of a suite:
///   steps30  thirty walks of 16 s at 0.1, 0.2 and 0.3 m/s with moving arms, turning, side drift,
///            changes of speed and pushes of up to 5 N s
///   plates30 the same walks over plates of 5 mm that the robot does not know
///   pushes   15 N s standing and 10 N s walking at 0.2 m/s from eight sides, early and late in
///            a step
///   speeds   steady walks: forward, back, sideways, turning, with arms
///   naive    the speeds without stabilizer and filter, which must be able to fall
/// Arms that are heavier for their robot than those of biped.urdf swing less, so that they throw it
/// about no more: JVRC-1's by less than a half.
/// @param robot  outlives the trials. @throws ConfigError for another name
std::vector<TrialSpec> make_suite(const std::string& name, const Robot& robot,
                                  const SuiteOptions& options);

}  // namespace mimesis::walk
