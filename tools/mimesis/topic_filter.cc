#include "tools/mimesis/topic_filter.h"

#include <algorithm>
#include <array>

#include "common/error.h"

namespace mimesis::tool {
namespace {

bool matches(const regex_t& regex, const std::string& topic) {
  return regexec(&regex, topic.c_str(), 0, nullptr, 0) == 0;
}

}  // namespace

TopicFilter::TopicFilter(std::vector<std::string> topics, const std::string& include,
                         const std::string& exclude)
    : topics_(std::move(topics)),
      include_(compile("--regex", include)),
      exclude_(compile("--exclude", exclude)) {}

TopicFilter::Regex TopicFilter::compile(const std::string& option, const std::string& expression) {
  if (expression.empty()) return nullptr;
  auto regex = std::make_unique<regex_t>();
  const std::string whole = "^(" + expression + ")$";
  if (const int error = regcomp(regex.get(), whole.c_str(), REG_EXTENDED | REG_NOSUB); error != 0) {
    std::array<char, 200> why{};
    regerror(error, regex.get(), why.data(), why.size());
    throw ConfigError(option + " '" + expression + "' is no regular expression: " + why.data());
  }
  return {regex.release(), [](const regex_t* r) {
            regfree(const_cast<regex_t*>(r));
            delete r;
          }};
}

bool TopicFilter::operator()(const std::string& topic) const {
  if (exclude_ && matches(*exclude_, topic)) return false;
  if (topics_.empty() && !include_) return true;
  return std::ranges::find(topics_, topic) != topics_.end() ||
         (include_ && matches(*include_, topic));
}

}  // namespace mimesis::tool
