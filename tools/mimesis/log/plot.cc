#include "tools/mimesis/log/plot.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "common/error.h"
#include "common/plot/gnuplot.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/verb_options.h"

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

constexpr double kNanosecondsOfPlot = 1e9;  // log times are in ns
constexpr int kWidth_px = 1200;
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
      : logs_(logs), span_(span_of(logs)), times_(resolve(options.range, span_)) {
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
    std::uint64_t invalid = 0;
    const log::Selection selection{wanted, times_.start, times_.end};
    const std::uint64_t damages = scan_logs(
        logs_, selection, "plot", [&](const Item& item) { invalid += take(item) ? 0 : 1; });
    return damages + invalid;
  }

  std::vector<Curve> curves() {
    std::vector<Curve> all;
    for (auto& [key, curve] : curves_) all.push_back(std::move(curve));
    return all;
  }

 private:
  /// Query, node, element.
  using Key = std::tuple<std::size_t, std::string, FieldColumns::Key>;

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
    const auto* message = decoder_.decode_or_tell(item);
    if (message == nullptr) return false;
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
    auto it = curves_.find({q, node, key});
    if (it == curves_.end()) it = curves_.emplace(Key{q, node, key}, make(q, node, key, v)).first;
    Curve& curve = it->second;
    const double value = field_number(v.message, v.field, v.index);
    if (curve.discrete) {
      curve.words.try_emplace(static_cast<int>(value), value_word(v, static_cast<int>(value)));
    }
    curve.thinning.add({seconds(m.log_time), value});
    ++curve.samples;
    if (!std::isfinite(value)) return;
    curve.least = std::min(curve.least, value);
    curve.greatest = std::max(curve.greatest, value);
  }

  Curve make(std::size_t q, const std::string& node, const FieldColumns::Key& key,
             const FieldColumns::Value& v) const {
    const std::string& topic = queries_[q].topic();
    std::string label = topic + "." + queries_[q].name(key);
    if (nodes_.at(topic).size() > 1) label += " (" + node + ")";
    const bool discrete = v.field.cpp_type() == FieldDescriptor::CPPTYPE_ENUM ||
                          v.field.cpp_type() == FieldDescriptor::CPPTYPE_BOOL;
    return {q,  label,    quantity_of(v.field.name()),
            {}, discrete, CurveThinning(start_s_, end_s_, kWidth_px * kColumnsPerPixel)};
  }

  /// From the start of the log.
  double seconds(std::uint64_t time_ns) const {
    return time_ns >= span_.start_ns
               ? static_cast<double>(time_ns - span_.start_ns) / kNanosecondsOfPlot
               : -static_cast<double>(span_.start_ns - time_ns) / kNanosecondsOfPlot;
  }

  const std::vector<OpenLog>& logs_;
  Span span_;
  LogTimes times_;
  double start_s_ = 0.0, end_s_ = 0.0;
  LogDecoder decoder_;
  std::vector<FieldColumns> queries_;
  std::map<std::string, std::set<std::string>> nodes_;  ///< by topic
  std::map<Key, Curve> curves_;
};

// --- Pictures

constexpr std::size_t kLineTypes = 8;  // line types that the style of gnuplot.cc distinguishes
constexpr int kPanelHeight = 320, kFirstPanelHeight = 460;  // [px]

using Panel = std::vector<std::size_t>;  ///< indexes of curves that share an axis

/// Axis of curves that share a panel; curves of words have their own.
std::string axis_of(const Curve& curve) {
  if (!curve.discrete) return "unit " + curve.quantity.unit;
  std::string words = "words";
  for (const auto& [value, word] : curve.words) {
    words = word == "true" || word == "false" ? "boolean" : "words " + curve.quantity.name;
  }
  return words;
}

std::vector<Panel> panels_of(const std::vector<Curve>& curves) {
  std::vector<Panel> panels;
  std::vector<std::string> axes;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const std::string axis = axis_of(curves[i]);
    const auto at = static_cast<std::size_t>(std::ranges::find(axes, axis) - axes.begin());
    if (at == axes.size()) {
      axes.push_back(axis);
      panels.emplace_back();
    }
    panels[at].push_back(i);
  }
  return panels;
}

std::string y_label(const std::vector<Curve>& curves, const Panel& panel) {
  std::set<std::string> names;
  for (const std::size_t i : panel) names.insert(curves[i].quantity.name);
  const std::string& unit = curves[panel.front()].quantity.unit;
  std::string name = names.size() == 1 ? *names.begin() : "";
  if (unit.empty()) return name;
  return name.empty() ? unit : name + " [" + unit + "]";
}

/// Common part of all labels, for the title: "bridge/joint_states.".
std::string common_topic(const std::vector<Curve>& curves) {
  const std::string& first = curves.front().label;
  const std::size_t slash = first.rfind('/');
  const std::string topic = first.substr(0, first.find('.', slash == first.npos ? 0 : slash) + 1);
  const bool all = std::ranges::all_of(
      curves, [&](const Curve& curve) { return curve.label.starts_with(topic); });
  return all ? topic : "";
}

/// Values of an axis with names, and room above and below.
std::string word_tics(const std::vector<Curve>& curves, const Panel& panel) {
  std::map<int, std::string> words;
  for (const std::size_t i : panel) words.insert(curves[i].words.begin(), curves[i].words.end());
  std::string tics;
  for (const auto& [value, word] : words) {
    tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ", plot::quoted(word), value);
  }
  return fmt::format("set ytics ({})\nset yrange [{}:{}]\n", tics, words.begin()->first - 0.3,
                     words.rbegin()->first + 0.3);
}

/// Equal ones for all panels, so that their times stand above each other [characters].
std::size_t left_margin(const std::vector<Curve>& curves) {
  std::size_t longest = 8;  // longest number
  for (const Curve& curve : curves) {
    for (const auto& [value, word] : curve.words) longest = std::max(longest, word.size());
  }
  return longest + 4;
}
std::size_t right_margin(const std::vector<Curve>& curves, const std::string& topic) {
  std::size_t longest = 0;
  for (const Curve& curve : curves) longest = std::max(longest, curve.label.size() - topic.size());
  return longest + 8;
}

/// Look of the curves of a panel. Where fields have several elements, equal ones of each have one
/// colour, and each field has its dashes: set-points lie upon what followed them.
struct Look {
  std::size_t colour, dash;
};
std::vector<Look> looks(const std::vector<Curve>& curves, const Panel& panel) {
  std::map<std::size_t, std::size_t> sizes;  // sizes of fields
  for (const std::size_t i : panel) ++sizes[curves[i].field];
  const bool by_field =
      sizes.size() > 1 && std::ranges::any_of(sizes, [](const auto& s) { return s.second > 1; });
  std::map<std::size_t, std::size_t> dashes, elements;
  std::vector<Look> all;
  for (std::size_t n = 0; n < panel.size(); ++n) {
    const std::size_t field = curves[panel[n]].field;
    const std::size_t dash = dashes.try_emplace(field, dashes.size()).first->second;
    const std::size_t element = elements[field]++;
    all.push_back(by_field ? Look{element % kLineTypes, dash}
                           : Look{n % kLineTypes, n / kLineTypes});
  }
  return all;
}

std::string curve_style(const Curve& curve, const std::string& style, const Look& look) {
  if (style == "dots" || curve.samples < 2) {
    return fmt::format("points linetype {} pointtype 7 pointsize 0.4", look.colour + 1);
  }
  return fmt::format("{} linetype {} linewidth 1.4 dashtype {}",
                     style == "steps" || curve.discrete ? "steps" : "lines", look.colour + 1,
                     look.dash + 1);
}

/// gnuplot chooses it, but for curves that are constant.
std::string value_range(const std::vector<Curve>& curves, const Panel& panel) {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const std::size_t i : panel) {
    least = std::min(least, curves[i].least);
    greatest = std::max(greatest, curves[i].greatest);
  }
  if (least < greatest) return "set autoscale y\n";
  const double middle = least == greatest ? least : 0.0;
  const double half = std::max(1.0, 0.1 * std::abs(middle));
  return fmt::format("set yrange [{}:{}]\n", middle - half, middle + half);
}

std::string draw_panel(const std::vector<Curve>& curves, const Panel& panel,
                       const PlotOptions& options, const std::string& topic) {
  std::string script = "set ylabel " + plot::quoted(y_label(curves, panel)) + "\n";
  if (curves[panel.front()].discrete) {
    script += word_tics(curves, panel);
  } else {
    script += value_range(curves, panel);
    script += "set ytics autofreq\nset offsets 0, 0, graph 0.05, graph 0.05\n";
  }
  const auto look = looks(curves, panel);
  std::string plots;
  for (std::size_t n = 0; n < panel.size(); ++n) {
    const Curve& curve = curves[panel[n]];
    plots += fmt::format("{} $curve{} using 1:2 with {} title {}", n == 0 ? "" : ", \\\n ",
                         panel[n], curve_style(curve, options.style, look[n]),
                         plot::quoted(curve.label.substr(topic.size())));
  }
  return script + "plot" + plots + "\n";
}

// --- The verb

int run_plot(PlotOptions& o) {
  const std::string extension = std::filesystem::path(o.output).extension().string();
  if (extension != ".png" && extension != ".svg") {
    throw ConfigError("-o " + o.output + ": expected a name that ends in .png or .svg");
  }
  std::vector<std::string> files;
  for (const std::string& word : o.words) {
    std::error_code ignored;
    const bool is_file = word.ends_with(".mcap") || std::filesystem::exists(word, ignored);
    (o.fields.empty() && is_file ? files : o.fields).push_back(word);
  }
  if (files.empty() || o.fields.empty()) {
    throw ConfigError(
        "expected FILE... TOPIC.FIELD..., as in run.mcap bridge/joint_states.position_rad[*]");
  }
  std::uint64_t failures = 0, samples = 0;
  const auto curves = read_curves(open_logs(files), o, failures);
  if (curves.empty()) throw VerbEnd{"nothing to plot: no messages in this part of the log", 3};
  try {
    draw_curves(curves, o);
  } catch (const ConfigError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw VerbEnd{error.what(), 1};
  }
  auto list = nlohmann::ordered_json::array();
  for (const Curve& c : curves) {
    samples += c.samples;
    const bool finite = c.least <= c.greatest;  // has a finite sample
    list.push_back({{"field", c.label},
                    {"unit", c.quantity.unit},
                    {"samples", c.samples},
                    {"min", finite ? nlohmann::ordered_json(c.least) : nullptr},
                    {"max", finite ? nlohmann::ordered_json(c.greatest) : nullptr}});
  }
  if (o.json) {
    print_json({{"file", o.output}, {"curves", list}});
  } else {
    std::cerr << fmt::format("{}: {} curves of {} samples\n", o.output, curves.size(), samples);
  }
  return failures == 0 ? 0 : 1;
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

std::vector<Curve> read_curves(const std::vector<OpenLog>& logs, const PlotOptions& options,
                               std::uint64_t& failures) {
  CurveReader reader(logs, options);
  failures += reader.read();
  return reader.curves();
}

void draw_curves(const std::vector<Curve>& curves, const PlotOptions& options) {
  const auto panels = panels_of(curves);
  const std::string topic = common_topic(curves);
  std::vector<plot::Data> data;
  double first_s = std::numeric_limits<double>::infinity(), last_s = -first_s;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    plot::Data d{fmt::format("curve{}", i), {}};
    for (const auto& p : curves[i].thinning.points()) {
      d.rows.push_back({p.time_s, p.value});
      first_s = std::min(first_s, p.time_s);
      last_s = std::max(last_s, p.time_s);
    }
    if (d.rows.empty()) d.rows.push_back({0.0, std::numeric_limits<double>::quiet_NaN()});
    data.push_back(std::move(d));
  }
  const std::string title = topic.empty() ? "" : topic.substr(0, topic.size() - 1);
  std::string script = fmt::format(
      "set key at graph 1.01, graph 1.02 left top Left reverse\n"
      "set grid back linetype 1 linecolor rgb '#e0e0e0' linewidth 1 dashtype 1\n"
      "set lmargin {}\nset rmargin {}\n{}",
      left_margin(curves), right_margin(curves, topic),
      first_s < last_s ? fmt::format("set xrange [{}:{}]\n", first_s, last_s) : "");
  script += fmt::format("set multiplot layout {},1{}\n", panels.size(),
                        title.empty() ? "" : " title " + plot::quoted(title));
  for (const Panel& panel : panels) {
    if (&panel == &panels.back()) script += "set xlabel 'time from the start of the log [s]'\n";
    script += draw_panel(curves, panel, options, topic);
  }
  script += "unset multiplot\n";
  const int height = kFirstPanelHeight + kPanelHeight * (static_cast<int>(panels.size()) - 1);
  const bool svg = std::filesystem::path(options.output).extension() == ".svg";
  (svg ? plot::plot_svg : plot::plot_png)(options.output, kWidth_px, height, data, script);
}

void add_plot(CLI::App& verb, int& exit_code) {
  CLI::App* sub = verb.add_subcommand("plot", "Fields over time as a picture (as rqt_plot)");
  auto o = std::make_shared<PlotOptions>();
  sub->add_option("FILE... TOPIC.FIELD...", o->words,
                  "MCAP files (bags), then fields; FIELD[2] is one element, FIELD[*] a curve for "
                  "each")
      ->required();
  sub->add_option("-o,--output", o->output, "Picture: NAME.png or NAME.svg")->required();
  add_time_options(*sub, o->range);
  sub->add_option("--style", o->style, "lines, steps or dots")
      ->check(CLI::IsMember({"lines", "steps", "dots"}))
      ->capture_default_str();
  sub->add_flag("--json", o->json, "Print one JSON object at the end");
  sub->footer(
      "Fields of different units get a panel each, with a common axis of time. Needs gnuplot.\n"
      "Example: mimesis log plot run.mcap bridge/joint_states.position_rad[*] planner/status.state "
      "-o "
      "arm.svg");
  on_run(*sub, exit_code, [o] { return run_plot(*o); });
}

}  // namespace mimesis::tool
