#pragma once
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/motion/mocap/body_map.h"
#include "common/motion/mocap/trials.h"

namespace mimesis::mocap {

struct CycleOptions {
  enum class Cut {
    kGaitCycles,  ///< from left heel strike to left heel strike
    kWholeClip,   ///< the whole clip is one trial, for motions that do not repeat
    kRanges       ///< the frame ranges below
  };
  Cut cut = Cut::kGaitCycles;
  std::vector<std::pair<long, long>> ranges;  ///< first and last frame of trials, as in the file
  int samples = 100;                          ///< T
  double cutoff_hz = 8.0;                     ///< zero-phase low-pass of the angles; 0: none
  double shortest_s = 0.4, longest_s = 3.0;   ///< of a gait cycle; others are left out
  bool keep_heading = false;                  ///< leave the heading in the root's rotation
  std::string style;                          ///< empty: style_of(file name)
};

/// Further trajectories of a clip's frames that are filtered and cut with its angles: a robot's
/// joints.
struct MoreRows {
  std::vector<std::string> names;
  Eigen::MatrixXd values_rad{};  ///< names×frames
};

/// Trials of a clip: angles filtered, heading removed, cut, resampled to T samples. The period's
/// last frame is phase 2π, i.e. sample 0 of the next; a whole clip ends there likewise.
/// Status: why the clip gives no trial (fewer than two left heel strikes, standing, ...).
/// The rows are the body's, then `more`.
/// @throws ConfigError if options do not fit (a range outside the clip, T < 2, the cutoff), or
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
