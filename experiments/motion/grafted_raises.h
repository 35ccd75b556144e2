#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "common/motion/mocap/body.h"
#include "common/motion/mocap/trials.h"

/// Gaits with non-periodic arm movements, as [M18 3.3.3] learned from. No such recording is
/// published: arm raises recorded while standing are put on the legs and trunk of recorded walks.
namespace mimesis::synthesizer {

/// Where in a cycle a movement takes place that happens once, in shares of the period.
struct Graft {
  double onset = 0.0;  ///< until then its first posture holds
  double span = 1.0;   ///< its duration; after that its last posture holds
};

/// Puts `movement` (rows × M frames, M >= 2) on the rows `rows` of one trial (R×T): linear between
/// frames, the other rows stay. @throws ConfigError if the rows are not of the trial or not as many
/// as the movement has, or the graft is not within the period
void graft(Eigen::Ref<Eigen::MatrixXd> trial, const Eigen::MatrixXd& movement,
           const std::vector<Eigen::Index>& rows, const Graft& where);

/// Rows of the shoulder, elbow and wrist of a side, of the 17-joint figure.
std::vector<Eigen::Index> arm_rows(mocap::Side side);

/// The frame in which that hand is highest, of the root's height.
Eigen::Index highest_hand(const mocap::BodyClip& clip, mocap::Side side);

/// Gait cycles of the walking clips among Bandai-Namco's (styles and turns) and 12 composed ones:
/// raises of the left, the right and both hands, up to the hand's highest place, over `span` of the
/// period from the onsets 0, 0.1, 0.2 and 0.3 on, on cycles of the same actor's walk. Rotations of
/// all on the same branch (align_rotation_branches()).
struct GraftedSet {
  mocap::Trials trials;
  Eigen::Index walks = 0;  ///< trials before the first composed one
};
/// @throws ConfigError if a clip is missing or gives no cycle; if the span does not fit after an
/// onset
GraftedSet walks_with_raises(const std::filesystem::path& clips, double span = 0.6);

}  // namespace mimesis::synthesizer
