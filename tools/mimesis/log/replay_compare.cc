#include "tools/mimesis/log/replay_compare.h"

#include <algorithm>

namespace mimesis::tool {
namespace {

constexpr std::size_t kFieldsKept = 100;  // of an array, the first hundred say enough

}  // namespace

MessageDifference ReplayCompare::compare(const std::string& topic, const log::Schema* schema,
                                         std::string_view recorded, std::string_view replayed) {
  if (recorded == replayed) return {};
  DiffRules rules{.tolerance = tolerance_, .exact = tolerance_ == 0.0, .limit = kFieldsKept};
  if (schema != nullptr) {
    if (const auto it = ignored_.find(schema->name); it != ignored_.end())
      rules.ignore = it->second;
  }
  WorstDifferences worst;
  MessageDifference found = payloads_.diff({recorded, schema}, {replayed, schema}, rules, &worst);
  if (found.equal()) {
    for (const auto& [field, difference] : worst) {
      double& most = tolerated_[{topic, field}];
      most = std::max(most, difference.difference);
    }
  }
  return found;
}

}  // namespace mimesis::tool
