#pragma once
#include <string>
#include <vector>

#include "common/runtime/yaml_document.h"

namespace mimesis::launch {

/// All that is wrong with a launch file: a check goes on after the first mistake.
class Mistakes {
 public:
  void add(const runtime::Place& place, const std::string& what);
  /// A line that has its place already (from a ConfigError, or from a node's own check).
  void add_line(const runtime::Place& near, const std::string& line);
  bool empty() const { return all_.empty(); }
  /// "file:line:col: what", in the order of the file, each once.
  std::vector<std::string> lines() const;

 private:
  struct Mistake {
    int line, column;
    std::string text;
  };
  std::vector<Mistake> all_;
};

}  // namespace mimesis::launch
