#pragma once
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "tools/mimesis/log/message_diff.h"

namespace mimesis::tool {

/// Largest |recorded - replayed| that was tolerated, by topic and field ("q_rad" for all elements).
using Tolerated = std::map<std::pair<std::string, std::string>, double>;

/// Compares messages of a replay with recorded ones.
class ReplayCompare {
 public:
  /// @param tolerance  floating-point fields may differ by so much; 0: all bytes must be equal
  /// @param ignored    fields that may differ, by type
  explicit ReplayCompare(double tolerance,
                         std::map<std::string, std::set<std::string>> ignored = {})
      : tolerance_(tolerance), ignored_(std::move(ignored)) {}

  /// `schema`: of the recorded one, may be null.
  MessageDifference compare(const std::string& topic, const log::Schema* schema,
                            std::string_view recorded, std::string_view replayed);

  const Tolerated& tolerated() const { return tolerated_; }

 private:
  double tolerance_;
  std::map<std::string, std::set<std::string>> ignored_;
  PayloadDiff payloads_;
  Tolerated tolerated_;
};

}  // namespace mimesis::tool
