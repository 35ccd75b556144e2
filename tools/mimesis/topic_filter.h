#pragma once
#include <regex.h>

#include <memory>
#include <string>
#include <vector>

namespace mimesis::tool {

/// Which topics a verb is about: those named or matched, all if neither is given, less those
/// excluded.
class TopicFilter {
 public:
  /// `include`, `exclude`: extended regular expressions (POSIX) for the whole topic, empty: none.
  /// @throws ConfigError if one of them is invalid.
  TopicFilter(std::vector<std::string> topics, const std::string& include,
              const std::string& exclude);
  bool operator()(const std::string& topic) const;
  const std::vector<std::string>& topics() const { return topics_; }  ///< those given by name

 private:
  using Regex =
      std::shared_ptr<const regex_t>;  // shared by copies: filters travel in std::function
  static Regex compile(const std::string& option, const std::string& expression);

  std::vector<std::string> topics_;
  Regex include_, exclude_;
};

}  // namespace mimesis::tool
