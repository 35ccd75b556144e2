#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/synthesizer/drawer_run.h"
#include "nodes/synthesizer/walkers.h"

namespace mimesis::synthesizer {

enum class GoalKind { none, walk_to, drawer, stop };

/// How far a character is.
struct Progress {
  GoalKind kind = GoalKind::none;
  bool reached = false;
  std::string reason;  ///< why it does not come there
  double distance_m = 0.0;
};

/// What the characters do: they walk (Walkers), and may go to a drawer and take what is in it
/// (DrawerRun). One motion follows the other without a jump: at the change the difference of root
/// and rows fades within kFade_s (fade.h); feet on the ground may slide meanwhile.
///
/// To a drawer a character walks as to any goal until it faces it; then, standing or at a left heel
/// strike, the drawer's sequence takes over, if one leads there from that distance. A drawer that
/// moves along the way is followed within the sequence (DrawerSequence); one that moves across it,
/// and any other goal, takes the character out of it again.
class Director {
 public:
  /// @param drawer  actions for goals of that kind; null: they are refused. Must outlive this.
  Director(const MotionModel& model, std::span<const WalkerStart> starts,
           const WalkersSettings& settings, const ActionMaps* drawer);

  Walkers& walkers() { return walkers_; }
  const Walkers& walkers() const { return walkers_; }
  int size() const { return walkers_.size(); }

  void walk_to(int i, const Eigen::Vector2d& goal_W_m);
  void stop(int i);
  /// Why not; empty if it will be done.
  std::string to_drawer(int i, const DrawerPlace& place);

  /// Advances all by dt. Allocates only for characters in a drawer's sequence.
  void step();

  // of character i
  const WalkerState& state(int i) const;
  std::span<const float> angles(int i) const;  ///< R values [rad]
  const char* action(int i) const;  ///< stand, start, walk, stop; step, reach, take at a drawer
  Progress progress(int i) const;
  /// Actions left of a sequence, the one under way first; null: there is none.
  const std::vector<PlannedAction>* plan(int i) const;

  static constexpr double kFade_s = 0.5;

 private:
  /// Values of a motion: x, y, z of the pelvis in W, heading, rows.
  using Values = std::vector<double>;
  /// A character that is on its way to a drawer, in its sequence, or leaves it.
  struct Act {
    bool active = false;
    std::optional<DrawerPlace> wished;  // until its sequence begins
    std::string refused;                // why it did not
    std::optional<DrawerRun> run;
    double phase_rad = 0.0;  // of the walker at the last step
    WalkerState state;       // of this instant, with the fade
    std::vector<float> angles;
    Values shown, shown_before;  // of this and the last instant
    double fade_s = kFade_s;     // since the change
    bool from_now = true;        // `motion` is of the instant of the change; else of the next one
    Values offset, offset_rate;  // of the old motion to the new one, at the change
    Values motion;               // the new one, without fade
  };
  Act& act(int i);
  void advance(int i, Act& act);
  void begin(int i, Act& act);
  void leave(int i, Act& act);
  void begin_fade(Act& act, bool from_now);
  void read(int i, const Act& act, Values& values) const;
  void compose(int i, Act& act);
  void show(int i, Act& act);

  Walkers walkers_;
  const ActionMaps* drawer_;
  double dt_s_;
  bool body_rows_ = true;      // of the model: all are rows of a body
  std::vector<int> body_row_;  // of each row of the model
  std::vector<std::unique_ptr<Act>> acts_;
};

}  // namespace mimesis::synthesizer
