#pragma once
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>

#include "common/robot/biped.h"

namespace mimesis::walker {

using robot::kLeft;
using robot::kRight;
using robot::Side;

inline constexpr double kTick_s = 0.005;   ///< control period
inline constexpr int kPreviewTicks = 320;  ///< 1.6 s: two steps

/// Pose on the ground of a sole's frame S in W.
struct Footprint {
  Side side = kLeft;
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;
};

/// Wished walk at one tick. Velocities are the pelvis' in its heading frame, averaged over a step.
struct Wish {
  Eigen::Vector2d velocity_m_s = Eigen::Vector2d::Zero();  ///< forward, left
  double yaw_rate_rad_s = 0.0;
  /// Wished landings of the next swing foot and of the one after it. Without one the velocity alone
  /// decides [Herdt 2010, Naveau 2017].
  std::array<std::optional<Footprint>, 2> landing;
  bool walk = true;  ///< false: stop within two steps, independent of the velocity
};

/// Centre of mass along the ground: x and y in W.
struct ComState {
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero(), v_W = Eigen::Vector2d::Zero(),
                  a_W = Eigen::Vector2d::Zero();  ///< [m], [m/s], [m/s²]
};

/// A foot: pose of its sole S and its rates in W [m/s], [m/s²], [rad/s], [rad/s²].
struct FootState {
  Eigen::Isometry3d X_WS = Eigen::Isometry3d::Identity();
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero(), a_W = Eigen::Vector3d::Zero();
  double yaw_rate_rad_s = 0.0, yaw_acceleration = 0.0;
};

enum class Gait { standing, starting, walking, stopping };

/// Plan of the pattern generator for one tick.
struct PatternSample {
  ComState com;
  Eigen::Vector2d zmp_W_m = Eigen::Vector2d::Zero();  ///< ZMP of the cart-table model
  std::array<FootState, 2> foot;                      ///< left, right
  std::array<bool, 2> contact{true, true};            ///< on the ground
  double left_share = 0.5;                            ///< share of the weight on the left foot
  double yaw_rad = 0.0, yaw_rate_rad_s = 0.0;         ///< yaw of the waist: mean of the feet
  Gait gait = Gait::standing;
  Side swing = kLeft;           ///< foot that moves or that will move next
  double to_landing_s = 0.0;    ///< time until it lands; 0 while standing
  double since_change_s = 0.0;  ///< time since the support changed
  Footprint landing;            ///< planned landing of the swing foot
  int steps = 0;                ///< number of landings since the start
};

/// Trouble of the last tick; the last good plan continues.
struct PatternTrouble {
  int failed_solves = 0;  ///< in a row
  std::string reason;     ///< empty, or why the last one failed
  bool clipped = false;   ///< the wish was beyond the robot and was cut to its limits
};

/// Dimensions of robot and gait. Defaults: biped.urdf [docs/walking.md 2.6, 4, 8.1].
struct GaitSettings {
  double com_height_m = 0.807;
  double step_s = 0.8;            ///< duration of a step: first `double_support_s`, then swing
  double double_support_s = 0.1;  ///< double support at the begin of each step
  double first_double_support_s = 0.8;  ///< double support before the first step
  double step_height_m = 0.05;          ///< height of the sole at the top of a swing
  double feet_distance_m = 0.19;        ///< wished distance of the soles
  /// Half sizes, along and across the foot, of the rectangle around the ankle that must contain the
  /// ZMP.
  Eigen::Vector2d zmp_half_m{0.06, 0.03};
  /// Reachable landings relative to the other foot: the polygon with the corners (±longest,
  /// narrowest), (±5/7 longest, widest), (0, 4/3 widest) (forward, outward). At the wished distance
  /// of the feet a step can be 0.29 m long.
  double longest_step_m = 0.31, widest_step_m = 0.30, narrowest_step_m = 0.162;
  /// largest velocities; faster wishes are limited
  double most_forward_m_s = 0.35, most_sideways_m_s = 0.15, most_turn_rad_s = 0.2;
  double most_foot_yaw_rad = 0.17;  ///< largest angle between the feet
};
/// @throws ConfigError "gait.KEY: VALUE, expected ..." for the first setting that no robot can have
///         or that is no multiple of the MPC's sampling time.
void check(const GaitSettings& settings);
/// Settings for a robot: step time, height, distance and sole from its description, the rest scaled
/// from the defaults by the length of its legs [docs/walking.md 8.2]. @throws ConfigError as
/// check()
GaitSettings gait_settings(const robot::Biped& biped);

/// Walking pattern generator: plans CoM, ZMP and feet that a cart-table model can walk, every tick.
class PatternGenerator {
 public:
  virtual ~PatternGenerator() = default;
  /// Starts standing still with the CoM above the middle of the feet.
  virtual void reset(const std::array<Footprint, 2>& feet) = 0;
  /// Advances by one tick. Never throws, never allocates.
  virtual void step(const Wish& wish) = 0;
  const PatternSample& now() const { return sample_; }
  /// Plan for `ticks_ahead` ticks from now, in [0, kPreviewTicks): CoM and ZMP from the horizon,
  /// feet from the coming steps.
  virtual PatternSample ahead(int ticks_ahead) const = 0;
  const PatternTrouble& trouble() const { return trouble_; }
  /// Moves the whole plan, the standing feet included, to where an adjusted step has put them.
  virtual void shift(const Eigen::Vector2d& shift_W_m) = 0;

 protected:
  PatternSample sample_;
  PatternTrouble trouble_;
};

}  // namespace mimesis::walker
