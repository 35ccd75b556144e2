#pragma once
#include <string>
#include <vector>

#include "common/motion/mocap/body.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// A character of a run.
struct CharacterOptions {
  int character = 0;
  std::string topic;  ///< of v1.Motion or v1.MotionBatch; empty: the only one
  std::string model;  ///< file of its model; empty: the one that its node was started with
  TimeRange range;
  double rate_hz = 0.0;  ///< 0: the log's
};
/// Its motion in the log, joints that are a figure's. Between messages, which need not be evenly
/// spaced, it is interpolated. `notes`: rows that are left out, gaps.
/// @throws ConfigError if there is no such topic, node, character or model, or several to choose
/// from
mocap::BodyClip read_character(const std::vector<OpenLog>& logs, const CharacterOptions& options,
                               std::vector<std::string>& notes);

/// One cycle of a learned model's style, walked straight ahead from the origin along W's x axis:
/// its last frame is one before the first of the next cycle.
/// @param style  empty: the model's first
/// @param in_place  without the way
/// @throws ConfigError as load_motion_model(); for a style that it has not
mocap::BodyClip style_cycle(const std::string& model_file, const std::string& style, double rate_hz,
                            bool in_place);

}  // namespace mimesis::tool
