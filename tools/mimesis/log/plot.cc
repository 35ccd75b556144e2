#include "tools/mimesis/log/plot.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <set>

#include "common/error.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/field_text.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/message_json.h"

namespace mimesis::tool {
namespace {

struct WireUnit {
  std::string_view suffix, text;
};
/// The closed list of proto/README.md; longer ones first, for they end like shorter ones.
constexpr WireUnit kUnits[] = {
    {"_rad_s2", "rad/s²"}, {"_rad_s", "rad/s"}, {"_m_s2", "m/s²"}, {"_m_s", "m/s"},
    {"_n_m", "N·m"},       {"_1_s", "1/s"},     {"_rad", "rad"},   {"_px", "px"},
    {"_hz", "Hz"},         {"_kg", "kg"},       {"_ns", "ns"},     {"_m", "m"},
    {"_s", "s"},           {"_n", "N"},         {"_v", "V"},       {"_a", "A"}};

using google::protobuf::FieldDescriptor;

constexpr double kNanosecondsOfPlot = 1e9;   // of log times, in ns
constexpr std::size_t kColumnsPerPixel = 2;  // a vector picture can be enlarged a little

/// "planning" of TASK_STATE_PLANNING.
std::string value_word(const FieldColumns::Value& v, int number) {
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
    const log::Selection selection{wanted, times_.start, times_.end};
    failures += scan_logs(logs_, selection, "plot", [&](const Item& item) {
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
    for (const OpenChannel& c : channels_of(logs_)) {
      if (c.channel->topic != query.topic()) continue;
      nodes_[c.channel->topic].insert(sender_of(*c.channel));
      numbers = query.has_numbers(decoder_.type(c)) || numbers;
    }
    if (!numbers) throw ConfigError(text + ": expected a number, a boolean or an enum to plot");
  }

  bool take(const Item& item) {
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
      curve.words.try_emplace(static_cast<int>(value), value_word(v, static_cast<int>(value)));
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
    return time_ns >= span_.start_ns
               ? static_cast<double>(time_ns - span_.start_ns) / kNanosecondsOfPlot
               : -static_cast<double>(span_.start_ns - time_ns) / kNanosecondsOfPlot;
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

nlohmann::ordered_json finite_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

int plot_files(const std::vector<std::string>& files, const PlotOptions& options, bool json) {
  const auto logs = opened(files);
  std::uint64_t failures = 0;
  const auto curves = read_curves(logs, options, failures);
  if (curves.empty()) throw VerbEnd{"nothing to plot: no messages in this part of the log", 3};
  try {
    draw_curves(curves, options);
  } catch (const ConfigError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw VerbEnd{error.what(), 1};
  }
  std::uint64_t samples = 0;
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Curve& c : curves) {
    samples += c.samples;
    list.push_back({{"field", c.label},
                    {"unit", c.quantity.unit},
                    {"samples", c.samples},
                    {"min", finite_or_null(c.least)},
                    {"max", finite_or_null(c.greatest)}});
  }
  if (json) {
    print_json({{"file", options.output}, {"curves", list}});
  } else {
    std::cerr << fmt::format("{}: {} curves of {} samples\n", options.output, curves.size(),
                             samples);
  }
  return failures == 0 ? 0 : 1;
}

struct PlotChoice {
  std::vector<std::string> words;  ///< files, then fields
  PlotOptions plot;
  std::string style = "lines";
  bool json = false;
};

int run_plot(PlotChoice& o) {
  const std::string extension = std::filesystem::path(o.plot.output).extension().string();
  if (extension != ".png" && extension != ".svg") {
    throw ConfigError("-o " + o.plot.output + ": expected a name that ends in .png or .svg");
  }
  std::vector<std::string> files;
  for (const std::string& word : o.words) {
    std::error_code ignored;
    const bool is_file = word.ends_with(".mcap") || std::filesystem::exists(word, ignored);
    (o.plot.fields.empty() && is_file ? files : o.plot.fields).push_back(word);
  }
  if (files.empty() || o.plot.fields.empty()) {
    throw ConfigError("expected FILE... TOPIC.FIELD..., as in run.mcap bridge/arm.position_rad[*]");
  }
  static const std::map<std::string, PlotStyle> kStyles{
      {"lines", PlotStyle::lines}, {"steps", PlotStyle::steps}, {"dots", PlotStyle::dots}};
  o.plot.style = kStyles.at(o.style);
  return plot_files(files, o.plot, o.json);
}

}  // namespace

Quantity quantity_of(const std::string& field) {
  Quantity q{field, ""};
  for (const WireUnit& unit : kUnits) {
    if (!field.ends_with(unit.suffix) || field.size() == unit.suffix.size()) continue;
    q = {field.substr(0, field.size() - unit.suffix.size()), std::string(unit.text)};
    break;
  }
  std::ranges::replace(q.name, '_', ' ');
  return q;
}

std::string derivative_unit(const std::string& unit) {
  if (unit.empty()) return "1/s";
  if (unit == "s") return "";
  if (unit.ends_with("/s")) return unit + "²";
  return unit + "/s";
}

CurveThinning::CurveThinning(double start_s, double end_s, std::size_t columns)
    : start_s_(start_s),
      columns_per_s_(end_s > start_s ? static_cast<double>(columns) / (end_s - start_s) : 0.0),
      columns_(columns) {}

void CurveThinning::add(const Point& point) {
  const double at = std::floor((point.time_s - start_s_) * columns_per_s_);
  const double last = static_cast<double>(columns_.size() - 1);
  Column& column = columns_[static_cast<std::size_t>(std::clamp(at, 0.0, last))];
  const Numbered numbered{count_++, point};
  if (!std::isfinite(point.value)) {
    column.gap = {numbered.number, {point.time_s, std::numeric_limits<double>::quiet_NaN()}};
    column.has_gap = true;
    return;
  }
  if (!column.any) column.first = column.least = column.greatest = numbered;
  if (point.value < column.least.point.value) column.least = numbered;
  if (point.value > column.greatest.point.value) column.greatest = numbered;
  column.last = numbered;
  column.any = true;
}

std::vector<CurveThinning::Point> CurveThinning::points() const {
  std::vector<Point> all;
  for (const Column& c : columns_) {
    std::map<std::uint64_t, Point> in_order;
    if (c.has_gap) in_order[c.gap.number] = c.gap.point;
    if (c.any) {
      for (const Numbered* n : {&c.first, &c.least, &c.greatest, &c.last}) {
        in_order[n->number] = n->point;
      }
    }
    for (const auto& [number, point] : in_order) all.push_back(point);
  }
  return all;
}

std::vector<Curve> read_curves(const std::vector<OpenLog>& logs, const PlotOptions& options,
                               std::uint64_t& failures) {
  CurveReader reader(logs, options);
  failures += reader.read();
  return reader.curves();
}

void add_plot(CLI::App& verb, int& exit_code) {
  CLI::App* sub = verb.add_subcommand("plot", "Fields over time as a picture (as rqt_plot)");
  auto o = std::make_shared<PlotChoice>();
  sub->add_option("FILE... TOPIC.FIELD...", o->words,
                  "MCAP files (bags), then fields; FIELD[2] is one element, FIELD[*] a curve for "
                  "each")
      ->required();
  sub->add_option("-o,--output", o->plot.output, "Picture: NAME.png or NAME.svg")->required();
  add_time_options(*sub, o->plot.range);
  sub->add_option("--title", o->plot.title, "Above the picture");
  sub->add_option("--width", o->plot.width_px, "[px]")
      ->check(CLI::Range(100, 10'000))
      ->capture_default_str();
  sub->add_option("--height", o->plot.height_px, "[px]; by the number of panels")
      ->check(CLI::Range(100, 10'000));
  sub->add_option("--style", o->style, "lines, steps or dots")
      ->check(CLI::IsMember({"lines", "steps", "dots"}))
      ->capture_default_str();
  sub->add_flag("--derivative", o->plot.derivative, "Change per second instead of the value");
  sub->add_flag("--json", o->json, "Print one JSON object at the end");
  sub->footer(
      "Fields of different units get a panel each, with a common axis of time. Needs gnuplot.\n"
      "Example: mimesis log plot run.mcap bridge/arm.position_rad[*] planner/status.state -o "
      "arm.svg");
  on_run(*sub, exit_code, [o] { return run_plot(*o); });
}

}  // namespace mimesis::tool
