#pragma once
#include <google/protobuf/message.h>

#include <compare>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/cdr/ros_type.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// A type of a log: Protobuf, or ROS 2 in CDR.
class LogType {
 public:
  /// @throws ConfigError where its definition is none
  LogType(const log::Schema& schema, runtime::TypePool& pool);
  static bool reads(const log::Schema& schema) {
    return schema.encoding == "protobuf" || cdr::RosType::reads(schema.encoding);
  }
  /// What the channel's messages must be encoded as.
  static bool reads(const log::Schema& schema, std::string_view message_encoding) {
    return reads(schema) &&
           message_encoding == (schema.encoding == "protobuf" ? "protobuf" : "cdr");
  }
  google::protobuf::Message& message() const { return *message_; }  ///< filled again and again
  /// Why the bytes are no such message; empty: they are.
  std::string read(std::string_view bytes) const;

 private:
  std::shared_ptr<const cdr::RosType> ros_;  ///< null: Protobuf; outlives the message
  std::unique_ptr<google::protobuf::Message> message_;
};

/// Messages by the definitions in their logs.
class LogDecoder {
 public:
  /// Null if the message is of no type that is read, or not a valid one. Lives until the next of
  /// its type.
  const google::protobuf::Message* decode(const Item& item);
  /// Like `decode`; reports an invalid message on standard error.
  const google::protobuf::Message* decode_or_tell(const Item& item);
  /// Null if it is neither Protobuf nor ROS, or its definition is none, of which `trouble` tells.
  const LogType* type(const log::Schema& schema);
  std::string trouble(const log::Schema& schema);
  /// Type of a channel. @throws ConfigError if there is none.
  const google::protobuf::Descriptor& type(const OpenChannel& channel);

 private:
  struct Known {
    std::unique_ptr<LogType> type{};
    std::string trouble{};
  };
  const Known& known(const log::Schema& schema);

  runtime::TypePool types_;
  std::map<const log::Schema*, Known> known_;
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
