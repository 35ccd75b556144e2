#pragma once
#include <regex.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "common/error.h"

namespace mimesis::tool {

/// Which topics a verb is about: those named or matched, all if neither is given, less those
/// excluded.
class TopicFilter {
 public:
  /// `include`, `exclude`: extended regular expressions (POSIX) for the whole topic, empty: none.
  /// `option`: that of `include`, for messages.
  /// @throws ConfigError if one of them is invalid.
  TopicFilter(std::vector<std::string> topics, const std::string& include,
              const std::string& exclude, const std::string& option = "--regex")
      : topics_(std::move(topics)),
        include_(compile(option, include)),
        exclude_(compile("--exclude", exclude)) {}
  bool operator()(const std::string& topic) const {
    if (exclude_ && matches(*exclude_, topic)) return false;
    if (topics_.empty() && !include_) return true;
    return std::ranges::find(topics_, topic) != topics_.end() ||
           (include_ && matches(*include_, topic));
  }
  const std::vector<std::string>& topics() const { return topics_; }  ///< those given by name

 private:
  using Regex =
      std::shared_ptr<const regex_t>;  // shared by copies: filters travel in std::function
  static bool matches(const regex_t& regex, const std::string& topic) {
    return regexec(&regex, topic.c_str(), 0, nullptr, 0) == 0;
  }
  static Regex compile(const std::string& option, const std::string& expression) {
    if (expression.empty()) return nullptr;
    auto regex = std::make_unique<regex_t>();
    const std::string whole = "^(" + expression + ")$";
    if (const int error = regcomp(regex.get(), whole.c_str(), REG_EXTENDED | REG_NOSUB);
        error != 0) {
      std::array<char, 200> why{};
      regerror(error, regex.get(), why.data(), why.size());
      throw ConfigError(option + " '" + expression + "' is no regular expression: " + why.data());
    }
    return {regex.release(), [](const regex_t* r) {
              regfree(const_cast<regex_t*>(r));
              delete r;
            }};
  }

  std::vector<std::string> topics_;
  Regex include_, exclude_;
};

}  // namespace mimesis::tool
