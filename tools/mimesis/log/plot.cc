#include "tools/mimesis/log/plot.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "common/error.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/field_text.h"
#include "tools/mimesis/message_json.h"

namespace mimesis::tool {
namespace {

using google::protobuf::FieldDescriptor;

constexpr double kSecond = 1e9;              // of log times, in ns
constexpr std::size_t kColumnsPerPixel = 2;  // a vector picture can be enlarged a little

/// "planning" of TASK_STATE_PLANNING.
std::string word(const FieldColumns::Value& v, int number) {
  if (v.field.cpp_type() == FieldDescriptor::CPPTYPE_BOOL) return number == 0 ? "false" : "true";
  const auto* value = v.field.enum_type()->FindValueByNumber(number);
  if (value == nullptr) return std::to_string(number);
  const auto text = short_word(*value);
  return text.is_null() ? "unspecified" : text.get<std::string>();
}

class CurveReader {
 public:
  CurveReader(const std::vector<OpenLog>& logs, const PlotOptions& options)
      : logs_(logs),
        options_(options),
        span_(span_of(logs)),
        times_(resolve(options.range, span_)) {
    const auto topics = topics_of(logs);
    for (const std::string& text : options.fields) {
      queries_.emplace_back(parse_field_query(text, topics));
      check(text, queries_.back());
    }
    start_s_ = seconds(std::max(times_.start, span_.start_ns));
    end_s_ = seconds(std::min(times_.end, span_.end_ns));
  }

  std::uint64_t read() {
    const auto wanted = [this](const log::Channel& c) {
      return std::ranges::find(queries_, c.topic, &FieldColumns::topic) != queries_.end();
    };
    std::uint64_t failures = 0;
    failures +=
        scan_logs(logs_, {wanted, times_}, "plot", [&](const log::MergedReader::Item& item) {
          if (!take(item)) ++failures;
        });
    return failures;
  }

  std::vector<Curve> curves() {
    std::vector<Curve> all;
    for (auto& [key, state] : states_) all.push_back(std::move(state.curve));
    return all;
  }

 private:
  /// Query, node, element.
  using Key = std::tuple<std::size_t, std::string, FieldColumns::Key>;
  struct State {
    Curve curve;
    bool started = false;
    double stamp_s = 0.0, value = 0.0;  ///< of the sample before
  };

  void check(const std::string& text, FieldColumns& query) {
    bool numbers = false;
    for (const OpenLog& log : logs_) {
      for (const auto& [id, channel] : log.summary.channels) {
        if (channel.topic != query.topic()) continue;
        nodes_[channel.topic].insert(sender_of(channel));
        const auto& type = decoder_.type(log, channel);
        numbers = query.has_numbers(*type.GetDescriptor()) || numbers;
      }
    }
    if (!numbers) throw ConfigError(text + ": expected a number, a boolean or an enum to plot");
  }

  bool take(const log::MergedReader::Item& item) {
    const auto* message = decoder_.decode(item);
    if (message == nullptr) {
      std::cerr << fmt::format("{}: the message at log time {} ns is not a valid {}\n",
                               item.channel->topic, item.message->log_time, item.schema->name);
      return false;
    }
    const std::string node = sender_of(*item.channel);
    for (std::size_t q = 0; q < queries_.size(); ++q) {
      if (queries_[q].topic() != item.channel->topic) continue;
      queries_[q].visit(*message, [&](const FieldColumns::Key& key, const FieldColumns::Value& v) {
        if (is_number(v.field)) sample(q, node, key, v, *item.message);
      });
    }
    return true;
  }

  void sample(std::size_t q, const std::string& node, const FieldColumns::Key& key,
              const FieldColumns::Value& v, const log::Message& m) {
    auto it = states_.find({q, node, key});
    if (it == states_.end()) it = states_.emplace(Key{q, node, key}, make(q, node, key, v)).first;
    State& state = it->second;
    Curve& curve = state.curve;
    double value = field_number(v.message, v.field, v.index);
    if (curve.discrete) {
      curve.words.try_emplace(static_cast<int>(value), word(v, static_cast<int>(value)));
    }
    if (options_.derivative) {
      // By the sender's stamps: the receipt jitters.
      const double stamp_s = seconds(m.publish_time), change = value - state.value;
      const double step_s = stamp_s - state.stamp_s;
      const bool first = !state.started;
      state.started = true;
      state.stamp_s = stamp_s;
      state.value = value;
      if (first || step_s <= 0.0) return;
      value = change / step_s;
    }
    curve.thinning.add({seconds(m.log_time), value});
    ++curve.samples;
    if (!std::isfinite(value)) return;
    curve.least = std::min(curve.least, value);
    curve.greatest = std::max(curve.greatest, value);
  }

  State make(std::size_t q, const std::string& node, const FieldColumns::Key& key,
             const FieldColumns::Value& v) const {
    const std::string& topic = queries_[q].topic();
    std::string label = topic + "." + queries_[q].name(key);
    if (nodes_.at(topic).size() > 1) label += " (" + node + ")";
    const bool discrete =
        !options_.derivative && (v.field.cpp_type() == FieldDescriptor::CPPTYPE_ENUM ||
                                 v.field.cpp_type() == FieldDescriptor::CPPTYPE_BOOL);
    Quantity quantity = quantity_of(v.field.name());
    if (options_.derivative) quantity.unit = derivative_unit(quantity.unit);
    const auto columns = static_cast<std::size_t>(options_.width_px) * kColumnsPerPixel;
    return {{q, label, quantity, {}, discrete, CurveThinning(start_s_, end_s_, columns)}};
  }

  /// From the start of the log.
  double seconds(std::uint64_t time_ns) const {
    return time_ns >= span_.start_ns ? static_cast<double>(time_ns - span_.start_ns) / kSecond
                                     : -static_cast<double>(span_.start_ns - time_ns) / kSecond;
  }

  const std::vector<OpenLog>& logs_;
  const PlotOptions& options_;
  Span span_;
  LogTimes times_;
  double start_s_ = 0.0, end_s_ = 0.0;
  LogDecoder decoder_;
  std::vector<FieldColumns> queries_;
  std::map<std::string, std::set<std::string>> nodes_;  ///< by topic
  std::map<Key, State> states_;
};

nlohmann::ordered_json number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

}  // namespace

std::vector<Curve> read_curves(const std::vector<OpenLog>& logs, const PlotOptions& options,
                               std::uint64_t& failures) {
  CurveReader reader(logs, options);
  failures += reader.read();
  return reader.curves();
}

int log_plot(const std::vector<std::string>& files, const PlotOptions& options, bool json) {
  const auto logs = open_logs(files);
  if (!logs) {
    std::cerr << logs.error().line << '\n';
    return logs.error().exit_code;
  }
  std::uint64_t failures = 0;
  const auto curves = read_curves(*logs, options, failures);
  if (curves.empty()) {
    std::cerr << "nothing to plot: no messages in this part of the log\n";
    return 3;
  }
  try {
    draw_curves(curves, options);
  } catch (const std::runtime_error& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  std::uint64_t samples = 0;
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Curve& c : curves) {
    samples += c.samples;
    list.push_back({{"field", c.label},
                    {"unit", c.quantity.unit},
                    {"samples", c.samples},
                    {"min", number(c.least)},
                    {"max", number(c.greatest)}});
  }
  if (json) {
    std::cout << nlohmann::ordered_json{{"file", options.output}, {"curves", list}}.dump() << '\n';
  } else {
    std::cerr << fmt::format("{}: {} curves of {} samples\n", options.output, curves.size(),
                             samples);
  }
  return failures == 0 ? 0 : 1;
}

}  // namespace mimesis::tool
