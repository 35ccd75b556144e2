#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/synthesizer/director.h"
#include "nodes/synthesizer/sequence/drawer_sequence.h"

namespace mimesis::synthesizer {

/// Directs the characters: they walk (Characters), and may go to a drawer and take the object in it
/// (PlacedSequence). One motion follows the other without a jump: at the change the difference of
/// root and rows fades within kFade_s (smooth.h); feet on the ground may slide meanwhile.
///
/// To a drawer a character walks as to any goal until it faces it; then, standing or at a left heel
/// strike, the drawer's sequence takes over, if one leads there from that distance. A drawer that
/// moves along the way is followed within the sequence (DrawerSequence); one that moves across it,
/// and any other goal, takes the character out of it again.
class FigureDirector : public Director {
 public:
  /// @param drawer  actions for goals of that kind; null: they are refused. Must outlive this.
  FigureDirector(const motion::MotionModel& model, std::span<const CharacterStart> starts,
                 const CharactersSettings& settings, const ActionMaps* drawer);

  bool leads_robot() const override { return false; }
  void walk_to(int i, const Eigen::Vector2d& goal_W_m) override;
  void stop(int i) override;
  std::string to_drawer(int i, const DrawerPlace& place) override;
  void follow(int i, const GaitWish& wish, std::optional<double> phase_rad) override {
    characters_.set_gait(i, wish, phase_rad);
  }
  void release(int i) override { characters_.release(i); }
  /// Allocates only for characters in a drawer's sequence.
  void step(const RobotFeedback* robot, const DrawerSeen* seen) override;

  const CharacterState& state(int i) const override;
  std::span<const float> angles(int i) const override;
  DirectedMotion motion(int i) const override;  ///< smooth only if there is one character
  const char* action(int i) const;  ///< stand, start, walk, stop; step, reach, take at a drawer
  Progress progress(int i) const override;
  const std::vector<PlannedAction>* plan(int i) const override;

  static constexpr double kFade_s = 0.5;

 private:
  /// Values of a motion: x, y, z of the pelvis in W, heading, rows.
  using Values = std::vector<double>;
  /// A character that is on its way to a drawer, in its sequence, or leaves it.
  struct Act {
    bool active = false;
    std::optional<DrawerPlace> wished;  // until its sequence begins
    std::string refused;                // why it did not
    std::optional<PlacedSequence> run;
    double phase_rad = 0.0;  // phase of the walk at the last step
    CharacterState state;    // state at this instant, with the fade
    std::vector<float> angles;
    Values shown, shown_before;  // values of this and the last instant
    double fade_s = kFade_s;     // since the change
    bool from_now = true;        // `motion` is of the instant of the change; else of the next one
    Values offset, offset_rate;  // offset from the new motion to the old one, at the change
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

  const ActionMaps* drawer_;
  double dt_s_;
  PelvisVelocity pelvis_;      // velocity of a single character
  bool body_rows_ = true;      // all rows of the model are rows of a body
  std::vector<int> body_row_;  // row of the body, for each row of the model
  std::vector<std::unique_ptr<Act>> acts_;
};

}  // namespace mimesis::synthesizer
