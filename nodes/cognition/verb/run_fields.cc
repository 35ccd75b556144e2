#include "nodes/cognition/verb/run_fields.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>

#include "nodes/cognition/field_network.h"
#include "nodes/cognition/network_file.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

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

}  // namespace

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
  Table table({"FIELD", "ACTIVE AFTER", "AT THE END", "SITE", "MAX U"});
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
    std::cout << all.dump() << '\n';
  } else {
    table.print(std::cout, use_colour(STDOUT_FILENO));
  }
  return 0;
}

}  // namespace mimesis::tool
