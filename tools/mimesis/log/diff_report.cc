#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "tools/mimesis/log/diff.h"
#include "tools/mimesis/log/log_scan.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using Json = nlohmann::ordered_json;

Json first_json(const StreamDiff::First& first, const OpenLog& a) {
  Json fields = Json::array();
  for (const FieldDifference& f : first.difference.fields) {
    fields.push_back({{"path", f.path}, {"a", f.a}, {"b", f.b}});
  }
  const std::uint64_t start = a.summary.statistics.message_start_time;
  return {{"seq", first.sequence},
          {"time_s", static_cast<double>(first.time_a_ns - start) * 1e-9},
          {"log_time_a_ns", first.time_a_ns},
          {"log_time_b_ns", first.time_b_ns},
          {"fields", fields},
          {"differing_fields", first.difference.count}};
}

Json stream_json(const StreamDiff& s, const OpenLog& a) {
  Json worst = Json::array();
  for (const auto& [field, w] : s.worst) {
    worst.push_back(
        {{"field", field},
         {"difference", std::isfinite(w.difference) ? Json(w.difference) : Json(nullptr)},
         {"path", w.path},
         {"a", w.a},
         {"b", w.b}});
  }
  return {{"topic", s.topic},
          {"node", s.node},
          {"type_a", s.type_a},
          {"type_b", s.type_b},
          {"messages_a", s.a},
          {"messages_b", s.b},
          {"equal", s.equal},
          {"differing", s.differing},
          {"only_a", s.only_a},
          {"only_b", s.only_b},
          {"first", s.first ? first_json(*s.first, a) : Json(nullptr)},
          {"worst", worst}};
}

void print_details(const StreamDiff& s, const OpenLog& a) {
  std::cout << '\n' << s.topic << (s.node.empty() ? "" : " of " + s.node) << '\n';
  if (s.type_a != s.type_b && s.a > 0 && s.b > 0) {
    std::cout << fmt::format("  type: {} | {}\n", s.type_a, s.type_b);
  }
  if (s.first) {
    const auto& first = *s.first;
    std::cout << fmt::format(
        "  first difference: seq {}, at {} s\n", first.sequence,
        seconds_text(first.time_a_ns, a.summary.statistics.message_start_time));
    for (const FieldDifference& f : first.difference.fields) {
      std::cout << fmt::format("    {}: {} | {}\n", f.path.empty() ? "payload" : f.path, f.a, f.b);
    }
    const std::uint64_t more = first.difference.count - first.difference.fields.size();
    if (more > 0) std::cout << fmt::format("    and {} more fields\n", more);
  }
  for (const auto& [field, w] : s.worst) {
    std::cout << fmt::format("  worst of {}: {:g} ({}: {} | {})\n", field, w.difference, w.path,
                             w.a, w.b);
  }
}

void print_text(const std::vector<StreamDiff>& streams, const OpenLog& a) {
  Table table({"TOPIC", "NODE", "A", "B", "EQUAL", "DIFFERING", "ONLY A", "ONLY B"});
  for (const StreamDiff& s : streams) {
    table.row({s.topic, s.node, std::to_string(s.a), std::to_string(s.b), std::to_string(s.equal),
               std::to_string(s.differing), std::to_string(s.only_a), std::to_string(s.only_b)});
  }
  table.print(std::cout, use_colour(1));
  for (const StreamDiff& s : streams) {
    const bool other_type = s.type_a != s.type_b && s.a > 0 && s.b > 0;
    if (s.first || other_type || !s.worst.empty()) print_details(s, a);
  }
  const auto different = std::ranges::count_if(streams, [](const auto& s) { return !s.same(); });
  std::uint64_t equal = 0;
  for (const StreamDiff& s : streams) equal += s.equal;
  std::cout << (different == 0
                    ? fmt::format("\nequal: {} messages\n", equal)
                    : fmt::format("\ndifferent: {} of {} topics\n", different, streams.size()));
}

}  // namespace

int log_diff(const std::string& path_a, const std::string& path_b, const DiffOptions& options,
             bool json) {
  auto logs = open_logs({path_a, path_b});
  if (!logs) {
    std::cerr << logs.error().line << '\n';
    return logs.error().exit_code;
  }
  std::uint64_t damages = 0;
  const OpenLog& a = logs->front();
  const auto streams = diff_logs(a, logs->back(), options, damages);
  if (streams.empty()) {
    std::cerr << "nothing to compare: neither log has messages on the topics chosen\n";
    return 3;
  }
  const bool equal = std::ranges::all_of(streams, [](const StreamDiff& s) { return s.same(); });
  if (json) {
    Json topics = Json::array();
    for (const StreamDiff& s : streams) topics.push_back(stream_json(s, a));
    std::cout << Json{{"a", path_a},
                      {"b", path_b},
                      {"equal", equal},
                      {"damages", damages},
                      {"topics", topics}}
                     .dump(-1, ' ', false, Json::error_handler_t::replace)
              << '\n';
  } else {
    print_text(streams, a);
  }
  return equal && damages == 0 ? 0 : 1;
}

}  // namespace mimesis::tool
