#include <google/protobuf/descriptor.h>

#include <set>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/log/diff.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/log_scan.h"

namespace mimesis::tool {
namespace {

constexpr std::string_view kEveryTopic = "*.";

/// "blobs[2].u_px[*]" -> "blobs.2.u_px", as DiffRules names it.
std::string rule_path(const std::string& path) {
  std::string out;
  for (const char c : path) {
    if (c == '[') out += '.';
    if (c != '[' && c != ']') out += c;
  }
  for (std::size_t at; (at = out.find(".*")) != std::string::npos;) out.erase(at, 2);
  return out;
}

/// The fields that options name, by topic.
class RuleReader {
 public:
  RuleReader(const OpenLog& a, const OpenLog& b) {
    for (const OpenLog* log : {&a, &b}) {
      for (const auto& [id, channel] : log->summary.channels) {
        topics_.insert(channel.topic);
        const auto schema = log->summary.schemas.find(channel.schema_id);
        if (schema == log->summary.schemas.end()) continue;
        if (const auto* type = decoder_.type(&schema->second)) {
          types_.emplace(channel.topic, type->GetDescriptor());
        }
      }
    }
  }

  /// Calls `take(topic, path)` for what `text` names.
  template <class Take>
  void field(const std::string& text, const Take& take) {
    if (text.starts_with(kEveryTopic)) return every_topic(text.substr(kEveryTopic.size()), take);
    const FieldQuery query = parse_field_query(text, {topics_.begin(), topics_.end()});
    if (query.path.empty()) throw ConfigError(text + ": expected TOPIC.FIELD; see also --exclude");
    const auto [first, last] = types_.equal_range(query.topic);
    for (auto type = first; type != last; ++type) FieldColumns(query).check(*type->second);
    take(query.topic, rule_path(query.path));
  }

 private:
  template <class Take>
  void every_topic(const std::string& path, const Take& take) {
    bool found = false;
    std::optional<ConfigError> why;
    for (const auto& [topic, type] : types_) {
      try {
        FieldColumns({topic, path}).check(*type);
        found = true;
        take(topic, rule_path(path));
      } catch (const ConfigError& error) {
        why = error;
      }
    }
    if (!found && why) throw ConfigError(*why);
  }

  LogDecoder decoder_;
  std::set<std::string> topics_;
  std::multimap<std::string, const google::protobuf::Descriptor*> types_;  ///< by topic
};

}  // namespace

std::map<std::string, DiffRules> diff_rules(const DiffOptions& options, const OpenLog& a,
                                            const OpenLog& b) {
  RuleReader reader(a, b);
  std::map<std::string, DiffRules> rules;
  for (const std::string& text : options.field_tolerances) {
    const std::size_t equals = text.rfind('=');
    const auto value = equals == std::string::npos
                           ? std::nullopt
                           : runtime::to_double(std::string_view(text).substr(equals + 1));
    if (!value || *value < 0.0) {
      throw ConfigError("--field-tolerance " + text + ": expected TOPIC.FIELD=NUMBER, 0 or more");
    }
    reader.field(text.substr(0, equals), [&](const std::string& topic, const std::string& path) {
      rules[topic].field_tolerance[path] = *value;
    });
  }
  for (const std::string& text : options.ignore) {
    reader.field(text, [&](const std::string& topic, const std::string& path) {
      rules[topic].ignore.insert(path);
    });
  }
  for (const OpenLog* log : {&a, &b}) {
    for (const auto& [id, channel] : log->summary.channels) {
      rules[channel.topic].tolerance = options.tolerance;
    }
  }
  return rules;
}

}  // namespace mimesis::tool
