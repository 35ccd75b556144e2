#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "common/motion/mocap/body.h"
#include "common/motion/mocap/trials.h"

namespace mimesis::mocap {

/// Heading of the figure in every frame [rad]: direction of the root's x axis seen from above, from
/// W's x axis, + to the left, without jumps by 2π.
Eigen::VectorXd heading_rad(const BodyClip& clip);

/// Takes the heading out of the root's rotation: afterwards it faces W's x axis in every frame.
/// The position stays.
void remove_heading(BodyClip& clip);

/// The figure walks if its heels swing this far relative to the pelvis, further than this share of
/// the clip's largest swing, and this fast over the ground.
inline constexpr double kLeastSwing_m = 0.10, kLeastSwingShare = 0.35, kLeastSwing_m_s = 0.5;

/// Frames of a clip (columns) in which feet meet the ground, by side.
struct GaitEvents {
  std::array<std::vector<Eigen::Index>, 2> heel_strike;
  bool backward = false;  ///< the figure walks against its heading
};

/// Zeni's coordinate method: a foot strikes where its heel is farthest ahead of the pelvis (Zeni,
/// Richards, Higginson 2008). "Ahead" is along the heading, or against it in clips that travel
/// backwards (then it is the toe that strikes). A maximum counts if the heel swings by
/// kLeastSwing_m and kLeastSwingShare on both sides of it; half of that at the ends of a clip; a
/// strike counts if the foot flew at kLeastSwing_m_s within half a second before it. No walking, no
/// events.
/// @param ends  count a clip's first and last strike also by less of a swing, if the foot flies in
/// its first frame (1 m/s), or stands behind the last strike (0.3 m/s)
GaitEvents find_gait_events(const BodyClip& clip, bool ends = false);

/// First and last frame (column) of an interval.
struct FrameInterval {
  Eigen::Index first = 0, last = 0;
};

struct CycleOptions {
  enum class Cut {
    gait_cycles,  ///< from heel strike to heel strike, see cut_cycles()
    whole_clip    ///< the whole clip is one trial, for motions that do not repeat
  };
  Cut cut = Cut::gait_cycles;
  int samples = 100;                         ///< T
  double cutoff_hz = 8.0;                    ///< zero-phase low-pass of the angles; 0: none
  double shortest_s = 0.4, longest_s = 3.0;  ///< duration of a gait cycle; others are left out
  std::string style;                         ///< empty: style_of(file name)
};

/// Further trajectories of a clip's frames that are filtered and cut with its angles: a robot's
/// joints.
struct MoreRows {
  std::vector<std::string> names;
  Eigen::MatrixXd values_rad{};  ///< names×frames
};

/// Trials of a clip: angles filtered, heading removed, cut, resampled to T samples. The period's
/// last frame is phase 2π, i.e. sample 0 of the next; a whole clip ends there too. Cycles go from
/// left strike to left strike; of a clip that has none, with the strikes near its ends, or else
/// from right to right, as closed cycles that begin at the left strike within them (without one:
/// in their middle). So phase 0 is the left strike in all. Status: why the clip gives no trial (no
/// heel strikes twice, standing, ...). The rows are the body's, then `more`.
/// @throws ConfigError if options do not fit (T < 2, the cutoff), or
/// `more` has not the clip's frames
tl::expected<Trials, Status> cut_cycles(const BodyClip& clip, const CycleOptions& options = {},
                                        const MoreRows& more = {});

/// One set of all. @throws ConfigError if rows, T or task names differ, or the list is empty
Trials merge(std::span<const Trials> sets);

/// The label that a file name carries: "dataset-1_walk_happy_001.bvh" gives "happy" with the
/// motion before it unless that is a plain walk, "dance-short_normal"; none, as in "07_01.bvh":
/// empty.
std::string style_of(const std::string& file);

}  // namespace mimesis::mocap
