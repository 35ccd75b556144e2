#include "tools/mimesis/log/view_setup.h"

#include <algorithm>

#include "common/runtime/param_reader.h"

namespace mimesis::tool {
namespace {

/// Reads the parameters of a node, or one group of them, as it wrote them into the log.
void read(const v1::NodeStart& start, const runtime::Yaml& section,
          const runtime::ParamReader::VisitParams& visit) {
  const runtime::Variables none(section);
  runtime::ParamReader reader(start.node(), &section, none, {});
  visit(reader);
  reader.finish();
}

runtime::Yaml parameters(const v1::NodeStart& start) {
  return runtime::parse_yaml(start.parameters(), start.node() + "/start");
}

const v1::NodeStart* start_of(const Setups& setups, const std::string& executable) {
  for (const auto& [node, start] : setups) {
    if (start.executable() == executable) return &start;
  }
  return nullptr;
}

std::optional<image::View> view_in(const v1::NodeStart& start) {
  const runtime::Yaml all = parameters(start);
  const runtime::Yaml* section = all.find("view");
  if (section == nullptr) return std::nullopt;
  image::View view;
  read(start, *section, [&](runtime::ParamVisitor& v) { view.visit(v); });
  return view;
}

}  // namespace

Setups read_setups(const std::vector<OpenLog>& logs) {
  Setups setups;
  for (const OpenLog& log : logs) {
    const auto wanted = [&](const log::Channel& channel) {
      const auto schema = log.summary.schemas.find(channel.schema_id);
      return schema != log.summary.schemas.end() && schema->second.name == "mimesis.v1.NodeStart";
    };
    log::IndexedReader reader(*log.source, log.summary, {.channel = wanted});
    while (const log::Message* message = reader.next()) {
      v1::NodeStart start;
      if (start.ParseFromArray(message->data.data(), static_cast<int>(message->data.size()))) {
        setups.emplace(start.node(), std::move(start));
      }
    }
  }
  return setups;
}

std::optional<SeenTopic> topic_of(const std::vector<OpenLog>& logs, const std::string& type,
                                  const std::string& preferred) {
  std::optional<SeenTopic> found;
  for (const OpenLog& log : logs) {
    for (const auto& [id, channel] : log.summary.channels) {
      const auto schema = log.summary.schemas.find(channel.schema_id);
      if (schema == log.summary.schemas.end() || schema->second.name != type) continue;
      const auto rank = [&](const std::string& topic) {
        return std::pair(topic != preferred, topic);
      };
      if (!found || rank(channel.topic) < rank(found->topic)) {
        found = {channel.topic, sender_of(channel)};
      }
    }
  }
  return found;
}

planner::PlannerParams planner_params(const Setups& setups) {
  planner::PlannerParams params;
  if (const v1::NodeStart* start = start_of(setups, "mimesis_planner")) {
    const runtime::Yaml all = parameters(*start);
    read(*start, all, [&](runtime::ParamVisitor& v) { params.visit(v); });
  }
  return params;
}

std::string robot_of(const Setups& setups, const std::string& node) {
  if (const auto it = setups.find(node); it != setups.end()) {
    const runtime::Yaml all = parameters(it->second);
    if (const runtime::Yaml* robot = all.find("robot")) return robot->text;
  }
  return planner_params(setups).robot;
}

std::optional<image::View> view_of(const Setups& setups, const SeenTopic& image) {
  for (const auto& [node, start] : setups) {
    const auto takes_it = [&](const v1::TopicInfo& input) { return input.topic() == image.topic; };
    if (!std::ranges::any_of(start.inputs(), takes_it)) continue;
    if (auto view = view_in(start)) return view;
  }
  const auto maker = setups.find(image.node);
  return maker == setups.end() ? std::nullopt : view_in(maker->second);
}

}  // namespace mimesis::tool
