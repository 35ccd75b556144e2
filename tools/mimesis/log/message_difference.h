#pragma once
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/runtime/raw.h"

namespace mimesis::tool {

/// One field whose value differs between two messages of a type.
struct FieldDifference {
  std::string field;                     ///< "joints.2.position_rad"
  nlohmann::ordered_json first, second;  ///< null: not there (or not a number)
};

/// How two messages differ.
struct MessageDifference {
  std::vector<FieldDifference> fields;  ///< the first ones
  std::size_t field_count = 0;          ///< all of them; 0: only the bytes differ
  std::size_t offset = 0;               ///< of the first byte that differs
};

/// Offset of the first byte in which the two differ: the length of the shorter one if that is the
/// head of the longer one.
std::size_t first_difference(std::string_view a, std::string_view b);

/// Compares serialised messages: equal bytes are equal messages, others are compared field by
/// field.
class MessageComparison {
 public:
  /// @param tolerance  floating-point fields may differ by tolerance·max(1, |a|, |b|) [1]; 0: not
  ///                   at all. Everything else is compared exactly.
  /// @param ignored    full names of fields that may differ: "mimesis.v1.ClockTime.wall_ns"
  explicit MessageComparison(double tolerance = 0.0, std::set<std::string> ignored = {});

  /// Nothing if they are equal as far as is asked for. `topic` is where tolerated differences are
  /// noted; `descriptors`: serialised FileDescriptorSet of `type`.
  std::optional<MessageDifference> compare(const std::string& topic, const std::string& type,
                                           const std::string& descriptors, std::string_view first,
                                           std::string_view second);

  /// Largest |a − b| that was tolerated, by topic and field; elements of lists together ("q.*").
  const std::map<std::pair<std::string, std::string>, double>& tolerated() const {
    return tolerated_;
  }

 private:
  double tolerance_;
  std::set<std::string> ignored_;
  runtime::TypePool types_;
  std::map<std::pair<std::string, std::string>, double> tolerated_;
};

}  // namespace mimesis::tool
