#include "tools/mimesis/launch/file_help.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tools/mimesis/launch/graph_file.h"

namespace mimesis::launch {
namespace {

using Json = nlohmann::ordered_json;

/// The lines with # before the first one without.
std::string head_comment(const std::string& file) {
  std::ifstream in(file);
  std::string text;
  for (std::string line; std::getline(in, line) && line.starts_with('#');)
    text += line.substr(line.starts_with("# ") ? 2 : 1) + "\n";
  return text;
}

/// Variables stay as they are written: they have other values in each run.
Json argument(const runtime::Yaml::Entry& declared) {
  const auto text = [&](const char* key) {
    const runtime::Yaml* value = declared.value.find(key);
    return value != nullptr && value->kind == runtime::Yaml::Kind::scalar ? Json(value->text)
                                                                          : Json(nullptr);
  };
  Json implies = Json::object();
  if (const runtime::Yaml* implied = declared.value.find("implies")) {
    for (const auto& entry : implied->entries) implies[entry.key] = entry.value.text;
  }
  const Json type = text("type");
  return {{"name", declared.key},
          {"type", type.is_null() ? Json("string") : type},
          {"default", text("default")},
          {"help", text("help")},
          {"implies", implies}};
}

Json node_json(const NodeSpec& node, bool enabled) {
  return {{"name", node.name.text},
          {"exec", node.exec.text},
          {"host", node.host ? Json(node.host->text) : Json(nullptr)},
          {"enabled", enabled},
          {"file", node.name.place.file}};
}

std::string shown_default(const Json& arg) {
  return arg["default"].is_null() ? "(needed)" : arg["default"].get<std::string>();
}

/// One line each; the help of those with a long default is out of its column.
std::string argument_lines(const Json& args) {
  constexpr std::size_t kWidest = 24;
  std::size_t name = 0, fallback = 0;
  for (const Json& arg : args) {
    name = std::max(name, std::min(kWidest, arg["name"].get<std::string>().size()));
    fallback = std::max(fallback, std::min(kWidest, shown_default(arg).size()));
  }
  std::string text;
  for (const Json& arg : args) {
    std::string line =
        fmt::format("  {:<{}}  {:<8}  {:<{}}  {}", arg["name"].get<std::string>(), name,
                    arg["type"].get<std::string>(), shown_default(arg), fallback,
                    arg["help"].is_null() ? "" : arg["help"].get<std::string>());
    std::string implied;
    for (const auto& [other, value] : arg["implies"].items())
      implied += fmt::format(" {}={}", other, value.get<std::string>());
    if (!implied.empty())
      line += fmt::format("\n{:<{}}true implies{}", "", name + fallback + 16, implied);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

}  // namespace

std::string file_help(const std::string& file, const std::vector<std::string>& args, bool json) {
  const runtime::Yaml document = runtime::read_yaml(file);
  Mistakes ignored;  // --check is for them
  const GraphFile graph = read_graph_file(file, args, "${run:log}", ignored);
  Json help{{"file", file},
            {"about", head_comment(file)},
            {"args", Json::array()},
            {"nodes", Json::array()}};
  if (const runtime::Yaml* declared = document.find("args")) {
    for (const auto& entry : declared->entries) help["args"].push_back(argument(entry));
  }
  for (const NodeSpec& node : graph.nodes) help["nodes"].push_back(node_json(node, true));
  for (const NodeSpec& node : graph.disabled) help["nodes"].push_back(node_json(node, false));
  if (json) return help.dump() + "\n";

  std::string text = fmt::format("{}\n{}", file, help["about"].get<std::string>());
  if (!help["args"].empty()) text += "\nArguments (--arg NAME=VALUE; type, default):\n";
  text += argument_lines(help["args"]);
  text += "\nNodes:\n";
  for (const Json& node : help["nodes"]) {
    text += fmt::format("  {:<22} {}", node["name"].get<std::string>(),
                        node["exec"].get<std::string>());
    if (!node["host"].is_null()) text += " on " + node["host"].get<std::string>();
    text += node["enabled"] ? "\n" : " (switched off)\n";
  }
  return text + "\nOptions of every launch: mimesis launch --help\n";
}

}  // namespace mimesis::launch
