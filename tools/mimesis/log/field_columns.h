#pragma once
#include <google/protobuf/message.h>

#include <compare>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/runtime/raw.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// Messages by the descriptor sets of their logs.
class LogDecoder {
 public:
  /// Null if the message is not Protobuf, or not a valid one. Lives until the next of its type.
  const google::protobuf::Message* decode(const Item& item);
  /// Like `decode`; reports an invalid message on standard error.
  const google::protobuf::Message* decode_or_tell(const Item& item);
  /// An empty one; null if the schema is not Protobuf's, or does not define its type.
  google::protobuf::Message* make(const log::Schema& schema);
  /// Type of a channel. @throws ConfigError if that has no Protobuf with a schema.
  const google::protobuf::Descriptor& type(const OpenChannel& channel);

 private:
  runtime::TypePool types_;
  std::map<const log::Schema*, std::unique_ptr<google::protobuf::Message>> messages_;
};

/// Query of the user: "bridge/joint_states.position_rad[*]".
struct FieldQuery {
  std::string topic;
  std::string path;  ///< empty: all fields
};

/// Splits behind the longest of `topics` that fits: topics may contain dots.
/// @throws ConfigError with a suggestion if none does.
FieldQuery parse_field_query(const std::string& text, const std::vector<std::string>& topics);

/// The scalar values a path names in the messages of a topic. Elements of a repeated field are
/// chosen as "position_rad[2]" or "position_rad.2"; "position_rad[*]" or "position_rad" is all of
/// them, and a message stands for all its fields (but those of type bytes). A field that a message
/// does not have gives no value.
class FieldColumns {
 public:
  explicit FieldColumns(FieldQuery query);

  /// A column: a field that is not repeated, or one element.
  struct Key {
    std::size_t leaf = 0;      ///< which field
    std::vector<int> indexes;  ///< for each [*] on its way
    auto operator<=>(const Key&) const = default;
  };
  struct Value {
    const google::protobuf::Message& message;  ///< message that has the field
    const google::protobuf::FieldDescriptor& field;
    int index;  ///< kWholeField, or of the element
  };

  const std::string& topic() const { return query_.topic; }
  /// Calls `take` for each value in `message`.
  /// @throws ConfigError with a suggestion if its type has no such field.
  void visit(const google::protobuf::Message& message,
             const std::function<void(const Key&, const Value&)>& take);
  /// @throws ConfigError as above.
  void check(const google::protobuf::Descriptor& type) { static_cast<void>(leaves(type)); }
  /// True if one of the fields has numbers, booleans or enum values. @throws ConfigError as above.
  bool has_numbers(const google::protobuf::Descriptor& type);
  std::string name(const Key& key) const;  ///< "position_rad[2]"

 private:
  struct Step {
    const google::protobuf::FieldDescriptor* field;
    int index;  ///< index in a repeated field, kEach, or kWholeField
  };
  struct Leaf {
    std::size_t id;
    std::vector<Step> steps;
  };
  static constexpr int kEach = -2;

  const std::vector<Leaf>& leaves(const google::protobuf::Descriptor& type);
  void find(const google::protobuf::Descriptor& type, std::size_t part, std::vector<Step>& steps,
            std::vector<Leaf>& out);
  void add_field(const google::protobuf::FieldDescriptor& field, std::size_t part,
                 std::vector<Step>& steps, std::vector<Leaf>& out);
  void visit(const google::protobuf::Message& message, const Leaf& leaf, std::size_t step, Key& key,
             const std::function<void(const Key&, const Value&)>& take) const;

  FieldQuery query_;
  std::vector<std::string> parts_;               ///< parts of the path
  std::map<std::string, std::size_t> leaf_ids_;  ///< by name with [*]
  std::vector<std::string> leaf_names_;          ///< by id
  std::map<const google::protobuf::Descriptor*, std::vector<Leaf>> by_type_;
};

}  // namespace mimesis::tool
