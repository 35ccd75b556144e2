#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/image/pinhole.h"
#include "nodes/planner/planner_node.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// How the nodes of a log were set up, by name: what they said at their start.
using Setups = std::map<std::string, v1::NodeStart>;
Setups read_setups(const std::vector<OpenLog>& logs);

/// A topic of the log and who published on it.
struct SeenTopic {
  std::string topic, node;
};
/// The topic of this type: `preferred` if it is one of them, else the first by name.
std::optional<SeenTopic> topic_of(const std::vector<OpenLog>& logs, const std::string& type,
                                  const std::string& preferred = "");

/// The planner's parameters, its defaults if the log does not hold them. @throws ConfigError if it
/// holds what this version does not know.
planner::PlannerParams planner_params(const Setups& setups);

/// The model file of the robot that `node` moves: its parameter `robot`, else the planner's.
std::string robot_of(const Setups& setups, const std::string& node);

/// The calibrated view of the camera that publishes `image`: a parameter `view` of a node that
/// takes these images, else of the one that makes them.
std::optional<image::View> view_of(const Setups& setups, const SeenTopic& image);

}  // namespace mimesis::tool
