#pragma once
#include <functional>
#include <optional>
#include <span>

#include "experiments/walk/trial/capture.h"
#include "hw/sim/body/walk_judge.h"
#include "nodes/walker/walker.h"

namespace mimesis::walk {

/// A robot and the file of its description.
struct Robot {
  std::string name, urdf_file;
  robot::Biped biped;
};
/// "biped", "jvrc1" of models/, or a path of such a file with its ending.
/// @throws ConfigError if it cannot be read
Robot load_robot(const std::string& name);

enum class Engine {
  dart,    ///< BodyWorld
  mujoco,  ///< MujocoWorld, to judge by another physics
};

/// One walk of the whole chain in the physics, without messages: Walker, delay, world. A walker
/// that finds its attitude itself has stood for 3 s, until its gyro's bias is known, when the time
/// of a trial begins.
struct TrialSpec {
  std::string name;
  const Robot* robot = nullptr;
  hw::sim::BodyOptions body;
  walker::WalkerSettings walker;
  /// Wish as a function of the time since the start, called once per tick. Empty: stands.
  std::function<walker::WalkerWish(double)> wish;
  std::vector<hw::sim::Push> pushes;
  double duration_s = 10.0;
  int delay_ticks = 1;      ///< delay of sensor readings on their way to the walker
  double lost_share = 0.0;  ///< of the readings; the walker has the one before in their place
  Engine engine = Engine::dart;
};

/// One tick, for plots and for worlds with more than a robot in them.
struct TrialTick {
  double time_s;                    ///< since the start
  const walker::WalkerOutput& out;  ///< output of the walker
  const hw::sim::BodyTruth& truth;  ///< after it
  const hw::sim::BodySensors& sensors;
  hw::sim::BodyWorld& world;
  bool& ends;  ///< set: this tick is the last
};

/// Result of a trial.
struct TrialResult {
  std::string name;
  hw::sim::WalkFigures figures;
  double fell_at_s = 0.0;
  double walked_m = 0.0;  ///< distance walked by the pelvis along the ground, from start to end
  /// Divergent component in truth against the plan, seen from the standing foot [m].
  Eigen::Vector2d dcm_rms_m = Eigen::Vector2d::Zero();
  double dcm_max_m = 0.0;
  double tilt_error_rms_rad = 0.0,
         tilt_error_max_rad = 0.0;  ///< of what the walker takes for upright
  double reach_error_m = 0.0;       ///< error of a wished hand at the end; 0 without one
  int limited_ticks = 0, clipped_ticks = 0, failed_ticks = 0, saturated_ticks = 0;
  hw::sim::Collisions self, furniture;
  /// The state after the first push, if there is one, by a bound on what steps can capture.
  std::optional<Capturability> pushed;
  std::string trouble;  ///< first one that the walker told
  /// Times of Walker::step on this machine; not reproducible.
  double tick_p50_s = 0.0, tick_p99_s = 0.0, tick_max_s = 0.0;
  double real_time_factor = 0.0;  ///< simulated seconds per second, for the physics
};

/// Ground of a plan, for truth_to_plan().
hw::sim::PlannedGround planned_ground(const walker::PatternSample& plan);

/// Deterministic except for its times. `watch`: called every tick, in DART alone.
TrialResult run_trial(const TrialSpec& spec,
                      const std::function<void(const TrialTick&)>& watch = {});

/// Runs all trials on `jobs` threads. `done` is called in the order of the trials, from one thread
/// at a time. @throws like run_trial()
void run_trials(std::span<const TrialSpec> trials, int jobs,
                const std::function<void(const TrialResult&)>& done);

}  // namespace mimesis::walk
