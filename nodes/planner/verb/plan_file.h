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

/// Convex obstacle in W: all that is within `radius_m` of the hull of its points, rows x y z.
struct PlanHull {
  std::string name;
  std::vector<double> points_m;
  double radius_m = 0.0;

  void visit(runtime::ParamVisitor& v);
};

/// A piece of the way that the end effector keeps to, in W: straight to `to_m`, or on a circle
/// through `via_m`, which is empty else.
struct PlanToolPiece {
  std::vector<double> via_m, to_m;

  void visit(runtime::ParamVisitor& v);
};

/// A motion between two postures at rest, and all that it must keep clear of, in W. Numbers in
/// rows: balls x y z radius, boxes the centre and half the edges.
struct PlanMotion {
  std::string phase;
  std::vector<double> balls_m, boxes_m;
  std::vector<double> held_m;      ///< balls that cover what the hand holds, in E
  std::vector<double> supports_m;  ///< boxes that what is held may touch
  std::vector<PlanHull> hulls;     ///< parts of meshes
  /// From where the end effector is at the begin, with the orientation that it has there, within
  /// `tool_off_m` and `tool_off_rad`; empty: anywhere.
  std::vector<PlanToolPiece> tool;
  double tool_off_m = 0.0, tool_off_rad = 0.0;
  std::vector<PlanInstant> instants;

  void visit(runtime::ParamVisitor& v);
};

/// A file that tells what the arm is, and a sum of its bytes (FNV-1a, 16 hexadecimal digits).
struct PlanInput {
  std::string file, sum;

  void visit(runtime::ParamVisitor& v);
};

/// A plan for an arm: every instant with its stops. Those that leave the path follow from the file:
/// for up to `stop_delay_s` the joints go on at their speeds, then each is slowed down by its
/// drive, with the `a_max_rad_s2` of the arm's file or harder. One drive may fail alone: it stands
/// or slows down up to `stop_alone_s` before the others, or hears of it so much later.
struct PlanFile {
  static constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

  std::string format;             ///< "mimesis.plan 3"
  std::string robot;              ///< file of the arm
  std::vector<PlanInput> inputs;  ///< it, its URDF and meshes, when this was planned
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

struct PlanVerdict {
  std::vector<std::string> findings;  ///< a line each; none: the plan is proven
  std::size_t left_out = 0;           ///< findings beyond the first ones
  std::size_t instants = 0;
  long postures = 0;  ///< that were computed
  /// Least distances of the postures that were looked at [m].
  double nearest_m = std::numeric_limits<double>::infinity(), nearest_stop_m = nearest_m;
};

/// Judges a plan without the planner: own kinematics from the rows of the arm's file, in double
/// precision, and another proof. Of the motion around a posture, with joints within ±δⱼ of it, ball
/// or part i moves at most Σⱼ Lᵢⱼ δⱼ, Lᵢⱼ the stretched length of the arm from axis j to the ball;
/// what that does not prove is halved. Proven are
///  - the streamed motion between all instants (cubic Hermite), `margin_m` apart from everything;
///  - the stop of each instant that leaves the path, `stop_margin_m` apart: all q + q̇ τ + s ρ(u), ρ
///    the ramp from q̇ with the arm's accelerations, 0 ≤ τ ≤ `stop_delay_s`, 0 ≤ s ≤ 1;
///  - the same with τ = 0 and one joint elsewhere, whose drive fails alone, for each joint: between
///    where it was in the last `stop_alone_s` and q + q̇ `stop_alone_s` + s ρ(u);
///  - where a motion's tool has a way: that the end effector keeps to it, until its end;
/// and checked are limits of joints, speeds and accelerations, rest at both ends, that velocities
/// are those of the positions, that motions join, and that each stop along the path is one: it
/// begins where the arm is, goes forward, ends at rest within the motion, and no harder than the
/// arm's accelerations allow.
/// @throws ConfigError if the plan does not fit the arm (PlanFile::check).
PlanVerdict verify_plan(const PlanFile& plan, const kin::ArmModel& arm);

}  // namespace mimesis::tool
