#include "tools/mimesis/log/replay_report.h"

#include <fmt/format.h>

#include <iostream>

#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kFieldsShown = 20;

ordered_json life_json(const Life& life, const LifeReport& r, std::uint64_t equal,
                       std::uint64_t runs) {
  ordered_json out{{"node", life.node()},
                   {"start_id", life.start.start_id()},
                   {"clock", life.start.clock()},
                   {"result", result_word(r.result)},
                   {"runs", runs},
                   {"equal", equal},
                   {"steps", r.counts.steps},
                   {"graph_s", r.graph_s},
                   {"wall_s", r.wall_s},
                   {"inputs", r.counts.inputs},
                   {"outputs", r.counts.outputs},
                   {"writes", r.counts.writes},
                   {"responses", r.counts.responses},
                   {"bytes", r.counts.bytes},
                   {"difference_count", r.difference_count},
                   {"differences", ordered_json::array()},
                   {"problem", r.problem},
                   {"notes", r.notes},
                   {"tolerated", tolerated_json(r.tolerated)}};
  for (const ReplayDifference& d : r.differences) out["differences"].push_back(to_json(d));
  return out;
}

std::string figures(const LifeReport& r) {
  std::string line = fmt::format("{} steps, {:.2f} s of graph time, {} inputs, {} outputs",
                                 r.counts.steps, r.graph_s, r.counts.inputs, r.counts.outputs);
  if (r.counts.writes > 0) line += fmt::format(", {} packets written", r.counts.writes);
  if (r.counts.responses > 0) line += fmt::format(", {} responses", r.counts.responses);
  line +=
      fmt::format(", {:.1f} MB in {:.2f} s", static_cast<double>(r.counts.bytes) * 1e-6, r.wall_s);
  if (r.wall_s > 0.0) line += fmt::format(" ({:.1f} x real time)", r.graph_s / r.wall_s);
  return line;
}

}  // namespace

std::string_view result_word(ReplayResult result) {
  switch (result) {
    case ReplayResult::equal:
      return "equal";
    case ReplayResult::different:
      return "different";
    case ReplayResult::incomplete:
      return "incomplete";
    case ReplayResult::interrupted:
      return "interrupted";
  }
  return "";
}

ordered_json to_json(const ReplayDifference& d) {
  ordered_json out{{"step", d.step}, {"time_s", d.time_s}, {"what", d.what}};
  if (!d.topic.empty()) {
    out["topic"] = d.topic;
    out["seq"] = d.seq;
  }
  out["field_count"] = d.field_count;
  out["fields"] = ordered_json::array();
  for (const FieldDifference& f : d.fields) {
    out["fields"].push_back({{"field", f.field}, {"recorded", f.first}, {"replayed", f.second}});
  }
  return out;
}

void print_difference(const std::string& name, const ReplayDifference& d) {
  std::cout << fmt::format("{}: step {} at {:.6f} s: {}\n", name, d.step, d.time_s, d.what);
  if (d.fields.empty()) return;
  Table table({"  FIELD", "RECORDED", "REPLAYED"});
  for (std::size_t i = 0; i < std::min(d.fields.size(), kFieldsShown); ++i) {
    table.row({"  " + d.fields[i].field, d.fields[i].first.dump(), d.fields[i].second.dump()});
  }
  table.print(std::cout, use_colour(1));
  if (d.field_count > kFieldsShown) {
    std::cout << fmt::format("  and {} more\n", d.field_count - kFieldsShown);
  }
}

ordered_json tolerated_json(
    const std::map<std::pair<std::string, std::string>, double>& tolerated) {
  ordered_json all = ordered_json::array();
  for (const auto& [key, worst] : tolerated) {
    all.push_back({{"topic", key.first}, {"field", key.second}, {"worst", worst}});
  }
  return all;
}

void print_tolerated(const std::map<std::pair<std::string, std::string>, double>& tolerated) {
  for (const auto& [key, worst] : tolerated) {
    std::cout << fmt::format("  tolerated: {} {}: {:.3g} at most\n", key.first, key.second, worst);
  }
}

void print_life(const Life& life, const LifeReport& r, std::uint64_t equal, std::uint64_t runs,
                bool json) {
  if (json) {
    std::cout << life_json(life, r, equal, runs).dump() << std::endl;
    return;
  }
  for (const ReplayDifference& d : r.differences) print_difference(life.node(), d);
  if (!r.problem.empty()) std::cout << life.node() << ": " << r.problem << '\n';
  const std::string counted =
      runs == 1 ? std::string(result_word(r.result)) : fmt::format("{} of {} equal", equal, runs);
  std::cout << fmt::format("{}: {}: {}\n", life.node(), counted, figures(r));
  if (r.difference_count > r.differences.size()) {
    std::cout << fmt::format("  {} differences, {} shown\n", r.difference_count,
                             r.differences.size());
  }
  print_tolerated(r.tolerated);
  for (const std::string& note : r.notes) std::cout << "  " << note << '\n';
  std::cout << std::flush;
}

}  // namespace mimesis::tool
