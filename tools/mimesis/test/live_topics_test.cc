#include <gtest/gtest.h>

#include "common/error.h"
#include "tools/mimesis/graph_tools.h"

namespace mimesis::tool {
namespace {

v1::NodeInfo node(const std::string& name, const std::vector<std::string>& out,
                  const std::vector<std::string>& in, const std::string& obeys = "") {
  v1::NodeInfo info;
  info.set_name(name);
  for (const std::string& topic : out) info.add_outputs()->set_topic(topic);
  for (const std::string& topic : in) {
    v1::TopicInfo& input = *info.add_inputs();
    input.set_topic(topic);
    input.set_one_author(!obeys.empty());
    if (obeys != "first") input.set_obeys(obeys);
  }
  return info;
}

/// What is said of publishing `topic`; empty: nothing.
std::string said(const std::string& topic, const std::vector<v1::NodeInfo>& nodes,
                 std::set<std::string, std::less<>> into_live = {}, const char* self = "player") {
  try {
    demand_leave({.verb = "play", .self = self, .topics = {topic}, .into_live = into_live}, nodes);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

TEST(LiveTopics, WhatANodePublishesIsItsOwn) {
  const std::vector nodes = {node("a", {"a/x"}, {}), node("b", {}, {"a/x"})};
  EXPECT_NE(said("a/x", nodes).find("a/x (node a publishes it; heard by b)"), std::string::npos);
  EXPECT_EQ(said("a/y", nodes), "");
  EXPECT_EQ(said("a/x", nodes, {"a/x"}), "");
  EXPECT_EQ(said("a/x", nodes, {}, "a"), "") << "in its place";
}

TEST(LiveTopics, InputsOfOneAuthorAreNotForStrangers) {
  EXPECT_NE(said("a/x", {node("b", {}, {"a/x"}, "a")}).find("taken from node a alone; heard by b"),
            std::string::npos);
  EXPECT_NE(said("a/x", {node("b", {}, {"a/x"}, "first")}).find("may lead to motion; heard by b"),
            std::string::npos);
  EXPECT_EQ(said("a/x", {node("b", {}, {"a/x"}, "player")}), "");
  EXPECT_EQ(said("a/x", {node("b", {}, {"a/x"})}), "") << "it moves nothing";
}

TEST(LiveTopics, BesideABridgeNothingIsPlayedThatSomebodyReads) {
  std::vector nodes = {node("b", {}, {"a/x"}), node("bridge", {}, {})};
  nodes[1].add_services()->set_service("bridge/enable");
  EXPECT_NE(said("a/x", nodes).find("a/x (node bridge moves actuators; heard by b)"),
            std::string::npos);
  EXPECT_EQ(said("a/y", nodes), "") << "nobody reads it";
  EXPECT_EQ(said("a/x", nodes, {"a/x"}), "");
}

}  // namespace
}  // namespace mimesis::tool
