#pragma once
#include <set>
#include <string>
#include <vector>

#include "proto/runtime.pb.h"

// Publishing into a graph whose nodes run, without being one of them.
namespace mimesis::tool {

/// The name that the launch file of a running graph gave this process; empty: no launcher started
/// it.
std::string launched_as();

struct LivePublishing {
  std::string verb;                              ///< for messages: "mimesis log play"
  std::string self;                              ///< own name in the graph
  std::set<std::string> topics;                  ///< to be published
  std::set<std::string, std::less<>> into_live;  ///< of them, those that are meant to be heard
};

/// Refuses to publish what could move a robot, unless it is named: a topic that a node publishes
/// itself, or that an input of one author reads; and any topic that somebody reads, if there is a
/// bridge, because a way from it to the motors may exist.
/// @throws ConfigError with the topics, who would hear them, and what to do
void demand_leave(const LivePublishing& wish, const std::vector<v1::NodeInfo>& nodes);

}  // namespace mimesis::tool
