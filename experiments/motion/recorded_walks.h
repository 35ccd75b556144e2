#pragma once
#include <string>
#include <vector>

#include "experiments/harness/figure.h"
#include "common/motion/mocap/body.h"
#include "common/motion/mocap/trials.h"

/// Clips of the shared folder ($MIMESIS_SHARED/data/mocap, or ../shared of where one is), which are
/// no part of the repository.
namespace mimesis::synthesizer {

struct RecordedWalks {
  mocap::Body body;      ///< of the first clip
  mocap::Trials trials;  ///< gait cycles of all clips, in their order
};

/// Names are relative to data/mocap: "cmu_bvh/07_01.bvh". Empty: all are there; else the first that
/// is not, with its folder.
std::string absent_clip(const std::vector<std::string>& clips);
/// Gait cycles, cut with their heading taken out. @throws ConfigError, and std::runtime_error for a
/// clip without a cycle
RecordedWalks recorded_walks(const std::vector<std::string>& clips);
/// What a figure says instead of numbers: one row that does not hold.
reproduce::Report report_absent(const std::string& clip);

}  // namespace mimesis::synthesizer
