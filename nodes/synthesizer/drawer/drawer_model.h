#pragma once
#include "common/motion/demix/mixture.h"
#include "nodes/synthesizer/drawer/trial_generator.h"
#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer {

struct DrawerModelOptions {
  int first_sources = 3;    ///< periodic, learned from action 1
  int further_sources = 2;  ///< periodic, learned from what those leave of action 2
  int turns = 40;           ///< these three as in demix::SisaOptions
  double tolerance = 1e-4;
  std::uint32_t seed = 1;
};

/// The three actions as mixtures of the same sources [M18 3.3.3, "Stepwise estimation"]: source 0
/// is the non-periodic s₀(t) = cos(πt/T), then those of action 1, then the further ones. Delays are
/// the same in all trials and actions, so that transitions blend weights and means alone.
struct DrawerModel {
  mocap::Body body;
  Drawer drawer;
  DrawerModelOptions options;
  /// Patterns in the order of the trials. Action 1 has weight 0 on the further sources.
  std::array<MotionModel, kActions> action;
  double quality_squared = 0.0;        ///< Q2 of all actions together, all sources
  double first_quality_squared = 0.0;  ///< Q2 of action 1 with its sources
};

/// s₀ at t = 0..T−1, a row of T. (The text counts t = 1..T; then s₀ would be cos(φ/2) but for one
/// sample, and transitions [M18 after eq. 3.23] need it exactly.)
Eigen::MatrixXd drawer_ramp(Eigen::Index samples);

/// Learns the model: action 1 with tied delays; then actions 2 and 3 with those sources and delays,
/// weights estimated anew, and the further sources from what they leave of both. (The text takes
/// the residuals of action 2 for the further sources and only new weights for action 3: its
/// residuals are then the largest of all.) Some seconds for 40 trials.
/// @throws ConfigError from demix::sisa, or for fewer than 1 source of each kind.
DrawerModel learn_drawer_model(const DrawerData& data, const DrawerModelOptions& options = {});

}  // namespace mimesis::synthesizer
