#pragma once
#include <array>

#include "nodes/crowd/engine/agent.h"
#include "nodes/crowd/rules/gait.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {

/// Data that all agents of a group share in one step: rules, path, gait, and the mean fields.
struct WalkField {
  double dt = 0.0;
  // III: all-to-all by pull_to; on other graphs `pull` has the addend of φ̇.
  PhasePull pull_to{};
  int leader_row = -1;  // is not pulled
  const double* pull = nullptr;
  // I and II: all-to-all from count and sum of z − d; on other graphs errors are in the arrays.
  double frequency_gain = 0.0, saturation = 0.0, low_pass = 0.0;  // low_pass: share of low_passed
  double length_gain = 0.0, length_limit = 0.5;
  double count = 0.0, error_sum = 0.0;
  const double* frequency_error = nullptr;
  const double* length_error = nullptr;
  // Path: origin, unit vector along.
  double origin_x = 0.0, origin_y = 0.0, along_x = 1.0, along_y = 0.0, path_rad = 0.0;
  // IV
  HeadingKind heading = HeadingKind::keep;
  double heading_gain = 0.0, ahead = 1.0;
  CosSin mean_heading{0.0, 0.0};  // consensus: e^{iχ}; coupled, all-to-all: Σ e^{iψ}
  double arrive = 0.5;
  const double* turn = nullptr;  // added to ψ̇: navigation, coupled headings
  double per_width = 0.0;        // dt/σ_φ of navigation, 0: explicit [s/rad]
  // Receives velocities that others may bound before the step is made; else the step is made here.
  double *wish_x = nullptr, *wish_y = nullptr;
  // Rows that are not all our own, and the demands of the rules on every row.
  bool mixed = false;
  double *wished_rate = nullptr, *wished_length = nullptr, *wished_turn = nullptr;
  double mean_g = 0.0;
  std::array<double, SpeedFunction::kHarmonics> cosine{}, sine{};

  bool sways = false;
  HeadingSway sway{};

  void set_gait(const SpeedFunction& gait, const HeadingSway& of_heading);
};

/// Rows [first, last) one step on. All pointers of the field are indexed by row. Returns the sums
/// of the new state over own and external rows, lanes added in a fixed order, without a leader;
/// with wishes nothing.
GroupSums walk(const WalkField& field, Table& table, int first, int last);
/// The sums without a step.
GroupSums walk_sums(const WalkField& field, const Table& table, int first, int last);

}  // namespace mimesis::crowd
