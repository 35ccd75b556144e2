#pragma once
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/robot/biped.h"
#include "common/robot/dynamics.h"
#include "hw/sim/body/drawer.h"
#include "hw/sim/body/senses.h"

namespace mimesis::hw::sim {

/// How joints follow their set-points [docs/walking.md 7.3].
enum class Plant {
  springs,  ///< B: joint springs of 6000 N m/rad in legs and trunk
  /// C: velocity servos in legs and trunk, rubber bushes in the ankles: 1500 N m/rad where they
  /// turn; where they give along the leg, knees of 6000 N m/rad stand for them (see rigid_knees).
  servo,
};

/// A plate on the ground, unknown to the robot.
struct Plate {
  Eigen::Vector2d center_W_m = Eigen::Vector2d::Zero(), half_m{0.25, 0.5};
  double height_m = 0.005;

  template <class Visitor>
  void visit(Visitor& v) {
    v("x_m", center_W_m.x(), -100.0, 100.0);
    v("y_m", center_W_m.y(), -100.0, 100.0);
    v("half_x_m", half_m.x(), 0.01, 10.0);
    v("half_y_m", half_m.y(), 0.01, 10.0);
    v("height_m", height_m, 0.0, 0.1);
  }
};

/// A push: constant force for a while.
struct Push {
  double at_s = 0.0, duration_s = 0.1;  ///< of the world's time [s]
  Eigen::Vector3d impulse_W_ns = Eigen::Vector3d::Zero();
  std::string link = {};  ///< empty: the trunk

  template <class Visitor>
  void visit(Visitor& v) {
    v("at_s", at_s, 0.0, 1e6);
    v("duration_s", duration_s, 0.001, 10.0);
    v("x_n_s", impulse_W_ns.x(), -1000.0, 1000.0);
    v("y_n_s", impulse_W_ns.y(), -1000.0, 1000.0);
    v("z_n_s", impulse_W_ns.z(), -1000.0, 1000.0);
    v("link", link);
  }
};

enum class MotorFault {
  off,     ///< gives no torque: the joint is limp
  locked,  ///< its brake holds where it is
  weak,    ///< has a fifth of its torque
};

struct BodyOptions {
  Plant plant = Plant::springs;
  double dt_s = 0.001;
  double friction = 0.8;  ///< friction of the ground [1]
  /// Springs of arms and neck in both plants: nothing of balance depends on them, a servo each
  /// would cost a third of the speed. 600 in docs/walking.md 7.3, where gravity was fed forward;
  /// drives that get positions only would let the hands sink by 10 mm.
  double arm_stiffness_n_m_rad = 3000.0;
  /// Plant C with servos in the knees too, as in docs/walking.md 7.3. Two legs of one rigid length
  /// on rigid ground share the weight at random: any feedback of foot forces rocks from foot to
  /// foot in double support (10 Hz, ZMP ±0.09 m, measured).
  bool rigid_knees = false;
  /// Slope of the ground, first about y, then about x; the robot starts square on it.
  Eigen::Vector2d slope_rad = Eigen::Vector2d::Zero();
  std::vector<Plate> plates = {};  ///< boxes on the ground; the robot starts on the highest below
  double payload_kg = 0.0;         ///< unknown mass in the trunk, at its own centre [kg]
  double motor_speed_share = 1.0, motor_torque_share = 1.0;  ///< share of the model's limits [1]
  double ankle_pitch_n_m = 0.0;               ///< limit of these motors; 0: the model's
  std::optional<DrawerSettings> drawer = {};  ///< furniture that the robot can knock against
  std::uint64_t seed = 0;                     ///< of the sensors' errors
  Senses senses = {};
};

/// Contacts that a robot should not have, since the start.
struct Collisions {
  long steps = 0;  ///< of the physics, with one at least
  double deepest_m = 0.0;
  std::string deepest_between;  ///< what with what, at the deepest
};

/// Rotation of the ground: its z is the normal. `slope_rad`: see BodyOptions.
Eigen::Matrix3d ground_rotation(const Eigen::Vector2d& slope_rad);
/// Height of the ground in W below a point of it, without plates.
double ground_height_m(const Eigen::Vector2d& slope_rad, const Eigen::Vector2d& p_W_m);

/// True state of the world.
struct BodyTruth {
  double time_s = 0.0;
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  std::array<Eigen::Isometry3d, 2> X_WS{Eigen::Isometry3d::Identity(),
                                        Eigen::Isometry3d::Identity()};
  std::array<Eigen::Vector3d, 2> hand_W_m{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  Eigen::Isometry3d X_WH = Eigen::Isometry3d::Identity();  ///< link of the head, if it has one
  Eigen::Vector3d com_W_m = Eigen::Vector3d::Zero(), com_v_W = Eigen::Vector3d::Zero();
  Eigen::Vector2d zmp_W_m =
      Eigen::Vector2d::Zero();       ///< from the contact forces; the last one while in the air
  std::array<double, 2> normal_n{};  ///< normal force on each foot, mean over the step
  std::array<double, 2> ankle_pitch_n_m{};  ///< from the foot's wrench [docs/walking.md 7.2]
  double most_normal_n = 0.0;               ///< sum of both feet, raw, highest of the step
  /// CoM below 60 % of its height, or trunk tilted by 0.9 rad from where the set-points have it on
  /// level soles: stays true.
  bool fell = false;
  std::string how;  ///< it fell
  Collisions self, furniture;
};

/// The biped in DART: contacts, joints, sensors, trouble. W: origin on the ground between the first
/// soles, x forward, z up against gravity. The soles are boxes made of the biped's rectangles;
/// links with boxes in the URDF collide with each other and with furniture, not with the ground.
/// Deterministic: the same calls give the same bits. Instances do not disturb each other; one
/// thread an instance.
class BodyWorld {
 public:
  /// Half-sitting on the ground. `urdf_file`: of the same robot, for the boxes of its links.
  /// Precondition: as of model::load_biped, every link that moves has a mass, fixed ones have none.
  /// @throws ConfigError if the file cannot be read, or a plate has no size
  BodyWorld(const robot::Biped& biped, const std::string& urdf_file, const BodyOptions& options);
  ~BodyWorld();
  BodyWorld(const BodyWorld&) = delete;
  BodyWorld& operator=(const BodyWorld&) = delete;

  /// Advances by `duration_s` (rounded to steps of dt, at least one) while the set-points go
  /// linearly to `target` (dof [rad], cut to the limits). A target that is not a number leaves its
  /// joint's set-point unchanged, one of the wrong size all of them; trouble() reports it.
  void step(std::span<const double> target, double duration_s);
  /// at_s: time of this world; past: at once. Numbers that are none: not pushed, see trouble().
  /// Precondition: a link of the robot.
  void push(const Push& push);
  void fail(int joint, MotorFault fault);
  /// A drawer moves on by `duration_s` with the hands, which feel it: the left one the rail, the
  /// right one the mass of the object. `grips`: hands that are closed. Precondition:
  /// options.drawer.
  void move(Drawer& drawer, const std::array<bool, 2>& grips, double duration_s);
  /// Constant force on a link's point from now on, until it is set again; in W.
  void pull(int link, const Eigen::Vector3d& point_L_m, const Eigen::Vector3d& force_W_n);

  const BodySensors& sensors() const;
  const BodyTruth& truth() const;
  double time_s() const;
  /// The last call that was refused, in one line; empty: none yet.
  const std::string& trouble() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Speed of a servo by its error [1/s].
inline constexpr double kServoGain_1_s = 200.0;

/// How the motor of a joint follows its set-point, whatever physics moves it: a servo that reaches
/// a speed at once, or a spring to the set-point with a damper beside it. Its own ramp limits the
/// speed.
struct MotorModel {
  bool servo = false;
  double stiffness_n_m_rad = 0.0, damping_n_m_s_rad = 0.0;  ///< of the spring
  double speed_rad_s = 0.0, torque_n_m = 0.0;               ///< most
  double lower_rad = 0.0, upper_rad = 0.0;
};

/// One model per joint, in the order of the joints [docs/walking.md 7.3].
std::vector<MotorModel> motor_models(const robot::Biped& biped, const BodyOptions& options);

}  // namespace mimesis::hw::sim
