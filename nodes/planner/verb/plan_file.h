#pragma once
#include <limits>
#include <string>
#include <vector>

#include "common/kin/arm.h"
#include "common/runtime/params.h"

namespace mimesis::tool {

/// One instant of a motion as it is streamed, and where the arm goes if it is to stop then.
struct PlanInstant {
  std::vector<double> position_rad, velocity_rad_s;
  /// The stop along the path: places on it by the time of the motion, one after each period, until
  /// the arm rests. Empty if it rests already.
  std::vector<double> stop_s;

  void visit(runtime::ParamVisitor& v);
};

/// A motion between two postures at rest, and all that it must keep clear of, in W. Numbers in
/// rows: balls x y z radius, boxes the centre and half the edges.
struct PlanMotion {
  std::string phase;
  std::vector<double> balls_m, boxes_m;
  std::vector<double> held_m;      ///< balls that cover what the hand holds, in E
  std::vector<double> supports_m;  ///< boxes that what is held may touch
  std::vector<PlanInstant> instants;

  void visit(runtime::ParamVisitor& v);
};

/// A plan for an arm: every instant with its stops. Those that leave the path follow from the file:
/// for up to `stop_delay_s` the joints go on at their speeds, then each is slowed down by its
/// drive, with the `a_max_rad_s2` of the arm's file or harder. One drive may fail alone: it stands
/// or slows down up to `stop_alone_s` before the others, or hears of it so much later.
struct PlanFile {
  static constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

  std::string format;  ///< "mimesis.plan 2"
  std::string robot;   ///< file of the arm
  double period_s = kMissing;
  double margin_m = kMissing;       ///< least distance along the motions
  double stop_margin_m = kMissing;  ///< least distance of stops that leave the path
  double stop_delay_s = kMissing;
  double stop_alone_s = kMissing;
  std::vector<PlanMotion> motions;

  void visit(runtime::ParamVisitor& v);
  /// @throws ConfigError that names the first list whose length does not fit an arm of `dof`
  /// joints.
  void check(int dof) const;
};

/// @throws ConfigError "file:line:col: ..." (see runtime::load_params).
PlanFile load_plan(const std::string& file);
/// @throws ConfigError if the file cannot be written.
void save_plan(const PlanFile& plan, const std::string& file);

}  // namespace mimesis::tool
