#include "nodes/crowd/scenario_file/scenario_file.h"

#include <algorithm>
#include <filesystem>

#include "common/error.h"
#include "common/runtime/param_source.h"

namespace mimesis::crowd {
namespace {

/// Names of the scenarios in a folder.
std::string known(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

Scenario read_scenario(const std::string& file, const std::vector<std::string>& sets) {
  const runtime::ParamSource source(file, {}, sets);
  Scenario scenario;
  source.read("", [&](runtime::ParamVisitor& v) { visit(v, scenario); });
  std::string lines;
  for (const Fault& fault : faults(scenario)) {
    lines += (lines.empty() ? "" : "\n") + to_string(source.place_of(fault.path)) + ": " +
             fault.path + ": " + fault.what;
  }
  if (!lines.empty()) throw ConfigError(lines);
  return scenario;
}

std::string find_scenario(const std::string& name) {
  if (name.find_first_of("./") != std::string::npos) {
    return runtime::find_project_file("launch", name);
  }
  const std::filesystem::path folder =
      std::filesystem::path(runtime::find_project_file("launch", "crowd/README.md")).parent_path();
  const std::filesystem::path file = folder / (name + ".yaml");
  if (std::filesystem::exists(file)) return file.string();
  throw ConfigError("scenario: there is no '" + name + "', expected " + known(folder) +
                    ", or a file");
}

}  // namespace mimesis::crowd
