#include "nodes/crowd/scenario_file/scenario_file.h"

#include <filesystem>

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
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (fs::is_regular_file(name, ignored)) return name;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  std::string searched;
  for (const fs::path& root :
       {fs::path(MIMESIS_SOURCE_DIR), program.parent_path().parent_path() / "share/mimesis"}) {
    for (const fs::path& folder : {root / "launch", root / "launch/crowd"}) {
      for (const fs::path& file : {folder / name, folder / (name + ".yaml")}) {
        if (fs::is_regular_file(file, ignored)) return file.string();
      }
      searched += ", " + folder.string();
    }
  }
  throw ConfigError(name + ": no such scenario file here" + searched);
}

}  // namespace mimesis::crowd
