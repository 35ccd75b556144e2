#include "tools/mimesis/topic_filter.h"

#include <algorithm>

#include "common/error.h"

namespace mimesis::tool {
namespace {

std::optional<std::regex> compile(const std::string& option, const std::string& expression) {
  if (expression.empty()) return std::nullopt;
  try {
    return std::regex(expression);
  } catch (const std::regex_error& e) {
    throw ConfigError(option + " '" + expression + "' is no regular expression: " + e.what());
  }
}

}  // namespace

TopicFilter::TopicFilter(std::vector<std::string> topics, const std::string& include,
                         const std::string& exclude)
    : topics_(std::move(topics)),
      include_(compile("--regex", include)),
      exclude_(compile("--exclude", exclude)) {}

bool TopicFilter::operator()(const std::string& topic) const {
  if (exclude_ && std::regex_match(topic, *exclude_)) return false;
  if (topics_.empty() && !include_) return true;
  return std::ranges::find(topics_, topic) != topics_.end() ||
         (include_ && std::regex_match(topic, *include_));
}

}  // namespace mimesis::tool
