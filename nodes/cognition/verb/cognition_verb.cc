#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "common/plot/gnuplot.h"
#include "nodes/cognition/field_network.h"
#include "nodes/cognition/network_file.h"
#include "proto/cognition.pb.h"
#include "proto/planner.pb.h"
#include "proto/vision.pb.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/log/story.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Json = nlohmann::ordered_json;

struct ExplainOptions {
  std::string log, plot;
  int number = 0;  ///< of the decision to draw; 0: the last
  bool json = false;
};

/// max u of each field at one time.
struct Sample {
  double time_s;
  std::vector<double> peaks;
};

/// What a log says of decisions; times are from its start.
struct Record {
  std::vector<v1::Explanation> explanations;
  std::vector<std::string> seen;   ///< before each
  std::vector<std::string> asked;  ///< test plans before each, a line each
  std::vector<double> fallen_s;
  std::vector<std::string> fields;
  std::vector<Sample> samples;
};

Record read_record(const std::vector<OpenLog>& logs) {
  Record record;
  constexpr std::size_t kColorPrefix = 13;  // OBJECT_COLOR_
  const Span span = span_of(logs);
  const auto wanted = [&](const log::Channel& c) {
    return c.topic.ends_with("/explanation") || c.topic.ends_with("/fields") ||
           c.topic.ends_with("/observation") || c.topic.ends_with("/proposal") ||
           c.topic.ends_with("/status");
  };
  std::string seen, asked, open;  // open: the test plan that was asked for
  scan_logs(logs, {wanted}, "explain", [&](const Item& item) {
    const std::string type = item.schema == nullptr ? "" : item.schema->name;
    const double time_s = static_cast<double>(item.message->log_time - span.start_ns) * 1e-9;
    v1::FieldActivity activity;
    v1::Explanation explanation;
    v1::Observation observation;
    v1::Decision proposal;
    v1::TaskStatus status;
    if (type == explanation.GetTypeName() && parse(item, explanation)) {
      record.explanations.push_back(explanation);
      record.fallen_s.push_back(time_s);
      record.seen.push_back(seen);
      record.asked.push_back(std::exchange(asked, {}));
      open.clear();
    } else if (type == observation.GetTypeName() && parse(item, observation)) {
      if (words(observation) == "-, -, -") return;  // nobody acts, or the robot's own eyes
      seen = words(observation);
      const std::string color = word(v1::ObjectColor_Name(observation.color()), kColorPrefix);
      if (color != "-") seen += ", " + color;
    } else if (type == proposal.GetTypeName() && parse(item, proposal)) {
      open = words(proposal);
    } else if (type == status.GetTypeName() && parse(item, status)) {
      const bool failed = status.state() == v1::TASK_STATE_FAILED;
      if (words(status) != open || !(failed || status.plan_succeeded())) return;
      asked += fmt::format("  test plan for {}: {}\n", open, failed ? status.reason() : "found");
      open.clear();
    } else if (type == activity.GetTypeName() && parse(item, activity)) {
      Sample sample{time_s, {}};
      record.fields.clear();
      for (const v1::Field& f : activity.fields()) {
        record.fields.push_back(f.name());
        sample.peaks.push_back(f.u().empty() ? 0.0 : *std::ranges::max_element(f.u()));
      }
      record.samples.push_back(std::move(sample));
    }
  });
  return record;
}

std::string told(const Record& record, std::size_t at) {
  const v1::Explanation& e = record.explanations[at];
  const v1::Decision& d = e.decision();
  const std::string seen = fmt::format("{:.2f} s: seen {}; ", record.fallen_s[at], record.seen[at]);
  if (!d.settled()) return seen + "no decision: " + d.reason();
  return seen + fmt::format("decided {} after {:.2f} s, confidence {:.2f}", words(d),
                            e.deciding_s(), e.confidence());
}

void print(const Record& record, std::size_t at) {
  const v1::Explanation& e = record.explanations[at];
  std::cout << told(record, at) << '\n' << record.asked[at];
  TextTable table({"  FIELD", "SITE", "ACTIVE AFTER", "LEAD", "CARRIED BY"});
  for (const v1::FieldReason& f : e.fields()) {
    table.row({"  " + f.field(), f.site(), fmt::format("{:.0f} ms", 1000.0 * f.onset_s()),
               fmt::format("{:.2f}", f.lead()), carried_by(f)});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
}

/// Activity over time around one decision; an arrow where each field became active.
void draw(const Record& record, std::size_t at, const std::string& png) {
  const v1::Explanation& e = record.explanations[at];
  const double end_s = record.fallen_s[at], onset_s = end_s - e.deciding_s();
  double from_s = onset_s - 0.3;
  std::vector<plot::Data> data;
  std::string script = fmt::format(
      "set title {} font 'sans,12'\nset xlabel 'time of the log [s]'\nset ylabel 'max u'\nset key "
      "outside right\nset xrange [{}:{}]\n",
      plot::quoted(told(record, at)), from_s, end_s + 0.2);
  std::string curves = "plot 0 lt 8 lw 1 dt 3 notitle";
  for (std::size_t f = 0; f < record.fields.size(); ++f) {
    plot::Data d{fmt::format("f{}", f), {}};
    for (const Sample& s : record.samples) {
      if (s.time_s >= from_s && s.time_s <= end_s + 0.2 && f < s.peaks.size()) {
        d.rows.push_back({s.time_s, s.peaks[f]});
      }
    }
    std::string name = record.fields[f];
    for (const v1::FieldReason& reason : e.fields()) {
      if (reason.field() != record.fields[f]) continue;
      name += " " + reason.site();
      script += fmt::format("set arrow from {0},graph 0 to {0},graph 0.06 nohead lt {1} lw 3\n",
                            onset_s + reason.onset_s(), f + 1);
    }
    curves += fmt::format(", ${} using 1:2 with lines lt {} lw 2 title {}", d.name, f + 1,
                          plot::quoted(name));
    data.push_back(std::move(d));
  }
  plot::plot_png(png, 1000, 460, data, script + curves);
}

int explain(const ExplainOptions& options) {
  const auto logs = open_logs({options.log});
  const Record record = read_record(logs);
  if (record.explanations.empty()) {
    throw VerbEnd{options.log + ": holds no decision of cognition (topic cognition/explanation)",
                  3};
  }
  const auto count = static_cast<int>(record.explanations.size());
  if (options.number > count) {
    throw VerbEnd{fmt::format("--number {}: the log holds {}", options.number, count), 2};
  }
  if (options.json) {
    Json all = Json::array();
    for (std::size_t i = 0; i < record.explanations.size(); ++i) {
      Json one = {{"time_s", record.fallen_s[i]}};
      one.update(to_json(record.explanations[i]));
      all.push_back(std::move(one));
    }
    std::cout << json_text(all) << '\n';
  } else {
    for (std::size_t i = 0; i < record.explanations.size(); ++i) {
      print(record, i);
    }
  }
  if (!options.plot.empty()) {
    draw(record, static_cast<std::size_t>((options.number > 0 ? options.number : count) - 1),
         options.plot);
    std::cerr << "written: " << options.plot << '\n';
  }
  return 0;
}

// --- run

struct RunOptions {
  std::string network;
  std::vector<std::string> inputs;  ///< "NAME:FIELD[=SITE]@FROM-TO", times in s
  std::vector<std::string> recall;  ///< the same, after the training
  int train = 0;                    ///< presentations of `inputs` before
  double seconds = 2.0;
  bool json = false;
};

using cognition::NetworkSpec;
using Fields = cognition::FieldNetwork<double>;

/// An input of the file, at one of its sites (-1: all), for a time.
struct Shown {
  std::string name;
  std::size_t field;
  int site;
  double from_s, to_s;
};

Shown parse_shown(const std::string& text, const NetworkSpec& a) {
  const auto bad = [&](const std::string& why) {
    throw VerbEnd{fmt::format("input '{}': {}, expected NAME:FIELD[=SITE]@FROM-TO as in "
                              "vision:PFC=high@0-0.6",
                              text, why),
                  2};
  };
  const std::size_t colon = text.find(':'), at = text.rfind('@'), dash = text.find('-', at);
  if (colon == std::string::npos || at == std::string::npos || dash == std::string::npos ||
      colon > at) {
    bad("has no NAME, FIELD or time");
  }
  std::string field = text.substr(colon + 1, at - colon - 1), site;
  if (const std::size_t equals = field.find('='); equals != std::string::npos) {
    site = field.substr(equals + 1);
    field.resize(equals);
  }
  Shown s{text.substr(0, colon), a.field_index(field), -1, 0.0, 0.0};
  if (s.field == a.fields.size()) bad("there is no field '" + field + "'");
  if (std::ranges::none_of(a.inputs, [&](const cognition::InputSpec& i) {
        return i.name == s.name && i.into == field;
      })) {
    bad(fmt::format("the file has no input '{}' into {}", s.name, field));
  }
  if (!site.empty()) {
    s.site = NetworkSpec::site_index(a.fields[s.field], site);
    if (s.site < 0) bad(fmt::format("'{}' is no site of {}", site, field));
  }
  const std::string from = text.substr(at + 1, dash - at - 1), to = text.substr(dash + 1);
  char *end = nullptr, *last = nullptr;
  s.from_s = std::strtod(from.c_str(), &end);
  s.to_s = std::strtod(to.c_str(), &last);
  if (from.empty() || to.empty() || *end != '\0' || *last != '\0' || !(s.from_s < s.to_s)) {
    bad("its times are no interval");
  }
  return s;
}

/// When each field became active [s], negative: never.
std::vector<double> present(Fields& fields, const std::vector<Shown>& shown, double seconds) {
  const NetworkSpec& a = fields.spec();
  std::vector<double> active(a.fields.size(), -1.0);
  fields.reset();
  cognition::Stimulus constant(a);
  for (std::size_t f = 0; f < a.fields.size(); ++f) add_input(a, "task", f, -1, 1.0, constant);
  for (long k = 0; k < std::lround(seconds / a.dt_s); ++k) {
    const double t = (static_cast<double>(k) + 0.5) * a.dt_s;
    cognition::Stimulus stimulus = constant;
    for (const Shown& s : shown) {
      if (t > s.from_s && t < s.to_s) add_input(a, s.name, s.field, s.site, 1.0, stimulus);
    }
    fields.step(stimulus);
    for (std::size_t f = 0; f < active.size(); ++f) {
      const bool now = std::ranges::max(fields.field(f).activity()) > 0;
      if (now && active[f] < 0.0) active[f] = static_cast<double>(k + 1) * a.dt_s;
    }
  }
  return active;
}

/// Runs the fields of a network and prints what became active.
int run_fields(const RunOptions& options) {
  Fields fields(cognition::load_network(options.network));
  const NetworkSpec& a = fields.spec();
  std::vector<Shown> inputs, recall;
  for (const std::string& text : options.inputs) inputs.push_back(parse_shown(text, a));
  for (const std::string& text : options.recall) recall.push_back(parse_shown(text, a));
  fields.recall(false);
  for (int i = 0; i < options.train; ++i) present(fields, inputs, options.seconds);
  fields.recall(true);
  const auto active = present(fields, recall.empty() ? inputs : recall, options.seconds);

  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  TextTable table({"FIELD", "ACTIVE AFTER", "AT THE END", "SITE", "MAX U"});
  for (std::size_t f = 0; f < a.fields.size(); ++f) {
    const cognition::Peaks peaks = cognition::read_peaks(fields, f);
    const std::string site =
        peaks.site < 0 ? "" : a.fields[f].sites.at(static_cast<std::size_t>(peaks.site));
    const auto u = fields.field(f).activity();
    nlohmann::ordered_json one = {
        {"field", a.fields[f].name}, {"active_s", nullptr},
        {"peaks", peaks.count},      {"site", site},
        {"max_u", peaks.max_u},      {"u", std::vector<double>(u.begin(), u.end())}};
    if (active[f] >= 0.0) one["active_s"] = active[f];
    all.push_back(std::move(one));
    table.row({a.fields[f].name,
               active[f] < 0.0 ? "never" : fmt::format("{:.0f} ms", 1000.0 * active[f]),
               peaks.count == 0   ? "at rest"
               : peaks.count == 1 ? "1 peak"
                                  : fmt::format("{} peaks", peaks.count),
               site, fmt::format("{:.3f}", peaks.max_u)});
  }
  if (options.json) {
    std::cout << json_text(all) << '\n';
  } else {
    table.print(std::cout, use_colour(STDOUT_FILENO));
  }
  return 0;
}

}  // namespace

void add_cognition(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand(
      "cognition", "Runs neural fields, and says why they decided as they did");
  verb->require_subcommand(1);
  auto options = std::make_shared<ExplainOptions>();
  CLI::App* sub = verb->add_subcommand(
      "explain", "Which inputs and links carried each field over its threshold, per decision");
  sub->add_option("LOG", options->log, "A recorded run")->required();
  sub->add_flag("--json", options->json, "A list with an object for each decision");
  sub->add_option("--plot", options->plot, "Draw activity over time to this file (PNG)")
      ->type_name("FILE");
  sub->add_option("--number", options->number, "The decision to draw, from 1; default: the last")
      ->check(CLI::PositiveNumber);
  sub->footer(
      "LEAD: share of the winner's input that the best other site lacks. Confidence is the least "
      "of "
      "PF, F5g, F5t, PFC.\nExit codes: 0 done, 1 failed, 2 usage, 3 no log, or one without "
      "decisions.\nExamples:\n  mimesis cognition explain imitation.mcap --plot why.png");
  on_run(*sub, exit_code, [options] { return explain(*options); });

  auto run = std::make_shared<RunOptions>();
  CLI::App* fields = verb->add_subcommand("run", "Runs the fields of a network");
  fields->add_option("NETWORK", run->network, "File, in models/ or elsewhere")->required();
  fields->add_option("--input", run->inputs, "An input of the file, and when [s]; may be repeated")
      ->type_name("NAME:FIELD[=SITE]@FROM-TO");
  fields->add_option("--train", run->train, "Presentations of the inputs before, which links learn")
      ->check(CLI::Range(0, 100'000));
  fields->add_option("--recall", run->recall, "What is shown after the training, instead of inputs")
      ->type_name("NAME:FIELD[=SITE]@FROM-TO");
  fields->add_option("--seconds", run->seconds, "Duration of one presentation [s]")
      ->check(CLI::Range(0.001, 3600.0))
      ->capture_default_str();
  fields->add_flag("--json", run->json,
                   "A list with an object for each field, with its activity u");
  fields->footer(
      "Exit codes: 0 done, 2 usage or a bad file.\nExamples:\n"
      "  mimesis cognition run bar_fields.yaml --input vision:STSg=PG@0-0.6 --input "
      "vision:STSt=AT@0-0.6\n"
      "  mimesis cognition run sequence_fields.yaml --train 10 --input event:A@0-0.06 --input "
      "event:B@0.16-0.22 --input event:C@0.32-0.38 --recall event:A@0-0.06");
  on_run(*fields, exit_code, [run] { return run_fields(*run); });
}

}  // namespace mimesis::tool
