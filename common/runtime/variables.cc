#include "common/runtime/variables.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include "common/error.h"
#include "common/runtime/suggest.h"

namespace mimesis::runtime {
namespace {

constexpr int kMaxDepth = 16;  // defaults may name other arguments, but not in a circle

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::string from_environment(const std::string& name, const std::string& variable,
                             const Place& place) {
  const char* found = std::getenv(name.c_str());
  if (found == nullptr) {
    throw ConfigError(to_string(place) + ": ${" + variable + "}: the environment has no " + name);
  }
  return found;
}

}  // namespace

std::pair<std::string, std::string> split_assignment(const std::string& assignment,
                                                     const std::string& option) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw ConfigError(option + ": '" + assignment + "' is not NAME=VALUE");
  }
  return {assignment.substr(0, equals), assignment.substr(equals + 1)};
}

void Variables::set_arg(const std::string& assignment) {
  auto [name, value] = split_assignment(assignment, "--arg");
  if (declared_ == nullptr || declared_->find(name) == nullptr) {
    const auto known = declared_ != nullptr ? declared_->keys() : std::vector<std::string>{};
    throw ConfigError("--arg: the file declares no argument '" + name + "'" +
                      did_you_mean(name, known));
  }
  args_[name] = std::move(value);
}

std::string Variables::expand(const Yaml& scalar, int depth) const {
  const std::string& text = scalar.text;
  std::string out;
  std::size_t at = 0;
  while (true) {
    const std::size_t begin = text.find("${", at);
    out.append(text, at, begin == std::string::npos ? std::string::npos : begin - at);
    if (begin == std::string::npos) return out;
    if (begin > at && text[begin - 1] == '$') {  // "$${": one of the two is already in `out`
      out += '{';
      at = begin + 2;
      continue;
    }
    Place place = scalar.place;
    if (place.line > 0) place.column += static_cast<int>(begin) + (scalar.quoted ? 1 : 0);
    const std::size_t end = text.find('}', begin);
    if (end == std::string::npos) throw ConfigError(to_string(place) + ": ${ without }");
    if (depth > kMaxDepth)
      throw ConfigError(to_string(place) + ": an argument's default names itself");
    out += value(text.substr(begin + 2, end - begin - 2), place, depth);
    at = end + 1;
  }
}

std::string Variables::value(const std::string& variable, const Place& place, int depth) const {
  const std::size_t colon = variable.find(':');
  const std::string kind = variable.substr(0, colon);
  const std::string name = colon == std::string::npos ? "" : variable.substr(colon + 1);
  if (kind == "env" && !name.empty()) return from_environment(name, variable, place);
  if (kind == "run" && !name.empty()) {
    const auto it = run_.find(name);
    return it != run_.end() ? it->second
                            : from_environment("MIMESIS_RUN_" + upper(name), variable, place);
  }
  if (kind != "arg" || name.empty()) {
    throw ConfigError(to_string(place) + ": ${" + variable +
                      "}: expected ${arg:NAME}, ${env:NAME} or ${run:NAME}");
  }
  if (const auto it = args_.find(name); it != args_.end()) return it->second;
  const Yaml* declaration = declared_ != nullptr ? declared_->find(name) : nullptr;
  if (declaration == nullptr) {
    const auto known = declared_ != nullptr ? declared_->keys() : std::vector<std::string>{};
    throw ConfigError(to_string(place) + ": no argument '" + name + "' is declared" +
                      did_you_mean(name, known));
  }
  const Yaml* fallback = declaration->find("default");
  if (fallback == nullptr || fallback->kind != Yaml::Kind::scalar) {
    throw ConfigError(to_string(place) + ": argument '" + name + "' has no default: give --arg " +
                      name + "=VALUE");
  }
  return expand(*fallback, depth + 1);
}

}  // namespace mimesis::runtime
