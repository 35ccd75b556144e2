#include "tools/mimesis/log/record_report.h"

#include <iostream>
#include <nlohmann/json.hpp>

#include "tools/mimesis/table.h"

namespace mimesis::tool {

void print_json(const RecordResult& result) {
  nlohmann::ordered_json out{{"file", result.output},
                             {"files", result.files},
                             {"messages", result.messages},
                             {"lost", result.counts.total.lost},
                             {"bytes", result.bytes},
                             {"error", result.error},
                             {"topics", nlohmann::ordered_json::array()}};
  for (const auto& [key, count] : result.counts.topics) {
    out["topics"].push_back({{"topic", key.first},
                             {"node", key.second},
                             {"received", count.received},
                             {"lost", count.lost}});
  }
  std::cout << out.dump() << std::endl;
}

void print_table(const RecordResult& result) {
  Table table({"TOPIC", "NODE", "RECEIVED", "LOST"});
  for (const auto& [key, count] : result.counts.topics) {
    table.row({key.first, key.second, std::to_string(count.received), std::to_string(count.lost)});
  }
  table.print(std::cerr, use_colour(2));
}

}  // namespace mimesis::tool
