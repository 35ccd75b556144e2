#include "tools/mimesis/launch/result.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "tools/mimesis/message_json.h"

namespace mimesis::launch {
namespace {

using Json = nlohmann::ordered_json;

// Samples kept per topic: T is known soon after it has passed, this is seconds of a fast topic.
constexpr std::size_t kKept = 4096;

Json scaled(const Json& value, const ResultField& field) {
  if (!value.is_number() || (!field.scale && !field.digits)) return value;
  double number = value.get<double>() * field.scale.value_or(1.0);
  if (field.digits) {
    const double unit = std::pow(10.0, *field.digits);
    number = std::round(number * unit) / unit;
  }
  return number;
}

}  // namespace

ResultCollector::ResultCollector(const ResultSpec& spec) : spec_(spec) {
  paths_[spec.until.text];
  if (spec.success) paths_[spec.success->topic].push_back(*spec.success);
  for (const ResultField& field : spec.fields) paths_[field.from.topic].push_back(field.from);
}

void ResultCollector::add(const std::string& topic, Stamp stamp,
                          const google::protobuf::Message& message) {
  Sample sample{stamp, {}};
  for (const FieldPath& path : paths_.at(topic)) {
    try {
      sample.values[path.field] = tool::field_word(message, path.field);
    } catch (const ConfigError& e) {
      throw ConfigError(to_string(path.place) + ": " + e.what());
    }
  }
  std::deque<Sample>& kept = samples_[topic];
  kept.push_back(std::move(sample));
  if (kept.size() > kKept) kept.pop_front();
  if (topic == spec_.until.text && !end_) end_ = stamp;
}

bool ResultCollector::complete() const {
  if (!end_) return false;
  return std::all_of(paths_.begin(), paths_.end(), [&](const auto& entry) {
    if (entry.first == spec_.until.text) return true;
    const auto it = samples_.find(entry.first);
    return it != samples_.end() && it->second.back().stamp > *end_;
  });
}

Json ResultCollector::value(const FieldPath& path) const {
  const auto it = samples_.find(path.topic);
  if (it == samples_.end()) return nullptr;
  for (auto sample = it->second.rbegin(); sample != it->second.rend(); ++sample) {
    if (!end_ || sample->stamp <= *end_) return sample->values.at(path.field);
  }
  return nullptr;
}

std::string ResultCollector::success_name() const {
  for (const ResultField& field : spec_.fields) {
    if (spec_.success && field.from.topic == spec_.success->topic &&
        field.from.field == spec_.success->field) {
      return field.name;
    }
  }
  return "success";
}

bool ResultCollector::succeeded() const {
  return end_.has_value() && (!spec_.success || value(*spec_.success) == Json(true));
}

Json ResultCollector::line(const std::string& failure) const {
  Json line = Json::object();
  for (const ResultField& field : spec_.fields) line[field.name] = scaled(value(field.from), field);
  line[success_name()] = failure.empty() && succeeded();
  if (!failure.empty()) line["reason"] = failure;
  return line;
}

}  // namespace mimesis::launch
