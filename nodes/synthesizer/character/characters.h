#pragma once
#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nodes/synthesizer/character/walk_control.h"
#include "nodes/synthesizer/dynamics/character_batch.h"

namespace mimesis::synthesizer {

struct CharacterStart {
  Eigen::Vector2d position_W_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;
  double phase_rad = 0.0;
};

struct CharactersSettings {
  WalkSettings walk{};           ///< its dt_s is that of the characters
  std::string style{};           ///< style at the start; empty: the model's first
  bool walking = false;          ///< walks from the start; false: stands until told
  bool foot_lock = true;         ///< standing feet stay where they are
  double beat_alpha_1_s = 2.0;   ///< coupling α to the beat [M18 eq. 3.18] [1/s]
  double crowd_alpha_1_s = 2.0;  ///< coupling α to phases of crowd commands [1/s]
};

/// State of a character at one instant. H: heading frame of the pelvis, W: world.
struct CharacterState {
  RootPose root;  ///< velocities with all turns
  double phase_rad = 0.0, phase_rate_rad_s = 0.0;
};

/// Characters that walk by themselves: a WalkControl decides for each, a CharacterBatch draws them
/// all.
///
/// Rhythms couple the leading oscillator [M18 eq. 3.18]. The phase of the rhythm that enters is
/// kept within 1 rad of the oscillator's, and within what changes its rate by half: coupled to an
/// opposite phase as it is, the radius of eq. 3.18 collapses for α > 1, and the posture jumps. The
/// rate of the rhythm becomes the eigenfrequency, within WalkSettings' bounds, so that the locked
/// phases agree.
class Characters {
 public:
  /// @throws ConfigError as Repertoire and CharacterBatch, and for a style the model has not
  Characters(const motion::MotionModel& model, std::span<const CharacterStart> starts,
             const CharactersSettings& settings);

  int size() const { return batch_.size(); }
  int rows() const { return batch_.rows(); }
  const Repertoire& repertoire() const { return *repertoire_; }
  WalkControl& walk(int i) { return each_[static_cast<std::size_t>(i)].walk; }
  const WalkControl& walk(int i) const { return each_[static_cast<std::size_t>(i)].walk; }
  /// False: the rows move no pelvis, so no goal can be reached.
  bool moves() const { return moves_; }

  /// A rhythm for all, now at this phase; continues by itself.
  void set_beat(double phase_rad, double rate_rad_s);
  void end_beat() { beat_.on = false; }
  /// A coordinator's wish for one character, from now until release(); it has priority over the
  /// beat.
  void set_gait(int i, const GaitWish& wish, std::optional<double> phase_rad);
  void release(int i);

  /// Puts a character there, standing or in the middle of a walk; its goal and style stay.
  void place(int i, const CharacterStart& start, bool walking);

  /// Advances all by dt. Does not allocate.
  void step();

  const CharacterState& state(int i) const { return each_[static_cast<std::size_t>(i)].state; }
  std::span<const float> angles(int i) const { return batch_.angles(i); }  ///< R values [rad]
  const CharacterBatch& batch() const { return batch_; }

 private:
  struct Rhythm {
    bool on = false;
    double phase_rad = 0.0, rate_rad_s = 0.0;
    void advance(double dt_s) { phase_rad += dt_s * rate_rad_s; }
  };
  struct One {
    WalkControl walk;
    Rhythm coordinator;
    GaitWish gait;
    CharacterState state;
  };
  void decide(int i, One& c);
  void couple(int i, const Rhythm& rhythm, double alpha_1_s, const WalkControl& walk,
              double phase_rad);
  void observe(int i, One& c);
  void set_motion(int i, const WalkControl& walk);

  CharactersSettings settings_;
  std::unique_ptr<const Repertoire> repertoire_;  // stays where the controls look for it
  CharacterBatch batch_;
  std::vector<One> each_;
  Rhythm beat_;
  bool moves_;
  // parts of the mixture, for models with free delays
  std::vector<MotionParameters> parts_;
  MotionParameters mixed_;
};

/// Where characters stand at the start.
struct Formation {
  std::string arrangement = "grid";                      ///< row, circle or grid
  double spacing_m = 1.2;                                ///< between neighbours [m]
  Eigen::Vector2d centre_W_m = Eigen::Vector2d::Zero();  ///< [m]
  double heading_rad = 0.0;                              ///< in W, + to the left [rad]
  bool spread_phases = false;                            ///< false: all begin at left heel strike
};

/// Row: side by side, across the heading. Circle: facing the centre. Grid: rows of ⌈√count⌉, one
/// behind the other. Spread phases are multiples of the golden section of a cycle: even, and
/// neighbours differ.
std::vector<CharacterStart> form(int count, const Formation& formation);

/// The pelvis' velocity as a walking robot can follow it. The velocity from the standing foot has
/// ripples, because of the roll from heel to toe and of changes of support; this is the result of a
/// critically damped low-pass, v̈ = λ²(u − v) − 2λv̇ with λ = 20 1/s: 0.1 s behind, an oscillation
/// of ω reduced by 1/(1 + (ω/λ)²).
class PelvisVelocity {
 public:
  explicit PelvisVelocity(double dt_s);
  void step(const RootPose& root);

  /// Forward and left in the heading frame [m/s], turn to the left [rad/s].
  const Eigen::Vector3d& value() const { return value_; }

 private:
  double dt_s_, fade_;
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero(), rate_ = Eigen::Vector3d::Zero();
};

}  // namespace mimesis::synthesizer
