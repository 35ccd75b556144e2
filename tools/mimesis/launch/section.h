#pragma once
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/yaml_document.h"

namespace mimesis::launch {

/// All mistakes of a launch file: a check continues after the first one.
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

/// Text with the place it was written at.
struct Text {
  std::string text;
  runtime::Place place;
};

/// Reads one map of a launch file: each value by its expected type, with variables replaced. Call
/// `finish` after reading all known keys; keys not read are unknown.
class Section {
 public:
  Section(const runtime::Yaml& map, const runtime::Variables& variables, Mistakes& mistakes);

  bool has(const std::string& key) const { return map_.find(key) != nullptr; }
  /// Value of `key`, null if absent. The key counts as known.
  const runtime::Yaml* take(const std::string& key);

  // Empty if the key is absent or, with a mistake noted, if the value is wrong.
  std::optional<Text> text(const std::string& key);
  std::optional<std::string> choice(const std::string& key,
                                    const std::vector<std::string>& choices);
  std::optional<bool> flag(const std::string& key);  ///< also "!true", for `if: "!${arg:sim}"`
  std::optional<int> whole(const std::string& key, int lo, int hi);
  std::optional<double> number(const std::string& key, double lo, double hi);
  std::optional<std::chrono::nanoseconds> duration(const std::string& key);
  std::vector<Text> texts(const std::string& key);  ///< a list
  std::vector<int> wholes(const std::string& key, int lo, int hi);

  /// A nested section; nothing happens if it is absent.
  void section(const std::string& key, const std::function<void(Section&)>& read);
  /// Each entry of a map with free keys.
  void entries(const std::string& key,
               const std::function<void(const Text& name, const runtime::Yaml& value)>& read);

  void finish();

  std::optional<Text> expand(const runtime::Yaml& value, const std::string& expected);
  Mistakes& mistakes() { return mistakes_; }
  const runtime::Variables& variables() const { return variables_; }
  const runtime::Place& place() const { return map_.place; }

 private:
  bool expect(const runtime::Yaml& value, runtime::Yaml::Kind kind, const std::string& expected);

  const runtime::Yaml& map_;
  const runtime::Variables& variables_;
  Mistakes& mistakes_;
  std::vector<std::string> known_;
};

}  // namespace mimesis::launch
