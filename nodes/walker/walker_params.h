#pragma once
#include <array>
#include <string>

#include "common/runtime/params.h"
#include "nodes/walker/conduct.h"
#include "nodes/walker/tasks/stack.h"
#include "nodes/walker/walk_wish.h"

namespace mimesis::walker {

/// Visits the parameters of a stack of tasks. An empty list of tasks means walking_stack().
void visit_stack(runtime::ParamVisitor& v, StackSettings& settings);

/// Settings of the gait; 0: the robot's own value (gait_settings of its description).
struct GaitParams {
  static constexpr std::size_t kCount = 12;
  std::array<double, kCount> figures{};  ///< in the order of the .cc file's table

  void visit(runtime::ParamVisitor& v);
  /// @return `robot` with the values that are not 0. @throws ConfigError if they contradict each
  /// other
  GaitSettings over(GaitSettings robot) const;
};

/// Place of the robot at the start: middle of its feet in W.
struct PlaceParams {
  double x_m = 0.0, y_m = 0.0;  ///< place in W [m]
  double heading_rad = 0.0;     ///< heading, + to the left [rad]
};

/// Conditions for balance to begin, and the movement to half-sitting.
struct ReadyParams {
  double near_rad = 0.35;       ///< largest distance of a joint from half-sitting [rad]
  double tilt_rad = 0.15;       ///< largest tilt of the trunk [rad]
  double weight_share = 0.5;    ///< least share of the weight on the feet [1]
  double start_rad = 0.01;      ///< largest distance of the sent posture from the actual one [rad]
  double approach_s = 2.0;      ///< least time to half-sitting [s]
  double approach_share = 0.1;  ///< used share of the joints' largest speeds [1]
};

struct WalkerParams {
  double rate_hz = 200.0;             ///< rate of steps; fixed, because the gains belong to it [Hz]
  double offset_s = 0.0;              ///< time of the first step within the period [s]
  std::string robot = "biped.yaml";   ///< model file
  std::string pattern = "nonlinear";  ///< pattern generator: nonlinear, linear (MPC) or preview
  bool filter = true;                 ///< dynamic filter
  int filter_iterations = 1;          ///< iterations per tick [1]
  bool filter_legs_only = false;      ///< takes the upper body as at rest in half-sitting
  bool stabilize = true;
  StabilizerSettings stabilizer;
  StackSettings stack;  ///< without tasks: walking_stack()
  GaitParams gait;
  PlaceParams start;
  ReadyParams ready;
  double motion_stale_s = 0.1;      ///< an older motion has ended: the robot stops [s]
  bool use_smooth_velocity = true;  ///< low-passed velocities of the motion
  double sensors_stale_s = 0.03;    ///< older readings are not used [s]
  ConductSettings conduct;
  WalkWishSettings wish;

  void visit(runtime::ParamVisitor& v);
  double robot_rate_hz() const;  ///< see run_node
  /// Settings of the chain for this robot. @throws ConfigError
  WalkerSettings settings(const robot::Biped& biped) const;
};

}  // namespace mimesis::walker
