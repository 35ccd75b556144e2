#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/synthesizer/character/characters.h"
#include "nodes/synthesizer/robot/biped_sequence.h"
#include "nodes/synthesizer/robot/robot_walk.h"

namespace mimesis::synthesizer {

enum class GoalKind { none, walk_to, drawer, stop };

struct Progress {
  GoalKind kind = GoalKind::none;
  bool reached = false;
  std::string reason;  ///< why it does not come there
  double distance_m = 0.0;
};

/// Motion of a figure, or wished motion of a robot, at one instant.
struct DirectedMotion {
  double phase_rad = 0.0, phase_rate_rad_s = 0.0;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();         ///< forward, left [m/s], turn [rad/s]
  Eigen::Vector3d smooth_velocity = Eigen::Vector3d::Zero();  ///< velocity that a robot can follow
  Eigen::Vector3d pelvis_W_m = Eigen::Vector3d::Zero();
  double heading_rad = 0.0;
  mocap::Side support = mocap::kLeft;
  bool stands = false;  ///< for a robot: it shall end stepping
  /// landings of the next swing foot and of the one after it
  Landings landing;
  std::array<std::optional<HandWish>, 2> hand;  ///< left, right
  const char* action = "stand";
};

/// Turns goals into motion: of figures or of one robot.
class Director {
 public:
  Director(const motion::MotionModel& model, std::span<const CharacterStart> starts,
           const CharactersSettings& settings)
      : characters_(model, starts, settings) {}
  virtual ~Director() = default;
  Director(const Director&) = delete;
  Director& operator=(const Director&) = delete;

  Characters& characters() { return characters_; }
  const Characters& characters() const { return characters_; }
  int size() const { return characters_.size(); }
  /// It needs the place of its robot.
  virtual bool leads_robot() const = 0;

  virtual void walk_to(int i, const Eigen::Vector2d& goal_W_m) = 0;
  virtual void stop(int i) = 0;
  /// The reason if it will not be done, else nothing.
  virtual std::string to_drawer(int i, const DrawerPlace& place) = 0;
  /// A coordinator's wish, until the next one or release(). A goal goes before it.
  /// @param phase_rad  of the coordinator's rhythm now, if it has one
  virtual void follow(int i, const GaitWish& wish, std::optional<double> phase_rad) = 0;
  virtual void release(int i) = 0;

  /// Advances all by dt.
  /// @param robot  where the robot is; null: unknown, it is assumed to obey
  /// @param senses  of a drawer; until it was seen, it is at the goal's place
  virtual void step(const RobotFeedback* robot, const DrawerSenses& senses) = 0;

  virtual const CharacterState& state(int i) const { return characters_.state(i); }
  virtual std::span<const float> angles(int i) const = 0;  ///< rows of the model [rad]
  virtual DirectedMotion motion(int i) const = 0;
  virtual Progress progress(int i) const = 0;
  /// Actions left of a sequence, the one under way first; null: there is none.
  virtual const std::vector<PlannedAction>* plan(int i) const = 0;

 protected:
  Characters characters_;
};

/// Directs figures. Whatever a pointer leads to must outlive the director.
/// @param drawer  actions for goals of that kind; null: they are refused
std::unique_ptr<Director> make_figure_director(const motion::MotionModel& model,
                                               std::span<const CharacterStart> starts,
                                               const CharactersSettings& settings,
                                               const ActionMaps* drawer);
/// Directs a walking robot. @throws ConfigError if the model has no row of a joint that drawer
/// moves
std::unique_ptr<Director> make_robot_director(const motion::MotionModel& model,
                                              const CharacterStart& start,
                                              const CharactersSettings& settings,
                                              const RobotLimits& limits, const BipedDrawer* drawer);

}  // namespace mimesis::synthesizer
