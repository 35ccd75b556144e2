#pragma once
#include <fstream>
#include <string>

#include "common/testing/temporary_folder.h"
#include "tools/mimesis/launch/graph_file.h"

namespace mimesis::launch {

/// A folder for one test, removed with all in it.
class TemporaryFolder : public testing::TemporaryFolder {
 public:
  /// Writes a file and returns its path.
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(*this / name) << text;
    return *this / name;
  }
  std::string read(const std::string& name) const {
    std::ifstream in(*this / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

/// Reads `text` as a launch file; its mistakes are in `mistakes` with "@" for the file's path.
inline GraphFile read_text(const std::string& text, std::vector<std::string>& mistakes,
                           const std::vector<std::string>& args = {}) {
  const TemporaryFolder folder;
  const std::string file = folder.write("g.yaml", text);
  Mistakes found;
  GraphFile graph = read_graph_file(file, args, "/log", found);
  for (std::string line : found.lines()) {
    if (line.starts_with(file)) line.replace(0, file.size(), "@");
    mistakes.push_back(line);
  }
  return graph;
}

inline GraphFile read_text(const std::string& text) {
  std::vector<std::string> mistakes;
  GraphFile graph = read_text(text, mistakes);
  if (!mistakes.empty()) throw std::runtime_error(mistakes.front());
  return graph;
}

}  // namespace mimesis::launch
