#pragma once
#include <google/protobuf/message.h>

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/log/records.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/log/field_columns.h"

namespace mimesis::tool {

/// Which differences between two messages count. Fields are named as "arm.position_rad", for all
/// elements of repeated fields in the path, or as "arm.position_rad.3" for one; with all below
/// them.
struct DiffRules {
  double tolerance = 0.0;  ///< largest |a - b| of a float or double that counts as equal
  std::map<std::string, double> field_tolerance = {};  ///< by field instead; of integers, too
  std::set<std::string> ignore = {};                   ///< fields
  /// By default NaN is equal to NaN, and -0 to 0. Exact: floating-point numbers are equal if all
  /// their bits are, and payloads if all their bytes are (unless fields are ignored); tolerances
  /// play no part.
  bool exact = false;
  /// The types are those of two versions: fields are matched by number, since names may have
  /// changed, and one that only one version has does not count. Else they are matched by name.
  bool across_versions = false;
  std::size_t limit = 20;  ///< largest number of differences that are described; more are counted
};

/// A value that differs, as text: "0.25" and "0.26", "unset" and "0", bytes from the first that
/// differs.
struct FieldDifference {
  std::string path;  ///< "arm.position_rad.3"; empty: the payload as a whole
  std::string a, b;
};

/// Both sides from the first byte that differs; `more` behind a side that goes on.
FieldDifference byte_difference(std::string path, std::string_view a, std::string_view b,
                                const char* more = " ...");

struct MessageDifference {
  std::vector<FieldDifference> fields;  ///< the first ones, in the order of the .proto file
  std::uint64_t count = 0;              ///< number of all differences
  bool equal() const { return count == 0; }
};

/// Where a numeric field differs most, within the tolerance or not.
struct WorstDifference {
  double difference = 0.0;  ///< |a - b|; infinite if only one of them is finite
  std::string path;         ///< with the index
  std::string a, b;
};
/// By field without indexes: "arm.position_rad".
using WorstDifferences = std::map<std::string, WorstDifference>;

/// Compares field by field. The types may come from different descriptor sets: a field that only
/// one type has counts if it is set there. Maps are matched by key. Adds to
/// `worst` if it is given. O(size).
MessageDifference diff_messages(const google::protobuf::Message& a,
                                const google::protobuf::Message& b, const DiffRules& rules,
                                WorstDifferences* worst = nullptr);

/// Bytes with what describes them.
struct Payload {
  std::string_view bytes;
  const log::Schema* schema = nullptr;  ///< null: none
};

/// Compares payloads by the descriptor sets of their schemas. Equal bytes are equal without
/// decoding; data that is no Protobuf message differs in its bytes (path "").
class PayloadDiff {
 public:
  MessageDifference diff(const Payload& a, const Payload& b, const DiffRules& rules,
                         WorstDifferences* worst = nullptr);

 private:
  std::unique_ptr<google::protobuf::Message> decode(const Payload& payload);
  runtime::TypePool types_;
  LogDecoder ros_;
};

}  // namespace mimesis::tool
