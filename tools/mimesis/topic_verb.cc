#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "common/runtime/raw.h"
#include "common/runtime/suggest.h"
#include "tools/mimesis/number_check.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/topic_echo.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

struct Topic {
  std::string type;
  bool latched = false;
  std::set<std::string> publishers, subscribers;
};

/// What the nodes of a graph publish and listen to. Recorders and taps listen to everything: not
/// shown.
std::map<std::string, Topic> topics_of(const std::string& graph) {
  std::map<std::string, Topic> topics;
  for (const v1::NodeInfo& node : runtime::GraphView(graph).nodes()) {
    for (const v1::TopicInfo& out : node.outputs()) {
      Topic& topic = topics[out.topic()];
      topic.type = out.type();
      topic.latched = out.latched();
      topic.publishers.insert(node.name());
    }
    for (const v1::TopicInfo& in : node.inputs()) {
      if (in.topic().empty() || in.topic() == "*") continue;
      Topic& topic = topics[in.topic()];
      if (topic.type.empty()) topic.type = in.type();
      topic.subscribers.insert(node.name());
    }
  }
  return topics;
}

std::string joined(const std::set<std::string>& names) {
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ",") + name;
  return all;
}

int list_topics(const std::string& graph, bool json) {
  const auto topics = topics_of(graph);
  if (json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const auto& [name, topic] : topics) {
      list.push_back({{"topic", name},
                      {"type", topic.type},
                      {"latched", topic.latched},
                      {"publishers", topic.publishers},
                      {"subscribers", topic.subscribers}});
    }
    std::cout << list.dump() << '\n';
    return 0;
  }
  if (topics.empty()) {
    std::cerr << "graph '" << graph << "' has no topics\n";
    return 0;
  }
  Table table({"TOPIC", "TYPE", "PUBLISHERS", "SUBSCRIBERS"});
  for (const auto& [name, topic] : topics) {
    table.row({name, topic.type, joined(topic.publishers), joined(topic.subscribers)});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  return 0;
}

/// Tells on standard error that a topic is not there (yet).
void note_if_unknown(const std::string& graph, const std::string& topic) {
  const auto topics = topics_of(graph);
  if (topics.contains(topic)) return;
  std::vector<std::string> known;
  for (const auto& [name, ignored] : topics) known.push_back(name);
  std::cerr << "nobody publishes " << topic << " in graph '" << graph << "' yet"
            << runtime::did_you_mean(topic, known) << '\n';
}

struct CommonOptions {
  std::string graph;
  bool json = false;
};

}  // namespace

void add_topic(CLI::App& program, int& exit_code) {
  CLI::App* topic = program.add_subcommand("topic", "Shows topics and what is published on them");
  topic->require_subcommand(1);
  auto common = std::make_shared<CommonOptions>();
  const auto add_common = [common](CLI::App* verb) {
    verb->add_option("--graph", common->graph,
                     "Name of the graph (default: MIMESIS_GRAPH, or default)");
    verb->add_flag("--json", common->json, "Machine-readable output (tools/mimesis/README.md)");
  };
  const auto graph = [common] {
    return common->graph.empty() ? runtime::graph_name() : common->graph;
  };

  CLI::App* list = topic->add_subcommand("list", "Topics with their types and ends");
  add_common(list);
  list->footer("Examples:\n  mimesis topic list\n  mimesis topic list --json --graph demo");
  list->callback([=, &exit_code] { exit_code = list_topics(graph(), common->json); });

  auto echo_options = std::make_shared<EchoOptions>();
  CLI::App* echo = topic->add_subcommand("echo", "Prints messages as they come");
  echo->add_option("topic", echo_options->topic, "Name of the topic")->required();
  echo->add_flag("--once", echo_options->once, "One message, then end");
  echo->add_option("-n", echo_options->count, "Number of messages, then end")
      ->check(number_above_zero);
  echo->add_option("--field", echo_options->field,
                   "Only this field, such as header.seq or blobs.0.u_px");
  echo->add_flag("--reliable", echo_options->reliable,
                 "Lose none: the publisher waits with what does not fit");
  echo->add_option("--timeout", echo_options->timeout_s,
                   "Longest wait for a message [s]; then exit code 3")
      ->check(number_above_zero);
  add_common(echo);
  echo->footer(
      "Examples:\n  mimesis topic echo planner/status --once\n"
      "  mimesis topic echo bridge/arm --field position_rad --json -n 10");
  echo->callback([=, &exit_code] {
    note_if_unknown(graph(), echo_options->topic);
    exit_code = echo_topic(graph(), *echo_options, common->json);
  });

  auto hz_options = std::make_shared<HzOptions>();
  CLI::App* hz = topic->add_subcommand("hz", "Rate of a topic, once a second");
  hz->add_option("topic", hz_options->topic, "Name of the topic")->required();
  hz->add_option("-w,--window", hz_options->window, "Messages to look at")
      ->check(CLI::Range(2, 1'000'000));
  hz->add_option("-n", hz_options->reports, "Number of lines, then end")->check(number_above_zero);
  hz->add_option("--timeout", hz_options->timeout_s,
                 "Longest wait for a message [s]; then exit code 3")
      ->check(number_above_zero);
  add_common(hz);
  hz->footer(
      "Examples:\n  mimesis topic hz camera/image\n  mimesis topic hz bridge/arm -w 200 -n 1 "
      "--json");
  hz->callback([=, &exit_code] {
    note_if_unknown(graph(), hz_options->topic);
    exit_code = topic_rate(graph(), *hz_options, common->json);
  });
}

}  // namespace mimesis::tool
