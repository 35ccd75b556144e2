#pragma once
#include <optional>
#include <regex>
#include <string>
#include <vector>

namespace mimesis::tool {

/// Which topics a verb is about: those named or matched, all if neither is given, less those
/// excluded.
class TopicFilter {
 public:
  /// `include`, `exclude`: regular expressions (ECMAScript) for the whole topic, empty: none.
  /// @throws ConfigError if one of them is none.
  TopicFilter(std::vector<std::string> topics, const std::string& include,
              const std::string& exclude);
  bool operator()(const std::string& topic) const;
  const std::vector<std::string>& topics() const { return topics_; }  ///< those given by name

 private:
  std::vector<std::string> topics_;
  std::optional<std::regex> include_, exclude_;
};

}  // namespace mimesis::tool
