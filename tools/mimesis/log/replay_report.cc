#include "tools/mimesis/log/replay_report.h"

#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kFieldsShown = 20;

std::string_view result_word(ReplayResult result) {
  switch (result) {
    case ReplayResult::equal:
      return "equal";
    case ReplayResult::different:
      return "different";
    case ReplayResult::incomplete:
      return "incomplete";
    case ReplayResult::timed_out:
      return "timed out";
    case ReplayResult::interrupted:
      return "interrupted";
  }
  return "";
}

ordered_json to_json(const ReplayDifference& d) {
  ordered_json out = ordered_json::object();
  if (d.step) out["step"] = *d.step;
  out["time_s"] = d.time_s;
  out["what"] = d.what;
  if (!d.topic.empty()) {
    out["topic"] = d.topic;
    out["seq"] = d.seq;
  }
  out["field_count"] = d.fields.count;
  out["fields"] = ordered_json::array();
  for (const FieldDifference& f : d.fields.fields) {
    out["fields"].push_back({{"field", f.path}, {"recorded", f.a}, {"replayed", f.b}});
  }
  return out;
}

ordered_json to_json(const Tolerated& tolerated) {
  ordered_json all = ordered_json::array();
  for (const auto& [key, worst] : tolerated) {
    all.push_back({{"topic", key.first}, {"field", key.second}, {"worst", worst}});
  }
  return all;
}

/// Adds what every replay has.
void add_results(ordered_json& out, const LifeReport& r) {
  out["difference_count"] = r.difference_count;
  out["differences"] = ordered_json::array();
  for (const ReplayDifference& d : r.differences) out["differences"].push_back(to_json(d));
  out["problem"] = r.problem;
  out["notes"] = r.notes;
  out["tolerated"] = to_json(r.tolerated);
}

void print(const std::string& name, const ReplayDifference& d) {
  std::cout << fmt::format("{}: {}at {:.6f} s: {}\n", name,
                           d.step ? fmt::format("step {} ", *d.step) : "", d.time_s, d.what);
  const auto& fields = d.fields.fields;
  if (fields.empty()) return;
  Table table({"  FIELD", "RECORDED", "REPLAYED"});
  for (std::size_t i = 0; i < std::min(fields.size(), kFieldsShown); ++i) {
    table.row(
        {"  " + (fields[i].path.empty() ? "(message)" : fields[i].path), fields[i].a, fields[i].b});
  }
  table.print(std::cout, use_colour(1));
  if (d.fields.count > kFieldsShown) {
    std::cout << fmt::format("  and {} more\n", d.fields.count - kFieldsShown);
  }
}

std::string megabytes_in_seconds(const LifeReport& r) {
  std::string text =
      fmt::format("{:.1f} MB in {:.2f} s", static_cast<double>(r.counts.bytes) * 1e-6, r.wall_s);
  if (r.wall_s > 0.0) text += fmt::format(" ({:.1f} x real time)", r.graph_s / r.wall_s);
  return text;
}

std::string figures_of_node(const LifeReport& r) {
  std::string text = fmt::format("{} steps, {:.2f} s of graph time, {} inputs, {} outputs, ",
                                 r.counts.steps, r.graph_s, r.counts.inputs, r.counts.outputs);
  if (r.counts.writes > 0) text += fmt::format("{} packets written, ", r.counts.writes);
  if (r.counts.responses > 0) text += fmt::format("{} responses, ", r.counts.responses);
  return text + megabytes_in_seconds(r);
}

void print_text(const std::string& name, const RunCount& count, const std::string& figures) {
  const LifeReport& r = count.shown;
  for (const ReplayDifference& d : r.differences) print(name, d);
  if (!r.problem.empty()) std::cout << name << ": " << r.problem << '\n';
  const std::string result = count.runs == 1
                                 ? std::string(result_word(r.result))
                                 : fmt::format("{} of {} equal", count.equal, count.runs);
  std::cout << fmt::format("{}: {}: {}\n", name, result, figures);
  if (r.difference_count > r.differences.size()) {
    std::cout << fmt::format("  {} differences, {} shown\n", r.difference_count,
                             r.differences.size());
  }
  for (const auto& [key, worst] : r.tolerated) {
    std::cout << fmt::format("  tolerated: {} {}: {:.3g} at most\n", key.first, key.second, worst);
  }
  for (const std::string& note : r.notes) std::cout << "  " << note << '\n';
  std::cout << std::flush;
}

}  // namespace

void print_life(const Life& life, const RunCount& count, bool json) {
  const LifeReport& r = count.shown;
  if (!json) return print_text(life.node(), count, figures_of_node(r));
  ordered_json out{{"node", life.node()},
                   {"start_id", life.start.start_id()},
                   {"clock", life.start.clock()},
                   {"result", result_word(r.result)},
                   {"runs", count.runs},
                   {"equal", count.equal},
                   {"steps", r.counts.steps},
                   {"graph_s", r.graph_s},
                   {"wall_s", r.wall_s},
                   {"inputs", r.counts.inputs},
                   {"outputs", r.counts.outputs},
                   {"writes", r.counts.writes},
                   {"responses", r.counts.responses},
                   {"bytes", r.counts.bytes}};
  add_results(out, r);
  std::cout << out.dump() << std::endl;
}

void print_launch(const std::string& file, const RunCount& count, bool json) {
  const LifeReport& r = count.shown;
  if (!json) {
    return print_text(file, count,
                      fmt::format("{} messages, {:.2f} s of graph time, {}", r.counts.outputs,
                                  r.graph_s, megabytes_in_seconds(r)));
  }
  ordered_json out{{"launch", file},
                   {"result", result_word(r.result)},
                   {"runs", count.runs},
                   {"equal", count.equal},
                   {"graph_s", r.graph_s},
                   {"wall_s", r.wall_s},
                   {"messages", r.counts.outputs},
                   {"bytes", r.counts.bytes}};
  add_results(out, r);
  std::cout << out.dump() << std::endl;
}

}  // namespace mimesis::tool
