#pragma once
#include <span>
#include <string>
#include <vector>

#include "common/motion/model/motion_model.h"
#include "nodes/synthesizer/character/parameters.h"

namespace mimesis::synthesizer {

/// Motions of one style; numbers are indices of the repertoire, −1: there is none.
struct StyleMotions {
  std::string name;
  int straight = -1;          ///< walks on; of a style that only turns, one of its turns
  int left = -1, right = -1;  ///< turns by more than 0.2 rad a cycle
  int standing = -1;
  /// Travel of the half cycle in which the walk stops (StepCourse), in step lengths [1].
  double closing_share = 0.5;
};

/// One way to move that characters blend: the mean of the patterns of one style and turn.
struct RepertoireMotion {
  MotionParameters parameters;
  int delays = 0;  ///< motions with the same number have the same delays
  // measured on a character that moves so, and nothing but so
  double step_length_m = 0.0;  ///< travel of the pelvis in half a cycle
  double turn_rad = 0.0;       ///< turn in a cycle, + to the left
};

/// The motions of a model in the form that characters blend online: one per style and direction of
/// turning, and one per style to stand in. Delays are made comparable (delay_ambiguity.h).
///
/// How a mixture stands still: its weights are zero, and the mean remains. The mean of a walk is no
/// posture to stand in (knees half bent, heels up), so root and legs take the zero posture of the
/// body, feet flat, knees bent by 0.2 rad; the upper body keeps the style's mean. Rows that are no
/// body rows (a robot's joints) stand at their mean.
class Repertoire {
 public:
  /// @throws ConfigError for a model without patterns, with a pattern of no duration or of other
  /// sizes.
  explicit Repertoire(const motion::MotionModel& model);

  /// Its patterns are the motions, for a CharacterBatch. It is marked `tied`, so that the batch
  /// blends patterns; see same_delays().
  const motion::MotionModel& model() const { return model_; }
  /// All motions with a share have the same delays (of a tied model: all motions), so that their
  /// blend is a blend of weights and means.
  bool same_delays(std::span<const double> beta) const;
  const std::vector<RepertoireMotion>& motions() const { return motions_; }
  const RepertoireMotion& motion(int m) const { return motions_[static_cast<std::size_t>(m)]; }
  const std::vector<StyleMotions>& styles() const { return styles_; }
  const StyleMotions& style(int s) const { return styles_[static_cast<std::size_t>(s)]; }
  int style_count() const { return static_cast<int>(styles_.size()); }
  /// −1: no motion has that name.
  int find(const std::string& style) const;
  /// "happy, sad, neutral"
  std::string known() const;

 private:
  int add(const MotionParameters& parameters, const std::string& style);
  void measure();
  double measure_closing(const StyleMotions& style) const;

  motion::MotionModel model_;
  std::vector<RepertoireMotion> motions_;
  std::vector<StyleMotions> styles_;
};

}  // namespace mimesis::synthesizer
