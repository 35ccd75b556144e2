#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nodes/synthesizer/dynamics/character_batch.h"
#include "nodes/synthesizer/walker.h"

namespace mimesis::synthesizer {

/// Where and how a character begins.
struct WalkerStart {
  Eigen::Vector2d position_W_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;
  double phase_rad = 0.0;
};

struct WalkersSettings {
  WalkSettings walk{};  ///< its dt_s is that of the characters
  std::string style{};  ///< at the start; empty: the model's first
  bool walking = false;
  bool foot_lock = true;
  double beat_alpha_1_s = 2.0;   ///< α of [M18 eq. 3.18] to the beat
  double crowd_alpha_1_s = 2.0;  ///< and to the phase of a gait command
};

/// What a character does in one instant. H: heading frame of the pelvis, W: world.
struct WalkerState {
  RootPose root;  ///< velocities with the pivoting
  double phase_rad = 0.0, phase_rate_rad_s = 0.0;
};

/// Characters that walk by themselves: a Walker decides for each, a CharacterBatch draws them all.
///
/// Rhythms couple the leading oscillator [M18 eq. 3.18]. The phase of the rhythm that enters is
/// kept within 1 rad of the oscillator's, and within what changes its rate by half: coupled to an
/// opposite phase as it is, the radius of eq. 3.18 collapses for α > 1, and the posture jumps. The
/// rate of the rhythm becomes the eigenfrequency, within WalkSettings' bounds, so that the locked
/// phases agree.
class Walkers {
 public:
  /// @throws ConfigError as Repertoire and CharacterBatch, and for a style the model has not
  Walkers(const MotionModel& model, std::span<const WalkerStart> starts,
          const WalkersSettings& settings);

  int size() const { return batch_.size(); }
  int rows() const { return batch_.rows(); }
  const Repertoire& repertoire() const { return *repertoire_; }
  Walker& walker(int i) { return characters_[static_cast<std::size_t>(i)].walker; }
  const Walker& walker(int i) const { return characters_[static_cast<std::size_t>(i)].walker; }
  /// False: the rows move no pelvis, so no goal can be reached.
  bool moves() const { return moves_; }

  /// A rhythm for all, now at this phase; goes on by itself.
  void set_beat(double phase_rad, double rate_rad_s);
  void end_beat() { beat_.on = false; }
  /// What a coordinator wishes of one, from now until release(); goes before the beat.
  void set_gait(int i, const GaitWish& wish, std::optional<double> phase_rad);
  void release(int i);

  /// Puts a character there, standing or in the middle of a walk; its goal and style stay.
  void place(int i, const WalkerStart& start, bool walking);

  /// Advances all by dt. Does not allocate.
  void step();

  const WalkerState& state(int i) const { return characters_[static_cast<std::size_t>(i)].state; }
  std::span<const float> angles(int i) const { return batch_.angles(i); }  ///< R values [rad]
  const CharacterBatch& batch() const { return batch_; }

 private:
  struct Rhythm {
    bool on = false;
    double phase_rad = 0.0, rate_rad_s = 0.0;
    void advance(double dt_s) { phase_rad += dt_s * rate_rad_s; }
  };
  struct Character {
    Walker walker;
    Rhythm coordinator;
    GaitWish gait;
    WalkerState state;
  };
  void decide(int i, Character& c);
  void couple(int i, const Rhythm& rhythm, double alpha_1_s, const Walker& walker,
              double phase_rad);
  void pivot(int i, const RootPose& root, double angle_rad);
  void observe(int i, Character& c);
  void set_motion(int i, const Walker& walker);

  WalkersSettings settings_;
  std::unique_ptr<const Repertoire> repertoire_;  // stays where walkers look for it
  CharacterBatch batch_;
  std::vector<Character> characters_;
  Rhythm beat_;
  bool moves_;
  // of models with free delays
  std::vector<MotionParameters> parts_;
  MotionParameters mixed_;
};

}  // namespace mimesis::synthesizer
