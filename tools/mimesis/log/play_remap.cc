#include "tools/mimesis/log/play_remap.h"

#include <algorithm>
#include <set>

#include "common/error.h"

namespace mimesis::tool {
namespace {

constexpr std::string_view kBecomes = ":=";

std::string without_root(std::string prefix) { return prefix == "/" ? "" : prefix; }

}  // namespace

PlayRemap::PlayRemap(const std::vector<std::string>& rules) {
  for (const std::string& text : rules) {
    const std::size_t at = text.find(kBecomes);
    const std::string from = text.substr(0, at);
    const std::string to = at == std::string::npos ? "" : text.substr(at + kBecomes.size());
    if (from.empty() || to.empty() || from.ends_with('/') != to.ends_with('/')) {
      throw ConfigError("--remap '" + text + "': expected OLD:=NEW, or OLD/:=NEW/ for a prefix");
    }
    const bool prefix = from.ends_with('/');
    const Rule rule{text, prefix ? without_root(from) : from, prefix ? without_root(to) : to,
                    prefix};
    for (const Rule& other : rules_) {
      if (other.from == rule.from && other.prefix == rule.prefix) {
        throw ConfigError("--remap '" + text + "': '" + other.text + "' says otherwise");
      }
    }
    rules_.push_back(rule);
  }
}

const PlayRemap::Rule* PlayRemap::rule_for(const std::string& topic) const {
  const Rule* best = nullptr;
  for (const Rule& rule : rules_) {
    if (rule.prefix ? !topic.starts_with(rule.from) : topic != rule.from) continue;
    if (!rule.prefix) return &rule;
    if (best == nullptr || best->from.size() < rule.from.size()) best = &rule;
  }
  return best;
}

std::string PlayRemap::operator()(const std::string& topic) const {
  const Rule* rule = rule_for(topic);
  return rule == nullptr ? topic : rule->to + topic.substr(rule->from.size());
}

std::vector<std::string> PlayRemap::unused(const std::vector<std::string>& topics) const {
  std::set<const Rule*> used;
  for (const std::string& topic : topics) used.insert(rule_for(topic));
  std::vector<std::string> rest;
  for (const Rule& rule : rules_) {
    if (!used.contains(&rule)) rest.push_back(rule.text);
  }
  return rest;
}

}  // namespace mimesis::tool
