#include "nodes/crowd/scenario_file/scenario_file.h"

#include "common/error.h"
#include "common/runtime/param_source.h"

namespace mimesis::crowd {

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
  const bool bare = name.find_first_of("./") == std::string::npos;
  return runtime::find_project_file("launch", bare ? "crowd/" + name + ".yaml" : name);
}

}  // namespace mimesis::crowd
