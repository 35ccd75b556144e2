#pragma once
#include "experiments/motion/film.h"
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

/// What a walk leaves on the ground of a film: prints of the soles where they stood, as they really
/// did, in the colours of their legs, and a green cross about the true ZMP, wider than a sole.
class GroundMarks {
 public:
  explicit GroundMarks(const robot::Biped& biped) : biped_(biped) {}

  /// Of every tick. A print comes with the planned landing and moves with its sole until it lifts.
  void see(const TrialTick& tick);
  void add_to(synthesizer::FilmFrame& frame) const;

 private:
  const robot::Biped& biped_;
  std::vector<synthesizer::FilmBox> prints_;
  std::array<std::size_t, 2> now_{};  // the print that a foot stands on
  std::array<bool, 2> stands_{};
  Eigen::Vector2d zmp_W_m_ = Eigen::Vector2d::Zero();
};

}  // namespace mimesis::walk
